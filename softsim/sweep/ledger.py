"""Records of a running study: its table, the files of its folder, a line of progress."""

import time
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from datetime import datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Any

import polars
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from softsim import __version__
from softsim.errors import Interrupted
from softsim.output.claim import claimed
from softsim.output.console import PLAIN_EVERY
from softsim.output.study_folder import (
    CASES,
    WARNINGS,
    StudyRecord,
    is_study,
    read_study,
    write_study,
    write_table,
)
from softsim.study.axes import Axis, column
from softsim.study.bisection import Bisection
from softsim.study.cases import DONE, WAITING, Case, key_of
from softsim.study.description import settings
from softsim.study.loading import REPEAT, LoadedStudy
from softsim.study.measures import MeasureColumn
from softsim.study.schema import LatinHypercubeDesign, SobolDesign
from softsim.sweep.job import Job, Outcome, history_of, known_outcome

WRITE_EVERY = 10.0
"""Longest time [s] until new rows are on disk."""

WALL_TIME = column("wall_time", "s")

NOTHING_LEFT: tuple[list[Job], int] = [], 0
"""Round without jobs, used if no round is open."""


def told_size(study: LoadedStudy, stored: int) -> str:
    """Return a text such as "40 cases, 3 of them stored"; for a bisection, "at most 40 cases"."""
    most = "at most " if study.bisection is not None else ""
    return f"{most}{study.case_count} cases, {stored} of them stored"


class StudyTable:
    """Table of cases, in the order of their numbers. Columns: see `softsim.output.study_folder`."""

    def __init__(self, factors: Sequence[Axis], measures: Sequence[MeasureColumn]) -> None:
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
        repeats = (Axis(REPEAT),) if study.repeats > 1 else ()
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
        if console.is_terminal or console.is_jupyter:
            self.bar = Progress(
                BarColumn(),
                TextColumn("{task.percentage:>3.0f} %  {task.fields[state]}"),
                console=console,
                transient=True,
            )
            self.task = self.bar.add_task("study", total=count, state="")
            self.bar.start()

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
    def told(self) -> str:
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
        text = f"{self.told}, {in_flight} running"
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
        self.folder, self.table, self.progress = folder, table, progress
        earlier = read_study(folder).wall_time if is_study(folder) else 0.0
        self.record = replace(record, status="running", wall_time=earlier)
        self.earlier, self.began = earlier, time.monotonic()
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
        """Write table and record a last time; status: done or interrupted."""
        self.record = replace(self.record, status=status)
        self.write()


@contextmanager
def kept_ledger(
    folder: Path, record: StudyRecord, table: StudyTable, count: int, console: Console
) -> Iterator[Ledger]:
    """Yield the ledger of a sweep or an optimisation with `count` cases, with its folder locked.

    The progress is added to the message of an interruption. Raises OutputError if the folder is in
    use or cannot be written.
    """
    most = record.bisection is not None
    with claimed(folder), closing(StudyProgress(count, console, most)) as progress:
        ledger = Ledger(folder, record, table, progress)
        status = "interrupted"
        try:
            yield ledger
            status = "done"
        except Interrupted as stop:
            raise Interrupted(f"{stop.message}, {progress.told}", stop.hint) from None
        finally:
            ledger.close(status)


def _moment(now: datetime, later: timedelta) -> str:
    """Return the time of day, with the date if it is another day."""
    end = now + later
    return f"{end:%H:%M:%S}" if end.date() == now.date() else f"{end:%d %b, %H:%M}"
