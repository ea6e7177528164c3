"""The run of a scene with several steps, each in a folder of its own: 1_inflate, 2_shake.

A step starts from the state in which the previous one ended: positions, velocities, and the
internal variables of materials, contacts and loads. Time continues, so that the histories can be
joined.
"""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from softsim.compute.machine import AUTO, Choice, choose
from softsim.errors import Interrupted, OutputError
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
    claimed,
    read_checkpoint,
    read_summary,
    replacing,
)
from softsim.output.history import read_history
from softsim.run.batch import EarlierStep, Monitor
from softsim.run.loop import Results
from softsim.run.scenes import opened, outcome_of, ready_model
from softsim.scene.steps import AT_THE_START, Step, following


def run_steps(
    steps: Sequence[Step],
    out: Path | None = None,
    device: str = AUTO,
    resume: bool = False,
    console: Console | None = None,
    threads: int | str = AUTO,
    profile: bool = False,
    source: Path | None = None,
    monitors: Sequence[Monitor] = (),
) -> dict[str, Results]:
    """Run all steps of a scene and return their results.

    Parameters
    ----------
    steps : sequence of Step
        Steps from `load_steps`.
    out : Path, optional
        Folder of the steps' folders. Default: `runs/` and the name of the scene file.
    device : {"auto", "cpu", "cuda"}
        Device of the computation.
    resume : bool
        Skip finished steps and continue the one that was stopped. A step that was changed, and all
        steps after it, run anew.
    console : rich.console.Console, optional
        Console for progress and warnings. Default: the terminal.
    threads : int or "auto"
        Number of CPU threads. "auto": one for a small model, else all processors.
    profile : bool
        As for `run`.
    source : Path, optional
        Folder of another run. Its first steps are copied instead of run, as many as are finished
        and unchanged.
    monitors : sequence of Monitor
        As for `run`; each step starts them anew.

    Returns
    -------
    dict of str to Results
        Results of each step, by its name.

    Raises
    ------
    SoftsimError
        As from `run`. The folder keeps the results of the finished steps.

    Examples
    --------
    >>> from pathlib import Path
    >>> from softsim.run import run_steps
    >>> from softsim.scene.steps import load_steps
    >>> results = run_steps(load_steps("two_steps.yaml"), out=Path("runs/two_steps"))
    >>> list(results)
    ['press', 'release']
    >>> results["press"].folder
    PosixPath('runs/two_steps/1_press')
    """
    choice, console = choose(device, threads), console or Console()
    foreseen_models(steps, choice)
    path = out or Path("runs") / steps[0].loaded.path.stem
    taken: list[Path] = []
    if source is not None:
        refuse_source(source, path, resume)
        named = {folder_name(number, step): step for number, step in enumerate(steps, 1)}
        taken, reason = fitting_steps(source, named, choice)
        names = ", ".join(one.name for one in taken)
        said = f"reused from {source}: {names}" + (
            f"; later steps are not reused: {reason}" if reason else ""
        )
        console.print(said, highlight=False)
    work = Work(RunFolder(path), tuple(steps), choice, console, profile, tuple(monitors))
    with claimed(path):
        if taken:
            work.take(taken)
        return work.run(len(steps) if resume else len(taken))


def folder_name(number: int, step: Step) -> str:
    """Return the name of the folder of a step; numbers count from 1."""
    return f"{number}_{step.name}"


def foreseen_models(steps: Sequence[Step], choice: Choice) -> list[Model]:
    """Return the models of all steps, each as if the previous one ended at its time.

    Raises what `ready_model` raises for any of them.
    """
    beginning, models, before = AT_THE_START, [], None
    for step in steps:
        if before is not None:
            beginning = following(
                before.loaded.scene, beginning, step.loaded.scene, models[-1].end_time
            )
        models.append(ready_model(step.loaded, choice, beginning))
        before = step
    return models


