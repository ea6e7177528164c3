"""What a study found, and where it lies in diagrams, as its figures and its page need it."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import polars

from softsim.errors import OutputError
from softsim.output.study_folder import StudyRecord, read_study, read_table
from softsim.report.diagram import Scale
from softsim.study.axes import Axis
from softsim.study.cases import DONE, FAILED, LOST
from softsim.study.measures import MISMATCH

VERDICT = "verdict"

BEST = "best case"
"""How the sentence on the best design point begins."""

SPREAD, DONE_COUNT, FAILED_COUNT = "standard deviation of ", "cases done", "cases failed"
"""Columns of the design points: before the column of a measure; and two counts."""

NUMBER = re.compile(r"[-+]?\d+(\.\d*)?")
"""What a label may begin with."""


@dataclass(frozen=True, kw_only=True)
class AxisScale(Scale):
    """The scale of a factor or a measure: numbers lie where they are, labels one after another."""

    axis: Axis

    @classmethod
    def of(cls, axis: Axis, values: polars.Series) -> "AxisScale":
        """For all values that the axis has in the table; labels in the order of the table or of the
        numbers that they begin with.
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
        """Where values lie (n,); NaN where there is none."""
        if self.labels is not None:
            at = {label: float(place) for place, label in enumerate(self.labels)}
            return np.array([at.get(value, np.nan) for value in values], dtype=float)
        return values.cast(polars.Float64).to_numpy(writable=True)

    def place(self, value: float | str | None) -> float:
        """Where a single value lies."""
        return float(self.places(polars.Series([value]))[0])


def title_of(axis: Axis) -> str:
    """Of an axis of a diagram: "deflation rate [kPa/s]"."""
    words = axis.about or axis.name.replace("_", " ")
    return f"{words} [{axis.unit}]" if axis.unit else words


@dataclass(frozen=True)
class Best:
    """The best design point: its first case, the mean of the goal's measure over its repeats, and
    all its columns.
    """

    case: int
    value: float
    values: Mapping[str, Any]


@dataclass(frozen=True)
class Findings:
    """The record of a study and its table, a row a case."""

    record: StudyRecord
    table: polars.DataFrame

    @classmethod
    def read(cls, folder: Path) -> "Findings":
        """From the folder of a study. Raises OutputError where it holds none."""
        return cls(read_study(folder), read_table(folder))

    @property
    def factors(self) -> tuple[Axis, ...]:
        """What makes a design point."""
        return self.record.factors

    @cached_property
    def measures(self) -> tuple[Axis, ...]:
        """The measures, and the verdict where layouts have one."""
        verdict = VERDICT in self.table.columns
        return self.record.measures + (Axis(VERDICT, is_label=True),) * verdict

    @cached_property
    def axes(self) -> dict[str, Axis]:
        """Factors and measures by name."""
        return {axis.name: axis for axis in (*self.factors, *self.measures)}

    def axis(self, name: str) -> Axis:
        """Raises OutputError unless a factor or measure is called `name`."""
        if name not in self.axes:
            raise OutputError(
                f"the study has no factor or measure {name!r} to draw",
                hint=f"available: {', '.join(self.axes)}",
            )
        return self.axes[name]

    def scale(self, name: str) -> AxisScale:
        """How a factor or measure is drawn. Raises OutputError unless one is called `name`."""
        axis = self.axis(name)
        return AxisScale.of(axis, self.table[axis.column])

    def level_count(self, axis: Axis) -> int:
        """How many different values an axis has in the table."""
        return self.table[axis.column].drop_nulls().n_unique()

    @cached_property
    def varied(self) -> tuple[Axis, ...]:
        """The factors that have more than one level."""
        return tuple(factor for factor in self.factors if self.level_count(factor) > 1)

    @cached_property
    def done(self) -> polars.DataFrame:
        """The cases that are done."""
        return self.table.filter(polars.col("status") == DONE)

    @cached_property
    def design_points(self) -> polars.DataFrame:
        """A row a combination of the factors, in the order of the table: its first case, its
        factors, the mean and the SPREAD of each measure over the cases that are done (of labels
        the most frequent), how many are done and how many failed.
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
        """The best design point by the study's goal; none without a goal or a case that has it."""
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


def usual(axis: Axis, values: polars.Expr) -> polars.Expr:
    """The mean of an axis's values; of labels the most frequent one."""
    return values.drop_nulls().mode().sort().first() if axis.is_label else values.mean()


def written(axis: Axis, value: Any) -> str:
    """A value with its unit: "1.25 kPa/s"; a dash where there is none."""
    if value is None:
        return "–"
    number = value if axis.is_label or isinstance(value, str) else f"{value:.4g}"
    return f"{number} {axis.unit}".rstrip()


def written_together(axes: Iterable[Axis], values: Iterable[Any]) -> str:
    """Values of several factors: "pattern 3 rows, friction 0.5"."""
    pairs = zip(axes, values, strict=True)
    return ", ".join(f"{axis.name} {written(axis, value)}" for axis, value in pairs)


def best_in_words(findings: Findings) -> str:
    """The best design point in a sentence; empty where there is none."""
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
