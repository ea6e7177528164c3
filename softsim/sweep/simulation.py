"""The simulation behind a job. Taichi is imported in the workers only."""

import io
import math
from collections.abc import Sequence

from rich.console import Console

from softsim.errors import SceneError, SoftsimError
from softsim.machine import chosen_device
from softsim.output.checkpoint import read_checkpoint
from softsim.output.folder import CHECKPOINT
from softsim.scene.loading import LoadedScene
from softsim.study.cases import case_key, load_source
from softsim.sweep.job import Job


def simulate(jobs: Sequence[Job]) -> list[Exception | None]:
    """Run jobs, several that start anew side by side; what went wrong with each."""
    together = [job for job in jobs if len(jobs) > 1 and not _goes_on(job)]
    faults = _faults_together(together)
    faults |= {job.key: _fault(job) for job in jobs if job.key not in faults}
    return [faults[job.key] for job in jobs]


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


def _faults_together(jobs: Sequence[Job]) -> dict[str, Exception | None]:
    """Run jobs side by side, as far as they share a structure; key -> what went wrong."""
    from softsim.run import run_batch

    faults: dict[str, Exception | None] = {}
    scenes: dict[str, LoadedScene] = {}
    for job in jobs:
        try:
            scenes[job.key] = scene_of(job)
        except SoftsimError as error:
            faults[job.key] = error
    ready = [job for job in jobs if job.key in scenes]
    if not ready:
        return faults
    try:
        found = run_batch(
            list(scenes.values()), [job.folder for job in ready], ready[0].device, 1,
            [job.watches for job in ready],
        )  # fmt: skip
    except SoftsimError as error:  # a stop, a disk that is full: it concerns all
        return faults | dict.fromkeys(scenes, error)
    except Exception:  # one brought the others down: alone, each will tell for itself
        return faults
    for key, outcome in zip(scenes, found, strict=True):
        faults[key] = outcome if isinstance(outcome, SoftsimError) else None
    return faults


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
