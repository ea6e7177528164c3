"""Runs of scenes: one scene with its folder and console, or several that share a structure."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from softsim.builder import build_model
from softsim.compute import backend
from softsim.compute.machine import AUTO, Choice, choose, memory_of
from softsim.errors import DeviceError, SoftsimError
from softsim.model import Model
from softsim.output.folder import CHECKPOINT, RunFolder, claimed
from softsim.output.stop_conditions import MakesStopCondition
from softsim.run.batch import Batch, EarlierStep, MakesSolver, Monitor, new_solver
from softsim.run.callbacks import conditions_of_scene
from softsim.run.loop import Results
from softsim.run.record import RunFiles, fitting_checkpoint
from softsim.scene.loading import Loaded, LoadedScene, load_scene
from softsim.scene.steps import AT_THE_START, Beginning
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
