"""The state that a step takes over from the previous one.

It comprises positions, velocities, internal states of bodies, contacts and loads, and the state of
a controlled pressure that continues.
"""

import shutil
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from softsim.compute.machine import Choice
from softsim.errors import OutputError
from softsim.loads.pressure_control import ControlState
from softsim.model import Model
from softsim.output.folder import (
    CHECKPOINT,
    HISTORY,
    LOG,
    RESULTS,
    SCENE,
    SUMMARY,
    Checkpoint,
    RunFolder,
    read_checkpoint,
    read_summary,
    replacing,
)
from softsim.run.record import CHANGED_BY_HAND, Progress
from softsim.scene.steps import Step
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

    @property
    def changes_by_hand(self) -> dict[str, str]:
        """Warnings (kind -> text) about loads changed by hand in this step or an earlier one."""
        warnings = self._progress.warnings.items()
        return {kind: text for kind, text in warnings if kind.startswith(CHANGED_BY_HAND)}

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
        if chamber is None or chamber.source.control is None:
            return None
        settings = chamber.source.control
        if settings.start < progress.time:
            return progress.control
        # It begins in this step, with the pressure that is there.
        term = scenario.term_of(chamber)
        now = replace(settings.first_ramp(), pressure=float(scenario.read(term.pressure)))
        term.kernel.set_ramp(scenario.number, now)
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


# -------------------------------------------------------------------------------------------------
# Steps that a run takes from another run's folder in place of computing them anew.

FILES = (SCENE, HISTORY, RESULTS, CHECKPOINT, LOG)
"""Files of a step, apart from its summary, which is written last."""


def refuse_source(source: Path, folder: Path, resume: bool) -> None:
    """Raise OutputError where a run in `folder` cannot take steps from `source`."""
    if resume:
        raise OutputError(
            "--from and --resume cannot be combined",
            "a run started with --from has the reused steps in its folder: continue it with "
            "--resume alone",
        )
    if source.resolve() == folder.resolve():
        raise OutputError(
            f"{source} is the folder of this run",
            "continue it with --resume, or choose another folder with --out",
        )


def fitting_steps(
    source: Path, named: Mapping[str, Step], choice: Choice
) -> tuple[list[Path], str]:
    """Return the folders of the first steps in `source` that can be reused, and why not the next.

    A step can be reused if it is complete there and identical to the requested one. The reason is
    "" if there is no further step. named: folder name -> requested step.

    Raises OutputError if not even the first step can be reused.
    """
    told = read_summary(source).get("steps")
    if told is None:
        raise OutputError(
            f"{source} is not the run folder of a scene with steps",
            "name the run folder of a scene with steps",
        )
    found: list[Path] = []
    for name, step in named.items():
        if name in [one["folder"] for one in told]:
            reason = why_not(source / name, step, choice)
        else:
            reason = f"it has no folder {name}, only {', '.join(one['folder'] for one in told)}"
        if reason and not found:
            raise OutputError(
                f"no step of {source} can be reused: {reason}",
                "name a run whose first step is identical, or leave out --from",
            )
        if reason:
            return found, reason
        found.append(source / name)
    return found, ""


def why_not(path: Path, step: Step, choice: Choice) -> str:
    """Return why a step's folder does not hold the requested step, complete; "" if it does."""
    status = read_summary(path).get("status", "not begun")
    if status != "done":
        return f"{path.name} is not complete there, but {status}"
    if not (path / CHECKPOINT).is_file():
        return f"{path.name} has no {CHECKPOINT}"
    checkpoint = read_checkpoint(path / CHECKPOINT)
    mismatch = checkpoint.mismatch(step.loaded)
    if mismatch:
        return f"{path.name} {mismatch}"
    if not choice.allows(checkpoint.device):
        return f"{path.name} was computed on {checkpoint.device}, this is {choice.device}"
    return ""


def take_step(source: Path, target: RunFolder) -> None:
    """Copy the files of a completed step; its summary records their source.

    Raises OutputError if it cannot be read, or the disk refuses.
    """
    summary = read_summary(source) | {"taken_from": str(source)}
    for name in FILES:
        if (source / name).is_file():
            with replacing(target.path / name) as partial:
                shutil.copyfile(source / name, partial)
    target.write_json_atomic(SUMMARY, summary)
