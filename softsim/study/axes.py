"""Columns of a study's table for figures, and its plots: as given, or chosen by its factors."""

from collections.abc import Sequence
from dataclasses import dataclass

from softsim.errors import SceneError
from softsim.scene.reporting import did_you_mean
from softsim.scene.text import Tree, child, listed
from softsim.study.schema import PlotPart


def column(name: str, unit: str = "") -> str:
    """Heading of a column: "rate [kPa/s]", "passes"."""
    return f"{name} [{unit}]" if unit else name


@dataclass(frozen=True)
class StudyAxis:
    """A factor or a measure. unit: of its column, empty for labels and bare numbers. logarithmic:
    it is spaced, and drawn, so. about: in words, for axes and headings of figures.
    """

    name: str
    unit: str = ""
    is_label: bool = False
    logarithmic: bool = False
    about: str = ""

    @property
    def column(self) -> str:
        """Heading of its column."""
        return column(self.name, self.unit)


@dataclass(frozen=True)
class Plot:
    """Figure: kind is curve, heat_map or scatter; x, y, by, colour are names of axes. by: a curve
    each; colour: what a heat map or the points of a scatter show.
    """

    kind: str
    x: str
    y: str
    by: str | None = None
    colour: str | None = None


@dataclass(frozen=True)
class Goal:
    """Goal of an optimisation: sense is "maximize" or "minimize"; measure names a measure."""

    measure: str
    sense: str


AXES = ("x", "y", "by", "colour")
FACTORS_ONLY = {"curve": ("by",), "heat_map": ("x", "y")}


def given_plots(
    parts: Sequence[PlotPart],
    tree: Tree,
    factors: Sequence[StudyAxis],
    measures: Sequence[StudyAxis],
) -> tuple[Plot, ...]:
    """Return the plots given in a study. Raises SceneError for an unknown axis."""
    for part, held in zip(parts, listed(tree, "plots"), strict=True):
        for role in AXES:
            named = child(held, role)
            if named is None or named.value is None:
                continue
            only_factors = role in FACTORS_ONLY.get(part.kind, ())
            allowed = [axis.name for axis in (*factors, *(() if only_factors else measures))]
            if named.text not in allowed:
                what = "factor" if only_factors else "factor or measure"
                message = f"{role}: there is no {what} {named.text!r}"
                raise SceneError(message, did_you_mean(named.text, allowed), named.origin)
    return tuple(Plot(**part.model_dump()) for part in parts)


def chosen_plots(
    factors: Sequence[StudyAxis], measures: Sequence[StudyAxis], is_grid: bool
) -> tuple[Plot, ...]:
    """Plots of each measure that is a number. Of one factor a curve. Of two in a grid a heat map,
    where a label is among them a curve a value of it. Else a scatter over each factor.
    """
    shown = [axis.name for axis in measures if not axis.is_label]
    if len(factors) == 1:
        return tuple(Plot("curve", factors[0].name, name) for name in shown)
    if len(factors) > 2 or not is_grid:
        return tuple(Plot("scatter", axis.name, name) for name in shown for axis in factors)
    x, other = sorted(factors, key=lambda axis: axis.is_label)
    if other.is_label:
        return tuple(Plot("curve", x.name, name, by=other.name) for name in shown)
    return tuple(Plot("heat_map", x.name, other.name, colour=name) for name in shown)
