"""What `softsim sweep` asks, plans, and says in the end."""

from collections.abc import Collection
from contextlib import AbstractContextManager
from pathlib import Path

import polars
import typer
from rich.console import Console
from rich.table import Table

from softsim.errors import ClusterError, OutputError
from softsim.machine import chosen_device, processor_count
from softsim.output.study_folder import DONE, FAILED, LOST, TABLE_TEXT, WAITING
from softsim.study.loaded import LoadedStudy
from softsim.sweep.job import Job, known_outcome

MANY = 10_000
"""Cases above which one is asked whether that many are meant."""

MOST_SHOWN = 30
"""Rows of a table for people."""


def again(retry_failed: bool) -> tuple[str, ...]:
    """Statuses of stored cases that are run again."""
    return (LOST, FAILED) if retry_failed else (LOST,)


def confirm_size(study: LoadedStudy, folder: Path, is_meant: bool, console: Console) -> None:
    """Ask on a terminal whether so many cases are meant; elsewhere refuse them without --yes."""
    count = study.case_count
    if count <= MANY or is_meant:
        return
    text = f"{count:,} cases make up to {count:,} folders in {folder}"
    if not console.is_terminal:
        raise OutputError(text, hint="if that is meant, add --yes")
    if not typer.confirm(f"{text}. Go on?"):
        raise typer.Exit(0)


def asked_batch(text: str, device: str) -> int:
    """Cases that a worker runs at once. Raises ClusterError: no such number."""
    if text == "auto":
        return 1
    if not text.isdecimal() or int(text) < 1:
        raise ClusterError(f"--batch {text}: a number from 1 on, or auto")
    return int(text)


def crew(
    workers: int | None, scheduler: str | None, folder: Path, device: str
) -> AbstractContextManager:
    """The workers that were asked for. A graphics card is one worker's alone."""
    from softsim.sweep.crew import local_crew, remote_crew  # imports dask

    if scheduler is not None:
        return remote_crew(scheduler, folder)
    alone = chosen_device(device) == "cuda"
    return local_crew(workers or (1 if alone else processor_count()))


def print_plan(jobs: list[Job], statuses: Collection[str], console: Console) -> None:
    """The cases, what is stored of them, and how many runs are left."""
    known = [known_outcome(job, statuses) for job in jobs]
    table = Table("case", *jobs[0].case.values, "status", "key", box=None)
    for job, outcome in list(zip(jobs, known, strict=True))[:MOST_SHOWN]:
        status = WAITING if outcome is None else outcome.status
        values = [_shown(value) for value in job.case.values.values()]
        table.add_row(str(job.case.number), *values, status, job.key)
    console.print(table)
    _say_more(len(jobs), console)
    left = len({job.key for job, outcome in zip(jobs, known, strict=True) if outcome is None})
    stored = sum(outcome is not None for outcome in known)
    console.print(f"{len(jobs)} cases, {stored} of them stored, {left} to run")


def print_results(
    study: LoadedStudy, frame: polars.DataFrame, folder: Path, console: Console
) -> None:
    """The table, the best first where the study says what is best; what failed; where it is."""
    if study.goal is not None:
        measure = next(m for m in study.measures if m.name == study.goal.measure)
        frame = frame.sort(
            measure.column, descending=study.goal.sense == "maximize", nulls_last=True
        )
    shown = frame.drop("key", "reason").head(MOST_SHOWN)
    table = Table(*shown.columns, box=None)
    for row in shown.iter_rows():
        table.add_row(*map(_shown, row))
    console.print(table)
    _say_more(len(frame), console)
    ended_badly = frame.filter(polars.col("status").is_in([FAILED, LOST]))
    for case in ended_badly.select("case", "status", "reason").iter_rows():
        console.print("case {} {}: {}".format(*case), highlight=False)
    done = frame.filter(polars.col("status") == DONE)
    console.print(f"{len(done)} of {len(frame)} cases done", highlight=False)
    console.print(f"table   {folder / TABLE_TEXT}", highlight=False)


def _say_more(count: int, console: Console) -> None:
    if count > MOST_SHOWN:
        console.print(f"... and {count - MOST_SHOWN:,} more")


def _shown(value: float | str | None) -> str:
    if value is None:
        return ""
    return value if isinstance(value, str) else f"{value:.4g}"
