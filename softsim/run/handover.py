"""What a step takes over from the one before: places, velocities, inner states of its bodies,
contacts and loads, and the state of a controlled pressure that goes on.
"""

from dataclasses import dataclass, replace

import numpy as np

from softsim.loads.drive import ControlledPressure
from softsim.loads.pressure_control import ControlState
from softsim.model import Model
from softsim.output.checkpoint import Checkpoint
from softsim.output.progress import Progress
from softsim.solver.explicit import Scenario


@dataclass(frozen=True)
class EarlierStep:
    """The step before, at its end: its model, and its checkpoint."""

    model: Model
    checkpoint: Checkpoint

    @property
    def end(self) -> float:
        """When it has ended [s]."""
        return self._progress.time

    @property
    def _progress(self) -> Progress:
        return Progress.written(self.checkpoint.progress)

    def hand_over(self, scenario: Scenario) -> ControlState | None:
        """Let the only scenario of a solver go on from here; the state of its controlled pressure,
        None where none goes on.
        """
        progress = self._progress
        state = renumbered(self.checkpoint.state, self.model.load_names, scenario.model.load_names)
        from_rest = self.model.relaxation is not None
        scenario.solver.take_over(state, progress.time, progress.time_increment, from_rest)
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


def renumbered(
    state: dict[str, np.ndarray], before: tuple[str, ...], now: tuple[str, ...]
) -> dict[str, np.ndarray]:
    """A solver's state with its loads, of these names `before`, at their numbers `now`; without
    those that are no longer there.
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
