"""The simulation behind a job. Taichi is imported in the workers only."""

import io
import math
from collections.abc import Sequence

from rich.console import Console

from softsim.machine import chosen_device
from softsim.output.checkpoint import read_checkpoint
from softsim.output.folder import CHECKPOINT

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
            resolved(job.case), (), job.folder, job.device, _goes_on(job), silent, threads=1,
            profile_after=math.inf, watches=job.watches,
        )  # fmt: skip
    except Exception as error:
        return error
    return None


def _goes_on(job: Job) -> bool:
    """Whether an attempt that was cut off left a checkpoint, of the device that is to go on."""
    file = job.folder / CHECKPOINT
    return file.is_file() and read_checkpoint(file).device == chosen_device(job.device)
