"""Columns read from the summary or the history of each run, and the objective among them.

The objective is a measure that should be large or small, or the distance to reference values.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from softsim.errors import SceneError
from softsim.scene.measures import Measure
from softsim.scene.quantities import Quantity
from softsim.scene.reporting import did_you_mean
from softsim.scene.text import Tree, child, nearest
from softsim.study.cases import Value
from softsim.study.factors import Reading
from softsim.study.schema import Goal, MeasurePart, Objective, StudyAxis
from softsim.units import KINDS, size_of, usual_unit

History = Mapping[str, np.ndarray]
"""Columns of a history by name, (rows,) each."""

TIME, SLOPE = "time", "slope"
TAKES = "first, last, mean, min, max or slope"


@dataclass(frozen=True)
class MeasureColumn(StudyAxis):
    """Axis that is read from a summary.

    of: its name there, dotted into mappings. take: the element of a list. size: its unit in the SI
    unit of the summary.
    """

    of: str = ""
    take: str | None = None
    size: float = 1.0

    @property
    def axis(self) -> StudyAxis:
        """Axis of the column, for a report."""
        return StudyAxis(self.name, self.unit, self.is_label, self.logarithmic, self.about)

    @property
    def reads_history(self) -> bool:
        """True if its value is not in the summary."""
        return False

    @property
    def parts(self) -> "tuple[MeasureColumn, ...]":
        """Measures from which it is computed: itself."""
        return (self,)

    def si_unit(self, produced: Mapping[str, Measure]) -> str:
        """Return its SI unit; `produced`: name -> measure of a run of the scene."""
        return produced[self.of].unit

    def value(self, summary: Mapping[str, Any], history: History) -> Value | None:
        """Return the value of the measure in a run, in `unit`; None if the run has none."""
        found: Any = summary
        for word in self.of.split("."):
            found = found.get(word) if isinstance(found, Mapping) else None
        if isinstance(found, list):
            found = taken(found, self.take)
        if found is None or isinstance(found, str):
            return found
        return float(found) / self.size

    def partials(self, summary: Mapping[str, Any], history: History) -> Sequence[float]:
        """Return the derivatives of the value with respect to the values of all `parts`."""
        return (1.0,)


@dataclass(frozen=True)
class HistoryColumn(MeasureColumn):
    """Axis that is read from a column of the history, in the rows from `begin` to `end` [s]."""

    begin: float = -math.inf
    end: float = math.inf
    si: str = ""

    @property
    def reads_history(self) -> bool:
        """True."""
        return True

    def si_unit(self, produced: Mapping[str, Measure]) -> str:
        """Return its SI unit."""
        return self.si

    def value(self, summary: Mapping[str, Any], history: History) -> float | None:
        """Return the value taken from the rows, in `unit`; None if there are too few."""
        if self.of not in history:
            return None
        time = history[TIME]
        inside = self._includes(time)
        time, values = time[inside], history[self.of][inside]
        if self.take == SLOPE:
            return slope(time, values) / self.size if len(time) > 1 else None
        found = taken(values.tolist(), self.take)
        return None if found is None else found / self.size

    def _includes(self, time: np.ndarray) -> np.ndarray:
        """Return which times (n,) [s] lie between `begin` and `end`, within round-off."""
        slack = 1e-9 * np.abs(time)
        return (time >= self.begin - slack) & (time <= self.end + slack)

    def derivative(self, summary: Mapping[str, Any]) -> dict[str, float]:
        """Return path of the scene -> derivative of the last value [unit/SI] in a static run."""
        rows = [r for r in summary["derivatives"] if self._includes(np.array(r["time"]))]
        return {path: columns[self.of] / self.size for path, columns in rows[-1]["of"].items()}


def slope(time: np.ndarray, values: np.ndarray) -> float:
    """Return the slope of the straight line through values (n,) at times (n,) by least squares."""
    since = time - time.mean()
    return float((since * (values - values.mean())).sum() / (since**2).sum())


def taken(values: Sequence[float | None], take: str | None) -> float | None:
    """Return one number of a list; None if it has none."""
    known = [value for value in values if value is not None]
    if not known:
        return None
    one = {"first": values[0], "last": values[-1], "min": min(known), "max": max(known)}
    return one[take] if take in one else sum(known) / len(known)


def measure_column(
    name: str,
    part: MeasurePart,
    tree: Tree,
    produced: Mapping[str, Measure],
    recorded: Mapping[str, Measure],
) -> MeasureColumn:
    """Return the column of a measure.

    produced: name -> measure of a run of the scene. recorded: columns of its history.

    Raises
    ------
    SceneError: a run has no such measure, or not in this form.
    """
    if part.take is not None and part.of in recorded:
        return _history_column(name, part, tree, recorded[part.of])
    if part.of not in produced:
        known = [*produced, *recorded]
        message = f"no run of this scene has the result {part.of!r}"
        hint = did_you_mean(part.of, known)
        if part.of in recorded:
            message, hint = f"{part.of} is a column of the history", f"give take: {TAKES}"
        raise _refusal(tree, "of", message, hint)
    for key, given in (("from", part.begin), ("to", part.to)):
        if given is not None:
            hint = f"columns of the history: {', '.join(recorded)}; they need the key take"
            raise _refusal(tree, key, f"{part.of} has no values over time", hint)
    measure = produced[part.of]
    if part.take == SLOPE:
        hint = f"columns of the history have: {', '.join(recorded)}"
        raise _refusal(tree, "take", f"{part.of} has no slope over time", hint)
    if measure.listed and part.take is None:
        hint = "give take: first, last, mean, min or max"
        raise _refusal(tree, "of", f"{part.of} has one number per {measure.listed}", hint)
    if part.take is not None and not measure.listed:
        raise _refusal(tree, "take", f"{part.of} is a single value, not a list", "leave take out")
    unit, size = _unit_of(part, tree, measure.unit)
    return MeasureColumn(
        name, unit, measure.is_label, about=part.about, of=part.of, take=part.take, size=size
    )


def _history_column(name: str, part: MeasurePart, tree: Tree, measure: Measure) -> HistoryColumn:
    """Return the column of a measure from the history. Raises SceneError as measure_column."""
    si = measure.unit
    if part.take == SLOPE:
        si = f"{si}/s"
        if si not in KINDS:
            raise _refusal(tree, "take", f"a slope of {part.of} has no unit", "use another `take`")
    window = [-math.inf, math.inf]
    for k, key in enumerate(("from", "to")):
        held = child(tree, key)
        if held is not None:
            window[k] = Reading(Quantity("s"), "s").number(held)
    if not window[0] < window[1]:
        raise _refusal(tree, "to", "the window ends before it starts", "give a later time")
    unit, size = _unit_of(part, tree, si)
    begin, end = window
    return HistoryColumn(
        name, unit, about=part.about, of=part.of, take=part.take, size=size, begin=begin, end=end,
        si=si,
    )  # fmt: skip


def _unit_of(part: MeasurePart, tree: Tree, si: str) -> tuple[str, float]:
    """Return the unit of a column, and its size in the SI unit `si`. Raises SceneError."""
    unit = (usual_unit(si) if si else "") if part.unit is None else part.unit
    try:
        size = size_of(unit, si) if si else 1.0
    except ValueError as error:
        raise _refusal(tree, "unit", f"{unit!r} {error}") from None
    if part.unit and not si:
        raise _refusal(tree, "unit", f"{part.of} has no unit", "leave unit out")
    return unit, size


def _refusal(tree: Tree, key: str, message: str, hint: str = "") -> SceneError:
    """Return an error at the value of a measure's key."""
    held = child(tree, key)
    return SceneError(message, hint, tree.key_origin if held is None else held.origin)


