"""Jobs: a case and its folder, its execution by a worker, and its outcome, stored in case.json.

Taichi is imported here only when a job runs.
"""

import shutil
import time
import traceback
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import polars
from pydantic import BaseModel, ValidationError
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from softsim import __version__
from softsim.compute.machine import chosen_device
from softsim.errors import (
    ClusterError,
    ExpectationError,
    Interrupted,
    OutputError,
    SceneError,
    SoftsimError,
)
from softsim.interruption import interrupted_by_signals
from softsim.output.console import PLAIN_EVERY
from softsim.output.folder import (
    CASES,
    CHECKPOINT,
    HISTORY,
    RESULTS,
    WARNINGS,
    RunFolder,
    StudyRecord,
    claimed,
    explained,
    is_study,
    read_checkpoint,
    read_study,
    read_summary,
    write_study,
    write_table,
)
from softsim.output.history import read_history, thin_history
from softsim.output.stop_conditions import MakesStopCondition
from softsim.scene.loading import Loaded
from softsim.study.bisection import Bisection
from softsim.study.cases import (
    DONE,
    FAILED,
    LOST,
    PRUNED,
    WAITING,
    Case,
    case_key,
    key_of,
    load_source,
)
from softsim.study.loading import REPEAT, LoadedStudy, settings
from softsim.study.measures import History, MeasureColumn
from softsim.study.schema import LatinHypercubeDesign, SobolDesign, StudyAxis, column

if TYPE_CHECKING:
    from softsim.run.batch import ReusedSolver
    from softsim.run.record import RunFiles


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
        program = job.case.source.program
        if program is None:
            _run_elements(job)
        else:
            program(scene_of(job), job.folder)
    except Exception as error:
        return error
    return None


def _run_elements(job: Job) -> None:
    from softsim.run.scenes import run_case

    run_case(
        scene_of(job), job.folder, chosen_device(job.device), _goes_on(job), job.stop_conditions,
        _files_of(job), _solver_maker(),
    )  # fmt: skip


def _files_of(job: Job) -> "type[RunFiles]":
    """Return the class of the run's files: with frames only if the study stores them."""
    from softsim.run.record import FramelessFiles, RunFiles

    return RunFiles if job.keep == EVERYTHING else FramelessFiles


@cache
def _solver_maker() -> "ReusedSolver":
    """Return the maker of this process's solvers: a case reuses that of the previous case."""
    from softsim.run.batch import ReusedSolver

    return ReusedSolver()


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
    return job.case.source.program is None and not _goes_on(job)


def _goes_on(job: Job) -> bool:
    """Return True if a job can resume from the checkpoint of an interrupted attempt.

    The checkpoint must be of the same device, and the frames before it must exist if they are
    stored.
    """
    file = job.folder / CHECKPOINT
    if job.keep == EVERYTHING and not (job.folder / RESULTS).is_file():
        return False
    return file.is_file() and read_checkpoint(file).device == chosen_device(job.device)


# -------------------------------------------------------------------------------------------------
# Records of a running study: its table, the files of its folder, a line of progress.

WRITE_EVERY = 10.0
"""Longest time [s] until new rows are on disk."""

WALL_TIME = column("wall_time", "s")

CONTINUE = "repeat the command to continue"
"""Hint of an interrupted study."""

NOTHING_LEFT: tuple[list[Job], int] = [], 0
"""Round without jobs, used if no round is open."""


def told_size(study: LoadedStudy, stored: int) -> str:
    """Return a text such as "40 cases, 3 of them stored"; for a bisection, "at most 40 cases"."""
    most = "at most " if study.bisection is not None else ""
    return f"{most}{study.case_count} cases, {stored} of them stored"