@dataclass(frozen=True)
class Work:
    """Steps of a scene in a folder, and the settings of their computation."""

    folder: RunFolder
    steps: tuple[Step, ...]
    choice: Choice
    console: Console
    profile: bool
    monitors: tuple[Monitor, ...]

    def path(self, number: int) -> Path:
        """Return the folder of a step; numbers count from 1."""
        return self.folder.path / folder_name(number, self.steps[number - 1])

    def take(self, taken: Sequence[Path]) -> None:
        """Copy the first steps from the given folders."""
        self._forget_from(1)
        for number, source in enumerate(taken, 1):
            target = RunFolder(self.path(number))
            with claimed(target.path):
                take_step(source, target)

    def run(self, kept: int) -> dict[str, Results]:
        """Run the steps, except completed ones among the first `kept`."""
        results: dict[str, Results] = {}
        status = "aborted"
        try:
            self._run(kept, results)
            status = "done"
        except Interrupted:
            status = "interrupted"
            raise
        finally:
            self.write_summary(status)
        return results

    def _run(self, kept: int, results: dict[str, Results]) -> None:
        beginning, earlier, before = AT_THE_START, None, None
        for number, step in enumerate(self.steps, 1):
            scene = step.loaded.scene
            if before is not None and earlier is not None:
                beginning = following(before, beginning, scene, earlier.end)
            model = ready_model(step.loaded, self.choice, beginning)
            path = self.path(number)
            found = self._found(step, path) if number <= kept else None
            if found is not None and read_summary(path).get("status") == "done":
                self.console.print(f"step '{step.name}' is done: {path}", highlight=False)
                results[step.name] = Results(path, read_summary(path), read_history(path / HISTORY))
            else:
                if found is None:
                    self._forget_from(number)
                self.write_summary("running")
                self.console.rule(f"step {number} of {len(self.steps)}: {step.name}")
                results[step.name] = self._run_step(step, model, path, found is not None, earlier)
            earlier, before = EarlierStep(model, read_checkpoint(path / CHECKPOINT)), scene

    def _found(self, step: Step, path: Path) -> Checkpoint | None:
        """Return the checkpoint of an unchanged step on this device, or None if there is none."""
        if not (path / CHECKPOINT).is_file():
            return None
        checkpoint = read_checkpoint(path / CHECKPOINT)
        mismatch = mismatch_of(checkpoint, step, self.choice)
        if not mismatch:
            return checkpoint
        self.console.print(f"step '{step.name}' {mismatch}: it is run again", highlight=False)
        return None

    def _forget_from(self, number: int) -> None:
        """Delete the outdated checkpoints and summaries of this step and later ones."""
        for later in range(number, len(self.steps) + 1):
            for name in (CHECKPOINT, SUMMARY):
                (self.path(later) / name).unlink(missing_ok=True)

    def _run_step(
        self, step: Step, model: Model, path: Path, resume: bool, earlier: EarlierStep | None
    ) -> Results:
        target = RunFolder(path)
        with claimed(path):
            batch = opened(
                step.loaded, model, target, self.choice, self.console, resume, earlier=earlier
            )
            return outcome_of(batch, self.console, self.profile, self.monitors)

    def write_summary(self, status: str) -> None:
        """Write the summary of all steps to their common folder."""
        told = []
        for number, step in enumerate(self.steps, 1):
            summary = read_summary(self.path(number))
            told.append(
                {
                    "name": step.name,
                    "folder": self.path(number).name,
                    "status": summary.get("status", "not begun"),
                    "simulated_time": summary.get("simulated_time"),
                    "wall_time": summary.get("wall_time"),
                    "warnings": summary.get("warnings", []),
                }
            )
        title = self.steps[0].loaded.scene.title
        whole: dict[str, Any] = {"status": status, "title": title, "steps": told}
        self.folder.write_json_atomic(SUMMARY, whole)


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
    mismatch = mismatch_of(read_checkpoint(path / CHECKPOINT), step, choice)
    return f"{path.name} {mismatch}" if mismatch else ""


def mismatch_of(checkpoint: Checkpoint, step: Step, choice: Choice) -> str:
    """Return how a checkpoint differs from a step on a device, as a predicate; "" if it fits."""
    mismatch = checkpoint.mismatch(step.loaded)
    if not mismatch and not choice.allows(checkpoint.device):
        return f"was computed on {checkpoint.device}, this is {choice.device}"
    return mismatch


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
