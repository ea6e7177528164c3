"""Runs of scenes: one with its folder and console, several that share a structure, or steps."""

import shutil
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rich.console import Console

from softsim.builder import build_model
from softsim.compute import backend
from softsim.compute.machine import AUTO, Choice, choose, memory_of
from softsim.errors import DeviceError, Interrupted, OutputError, SoftsimError
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
from softsim.output.stop_conditions import MakesStopCondition
from softsim.run.batch import Batch, EarlierStep, MakesSolver, Monitor, new_solver
from softsim.run.callbacks import conditions_of_scene
from softsim.run.loop import Results
from softsim.run.record import RunFiles, fitting_checkpoint
from softsim.scene.loading import Loaded, LoadedScene, load_scene
from softsim.scene.steps import AT_THE_START, Beginning, Step, following
from softsim.solver.explicit import refuse_before_start, scenarios_that_fit


def run(
    scene: Path | str | LoadedScene,
    overrides: Sequence[str] = (),
    out: Path | None = None,
    device: str = AUTO,
    resume: bool = False,
    console: Console | None = None,
    threads: int | str = AUTO,
    profile: bool = False,
    stop_conditions: Sequence[MakesStopCondition] = (),
    monitors: Sequence[Monitor] = (),
) -> Results:
    """Run a scene to its end and return its results.

    Parameters
    ----------
    scene : Path, str or LoadedScene
        Path of a scene file, or a scene from `load_scene`.
    overrides : sequence of str
        Values that override those of the file: "time.end=3 s". Only for a path.
    out : Path, optional
        Run folder. Default: `runs/` and the name of the scene file.
    device : {"auto", "cpu", "cuda"}
        Device of the computation.
    resume : bool
        Continue from the checkpoint in the run folder; without a checkpoint the run starts anew.
    console : rich.console.Console, optional
        Console for progress and warnings. Default: the terminal.
    threads : int or "auto"
        Number of CPU threads. "auto": one for a small model, else all processors.
    profile : bool
        Measure the cost of each kernel after the run. This takes some seconds, 10 to 20 s for the
        first time.
    stop_conditions : sequence of callable
        Additional conditions that end the run early. Each is called with the model and returns a
        `softsim.output.stop_conditions.StopCondition`; `ended_by` in the summary names the one
        that ended the run.
    monitors : sequence of Monitor
        Programs that follow the run between its blocks of increments: `softsim.live.LiveView`.

    Returns
    -------
    Results
        Folder, summary and history of the run.

    Raises
    ------
    SceneError, MeshError, DeviceError
        The scene cannot be run. Raised before the computation starts.
    OutputError
        The run folder cannot be written, or another run uses it.
    StabilityError
        A check stopped the run. The folder keeps the results so far, including the failed frame.
    Interrupted
        The process received SIGINT or SIGTERM. A checkpoint is written.
    ExpectationError
        A result is outside the limits of the scene's `expect` block.

    Examples
    --------
    >>> from pathlib import Path
    >>> from softsim.run import run
    >>> results = run("block.yaml", ["time.end=5 ms"], out=Path("runs/block"))
    >>> results.summary["status"]
    'done'
    >>> float(results.history["pressure"][-1])  # [Pa]
    5000.0
    """
    choice = choose(device, threads)
    console = console or Console()
    loaded = scene if isinstance(scene, Loaded) else load_scene(scene, overrides)
    model = ready_model(loaded, choice)
    target = RunFolder(out or Path("runs") / loaded.path.stem)
    with claimed(target.path):
        if resume and not (target.path / CHECKPOINT).is_file():
            console.print(f"nothing to resume in {target.path}: the run starts from the beginning")
            resume = False
        batch = opened(loaded, model, target, choice, console, resume, stop_conditions)
        return outcome_of(batch, console, profile, monitors)


def ready_model(loaded: LoadedScene, choice: Choice, beginning: Beginning = AT_THE_START) -> Model:
    """Return the model of a scene, or of a step with its beginning, checked for the chosen device.

    Raises SceneError, MeshError, DeviceError.
    """
    model = build_model(loaded, beginning)
    refuse_before_start(model, choice.device_for(model.corner_count))
    conditions_of_scene(loaded, model)
    return model


def outcome_of(
    batch: Batch, console: Console, profile: bool, monitors: Sequence[Monitor] = ()
) -> Results:
    """Run a batch of one to its end; raise the error that stopped it, if there is one."""
    [outcome] = batch.run(console, monitors)
    if profile:
        batch.add_profile()
    if isinstance(outcome, SoftsimError):
        raise outcome
    return outcome


