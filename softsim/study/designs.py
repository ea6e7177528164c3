"""Which values of the factors are put together into cases."""

import itertools
import math
from collections.abc import Iterator, Sequence

from softsim.errors import SceneError
from softsim.scene.reporting import did_you_mean
from softsim.scene.tree import Tree, entries, listed, nearest
from softsim.study.case import Value
from softsim.study.factors import Factor
from softsim.study.schema import Design, GridDesign, LatinHypercubeDesign, ListDesign, SobolDesign
from softsim.study.spacing import Interval, at

Point = tuple[Value, ...]
"""A value of each factor, in their order."""


def point_count(design: Design, factors: Sequence[Factor]) -> int:
    """How many points a design has, without making them."""
    if isinstance(design, GridDesign):
        return math.prod(len(_levels(factor)) for factor in factors)
    return len(design.cases) if isinstance(design, ListDesign) else design.count


def points(design: Design, factors: Sequence[Factor], tree: Tree) -> Iterator[Point]:
    """The points of a design, in the order of the table; `tree` is what the study says."""
    if isinstance(design, GridDesign):
        yield from itertools.product(*(_levels(factor) for factor in factors))
    elif isinstance(design, ListDesign):
        for row in rows(tree):
            yield tuple(factor.read(row[factor.axis.name]) for factor in factors)
    else:
        for shares in even_shares(design, len(factors)):
            pairs = zip(factors, shares, strict=True)
            yield tuple(at(factor.space, share) for factor, share in pairs)


def even_shares(design: LatinHypercubeDesign | SobolDesign, dimension: int) -> list[list[float]]:
    """Points (count, dimension) that fill the unit cube evenly."""
    from scipy.stats import qmc  # slow to import

    is_sobol = isinstance(design, SobolDesign)
    engine = (qmc.Sobol if is_sobol else qmc.LatinHypercube)(dimension, seed=design.seed)
    shares: list[list[float]] = engine.random(design.count).tolist()
    return shares


def rows(tree: Tree) -> list[dict[str, Tree]]:
    """The cases that a list design writes."""
    return [dict(entries(case)) for case in listed(tree, "design", "cases")]


def refuse_incomplete_rows(tree: Tree, names: Sequence[str]) -> None:
    """Each case of a list gives each factor, and nothing else. SceneError at the case."""
    for number, row in enumerate(rows(tree)):
        for name, value in row.items():
            if name not in names:
                hint = did_you_mean(name, names)
                raise SceneError(f"there is no factor '{name}'", hint, value.key_origin)
        missing = [name for name in names if name not in row]
        if missing:
            place = nearest(tree, ("design", "cases", number))[0]
            raise SceneError(f"the case has no value of {', '.join(missing)}", "", place.origin)


def refuse_misfit(design: Design, factors: Sequence[Factor], tree: Tree) -> None:
    """A grid needs values; a Sobol sequence a power of two of points. SceneError there."""
    if isinstance(design, GridDesign):
        for factor in factors:
            if isinstance(factor.space, Interval):
                place = nearest(tree, ("factors", factor.axis.name))[0]
                raise SceneError(
                    f"{factor.axis.name}: a grid needs the number of its values",
                    "give a count, or another design", place.key_origin,
                )  # fmt: skip
    elif isinstance(design, SobolDesign) and design.count & (design.count - 1):
        below = 1 << (design.count.bit_length() - 1)
        raise SceneError(
            f"count: {design.count} is no power of two, so the sequence would not be even",
            f"take {below} or {2 * below}", nearest(tree, ("design", "count"))[0].origin,
        )  # fmt: skip


def _levels(factor: Factor) -> Sequence[Value]:
    assert not isinstance(factor.space, Interval)  # refuse_misfit has seen to it
    return factor.space
