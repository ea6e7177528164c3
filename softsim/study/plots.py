"""What is drawn of a study: as it says, or chosen by its factors."""

from collections.abc import Sequence

from softsim.errors import SceneError
from softsim.scene.reporting import did_you_mean
from softsim.scene.tree import Tree, child, listed
from softsim.study.axes import Axis, Plot
from softsim.study.schema import PlotPart

AXES = ("x", "y", "by", "colour")
FACTORS_ONLY = {"curve": ("by",), "heat_map": ("x", "y")}


def given_plots(
    parts: Sequence[PlotPart], tree: Tree, factors: Sequence[Axis], measures: Sequence[Axis]
) -> tuple[Plot, ...]:
    """The plots that a study asks for. SceneError: an axis that it does not have."""
    for part, held in zip(parts, listed(tree, "plots"), strict=True):
        for role in AXES:
            _refuse_unknown(part.kind, role, child(held, role), factors, measures)
    return tuple(Plot(**part.model_dump()) for part in parts)


def _refuse_unknown(
    kind: str,
    role: str,
    named: Tree | None,
    factors: Sequence[Axis],
    measures: Sequence[Axis],
) -> None:
    if named is None or named.value is None:
        return
    allowed = [axis.name for axis in factors]
    what = "factor"
    if role not in FACTORS_ONLY.get(kind, ()):
        allowed += [axis.name for axis in measures]
        what = "factor or measure"
    if named.text not in allowed:
        message = f"{role}: there is no {what} {named.text!r}"
        raise SceneError(message, did_you_mean(named.text, allowed), named.origin)


def chosen_plots(factors: Sequence[Axis], measures: Sequence[Axis]) -> tuple[Plot, ...]:
    """A plot a measure that is a number: a curve over the first factor that is one, with a curve
    a value of the first label; a heat map where a second factor is a number too.
    """
    numbers = [axis.name for axis in factors if not axis.is_label]
    labels = [axis.name for axis in factors if axis.is_label]
    shown = [axis.name for axis in measures if not axis.is_label]
    if len(numbers) > 1:
        return tuple(Plot("heat_map", numbers[0], numbers[1], colour=name) for name in shown)
    x, by = [*numbers, *labels][:1], labels[:1] if numbers else labels[1:2]
    return tuple(Plot("curve", x[0], name, by=by[0] if by else None) for name in shown)
