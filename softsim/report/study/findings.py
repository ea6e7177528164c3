"""Results of a study and their scales in diagrams, for its figures and its page."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from statistics import mean
from typing import Any

import numpy as np
import polars

from softsim.errors import OutputError
from softsim.output.folder import StudyRecord, read_study, read_table
from softsim.report.diagram import POINTS, Diagram, Panel, PlotAxis, PlotSeries, Scale
from softsim.report.style import BLUE, INK, ORANGE, QUIET
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
from softsim.study.measures import MISMATCH
from softsim.study.schema import StudyAxis, column
from softsim.units import count_text

VERDICT = "verdict"

BEST = "best case"
"""Beginning of the sentence on the best design point."""

SPREAD, DONE_COUNT, FAILED_COUNT = "standard deviation of ", "cases done", "cases failed"
"""Columns of design points: prefix of the spread of a measure, and two counts."""

NUMBER = re.compile(r"[-+]?\d+(\.\d*)?")
"""Pattern of a number at the beginning of a label."""


@dataclass(frozen=True, kw_only=True)
class AxisScale(Scale):
    """Scale of a factor or a measure: numbers at their values, labels at 0, 1, ..."""

    axis: StudyAxis

    @classmethod
    def of(cls, axis: StudyAxis, values: polars.Series) -> "AxisScale":
        """Return the scale for all values that the axis has in the table.

        Labels are in the order of the table, or sorted by the numbers at their beginning.
        """
        if not axis.is_label:
            known = values.drop_nulls()
            whole = bool((known == known.round()).all())
            return cls(
                title=title_of(axis), logarithmic=axis.logarithmic, whole=whole, axis=axis
            )  # fmt: skip
        labels = values.drop_nulls().cast(polars.String).unique(maintain_order=True).to_list()
        numbers = [float(found[0]) for found in map(NUMBER.match, labels) if found]
        if len(numbers) == len(labels):
            labels = [labels[at] for at in np.argsort(numbers, kind="stable")]
        return cls(title=title_of(axis), labels=tuple(labels), axis=axis)

    def places(self, values: polars.Series) -> np.ndarray:
        """Return the positions (n,) of values; NaN for a missing value."""
        if self.labels is not None:
            at = {label: float(place) for place, label in enumerate(self.labels)}
            return np.array([at.get(value, np.nan) for value in values], dtype=float)
        return values.cast(polars.Float64).to_numpy(writable=True)

    def place(self, value: float | str | None) -> float:
        """Return the position of a single value."""
        return float(self.places(polars.Series([value]))[0])


def title_of(axis: StudyAxis) -> str:
    """Return the title of an axis, such as "deflation rate [kPa/s]"."""
    words = axis.about or axis.name.replace("_", " ")
    return f"{words} [{axis.unit}]" if axis.unit else words


@dataclass(frozen=True)
class Best:
    """Best design point: its first case, the mean of the goal's measure, and all its columns."""

    case: int
    value: float
    values: Mapping[str, Any]


