"""Boundaries found by a bisection: as a table, in words, and as a map."""

from dataclasses import dataclass, replace
from statistics import mean
from typing import Any

import numpy as np
import polars

from softsim.report.diagram import POINTS, Diagram, Panel, PlotAxis, PlotSeries, Scale
from softsim.report.study.findings import Findings, written, written_together
from softsim.report.style import BLUE, INK, ORANGE, QUIET
from softsim.study.axes import StudyAxis, column
from softsim.study.bisection import (
    FOUND,
    NOT_MONOTONE,
    OUTSIDE,
    UNDECIDED,
    Answers,
    Bisection,
    Boundary,
    boundary,
)
from softsim.study.cases import DONE, FAILED, LOST
from softsim.study.loading import count_text

TABLE = "boundaries.csv"

NOWHERE = Scale(title="", labels=("",))
"""Empty scale for a study that varies no other factor."""


@dataclass(frozen=True)
class CellBoundary:
    """Boundary in a cell.

    values: of the other factors, by name. answers: of the runs so far, by level; cases: the
    first case of each level.
    """

    values: dict[str, Any]
    answers: Answers
    cases: dict[float, int]
    found: Boundary

    def runs(self, level: float) -> list[float]:
        """Return the measure in the runs at a level that have not failed."""
        return [value for value in self.answers.get(level, ()) if value is not None]


def cell_boundaries(findings: Findings, sought: Bisection) -> list[CellBoundary]:
    """Return the boundary of each cell, in the order of the table."""
    others = other_factors(findings, sought)
    level, measure = findings.axis(sought.factor).column, findings.axis(sought.measure).column
    names = [axis.name for axis in others]
    known: dict[tuple[Any, ...], tuple[dict[float, list[float | None]], dict[float, int]]] = {}
    for row in findings.table.sort("case").iter_rows(named=True):
        key = tuple(row[axis.column] for axis in others)
        answers, cases = known.setdefault(key, ({}, {}))
        cases.setdefault(row[level], row["case"])
        held = answers.setdefault(row[level], [])
        if row["status"] in (DONE, FAILED, LOST):
            held.append(row[measure] if row["status"] == DONE else None)
    return [
        CellBoundary(
            dict(zip(names, key, strict=True)), answers, cases, boundary(sought, answers)
        )
        for key, (answers, cases) in known.items()
    ]  # fmt: skip


def other_factors(findings: Findings, sought: Bisection) -> list[StudyAxis]:
    """Return the factors that are not bisected."""
    return [axis for axis in findings.factors if axis.name != sought.factor]


def boundary_table(findings: Findings, sought: Bisection) -> polars.DataFrame:
    """Return the table of boundaries, one row per cell.

    Columns: other factors; low, high (the bracket) and its middle if the boundary is found;
    state; mean of the measure at both ends; number of runs and of failed ones among them; the
    result in words.
    """
    unit = findings.axis(sought.factor).unit
    rows = []
    for cell in cell_boundaries(findings, sought):
        low, high = cell.found.low, cell.found.high
        is_found = cell.found.state == FOUND
        results = [value for values in cell.answers.values() for value in values]
        rows.append(
            {findings.axis(name).column: value for name, value in cell.values.items()}
            | {
                column(sought.factor, unit): sought.middle(low, high) if is_found else None,
                column("low", unit): float(low),
                column("high", unit): float(high),
                "state": cell.found.state,
                f"{sought.measure} at low": mean(cell.runs(low)) if cell.runs(low) else None,
                f"{sought.measure} at high": mean(cell.runs(high)) if cell.runs(high) else None,
                "runs": len(results),
                "failed": results.count(None),
                "in words": in_words(findings, sought, cell),
            }
        )
    shares = [column(sought.factor, unit), *(f"{sought.measure} at {end}" for end in ENDS)]
    return polars.DataFrame(rows, schema_overrides=dict.fromkeys(shares, polars.Float64))


ENDS = ("low", "high")


def boundaries_in_words(findings: Findings) -> list[str]:
    """Return a sentence for each cell; empty if the study is not a bisection."""
    sought = findings.record.bisection
    if sought is None:
        return []
    said, others = [], other_factors(findings, sought)
    for cell in cell_boundaries(findings, sought):
        place = written_together(others, cell.values.values())
        words = in_words(findings, sought, cell)
        said.append(f"{place}: {words}" if place else words)
    return said


