"""Columns of measures: what is read from the summary of each run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from softsim.errors import SceneError
from softsim.scene.measures import Measure
from softsim.scene.reporting import did_you_mean
from softsim.scene.tree import Tree, child
from softsim.study.axes import Axis
from softsim.study.case import Value
from softsim.study.schema import MeasurePart
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
    """One number of a list with one a pressure cycle; None where it has none."""
    known = [value for value in values if value is not None]
    if not known:
        return None
    match take:
        case "first":
            return values[0]
        case "last":
            return values[-1]
        case "min":
            return min(known)
        case "max":
            return max(known)
    return sum(known) / len(known)


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
    if measure.per_cycle and part.take is None:
        hint = "give take: first, last, mean, min or max"
        raise _refusal(tree, "of", f"{part.of} has a number a pressure cycle", hint)
    if part.take is not None and not measure.per_cycle:
        raise _refusal(tree, "take", f"{part.of} is one value, no list", "leave take out")
    unit = _usual(measure) if part.unit is None else part.unit
    try:
        size = size_of(unit, measure.unit) if measure.unit else 1.0
    except ValueError as error:
        raise _refusal(tree, "unit", f"{unit!r} {error}") from None
    if part.unit and not measure.unit:
        raise _refusal(tree, "unit", f"{part.of} has no unit", "leave unit out")
    return MeasureColumn(
        name, unit, measure.is_label, about=part.about, of=part.of, take=part.take, size=size
    )


def _usual(measure: Measure) -> str:
    """The unit in which a measure is shown that the study says none for."""
    return usual_unit(measure.unit) if measure.unit else ""


def _refusal(tree: Tree, key: str, message: str, hint: str = "") -> SceneError:
    """An error at the value of a measure's key."""
    held = child(tree, key)
    return SceneError(message, hint, tree.key_origin if held is None else held.origin)
