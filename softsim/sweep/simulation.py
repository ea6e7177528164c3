"""The simulation behind a job. Taichi is imported in the workers only."""

import io
import math
from collections.abc import Sequence

from rich.console import Console

from softsim.errors import SceneError
from softsim.machine import chosen_device
from softsim.output.checkpoint import read_checkpoint
from softsim.output.folder import CHECKPOINT
from softsim.scene.loading import LoadedScene
from softsim.study.resolution import case_key, load_source
from softsim.sweep.job import Job


def simulate(jobs: Sequence[Job]) -> list[Exception | None]:
    """Run jobs one after the other; what went wrong with each."""
    return [_fault(job) for job in jobs]


def _fault(job: Job) -> Exception | None:
    """Run a job; whatever goes wrong is told, so that the study goes on."""
    from softsim.run import run

    silent = Console(file=io.StringIO())
    try:
        run(
            scene_of(job), (), job.folder, job.device, _goes_on(job), silent, threads=1,
            profile_after=math.inf, watches=job.watches,
        )  # fmt: skip
    except Exception as error:
        return error
    return None


def scene_of(job: Job) -> LoadedScene:
    """The scene of a job, from its files. Raises SceneError: it is not what the key stands for."""
    loaded = load_source(job.case.source, job.case.overrides)
    if case_key(loaded) != job.key:
        raise SceneError(
            f"{job.case.source.scene}, or softsim itself, changed while the study ran",
            hint="start the study again: it runs what changed",
        )
    return loaded


def _goes_on(job: Job) -> bool:
    """Whether an attempt that was cut off left a checkpoint, of the device that is to go on."""
    file = job.folder / CHECKPOINT
    return file.is_file() and read_checkpoint(file).device == chosen_device(job.device)