def in_words(findings: Findings, sought: Bisection, cell: CellBoundary) -> str:
    """Return the known facts about a boundary in a clause."""
    axis, found = findings.axis(sought.factor), cell.found
    what = f"{sought.measure} is at least {sought.share:g}"

    def at(level: float) -> str:
        runs = cell.runs(level)
        told = f"{mean(runs):.3g} in {count_text(len(runs), 'run')}" if runs else "no runs"
        return f"{written(axis, level)} ({told})"

    low, high = at(found.low), at(found.high)
    middle = at(sought.middle(found.low, found.high))
    begins = sought.reached(cell.answers.get(found.low, ()))
    if found.state == FOUND:
        if begins:
            return f"{what} up to {low}, and below it from {high}"
        return (
            f"{sought.measure} is below {sought.share:g} up to {low}, and not below it from {high}"
        )
    if found.state == OUTSIDE:
        levels = "at all" if begins else "at none"
        return f"{what} {levels} of {low}, {middle}, {high}: no boundary was found in this range"
    if found.state == NOT_MONOTONE:
        if begins:
            return f"not monotone: {what} at both {low} and {high}, but not at {middle}"
        return f"not monotone: {what} at neither {low} nor {high}, but at {middle}"
    between = f"between {low} and {high}, if there is a boundary"
    if found.state == UNDECIDED:
        return f"not determined, because all runs at one level failed: {between}"
    return f"not determined yet: {between}"


def boundary_maps(findings: Findings, sought: Bisection) -> list[Diagram]:
    """Return maps of the boundary over another factor, a numeric one if possible.

    There is one diagram for each combination of the remaining factors.
    """
    others = [axis for axis in other_factors(findings, sought) if axis in findings.varied]
    along = min(others, key=lambda axis: axis.is_label, default=None)
    rest = [axis for axis in others if axis is not along]
    groups: dict[tuple[Any, ...], list[CellBoundary]] = {}
    for cell in cell_boundaries(findings, sought):
        groups.setdefault(tuple(cell.values[axis.name] for axis in rest), []).append(cell)
    return [
        _map(findings, sought, along, written_together(rest, key), cells)
        for key, cells in groups.items()
    ]


def _map(
    findings: Findings, sought: Bisection, along: StudyAxis | None, of: str,
    cells: list[CellBoundary],
) -> Diagram:  # fmt: skip
    """Return the map with the middles of the brackets as a line in its band, and the levels run."""
    x: Scale = NOWHERE
    places = np.zeros(len(cells))
    if along is not None:
        x = scale = findings.scale(along.name)
        places = scale.places(polars.Series([cell.values[along.name] for cell in cells]))
    y = findings.scale(sought.factor)
    order = np.argsort(places, kind="stable")
    series = [_line(sought, [cells[k] for k in order], places[order])]
    series += _levels(findings, sought, cells, places)
    title = f"boundary of {findings.scale(sought.measure).title} over {x.title} and {y.title}"
    named = replace(x, title=f"{x.title}, {of}".strip(", ")) if of else x
    told = f"{sum(cell.found.state == FOUND for cell in cells)} of {len(cells)} boundaries found"
    panel = Panel(PlotAxis(y, series), height=1.5)
    return Diagram(f"{title}; {of}".rstrip("; "), named, (panel,), told)


def _line(sought: Bisection, cells: list[CellBoundary], places: np.ndarray) -> PlotSeries:
    """Return the boundary line with its bracket as band; NaN where no boundary is found."""
    band = np.array(
        [[getattr(cell.found, end) if cell.found.state == FOUND else np.nan for cell in cells]
         for end in ENDS]
    )  # fmt: skip
    middle = np.array([sought.middle(*ends) if np.isfinite(ends[0]) else np.nan for ends in band.T])
    cases = np.array([cell.cases[cell.found.low] for cell in cells])
    return PlotSeries(
        "boundary with its bracket", places, middle, INK, "-", band, cases=cases,
        mean=sought.repeats > 1,
    )  # fmt: skip


def _levels(
    findings: Findings, sought: Bisection, cells: list[CellBoundary], places: np.ndarray
) -> list[PlotSeries]:
    """Return the levels that were run, one series for each answer."""
    name = findings.axis(sought.measure).name
    kinds = {
        True: (f"{name} at least {sought.share:g}", BLUE),
        False: (f"{name} below {sought.share:g}", ORANGE),
        None: ("not determined", QUIET),
    }
    found = []
    for answer, (words, colour) in kinds.items():
        points = [
            (place, level, cell.cases[level])
            for cell, place in zip(cells, places, strict=True)
            for level, values in cell.answers.items()
            if values and sought.reached(values) is answer
        ]
        if points:
            at_x, at_y, cases = np.array(points).T
            found.append(PlotSeries(
                words, at_x, at_y, colour, POINTS, cases=cases.astype(int), mean=sought.repeats > 1
            ))  # fmt: skip
    return found