MISMATCH = "mismatch"
MAXIMIZE, MINIMIZE = "maximize", "minimize"


@dataclass(frozen=True)
class Target:
    """Measure with its reference value and the deviation that counts as 1, in its unit."""

    column: MeasureColumn
    reference: float
    scale: float


@dataclass(frozen=True)
class Mismatch(MeasureColumn):
    """Column of a distance to reference values."""

    targets: tuple[Target, ...] = ()

    @property
    def parts(self) -> tuple[MeasureColumn, ...]:
        """Measures that are to match."""
        return tuple(target.column for target in self.targets)

    @property
    def reads_history(self) -> bool:
        """True if one of the measures does."""
        return any(target.column.reads_history for target in self.targets)

    def value(self, summary: Mapping[str, Any], history: History) -> float | None:
        """Return the sum of ((measure - reference) / scale)^2; None if a run lacks one of them."""
        total = 0.0
        for target in self.targets:
            found = target.column.value(summary, history)
            if found is None:
                return None
            total += ((float(found) - target.reference) / target.scale) ** 2
        return total

    def partials(self, summary: Mapping[str, Any], history: History) -> Sequence[float]:
        """Return the derivatives of the distance with respect to the values of all measures."""
        return [
            2.0 * (float(t.column.value(summary, history) or 0.0) - t.reference) / t.scale**2
            for t in self.targets
        ]