@dataclass(frozen=True)
class Findings:
    """Record of a study and its table, one row per case."""

    record: StudyRecord
    table: polars.DataFrame

    @classmethod
    def read(cls, folder: Path) -> "Findings":
        """Read the results in the folder of a study.

        Raises OutputError if it holds none.
        """
        return cls(read_study(folder), read_table(folder))

    @property
    def factors(self) -> tuple[StudyAxis, ...]:
        """Factors, whose values define a design point."""
        return self.record.factors

    @cached_property
    def measures(self) -> tuple[StudyAxis, ...]:
        """Measures, and the verdict if the layouts have one."""
        verdict = VERDICT in self.table.columns
        return self.record.measures + (StudyAxis(VERDICT, is_label=True),) * verdict

    @cached_property
    def axes(self) -> dict[str, StudyAxis]:
        """Factors and measures by name."""
        return {axis.name: axis for axis in (*self.factors, *self.measures)}

    def axis(self, name: str) -> StudyAxis:
        """Return the factor or measure `name`.

        Raises OutputError if there is none.
        """
        if name not in self.axes:
            raise OutputError(
                f"the study has no factor or measure {name!r} to draw",
                hint=f"available: {', '.join(self.axes)}",
            )
        return self.axes[name]

    def scale(self, name: str) -> AxisScale:
        """Return the scale of the factor or measure `name`.

        Raises OutputError if there is none.
        """
        axis = self.axis(name)
        return AxisScale.of(axis, self.table[axis.column])

    def level_count(self, axis: StudyAxis) -> int:
        """Return the number of different values of an axis in the table."""
        return self.table[axis.column].drop_nulls().n_unique()

    @cached_property
    def varied(self) -> tuple[StudyAxis, ...]:
        """Factors that have more than one level."""
        return tuple(factor for factor in self.factors if self.level_count(factor) > 1)

    @cached_property
    def done(self) -> polars.DataFrame:
        """Cases that are done."""
        return self.table.filter(polars.col("status") == DONE)

    @cached_property
    def design_points(self) -> polars.DataFrame:
        """Table of design points, one row per combination of factors, in the order of the table.

        Each has its first case, its factors, the mean and the SPREAD of each measure over
        the cases that are done (the most frequent for labels), and the numbers of done and
        of failed cases.
        """
        done = polars.col("status") == DONE
        values = {axis: polars.col(axis.column).filter(done) for axis in self.measures}
        return self.table.group_by([axis.column for axis in self.factors], maintain_order=True).agg(
            polars.col("case").first(),
            *[usual(axis, of) for axis, of in values.items()],
            *[of.std().alias(SPREAD + a.column) for a, of in values.items() if not a.is_label],
            done.sum().alias(DONE_COUNT),
            polars.col("status").is_in([FAILED, LOST]).sum().alias(FAILED_COUNT),
        )

    @cached_property
    def best(self) -> Best | None:
        """Best design point by the study's goal; None without a goal or a case with its measure."""
        goal = self.record.goal
        if goal is None:
            return None
        column = self.axis(goal.measure).column
        found = self.design_points.filter(polars.col(column).is_not_null())
        if found.is_empty():
            return None
        row = found.sort(column, descending=goal.sense == "maximize", maintain_order=True).row(
            0, named=True
        )
        return Best(row["case"], row[column], row)


def usual(axis: StudyAxis, values: polars.Expr) -> polars.Expr:
    """Return the mean of an axis's values, or the most frequent label."""
    return values.drop_nulls().mode().sort().first() if axis.is_label else values.mean()


def written(axis: StudyAxis, value: Any) -> str:
    """Return a value with its unit, such as "1.25 kPa/s"; a dash for None."""
    if value is None:
        return "–"
    number = value if axis.is_label or isinstance(value, str) else f"{value:.4g}"
    return f"{number} {axis.unit}".rstrip()


def written_together(axes: Iterable[StudyAxis], values: Iterable[Any]) -> str:
    """Return values of several factors, such as "pattern 3 rows, friction 0.5"."""
    pairs = zip(axes, values, strict=True)
    return ", ".join(f"{axis.name} {written(axis, value)}" for axis, value in pairs)


def best_in_words(findings: Findings) -> str:
    """Return a sentence on the best design point; empty if there is none."""
    best, goal = findings.best, findings.record.goal
    if best is None or goal is None:
        return ""
    measure = findings.axis(goal.measure)
    count, failed = best.values[DONE_COUNT], best.values[FAILED_COUNT]
    repeats = [f"mean of {count} cases"] * (count > 1) + [f"{failed} more failed"] * (failed > 0)
    remark = f" ({', '.join(repeats)})" if repeats else ""
    at = written_together(findings.factors, [best.values[f.column] for f in findings.factors])
    value = f"{measure.name} {written(measure, best.value)}"
    if measure.name == MISMATCH:
        value += f" ({measure.about})"
    return f"{BEST} {best.case}: {value}{remark} at {at}"


# -------------------------------------------------------------------------------------------------
# Boundaries found by a bisection: as a table, in words, and as a map.

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
