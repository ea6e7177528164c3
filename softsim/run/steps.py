"""The run of a scene with several steps, each in a folder of its own: 1_inflate, 2_shake.

A step starts from the state in which the previous one ended: positions, velocities, and the
internal variables of materials, contacts and loads. Time continues, so that the histories can be
joined.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from softsim.compute.machine import AUTO, Choice, choose
from softsim.errors import Interrupted
from softsim.model import Model
from softsim.output.folder import (
    CHECKPOINT,
    HISTORY,
    SUMMARY,
    Checkpoint,
    RunFolder,
    claimed,
    read_checkpoint,
    read_summary,
)
from softsim.output.history import read_history
from softsim.run.batch import Batch, Monitor
from softsim.run.course import Results
from softsim.run.handover import EarlierStep, fitting_steps, refuse_source, take_step
from softsim.run.record import RunFiles
from softsim.run.scenes import outcome_of, ready_model, resumed
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
        mismatch = checkpoint.mismatch(step.loaded)
        if not mismatch and not self.choice.allows(checkpoint.device):
            mismatch = f"was computed on {checkpoint.device}, this is {self.choice.device}"
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
            if resume:
                batch = resumed(step.loaded, model, target, self.choice, self.console)
            else:
                files = RunFiles(step.loaded, model, target, self.console)
                batch = Batch([files], self.choice, [()], earlier=earlier)
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
