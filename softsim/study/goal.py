"""What counts as best: a measure that should be large or small, or the distance to references."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from softsim.errors import SceneError
from softsim.scene.measures import Measure
from softsim.scene.quantities import Quantity
from softsim.scene.reporting import did_you_mean
from softsim.scene.tree import Tree, child, nearest
from softsim.study.axes import Goal
from softsim.study.measures import MeasureColumn
from softsim.study.numbers import Reading
from softsim.study.objective import Objective

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


def mismatch_column(
    objective: Objective,
    tree: Tree,
    columns: Sequence[MeasureColumn],
    produced: Mapping[str, Measure],
) -> Mismatch | None:
    """The further column that an objective with references needs; None for one without.

    tree: what the study writes under `optimize`; columns: its measures; produced: name -> what a
    run tells.

    Raises
    ------
    SceneError: no such measure, one that is a text, a reference of another kind, a scale of 0.
    """
    if objective.match is None:
        return None
    if MISMATCH in [column.name for column in columns]:
        message = f"the column {MISMATCH} is the optimisation's own"
        raise SceneError(message, "give the measure of this name another one", tree.key_origin)
    scales, targets = child(tree, "scale"), []
    for name in objective.match:
        written = nearest(tree, ("match", name))[0]
        column = number_column(name, columns, written)
        reading = reading_of_measure(column, produced[column.of])
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
    return Mismatch(MISMATCH, about="distance to the reference values", targets=tuple(targets))


def goal_of(objective: Objective, tree: Tree, columns: Sequence[MeasureColumn]) -> Goal:
    """Which column should be large or small. SceneError: there is none of this name, or a text."""
    if objective.match is not None:
        return Goal(MISMATCH, MINIMIZE)
    sense = MAXIMIZE if objective.maximize is not None else MINIMIZE
    written = nearest(tree, (sense,))[0]
    return Goal(number_column(str(written.value), columns, written).name, sense)


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


def reading_of_measure(column: MeasureColumn, measure: Measure) -> Reading:
    """How reference values of a measure are read, in the unit of its column."""
    if not measure.unit:
        return Reading()
    return Reading(Quantity(measure.unit), column.unit)