def opened(
    loaded: LoadedScene, model: Model, target: RunFolder, choice: Choice, console: Console,
    resume: bool, stop_conditions: Sequence[MakesStopCondition] = (),
    files: type[RunFiles] = RunFiles, make_solver: MakesSolver = new_solver,
    earlier: EarlierStep | None = None,
) -> Batch:  # fmt: skip
    """Return a batch of one; resume: continued from the checkpoint in its folder.

    Raises OutputError if there is none, or if it is of another scene or device.
    """
    checkpoint, resumed_at = None, None
    if resume:
        checkpoint = fitting_checkpoint(loaded, target, choice)
        choice = replace(choice, device=checkpoint.device)
        resumed_at = float(checkpoint.progress["time"])
    record = files(loaded, model, target, console, resumed_at)
    return Batch([record], choice, [stop_conditions], checkpoint, earlier, make_solver)


def run_case(
    loaded: LoadedScene,
    folder: Path,
    device: str,
    resume: bool,
    stop_conditions: Sequence[MakesStopCondition],
    files: type[RunFiles],
    make_solver: MakesSolver,
) -> Results:
    """Run a case of a study on one thread, as `run` does; nothing is printed, no passes measured.

    resume: continue from the existing checkpoint. files: class of the run's files. make_solver: as
    in Batch. Raises what `run` raises.
    """
    choice, console = choose(device, 1), Console(quiet=True)
    model = ready_model(loaded, choice)
    target = RunFolder(folder)
    with claimed(target.path):
        batch = opened(
            loaded, model, target, choice, console, resume, stop_conditions, files, make_solver
        )
        return outcome_of(batch, console, profile=False)


def run_batch(
    scenes: Sequence[LoadedScene],
    folders: Sequence[Path],
    device: str = AUTO,
    threads: int | str = AUTO,
    stop_conditions: Sequence[Sequence[MakesStopCondition]] | None = None,
    files: type[RunFiles] = RunFiles,
) -> list[Results | SoftsimError]:
    """Run several scenes in this process, each as `run` does, those of one structure side by side.

    Scenes that share mesh, materials and kinds of loads and walls are computed together, as many at
    once as fit into memory; a static one is alone. The results of a scene do not depend on the
    others. folders, stop_conditions: those of each scene. files: what each is recorded in. Nothing
    is printed, no passes are measured.

    Returns the outcome of each: Results, or the error that stopped it; DeviceError where not even
    one of its structure fits.
    Raises DeviceError where the device is not there, Interrupted for SIGINT and SIGTERM; each that
    was running has a checkpoint then, and goes on by `run(..., resume=True)`.
    """
    choice, console = choose(device, threads), Console(quiet=True)
    stop_conditions = [()] * len(scenes) if stop_conditions is None else stop_conditions
    outcomes: dict[int, Results | SoftsimError] = {}
    models: dict[int, Model] = {}
    for k, loaded in enumerate(scenes):
        try:
            models[k] = ready_model(loaded, choice)
        except SoftsimError as error:
            outcomes[k] = error
    for group in groups(models, choice):
        records: dict[int, RunFiles] = {}
        with ExitStack() as claims:
            for k in group:
                try:
                    target = RunFolder(folders[k])
                    claims.enter_context(claimed(target.path))
                    records[k] = files(scenes[k], models[k], target, console)
                except SoftsimError as error:
                    outcomes[k] = error
            if not records:
                continue
            try:
                batch = Batch(list(records.values()), choice, [stop_conditions[k] for k in records])
            except DeviceError as error:  # not even one of this structure fits
                for one in records.values():
                    one.close()
                outcomes |= dict.fromkeys(records, error)
            else:
                outcomes |= dict(zip(records, batch.run(console), strict=True))
    return [outcomes[k] for k in range(len(scenes))]


def groups(models: Mapping[int, Model], choice: Choice) -> list[list[int]]:
    """Return groups of models that are computed together: of one structure, as many as fit."""
    structures: list[list[int]] = []
    for k, model in models.items():
        same = (group for group in structures if models[group[0]].can_share(model))
        group = next(same, None)
        if group is None:
            structures.append([k])
        else:
            group.append(k)
    parts = []
    for group in structures:
        size = len(group)
        if size > 1:
            model = models[group[0]]
            device = choice.device_for(model.corner_count)
            backend.start(device)
            fitting = scenarios_that_fit(model, device, memory_of(device))
            size = size if fitting is None else max(1, fitting)
        parts += [group[k : k + size] for k in range(0, len(group), size)]
    return parts


# -------------------------------------------------------------------------------------------------
# The run of a scene with several steps, each in a folder of its own: 1_inflate, 2_shake.
#
# A step starts from the state in which the previous one ended: positions, velocities, and the
# internal variables of materials, contacts and loads. Time continues, so that the histories can be
# joined.


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
