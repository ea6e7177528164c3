"""Loads that change while a run goes on: a pressure by the rows of its history, chambers and motors
by commands.

Rows come at increments that depend on model and scene only, so a controlled pressure takes the same
course whatever stops the run in between.
"""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from softsim.errors import SimulationError
from softsim.loads import profile
from softsim.loads.nodal import Rotor
from softsim.loads.pressure import FollowerPressure, PressureSource
from softsim.loads.pressure_control import PressureControl, PressureRamp, Sensed
from softsim.run.callbacks import RowReader
from softsim.run.loop import Run
from softsim.scene.reporting import did_you_mean

log = logging.getLogger("softsim")


class Feedback(RowReader):
    """Cycles of the pressure in the robot's chamber, and its control by rows of the history.

    source: pressure source of that chamber; None without one, and once commands set the pressure.
    control: controller of the source, whose state is changed in place; None for a pressure that is
    given over time. The ramp of the pressure is in the solver's state. is_commanded: True once a
    command has replaced the source.
    """

    def __init__(self, run: Run) -> None:
        self.run, chamber = run, run.model.chamber
        self.source = None if chamber is None else chamber.source
        self.control: PressureControl | None = None
        if chamber is not None and chamber.source.control is not None:
            self.control = PressureControl(chamber.source.control, run.progress.control)
            self.kernel = run.scenario.term_of(chamber).kernel
            run.progress.control = self.control.state
        self.needs_each_row, self.is_commanded = self.control is not None, False

    def end(self) -> None:
        """End the control by a profile or by events: commands set the pressure."""
        self.source = self.control = self.run.progress.control = None
        self.needs_each_row, self.is_commanded = False, True

    def cycles_done(self, time: float) -> int:
        """Return the number of pressure cycles ended by a time [s]; 0 without a source."""
        if self.control is not None:
            return self.control.state.cycles_done
        return 0 if self.source is None else self.source.cycles_done(time)

    def readings(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """Return the column `cycles_done`, and of a controlled pressure `cycle` and `phase`."""
        found = {"cycles_done": np.array([self.cycles_done(time) for time in times])}
        if self.control is not None:
            found["cycle"] = np.array([self.control.cycle])
            found["phase"] = np.array([self.control.phase_at(time) for time in times])
        return found

    def see_row(self, row: Mapping[str, float]) -> None:
        """Pass a row to the control, and its decision, if any, to the solver."""
        decision = None if self.control is None else self.control.sense(sensed(row))
        if decision is None:
            return
        self.kernel.set_ramp(self.run.scenario.number, decision.ramp)
        log.info(
            "t = %.6g s, cycle %d: %s at %.4g kPa, now %+.4g kPa/s",
            row["time"], row["cycle"], decision.reason, 1e-3 * row["pressure"],
            1e-3 * decision.ramp.rate,
        )  # fmt: skip


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


# -------------------------------------------------------------------------------------------------
# Commands of a program or of the live view.


@dataclass(frozen=True)
class Adjustable:
    """Load with a value that can be changed.

    unit: SI unit of its value. low, high: range of its value in the scene. limit: largest value
    that is accepted. value: returns the present value. change: takes the new value and the time [s]
    within which it is reached.
    """

    name: str
    unit: str
    low: float
    high: float
    limit: float
    value: Callable[[], float]
    change: Callable[[float, float], None]


class LoadCommands:
    """Commands to the chambers and motors of a run, from its present time on."""

    def __init__(self, run: Run) -> None:
        self.run, self.scenario, self.model = run, run.scenario, run.model
        self.loads = self.model.named_loads

    @property
    def adjustable(self) -> list[Adjustable]:
        """Chambers and motors that can be changed.

        None in a run along a path of equilibria, whose load factor is an unknown, and in one that
        computes derivatives, which are those of the loads of the scene.
        """
        relaxation = self.model.relaxation
        follows_path = relaxation is not None and relaxation.follows_path
        if follows_path or self.run.output.derivatives is not None:
            return []
        return [
            *map(self._adjustable_chamber, self.chambers),
            *map(self._adjustable_motor, self.names(Rotor)),
        ]

    def _adjustable_chamber(self, name: str) -> Adjustable:
        load = self._named(name, FollowerPressure, "chamber")
        low, high = load.source.value_range
        return Adjustable(
            name, load.source.unit, low, high, load.source.stiffest_value,
            lambda: self.present_value(load),
            lambda value, within: self.set_load(name, value, within),
        )  # fmt: skip

    def _adjustable_motor(self, name: str) -> Adjustable:
        motor = self._named(name, Rotor, "motor")
        rotors, scenario = self.scenario.term_of(motor).rotors, self.scenario.number
        return Adjustable(
            name, "Hz", 0.0, motor.rotor.frequency, np.inf,
            lambda: rotors[scenario].frequency,
            lambda frequency, within: self.set_motor(frequency, name),
        )  # fmt: skip

    def present_value(self, load: FollowerPressure) -> float:
        """Return the gauge pressure [Pa], added volume [m^3] or added mass [kg] of a chamber."""
        term = self.scenario.term_of(load)
        source: PressureSource = term.sources[self.scenario.number]
        if source.control is not None:
            return float(self.scenario.read(term.pressure))
        return source.value_at(self.scenario.time)

    def set_load(self, name: str, value: float, within: float = 0.0) -> None:
        """Change a chamber linearly to a pressure or filling; see `Simulation.set_load`."""
        self._refuse_network(name)
        load = self._named(name, FollowerPressure, "chamber")
        value = number(value, f"the value of '{name}'")
        within = number(within, f"the time within which '{name}' changes")
        if not (np.isfinite(value) and 0.0 <= within < np.inf):
            raise SimulationError(
                f"'{name}' cannot change to {value} within {within} s: both must be finite "
                "numbers, and the time at least zero"
            )
        scenario, term, now = self.scenario, self.scenario.term_of(load), self.scenario.time
        source: PressureSource = term.sources[scenario.number]
        if source.control is not None:
            start = self.present_value(load) if within > 0.0 else value
            rate = (value - start) / within if within > 0.0 else 0.0
            term.kernel.set_ramp(scenario.number, PressureRamp(start, now, rate, value))
        else:
            if value > (most := load.source.stiffest_value):
                raise SimulationError(
                    f"'{name}' cannot be set to {value:.6g}: the stable step was computed for at "
                    f"most {most:.6g}, the highest value of its profile in the scene",
                    hint="raise the highest value of the profile in the scene",
                )
            change = profile.ramp(now, self.present_value(load), within, value)
            term.follow(scenario.number, source.with_profile(change))
        if load is self.model.chamber:
            self.run.callback(Feedback).end()

    def set_motor(self, frequency: float, name: str | None = None) -> None:
        """Set the frequency [Hz] of a motor, or of all; see `Simulation.set_motor`."""
        frequency = number(frequency, "the frequency of a motor")
        if not 0.0 <= frequency < np.inf:
            raise SimulationError(f"the frequency of a motor cannot be {frequency} Hz")
        motors = self.model.of_kind(Rotor)
        if name is not None:
            motors = (self._named(name, Rotor, "motor"),)
        if not motors:
            raise SimulationError(
                "the scene has no motor", hint="add a load of kind eccentric_mass"
            )
        for motor in motors:
            term = self.scenario.term_of(motor)
            now = term.rotors[self.scenario.number]
            changed = motor.at_frequency(now, frequency, self.scenario.time)
            term.follow(self.scenario.number, changed)

    @property
    def chambers(self) -> tuple[str, ...]:
        """Names of the chambers that can be set: all but those of a network."""
        return tuple(
            name
            for name, load in self.loads.items()
            if isinstance(load, FollowerPressure) and load.source.can_be_set
        )

    def _refuse_network(self, name: str) -> None:
        for key, load in self.loads.items():
            is_fed = isinstance(load, FollowerPressure) and not load.source.can_be_set
            if is_fed and name in (key, key.rpartition(".")[2]):
                raise SimulationError(
                    f"the pressure of '{name}' follows from the network, so it cannot be set",
                    hint="load the chamber by follower_pressure, added_volume or added_gas",
                )

    def names(self, kind: type) -> tuple[str, ...]:
        """Return the names of the loads of a class."""
        return tuple(name for name, load in self.loads.items() if isinstance(load, kind))

    def _named(self, name: str, kind: type, called: str) -> Any:
        known = self.names(kind)
        if name not in known:
            hint = did_you_mean(str(name), known) if known else f"the scene has no {called}"
            raise SimulationError(f"there is no {called} '{name}'", hint)
        return self.loads[name]


def number(value: Any, meaning: str) -> float:
    """Return a real number of any type, numpy's too, as float; raise SimulationError for others."""
    found = np.asarray(value)
    if found.dtype.kind not in "iuf" or found.size != 1:
        raise SimulationError(f"{meaning} must be a number, not {value!r}")
    return float(found.item())
