"""Jobs: a case and its folder, its execution by a worker, and its outcome, stored in case.json.

Taichi is imported here only when a job runs.
"""

import shutil
import time
import traceback
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import BaseModel, ValidationError

from softsim.errors import (
    ClusterError,
    ExpectationError,
    Interrupted,
    OutputError,
    SceneError,
    SoftsimError,
)
from softsim.machine import chosen_device
from softsim.output.checkpoint import read_checkpoint
from softsim.output.folder import CHECKPOINT, HISTORY, RESULTS, RunFolder, explained, read_summary
from softsim.output.history import read_history, thin_history
from softsim.output.stop_conditions import MakesStopCondition
from softsim.scene.loading import Loaded
from softsim.study.cases import (
    DONE,
    FAILED,
    LOST,
    PRUNED,
    WAITING,
    Case,
    ChainSource,
    Source,
    case_key,
    load_source,
)
from softsim.study.measures import History, MeasureColumn

if TYPE_CHECKING:
    from softsim.run.batch import ReusedSolver
    from softsim.run.files import RunFiles

CASE = "case.json"
FAILURE = "failure.txt"
STARTS = "starts"

THIN, EVERYTHING = "thin", "everything"
"""Stored results of a case: a thinned history and no fields, or all results of the run."""

PRUNING = "pruning"
"""Name, in the summary, of the stop condition that ends a trial early."""

HISTORY_ROWS = 1000
"""Approximate number of rows of a thinned history: more than a figure has pixel columns."""


