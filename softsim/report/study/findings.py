"""Results of a study and their scales in diagrams, for its figures and its page."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import polars

from softsim.errors import OutputError
from softsim.output.folder import StudyRecord, read_study, read_table
from softsim.report.diagram import Scale
from softsim.study.axes import StudyAxis
from softsim.study.cases import DONE, FAILED, LOST
from softsim.study.measures import MISMATCH

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
