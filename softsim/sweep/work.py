"""What a worker does with jobs: it runs them, says what came of each, and tidies up."""

import shutil
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path

from softsim.errors import ClusterError, ExpectationError, Interrupted, OutputError, SoftsimError
from softsim.output.folder import CHECKPOINT, HISTORY, RESULTS, explained, read_summary
from softsim.output.history import thin_history
from softsim.study.cases import DONE, FAILED, LOST, PRUNED, WAITING
from softsim.sweep.job import CASE, FAILURE, THIN, Job, Outcome, stored_outcome, write_outcome

HISTORY_ROWS = 1000
"""Rows that a thinned history has about: more than a figure has columns."""

Simulate = Callable[[Sequence[Job]], list[Exception | None]]
"""Runs jobs, and tells what went wrong with each."""


def work(jobs: Sequence[Job], simulate: Simulate) -> list[Outcome]:
    """Run `jobs` together, and keep what came of each in its folder.

    Raises OutputError if the disk refuses one: it would refuse the others too; ClusterError where
    the study's folder cannot be seen.
    """
    for job in jobs:
        with explained(job.folder):
            _prepare(job)
    began = time.monotonic()
    faults = simulate(jobs)
    wall_time = (time.monotonic() - began) / len(jobs)
    outcomes = [
        _end(job, fault, wall_time)
        for job, fault in zip(jobs, faults, strict=True)
        if not isinstance(fault, OutputError)
    ]
    for fault in faults:
        if isinstance(fault, OutputError):
            raise fault
    return outcomes


def _prepare(job: Job) -> None:
    """Make the folder; an attempt that ended leaves nothing to go on from."""
    if not job.folder.parent.is_dir():
        raise ClusterError(
            f"a worker cannot see {job.folder.parent}",
            hint="the study's folder must be on a disk that all workers share",
        )
    before = stored_outcome(job.folder)
    if before is not None and before.status != LOST:
        shutil.rmtree(job.folder)
    job.folder.mkdir(exist_ok=True)
    for stale in (CASE, FAILURE):
        (job.folder / stale).unlink(missing_ok=True)


def _end(job: Job, fault: Exception | None, wall_time: float) -> Outcome:
    """What came of a job, written down unless it is to go on later."""
    if isinstance(fault, Interrupted):
        return Outcome(job.key, WAITING)
    summary = read_summary(job.folder)
    if fault is None or isinstance(fault, ExpectationError):
        stopped = summary.get("ended_by") in {watch.name for watch in job.watches}
        status, reason = PRUNED if stopped else DONE, "" if fault is None else fault.message
    else:
        status, reason = FAILED, _reason(fault)
        with explained(job.folder / FAILURE):
            (job.folder / FAILURE).write_text(_explanation(fault), encoding="utf-8")
    if job.keep == THIN and status != FAILED:
        _thin(job.folder)
    outcome = Outcome(job.key, status, reason, wall_time, summary)
    write_outcome(job, outcome)
    return outcome


def _reason(fault: Exception) -> str:
    """A line for the table."""
    text = fault.message if isinstance(fault, SoftsimError) else f"{type(fault).__name__}: {fault}"
    return " ".join(text.split())


def _explanation(fault: Exception) -> str:
    """All there is to know: of what is no fault of the scene, the way there too."""
    if isinstance(fault, SoftsimError):
        return f"{fault}\n"
    return "".join(traceback.format_exception(fault))


def _thin(folder: Path) -> None:
    """Leave what tables and figures of a study need. A failed run keeps what shows why."""
    thin_history(folder / HISTORY, HISTORY_ROWS)
    for large in (RESULTS, CHECKPOINT):
        (folder / large).unlink(missing_ok=True)