class StudyTable:
    """Table of cases, in the order of their numbers. Columns: see `softsim.output.folder`."""

    def __init__(self, factors: Sequence[StudyAxis], measures: Sequence[MeasureColumn]) -> None:
        self.factors, self.measures = factors, measures
        self.rows: dict[int, dict[str, Any]] = {}
        axes = (*factors, *measures)
        self.schema = {
            "case": polars.Int64,
            **{axis.column: polars.String if axis.is_label else polars.Float64 for axis in axes},
            "verdict": polars.String,
            "status": polars.String,
            "reason": polars.String,
            WARNINGS: polars.Int64,
            WALL_TIME: polars.Float64,
            "key": polars.String,
        }

    @classmethod
    def of(cls, study: LoadedStudy) -> "StudyTable":
        """Return the table of a sweep, with a column of repeats if there are several."""
        repeats = (StudyAxis(REPEAT),) if study.repeats > 1 else ()
        return cls((*study.factors, *repeats), study.measures)

    def open_rounds(
        self, study: LoadedStudy, folder: Path, device: str, again: Collection[str]
    ) -> Iterator[tuple[list[Job], int]]:
        """Yield rounds of the study: jobs to run, and the largest number of cases left with them.

        Stored outcomes, except with statuses in `again`, are entered into the table. The outcomes
        of a round must be entered before the next one is requested.
        """
        place = folder.resolve() / CASES
        for one in study.rounds(partial(self._result, study.bisection)):
            waiting = []
            for case in one.cases:
                key = key_of(case)
                job = Job(case, key, place / key, device, study.study.keep)
                known = known_outcome(job, again)
                self.note(job, known or Outcome(job.key, WAITING))
                if known is None:
                    waiting.append(job)
            if waiting:
                yield waiting, one.left - (len(one.cases) - len(waiting))

    def _result(self, sought: Bisection | None, case: Case) -> float | None:
        """Return the bisected measure of a case that is done, else None."""
        row = self.rows[case.number]
        if sought is None or row["status"] != DONE:
            return None
        found = next(m for m in self.measures if m.name == sought.measure)
        result: float | None = row[found.column]
        return result

    def note(self, job: Job, outcome: Outcome) -> None:
        """Enter the outcome of a job into its row."""
        history = history_of(job, self.measures)
        asked = outcome.summary.get("layout") or outcome.summary.get("crossing") or {}
        self.rows[job.case.number] = {
            "case": job.case.number,
            **{factor.column: job.case.values[factor.name] for factor in self.factors},
            **{
                measure.column: measure.value(outcome.summary, history) for measure in self.measures
            },
            "verdict": asked.get("verdict"),
            "status": outcome.status,
            "reason": outcome.reason or None,
            WARNINGS: len(outcome.summary.get("warnings", [])) or None,
            WALL_TIME: outcome.wall_time or None,
            "key": outcome.key,
        }

    def frame(self) -> polars.DataFrame:
        """Return the table as it is now, without the columns of verdicts and warnings if they are
        empty.
        """
        rows = [self.rows[number] for number in sorted(self.rows)]
        frame = polars.DataFrame(rows, schema=self.schema, orient="row")
        empty = [name for name in ("verdict", WARNINGS) if frame[name].is_null().all()]
        return frame.drop(empty)


class StudyProgress:
    """Progress display of a study: number of ended cases of this session, and estimated end.

    It is a live line on a terminal or in a notebook, else a plain line at intervals.
    """

    def __init__(self, count: int, console: Console, at_most: bool = False) -> None:
        self.console, self.count, self.at_most = console, count, at_most
        self.ended: Counter[str] = Counter()
        self.began = self.last_line = time.monotonic()
        self.bar: Progress | None = None

    def begin(self, left: int) -> None:
        """Start the display and its clock; left: largest number of cases that will run."""
        self.began = self.last_line = time.monotonic()
        if self.console.is_terminal or self.console.is_jupyter:
            self.bar = Progress(
                BarColumn(),
                TextColumn("{task.percentage:>3.0f} %  {task.fields[state]}"),
                console=self.console,
                transient=True,
            )
            self.task = self.bar.add_task("study", total=left, state="")
            self.bar.start()
        self.expect(left)

    def note(self, outcome: Outcome) -> None:
        """Count a case that has ended."""
        self.ended[outcome.status] += 1

    def show(self, in_flight: int) -> None:
        """Show the progress, if a line is due."""
        if self.bar is not None:
            self.bar.update(self.task, completed=self.ended.total(), state=self._state(in_flight))
        elif time.monotonic() - self.last_line >= PLAIN_EVERY:
            self.last_line = time.monotonic()
            self.console.print(self._state(in_flight), highlight=False)

    @property
    def summary(self) -> str:
        """Progress such as "12 of 40 cases, 1 failed"."""
        ended = self.ended.total()
        others = [f"{n} {status}" for status, n in sorted(self.ended.items()) if status != DONE]
        most = "at most " if self.at_most else ""
        return ", ".join([f"{ended} of {most}{self.count} cases", *others])

    def expect(self, left: int) -> None:
        """Set the largest number of cases left, when the next round of a bisection begins."""
        self.count = self.ended.total() + left
        if self.bar is not None:
            self.bar.update(self.task, total=self.count)

    def _state(self, in_flight: int) -> str:
        """Return the progress with the number of running cases and the estimated end."""
        text = f"{self.summary}, {in_flight} running"
        ended = self.ended.total()
        if not ended:
            return text
        left = (time.monotonic() - self.began) * (self.count - ended) / ended
        end = "ends at the latest at" if self.at_most else "expected end"
        return f"{text}, {end} {_moment(datetime.now(), timedelta(seconds=left))}"

    def close(self) -> None:
        """Remove the live line."""
        if self.bar is not None:
            self.bar.stop()


