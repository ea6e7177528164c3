"""Feedback: a row of the history goes to the pressure control, its command to the solver.

Rows come at increments that depend on model and scene only, so a run decides the same whatever
stops it in between.
"""

import logging
from collections.abc import Mapping

from scipy.spatial.transform import Rotation

from softsim.loads.air_line import AirLineSource
from softsim.loads.drive import ControlledPressure, ControlledPressureSource, Scheduled
from softsim.loads.pressure_control import ControlState, EventCycles, PressureControl, Sensed
from softsim.solver.explicit import Scenario

log = logging.getLogger("softsim")


class OpenLoop:
    """Loop without feedback: the pressure of the robot's chamber, if any, is given over time."""

    state: ControlState | None = None

    def __init__(self, scenario: Scenario, drive: Scheduled | None) -> None:
        self.scenario, self.drive = scenario, drive

    def cycles_done(self) -> int:
        """Return the number of pressure cycles that have ended; 0 without a falling pressure."""
        return 0 if self.drive is None else self.drive.cycles_done(self.scenario.time)

    def readings(self) -> dict[str, float]:
        """Return the values of the column `cycles_done`."""
        return {"cycles_done": self.cycles_done()}

    def follow(self, row: Mapping[str, float]) -> None:
        """Do nothing: rows of the history have no effect."""


class ClosedLoop:
    """Loop with feedback: the pressure of the robot's chamber depends on sensed quantities.

    state: of a resumed run, changed in place; None for a run that begins.
    """

    def __init__(
        self,
        scenario: Scenario,
        source: ControlledPressureSource | AirLineSource,
        settings: EventCycles,
        state: ControlState | None,
    ) -> None:
        self.scenario, self.source = scenario, source
        self.control = PressureControl(settings, state)

    @property
    def state(self) -> ControlState:
        """State for a checkpoint; the command in force is in the solver's state."""
        return self.control.state

    def cycles_done(self) -> int:
        """Return the number of pressure cycles that have ended."""
        return self.control.state.cycles_done

    def readings(self) -> dict[str, float]:
        """Return the values of the columns `cycles_done`, `cycle` and `phase`."""
        return {
            "cycles_done": self.cycles_done(),
            "cycle": self.control.cycle,
            "phase": self.control.phase_at(self.scenario.time),
        }

    def follow(self, row: Mapping[str, float]) -> None:
        """Pass a row of the history to the control, and send its command, if any, to the solver."""
        decision = self.control.sense(sensed(row))
        if decision is None:
            return
        self.source.obey(self.scenario.number, decision.command)
        log.info(
            "t = %.6g s, cycle %d: %s at %.4g kPa, now %+.4g kPa/s",
            row["time"], row["cycle"], decision.reason, 1e-3 * row["pressure"],
            1e-3 * decision.command.rate,
        )  # fmt: skip


def feedback(scenario: Scenario, state: ControlState | None) -> OpenLoop | ClosedLoop:
    """Return the loop for the pressure source of the robot's chamber; state: of a resumed run."""
    chamber = scenario.model.chamber
    if chamber is None:
        return OpenLoop(scenario, None)
    course = chamber.drive.course
    if isinstance(course, ControlledPressure):
        return ClosedLoop(scenario, scenario.term_of(chamber).source, course.settings, state)
    return OpenLoop(scenario, course)


def sensed(row: Mapping[str, float]) -> Sensed:
    """Return the sensed quantities in a row of the history."""
    place = tuple(row[name] for name in ("frame_x", "frame_y", "frame_z") if name in row)
    turns = ("frame_rotation_x", "frame_rotation_y", "frame_rotation_z")
    turn = [row[name] for name in turns] if "frame_z" in row else [0.0, 0.0, row["frame_angle"]]
    axis = Rotation.from_rotvec(turn).apply([1.0, 0.0, 0.0])[: len(place)]
    return Sensed(
        row["time"], row["pressure"], row["rows_in_contact"], row["wall_force_normal"], place,
        tuple(axis.tolist()),
    )  # fmt: skip
