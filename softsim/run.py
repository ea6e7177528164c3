"""Build, loop, observe, verdict: `softsim run` without the command line."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from rich.console import Console

from softsim import backend
from softsim.batch import Batch
from softsim.builder import build_model
from softsim.errors import DeviceError, OutputError, SoftsimError
from softsim.machine import AUTO, Choice, choose, memory_of
from softsim.model import Model
from softsim.output import folder as files
from softsim.output.checkpoint import Checkpoint, read_checkpoint
from softsim.output.folder import RunFolder
from softsim.output.watch import Watch
from softsim.recording import Recording
from softsim.scene.loading import LoadedScene, load_scene
from softsim.simulation import Results
from softsim.solver.memory import scenarios_that_fit

# Only a loop that took longer [s] is followed by measuring its passes: their kernel takes a second
# or two to trace, ten or twenty to compile the first time.
PROFILE_AFTER = 60.0


def run(
    scene: Path | str | LoadedScene,
    overrides: Sequence[str] = (),
    out: Path | None = None,
    device: str = AUTO,
    resume: bool = False,
    console: Console | None = None,
    threads: int | str = AUTO,
    profile_after: float = PROFILE_AFTER,
    watches: Sequence[Watch] = (),
) -> Results:
    """Run a scene to its end and return what it found.

    Parameters
    ----------
    scene: path of a scene file, or a loaded scene. overrides: "a.b.c=value".
    out: run folder, `runs/<scene's name>` by default. device: auto, cpu, cuda.
    resume: go on from the checkpoint in the run folder.
    threads: CPU threads, a number or auto: one for a small model, else all processors.
    profile_after: a run whose loop took longer [s] ends with measuring what each pass costs.
    watches: see each row of the history, and may end the run early; the summary's `ended_by` names
    the one that did.

    Raises
    ------
    SceneError, MeshError, OutputError, DeviceError: before anything long starts.
    StabilityError: a guard stopped the run; the folder keeps what was computed, the failed frame
    too. Interrupted: SIGINT or SIGTERM came; a checkpoint is written.
    ExpectationError: the run ended outside the scene's `expect` block.
    """
    choice = choose(device, threads)
    console = console or Console()
    loaded = scene if isinstance(scene, LoadedScene) else load_scene(scene, overrides)
    model = build_model(loaded)
    target = RunFolder(out or Path("runs") / loaded.path.stem)
    if resume:
        batch = resumed(loaded, model, target, choice, console, watches)
    else:
        batch = Batch([Recording(loaded, model, target, console)], choice, [watches])
    [outcome] = batch.run(console)
    batch.add_profile(profile_after)
    if isinstance(outcome, SoftsimError):
        raise outcome
    return outcome


def resumed(
    loaded: LoadedScene, model: Model, target: RunFolder, choice: Choice, console: Console,
    watches: Sequence[Watch] = (),
) -> Batch:  # fmt: skip
    """A run that goes on from the checkpoint in its folder.

    Raises OutputError where there is none, or it is of another scene or device.
    """
    checkpoint = fitting_checkpoint(loaded, target, choice)
    then = float(checkpoint.progress["time"])
    recording = Recording.resumed(loaded, model, target, console, then)
    return Batch([recording], choice, [watches], checkpoint)


def run_batch(
    scenes: Sequence[LoadedScene],
    folders: Sequence[Path],
    device: str = AUTO,
    threads: int | str = AUTO,
    watches: Sequence[Sequence[Watch]] | None = None,
) -> list[Results | SoftsimError]:
    """Run several scenes in this process, each as `run` does, those of one structure side by side.

    Scenes that share mesh, materials and kinds of loads and walls are computed together, as many at
    once as fit into memory; a static one is alone. What becomes of a scene does not depend on the
    others. folders: of each. watches: those of each. Nothing is printed, no passes are measured.

    Returns what came out of each: Results, or the error that stopped it; DeviceError where not even
    one of its structure fits.
    Raises DeviceError where the device is not there, Interrupted for SIGINT and SIGTERM; each that
    was running has a checkpoint then, and goes on by `run(..., resume=True)`.
    """
    choice, console = choose(device, threads), Console(quiet=True)
    watches = [()] * len(scenes) if watches is None else watches
    outcomes: dict[int, Results | SoftsimError] = {}
    models: dict[int, Model] = {}
    for k, loaded in enumerate(scenes):
        try:
            models[k] = build_model(loaded)
        except SoftsimError as error:
            outcomes[k] = error
    for group in groups(models, choice):
        recordings: dict[int, Recording] = {}
        for k in group:
            try:
                target = RunFolder(folders[k])
                recordings[k] = Recording(scenes[k], models[k], target, console)
            except SoftsimError as error:
                outcomes[k] = error
        if not recordings:
            continue
        try:
            batch = Batch(list(recordings.values()), choice, [watches[k] for k in recordings])
        except DeviceError as error:  # not even one of this structure fits
            for recording in recordings.values():
                recording.close()
            outcomes |= dict.fromkeys(recordings, error)
        else:
            outcomes |= dict(zip(recordings, batch.run(console), strict=True))
    return [outcomes[k] for k in range(len(scenes))]


def groups(models: Mapping[int, Model], choice: Choice) -> list[list[int]]:
    """Numbers of the models that are computed together: of one structure, no more than fit."""
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
            backend.start(choice.device)
            place = memory_of(choice.device)
            fitting = scenarios_that_fit(models[group[0]], choice.device, place)
            size = size if fitting is None else max(1, fitting)
        parts += [group[k : k + size] for k in range(0, len(group), size)]
    return parts


def fitting_checkpoint(loaded: LoadedScene, target: RunFolder, choice: Choice) -> Checkpoint:
    """The checkpoint in a run folder.

    Raises OutputError where there is none, or it is of another scene or device.
    """
    path = target.path
    checkpoint = read_checkpoint(path / files.CHECKPOINT)
    if checkpoint.scene != loaded.scene.model_dump_json():
        raise OutputError(
            f"the checkpoint in {path} belongs to another scene or other settings",
            hint=f"compare with {path / files.SCENE}, or run without --resume",
        )
    if checkpoint.device != choice.device:
        raise OutputError(
            f"the checkpoint in {path} was computed on {checkpoint.device}, this is "
            f"{choice.device}: the run would not go on to the same bits",
            hint=f"resume with --device {checkpoint.device}",
        )
    return checkpoint