def goal_of(
    objective: Objective | None,
    tree: Tree,
    columns: Sequence[MeasureColumn],
    produced: Mapping[str, Measure],
) -> tuple[Goal | None, tuple[Mismatch, ...]]:
    """Return the goal of an optimisation, and the mismatch columns that references need.

    The goal is None without an objective. tree: entry `optimize` of the study. columns: measures of
    the study. produced: name -> measure of a run.

    Raises
    ------
    SceneError: no such measure, one that is a text, a reference of another kind, a scale of 0.
    """
    if objective is None:
        return None, ()
    if objective.match is not None:
        return Goal(MISMATCH, MINIMIZE), (_mismatch(objective.match, tree, columns, produced),)
    sense = MAXIMIZE if objective.maximize is not None else MINIMIZE
    written = nearest(tree, (sense,))[0]
    return Goal(number_column(str(written.value), columns, written).name, sense), ()


def _mismatch(
    references: Iterable[str],
    tree: Tree,
    columns: Sequence[MeasureColumn],
    produced: Mapping[str, Measure],
) -> Mismatch:
    """Return the column of the distance to the `references` given under `match`."""
    if MISMATCH in [column.name for column in columns]:
        message = f"the column {MISMATCH} is reserved for the optimization"
        raise SceneError(message, "give the measure another name", tree.key_origin)
    scales, targets = child(tree, "scale"), []
    for name in references:
        written = nearest(tree, ("match", name))[0]
        column = number_column(name, columns, written)
        unit = column.si_unit(produced)
        reading = Reading(Quantity(unit), column.unit) if unit else Reading()
        reference = reading.number(written)
        spread = None if scales is None else child(scales, name)
        scale = abs(reference) if spread is None else reading.number(spread)
        if not scale > 0.0:
            raise SceneError(
                f"the scale of {name} must be greater than 0",
                f"give one: scale: {{{name}: ...}}",
                (spread or written).origin,
            )
        targets.append(Target(column, reference, scale))
    return Mismatch(
        MISMATCH,
        about="distance to the reference values; 0 if all are met",
        targets=tuple(targets),
    )


def number_column(name: str, columns: Sequence[MeasureColumn], written: Tree) -> MeasureColumn:
    """Return the measure `name`. Raises SceneError, at `written`, if it is missing or a text."""
    known = {column.name: column for column in columns}
    if name not in known:
        raise SceneError(
            f"there is no measure {name!r}", did_you_mean(name, list(known)), written.origin
        )
    if known[name].is_label:
        raise SceneError(
            f"{name} is a text and cannot be minimized or maximized", "", written.origin
        )
    return known[name]