def record_of(study: LoadedStudy, case_count: int) -> StudyRecord:
    """Return the record of a study for study.json."""
    return StudyRecord(
        title=study.title,
        source=str(study.path),
        factors=tuple(study.factors),
        measures=tuple(measure.axis for measure in study.measures),
        plots=tuple(study.plots),
        goal=study.goal,
        bisection=study.bisection,
        repeats=study.repeats,
        case_count=case_count,
        version=__version__,
        settings=dict(settings(study)),
        sampled=isinstance(study.design, LatinHypercubeDesign | SobolDesign),
    )


class Ledger:
    """Ledger of a running study: it updates the table, the files and the progress display."""

    def __init__(
        self, folder: Path, record: StudyRecord, table: StudyTable, progress: StudyProgress
    ) -> None:
        self.folder, self.table, self.progress, self.record = folder, table, progress, record
        self.earlier = read_study(folder).wall_time if is_study(folder) else 0.0
        self.began, self.has_begun = time.monotonic(), False

    def begin(self, left: int) -> None:
        """Write the files of a running study; left: largest number of cases that will run."""
        self.progress.begin(left)
        self.has_begun = True
        self.record = replace(self.record, status="running")
        self.write()

    def note(self, job: Job, outcome: Outcome) -> None:
        """Enter the outcome of a job."""
        self.table.note(job, outcome)
        self.progress.note(outcome)
        self.is_behind = True

    def keep_up(self, in_flight: int) -> None:
        """Show the progress, and write new rows at intervals."""
        self.progress.show(in_flight)
        if self.is_behind and time.monotonic() - self.written_at >= WRITE_EVERY:
            self.write()

    def write(self) -> None:
        """Write table and record. Raises OutputError."""
        self.record = replace(self.record, wall_time=self.earlier + time.monotonic() - self.began)
        write_study(self.folder, self.record)
        write_table(self.folder, self.table.frame())
        self.is_behind, self.written_at = False, time.monotonic()

    def close(self, status: str) -> None:
        """Write table and record a last time; status: done or interrupted.

        Before `begin`, the files of an earlier session are kept except for their status.
        """
        if not self.has_begun and is_study(self.folder):
            write_study(self.folder, replace(read_study(self.folder), status=status))
            return
        self.record = replace(self.record, status=status)
        self.write()


@contextmanager
def kept_ledger(
    folder: Path, record: StudyRecord, table: StudyTable, console: Console
) -> Iterator[Ledger]:
    """Yield the ledger of a sweep or an optimisation, with its folder locked.

    SIGINT and SIGTERM end the block at any time. Raises Interrupted then, with the progress in its
    message; OutputError if the folder is in use or cannot be written.
    """
    most = record.bisection is not None
    with claimed(folder), closing(StudyProgress(record.case_count, console, most)) as progress:
        ledger = Ledger(folder, record, table, progress)
        try:
            with interrupted_by_signals():
                yield ledger
                ledger.close("done")
        except Interrupted as stop:
            ledger.close("interrupted")
            raise Interrupted(f"{stop.message}, {progress.summary}", stop.hint) from None
        except KeyboardInterrupt as stop:
            ledger.close("interrupted")
            raise Interrupted(f"stopped by {stop}, {progress.summary}", CONTINUE) from None
        except BaseException:
            if ledger.has_begun:
                ledger.close("interrupted")
            raise


def _moment(now: datetime, later: timedelta) -> str:
    """Return the time of day, with the date if it is another day."""
    end = now + later
    return f"{end:%H:%M:%S}" if end.date() == now.date() else f"{end:%d %b, %H:%M}"