@dataclass(frozen=True)
class Job:
    """Case to run in `folder`.

    key: digest of all its inputs; jobs of the same key are one run. device: auto, cpu, cuda. keep:
    THIN or EVERYTHING. stop_conditions: makers of the conditions that may end the run early.
    """

    case: Case
    key: str
    folder: Path
    device: str = "auto"
    keep: str = THIN
    stop_conditions: tuple[MakesStopCondition, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """Outcome of a job.

    status: one of those in `softsim.study.cases`. reason: why it failed, or which expectations of
    the scene a finished run missed. wall_time: of its last attempt [s]. summary: of its run.
    """

    key: str
    status: str
    reason: str = ""
    wall_time: float = 0.0
    summary: Mapping[str, Any] = field(default_factory=dict)


class StoredOutcome(BaseModel):
    """Part of case.json that an `Outcome` is read from."""

    key: str
    status: Literal["done", "failed", "pruned", "lost"]
    reason: str
    wall_time: float


def write_outcome(job: Job, outcome: Outcome) -> None:
    """Write case.json, which marks the case as ended. Raises OutputError."""
    content = {
        "key": outcome.key,
        "status": outcome.status,
        "reason": outcome.reason,
        "wall_time": outcome.wall_time,
        "scene": job.case.source.scene,
        "robot": job.case.source.robot,
        "values": job.case.values,
        "overrides": job.case.overrides,
    }
    RunFolder(job.folder).write_json_atomic(CASE, content)


def stored_outcome(folder: Path) -> Outcome | None:
    """Return the outcome of the case in `folder`; None if none has ended there.

    Raises OutputError if its case.json was not written by softsim.
    """
    file = folder / CASE
    if not file.is_file():
        return None
    try:
        found = StoredOutcome.model_validate_json(file.read_bytes(), strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        place = "".join(f"{key}: " for key in first["loc"])
        raise OutputError(
            f"{file} is not a file written by softsim: {place}{first['msg']}",
            hint=f"remove the folder {folder} to run its case again",
        ) from error
    return Outcome(found.key, found.status, found.reason, found.wall_time, read_summary(folder))


def history_of(job: Job, columns: Sequence[MeasureColumn]) -> History:
    """Return the history of a job, if one of the columns reads it.

    It is empty otherwise, or if there is none. Raises OutputError if it is damaged.
    """
    file = job.folder / HISTORY
    if not file.is_file() or not any(column.reads_history for column in columns):
        return {}
    return read_history(file)


def known_outcome(job: Job, again: Collection[str]) -> Outcome | None:
    """Return the stored outcome of a job, None if it must run; `again`: statuses that run again.

    Raises OutputError as stored_outcome does.
    """
    outcome = stored_outcome(job.folder)
    return None if outcome is None or outcome.status in again else outcome


def note_start(job: Job) -> None:
    """Record that a worker starts a job; the record survives a crash of its process."""
    with (job.folder / STARTS).open("a", encoding="utf-8") as stream:
        stream.write(".")


def starts(job: Job) -> int:
    """Return how often workers have started a job since `forget_starts`, without ending it."""
    file = job.folder / STARTS
    return file.stat().st_size if file.is_file() else 0


def forget_starts(job: Job) -> None:
    """Delete the record of starts of a job. Raises OutputError."""
    with explained(job.folder / STARTS):
        (job.folder / STARTS).unlink(missing_ok=True)


Simulate = Callable[[Sequence[Job]], list[Exception | None]]
"""Function that runs jobs and returns the error of each, None if there was none."""


def work(jobs: Sequence[Job], simulate: Simulate) -> list[Outcome]:
    """Run `jobs` together, store the outcome of each in its folder, and return the outcomes.

    Raises OutputError if one cannot be written, as the others could not either; ClusterError if the
    study's folder is not accessible.
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
    """Create the folder of a job; delete the results of an attempt that ended."""
    if not job.folder.parent.is_dir():
        raise ClusterError(
            f"a worker cannot access {job.folder.parent}",
            hint="the folder of the study must be on a disk shared by all workers",
        )
    before = stored_outcome(job.folder)
    if before is not None and before.status != LOST:
        shutil.rmtree(job.folder)
    job.folder.mkdir(exist_ok=True)
    for stale in (CASE, FAILURE):
        (job.folder / stale).unlink(missing_ok=True)
    note_start(job)


def _end(job: Job, fault: Exception | None, wall_time: float) -> Outcome:
    """Return the outcome of a job, and write it unless the job is to continue later."""
    forget_starts(job)
    if isinstance(fault, Interrupted):
        return Outcome(job.key, WAITING)
    summary = read_summary(job.folder)
    if fault is None or isinstance(fault, ExpectationError):
        is_pruned = summary.get("ended_by") == PRUNING
        status, reason = PRUNED if is_pruned else DONE, "" if fault is None else fault.message
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
    """Return an error as one line for the table."""
    text = fault.message if isinstance(fault, SoftsimError) else f"{type(fault).__name__}: {fault}"
    return " ".join(text.split())


def _explanation(fault: Exception) -> str:
    """Return the full text of an error, with a traceback unless it is a SoftsimError."""
    if isinstance(fault, SoftsimError):
        return f"{fault}\n"
    return "".join(traceback.format_exception(fault))


def _thin(folder: Path) -> None:
    """Reduce the results to those that tables and figures of a study need."""
    thin_history(folder / HISTORY, HISTORY_ROWS)
    for large in (RESULTS, CHECKPOINT):
        (folder / large).unlink(missing_ok=True)


def simulate(jobs: Sequence[Job]) -> list[Exception | None]:
    """Run jobs, several new ones side by side; return the error of each, None without one."""
    together = [job for job in jobs if len(jobs) > 1 and _can_be_joined(job)]
    faults = _faults_together(together)
    faults |= {job.key: _fault(job) for job in jobs if job.key not in faults}
    return [faults[job.key] for job in jobs]


def _fault(job: Job) -> Exception | None:
    """Run a job; return its error instead of raising it, so that the study continues."""
    try:
        RUNS[type(job.case.source)](job)
    except Exception as error:
        return error
    return None


def _run_elements(job: Job) -> None:
    from softsim.run.scenes import run_case

    run_case(
        scene_of(job), job.folder, chosen_device(job.device), _goes_on(job), job.stop_conditions,
        _files_of(job), _solver_of_worker(),
    )  # fmt: skip


def _files_of(job: Job) -> "type[RunFiles]":
    """Return the class of the run's files: with frames only if the study stores them."""
    from softsim.run.files import FramelessFiles, RunFiles

    return RunFiles if job.keep == EVERYTHING else FramelessFiles


@cache
def _solver_of_worker() -> "ReusedSolver":
    """Return the maker of this process's solvers.

    A case with the structure of the previous case reuses its solver.
    """
    from softsim.run.batch import ReusedSolver

    return ReusedSolver()


def _run_chain(job: Job) -> None:
    from softsim.chain.running import run_chain

    run_chain(scene_of(job), job.folder)


RUNS: dict[type[Source], Callable[[Job], None]] = {
    Source: _run_elements, ChainSource: _run_chain,
}  # fmt: skip
"""Class of the source of a case -> function that runs it."""


def _faults_together(jobs: Sequence[Job]) -> dict[str, Exception | None]:
    """Run jobs side by side, as far as they share a structure; return key -> error or None."""
    from softsim.run import run_batch

    faults: dict[str, Exception | None] = {}
    scenes: dict[str, Loaded[Any]] = {}
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
            list(scenes.values()), [job.folder for job in ready],
            chosen_device(ready[0].device), 1, [job.stop_conditions for job in ready],
            _files_of(ready[0]),
        )  # fmt: skip
    except SoftsimError as error:  # a stop, a disk that is full: it concerns all
        return faults | dict.fromkeys(scenes, error)
    except Exception:  # one brought the others down: alone, each will tell for itself
        return faults
    for key, outcome in zip(scenes, found, strict=True):
        faults[key] = outcome if isinstance(outcome, SoftsimError) else None
    return faults


def scene_of(job: Job) -> Loaded[Any]:
    """Return the scene of a job, from its files. Raises SceneError if it does not match the key."""
    loaded = load_source(job.case.source, job.case.overrides)
    if case_key(loaded) != job.key:
        raise SceneError(
            f"{job.case.source.scene}, or softsim itself, was changed while the study was running",
            hint="start the study again: it runs the cases that changed",
        )
    return loaded


def _can_be_joined(job: Job) -> bool:
    """Return True if a job can run in a batch: finite elements from the start."""
    return type(job.case.source) is Source and not _goes_on(job)


def _goes_on(job: Job) -> bool:
    """Return True if a job can resume from the checkpoint of an interrupted attempt.

    The checkpoint must be of the same device, and the frames before it must exist if they are
    stored.
    """
    file = job.folder / CHECKPOINT
    if job.keep == EVERYTHING and not (job.folder / RESULTS).is_file():
        return False
    return file.is_file() and read_checkpoint(file).device == chosen_device(job.device)
