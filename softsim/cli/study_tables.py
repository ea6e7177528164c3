"""Prompts, plans and results that the commands on a study print."""

import shlex
from collections.abc import Collection
from pathlib import Path

import polars
import typer
from rich.console import Console

from softsim.compute.machine import chosen_device
from softsim.errors import ClusterError, OutputError, SoftsimError
from softsim.output.folder import TABLE_TEXT
from softsim.report.study.findings import Findings, best_in_words, boundaries_in_words
from softsim.report.table import Table, cell
from softsim.study.cases import (
    DONE,
    FAILED,
    LOST,
    PRUNED,
    Case,
)
from softsim.study.loading import LoadedStudy, describe
from softsim.sweep.job import NOTHING_LEFT, StudyTable, told_size
from softsim.sweep.study import cost_line, estimated_cost, refusals, stored_cost

MANY = 10_000
"""Number of cases above which the user must confirm the size of the study."""

GPU_BATCH = 256
"""Number of cases in a batch on a graphics card; if one fails, each is run alone."""

MOST_SHOWN = 30
"""Largest number of rows in a printed table."""


def again(retry_failed: bool) -> tuple[str, ...]:
    """Return the statuses of stored cases that are run again, including those pruned."""
    return (LOST, PRUNED, FAILED) if retry_failed else (LOST, PRUNED)


def confirm_size(study: LoadedStudy, folder: Path, is_meant: bool, console: Console) -> None:
    """Ask on a terminal whether a large study is intended; elsewhere require --yes."""
    count = study.case_count
    if count <= MANY or is_meant:
        return
    text = f"{count:,} cases would create up to {count:,} folders in {folder}"
    if not console.is_terminal:
        raise OutputError(text, hint="to run them all, add --yes")
    if not typer.confirm(f"{text}. Continue?"):
        raise typer.Exit(0)


def asked_batch(text: str, device: str) -> int:
    """Return the number of cases that a worker runs at once.

    Raises ClusterError for an invalid number.
    """
    if text == "auto":
        return GPU_BATCH if chosen_device(device) == "cuda" else 1
    if not text.isdecimal() or int(text) < 1:
        raise ClusterError(f"--batch {text}: must be a whole number of at least 1, or auto")
    return int(text)


def print_plan(
    study: LoadedStudy, folder: Path, device: str, workers: int | None, again: Collection[str],
    console: Console,
) -> None:  # fmt: skip
    """Print the factors, the cases, the stored ones, and the number and cost of remaining runs."""
    console.print(Table(describe(study)))
    table = StudyTable.of(study)
    waiting, left = next(table.open_rounds(study, folder, device, again), NOTHING_LEFT)
    frame = table.frame()
    factors = [axis.column for axis in table.factors]
    _print_rows(frame.select("case", *factors, "status", "key"), console)
    size = told_size(study, len(frame) - len(waiting))
    runs = len({job.key for job in waiting})
    if study.bisection is None:
        left = runs
        console.print(f"{size}, {runs} to run")
    else:
        console.print(f"{size}, {runs} to run next, at most {left} in total")
    for line in refusals(waiting, device):
        console.print(line, highlight=False, markup=False, soft_wrap=True)
    if waiting:
        each = stored_cost(frame) or estimated_cost(waiting[0], device)
        console.print(cost_line(each, left, device, workers), highlight=False, soft_wrap=True)


def print_results(
    study: LoadedStudy, frame: polars.DataFrame, folder: Path, console: Console
) -> None:
    """Print the table, sorted by the goal if any, the failed cases, boundaries and the file."""
    if study.goal is not None:
        measure = next(m for m in study.measures if m.name == study.goal.measure)
        frame = frame.sort(  # what a run had found when it was stopped counts for nothing
            polars.col("status") != DONE, measure.column,
            descending=[False, study.goal.sense == "maximize"], nulls_last=True,
        )  # fmt: skip
    _print_rows(frame.drop("key", "reason"), console)
    ended_badly = frame.filter(polars.col("status").is_in([FAILED, LOST]))
    for case in ended_badly.select("case", "status", "reason").iter_rows():
        text = "case {} {}: {}".format(*case)
        console.print(text, highlight=False, markup=False, soft_wrap=True)
    for sentence in boundaries_in_words(Findings.read(folder)):
        console.print(sentence, highlight=False, markup=False, soft_wrap=True)
    done = frame.filter(polars.col("status") == DONE)
    console.print(f"{len(done)} of {len(frame)} cases done", highlight=False)
    console.print(f"table   {folder / TABLE_TEXT}", highlight=False, markup=False, soft_wrap=True)


def _print_rows(frame: polars.DataFrame, console: Console) -> None:
    rows = [list(map(cell, row)) for row in frame.head(MOST_SHOWN).iter_rows()]
    console.print(Table(rows, frame.columns))
    if len(frame) > MOST_SHOWN:
        console.print(f"... and {len(frame) - MOST_SHOWN:,} more")


def print_best(study: LoadedStudy, folder: Path, console: Console) -> None:
    """Print the best trial and the command that runs it alone.

    Raises SoftsimError if there is none.
    """
    findings = Findings.read(folder)
    best = findings.best
    if best is None:
        raise SoftsimError(
            f"none of {len(findings.table)} trials has a value of the objective",
            hint=f"the column reason of {folder / TABLE_TEXT} gives the cause of each failure",
        )
    case = study.case(best.case, {axis.name: best.values[axis.column] for axis in study.factors})
    words = best_in_words(findings)
    console.print(words, style="bold", highlight=False, markup=False, soft_wrap=True)
    console.print(run_command(case), highlight=False, markup=False, soft_wrap=True)


def run_command(case: Case) -> str:
    """Return the command that runs a case alone, with its overrides."""
    settings = (word for one in case.overrides for word in ("--set", one))
    return shlex.join([*case.source.command, *settings])
