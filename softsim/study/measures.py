"""Columns read from the summary of each run, and which of them is sought: a measure that should be
large or small, or the distance to reference values.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from softsim.errors import SceneError
from softsim.scene.measures import Measure
from softsim.scene.quantities import Quantity
from softsim.scene.reporting import did_you_mean
from softsim.scene.tree import Tree, child, nearest
from softsim.study.axes import Axis, Goal
from softsim.study.cases import Value
from softsim.study.factors import Reading
from softsim.study.schema import MeasurePart, Objective
from softsim.units import size_of, usual_unit


@dataclass(frozen=True)
class MeasureColumn(Axis):
    """An axis that is read from a summary. of: its name there, dotted into mappings; take: which
    of a list; size: of its unit in the SI unit of the summary.
    """

    of: str = ""
    take: str | None = None
    size: float = 1.0

    @property
    def axis(self) -> Axis:
        """The axis alone, as a report needs it."""
        return Axis(self.name, self.unit, self.is_label, self.logarithmic, self.about)

    def value(self, summary: Mapping[str, Any]) -> Value | None:
        """What a run found, in `unit`; None where it found nothing."""
        found: Any = summary
        for word in self.of.split("."):
            found = found.get(word) if isinstance(found, Mapping) else None
        if isinstance(found, list):
            found = taken(found, self.take)
        if found is None or isinstance(found, str):
            return found
        return float(found) / self.size


def taken(values: Sequence[float | None], take: str | None) -> float | None:
    """One number of a list; None where it has none."""
    known = [value for value in values if value is not None]
    if not known:
        return None
    one = {"first": values[0], "last": values[-1], "min": min(known), "max": max(known)}
    return one[take] if take in one else sum(known) / len(known)


def measure_column(
    name: str, part: MeasurePart, tree: Tree, produced: Mapping[str, Measure]
) -> MeasureColumn:
    """The column of a measure; `produced` is what a run of the scene tells.

    Raises
    ------
    SceneError: it does not tell this, or not so.
    """
    if part.of not in produced:
        message = f"no run of this scene tells {part.of!r}"
        raise _refusal(tree, "of", message, did_you_mean(part.of, list(produced)))
    measure = produced[part.of]
    if measure.listed and part.take is None:
        hint = "give take: first, last, mean, min or max"
        raise _refusal(tree, "of", f"{part.of} has a number a {measure.listed}", hint)
    if part.take is not None and not measure.listed:
        raise _refusal(tree, "take", f"{part.of} is one value, no list", "leave take out")
    usual = usual_unit(measure.unit) if measure.unit else ""
    unit = usual if part.unit is None else part.unit
    try:
        size = size_of(unit, measure.unit) if measure.unit else 1.0
    except ValueError as error:
        raise _refusal(tree, "unit", f"{unit!r} {error}") from None
    if part.unit and not measure.unit:
        raise _refusal(tree, "unit", f"{part.of} has no unit", "leave unit out")
    return MeasureColumn(
        name, unit, measure.is_label, about=part.about, of=part.of, take=part.take, size=size
    )


def _refusal(tree: Tree, key: str, message: str, hint: str = "") -> SceneError:
    """An error at the value of a measure's key."""
    held = child(tree, key)
    return SceneError(message, hint, tree.key_origin if held is None else held.origin)


MISMATCH = "mismatch"
MAXIMIZE, MINIMIZE = "maximize", "minimize"


@dataclass(frozen=True)
class Target:
    """A measure, the reference value it should have and the deviation that counts as 1, in the
    measure's unit.
    """

    column: MeasureColumn
    reference: float
    scale: float


@dataclass(frozen=True)
class Mismatch(MeasureColumn):
    """The column of a distance to reference values."""

    targets: tuple[Target, ...] = ()

    def value(self, summary: Mapping[str, Any]) -> float | None:
        """Sum of ((measure - reference) / scale)^2; None where a run found not all of them."""
        total = 0.0
        for target in self.targets:
            found = target.column.value(summary)
            if found is None:
                return None
            total += ((float(found) - target.reference) / target.scale) ** 2
        return total


def goal_of(
    objective: Objective | None,
    tree: Tree,
    columns: Sequence[MeasureColumn],
    produced: Mapping[str, Measure],
) -> tuple[Goal | None, tuple[Mismatch, ...]]:
    """Which column should be large or small, None where nothing is sought; and the further one that
    references need to tell.

    tree: what the study writes under `optimize`; columns: its measures; produced: name -> what a
    run tells.

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
    """The distance to what `match` says of the measures that are called `references`."""
    if MISMATCH in [column.name for column in columns]:
        message = f"the column {MISMATCH} is the optimisation's own"
        raise SceneError(message, "give the measure of this name another one", tree.key_origin)
    scales, targets = child(tree, "scale"), []
    for name in references:
        written = nearest(tree, ("match", name))[0]
        column = number_column(name, columns, written)
        unit = produced[column.of].unit
        reading = Reading(Quantity(unit), column.unit) if unit else Reading()
        reference = reading.number(written)
        spread = None if scales is None else child(scales, name)
        scale = abs(reference) if spread is None else reading.number(spread)
        if not scale > 0.0:
            raise SceneError(
                f"a deviation of {name} that counts as 1 must be greater than 0",
                f"write one: scale: {{{name}: ...}}",
                (spread or written).origin,
            )
        targets.append(Target(column, reference, scale))
    return Mismatch(
        MISMATCH,
        about="distance to the reference values, 0 where all are met",
        targets=tuple(targets),
    )


def number_column(name: str, columns: Sequence[MeasureColumn], written: Tree) -> MeasureColumn:
    """The measure of this name. SceneError, at `written`: there is none, or it is a text."""
    known = {column.name: column for column in columns}
    if name not in known:
        raise SceneError(
            f"there is no measure {name!r}", did_you_mean(name, list(known)), written.origin
        )
    if known[name].is_label:
        raise SceneError(f"{name} is a text: nothing is larger or smaller", "", written.origin)
    return known[name]
