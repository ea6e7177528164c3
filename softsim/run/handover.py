"""The state that a step takes over from the previous one.

It comprises positions, velocities, internal states of bodies, contacts and loads, and the state of
a controlled pressure that continues.
"""

from dataclasses import dataclass, replace

import numpy as np

from softsim.loads.drive import ControlledPressure
from softsim.loads.pressure_control import ControlState
from softsim.model import Model
from softsim.output.checkpoint import Checkpoint
from softsim.output.progress import Progress
from softsim.solver.explicit import Scenario

# Of the larger pressure: a change at the beginning of a step above which is told.
JUMP = 0.02


@dataclass(frozen=True)
class EarlierStep:
    """Previous step at its end: its model and its checkpoint."""

    model: Model
    checkpoint: Checkpoint

    @property
    def end(self) -> float:
        """End time of the step [s]."""
        return self._progress.time

    @property
    def _progress(self) -> Progress:
        return Progress.written(self.checkpoint.progress)

    def _state_for(self, model: Model) -> dict[str, np.ndarray]:
        return renumbered(self.checkpoint.state, self.model.load_names, model.load_names)

    def hand_over(self, scenario: Scenario) -> ControlState | None:
        """Continue the only scenario of a solver from here.

        Return the state of its controlled pressure, None if none continues.
        """
        progress, solver = self._progress, scenario.solver
        solver.take_over(self._state_for(scenario.model), progress.time)
        if self.model.relaxation is None:
            solver.go_back_half(progress.time_increment)
        else:
            solver.come_to_rest(progress.time_increment)
        chamber = scenario.model.chamber
        if chamber is None or not isinstance(chamber.drive.course, ControlledPressure):
            return None
        settings = chamber.drive.course.settings
        if settings.start < progress.time:
            return progress.control
        # It begins in this step, with the pressure that is there.
        term = scenario.term_of(chamber)
        now = replace(settings.first_command(), pressure=float(scenario.read(term.pressure)))
        term.source.obey(scenario.number, now)
        return None

    def jumps(self, scenario: Scenario) -> dict[str, str]:
        """Return warnings (kind -> text) on chambers whose pressure jumps at the start of the step.

        The scenario must have started.
        """
        state, found = self._state_for(scenario.model), {}
        for number, load in enumerate(scenario.model.loads):
            pressure = state.get(f"loads/{number}/pressure")
            if pressure is None:
                continue
            before, now = float(pressure[0]), float(scenario.read(scenario.term_of(load).pressure))
            if abs(now - before) > JUMP * max(abs(now), abs(before)):
                name = scenario.model.load_names[number]
                found[f"jump of {name}"] = (
                    f"'{name}' jumps from {1e-3 * before:.4g} to {1e-3 * now:.4g} kPa on the "
                    "facets at the start of the step: start its profile at the last value of "
                    "the previous step"
                )
        return found


def renumbered(
    state: dict[str, np.ndarray], before: tuple[str, ...], now: tuple[str, ...]
) -> dict[str, np.ndarray]:
    """Return a solver's state with its loads renumbered from the names `before` to those `now`.

    Loads that no longer exist are left out.
    """
    result = {}
    for key, values in state.items():
        owner, _, rest = key.partition("/")
        if owner == "loads":
            number, _, field = rest.partition("/")
            name = before[int(number)]
            if name not in now:
                continue
            key = f"loads/{now.index(name)}/{field}"
        result[key] = values
    return result
