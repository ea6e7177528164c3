"""The run of a scene of several steps (scene/steps.py), one after another, each in a folder of its
own: 1_inflate, 2_shake.

A step begins with the state in which the one before has ended: places, velocities, what its
branches, contacts and loads remember. Time goes on, so that the histories can be put together.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from softsim.errors import Interrupted
from softsim.machine import AUTO, Choice, choose
from softsim.model import Model
from softsim.output.checkpoint import Checkpoint, read_checkpoint
from softsim.output.claim import claimed
from softsim.output.folder import CHECKPOINT, HISTORY, SUMMARY, RunFolder, read_summary
from softsim.output.history import read_history
from softsim.run.batch import Batch
from softsim.run.course import Results
from softsim.run.files import RunFiles
from softsim.run.handover import EarlierStep
from softsim.run.scenes import PROFILE_AFTER, outcome_of, ready_model, resumed
from softsim.run.taken_steps import fitting_steps, refuse_source, take_step
from softsim.scene.steps import AT_THE_START, Step, following


def run_steps(
    steps: Sequence[Step],
    out: Path | None = None,
    device: str = AUTO,
    resume: bool = False,
    console: Console | None = None,
    threads: int | str = AUTO,
    profile_after: float = PROFILE_AFTER,
    source: Path | None = None,
) -> dict[str, Results]:
    """Run the steps of a scene, `load_steps("scene.yaml")`, to the end of the last; returns the
    results of each by its name.

    out: folder of the steps' folders, `runs/<scene's name>` by default. resume: keep the steps that
    are done as they are asked for now, go on in the one that was stopped; a step that is asked for
    otherwise begins anew, and all after it. source: the folder of another run, of which the first
    steps are copied, as many as are done there as they are asked for now. The rest as `run`, what
    is raised, too: the folder keeps the steps before.
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
    work = Work(RunFolder(path), tuple(steps), choice, console, profile_after)
    with claimed(path):
        if taken:
            work.take(taken)
        return work.run(len(steps) if resume else len(taken))


def folder_name(number: int, step: Step) -> str:
    """How the folder of a step is called; numbers count from 1."""
    return f"{number}_{step.name}"


def foreseen_models(steps: Sequence[Step], choice: Choice) -> list[Model]:
    """The models of all steps, each as if the one before ended at its time.

    Raises what `ready_model` does, of any of them.
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
    """The steps of a scene in a folder, and with what they are computed."""

    folder: RunFolder
    steps: tuple[Step, ...]
    choice: Choice
    console: Console
    profile_after: float

    def path(self, number: int) -> Path:
        """The folder of a step; numbers count from 1."""
        return self.folder.path / folder_name(number, self.steps[number - 1])

    def take(self, taken: Sequence[Path]) -> None:
        """Begin with copies of the first steps, from these folders of theirs."""
        self._forget_from(1)
        for number, source in enumerate(taken, 1):
            target = RunFolder(self.path(number))
            with claimed(target.path):
                take_step(source, target)

    def run(self, kept: int) -> dict[str, Results]:
        """Run the steps, but for those that are done among the first `kept`."""
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
        """The checkpoint of a step as it is asked for now, on this device; None where there is
        none.
        """
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
        """What is in the folders of this step and of those after it is of another course."""
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
            return outcome_of(batch, self.console, self.profile_after)

    def write_summary(self, status: str) -> None:
        """Write what the steps have come to, in the folder of them all."""
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
