"""A boundary, sought by bisection: the level of a factor at which a measure crosses a share.

In each cell, a combination of the values of the other factors, both ends of the range are asked
first. Where they answer alike the boundary lies outside, or there is more than one: the middle is
asked too. Else a bracket is halved until it is as narrow as the tolerance. Assumed: the answer
changes once, as it must between ends that differ; whether it changes more often in there no
bisection tells.

A level answers yes if the mean of the measure over its repeats reaches the share. Repeats are asked
one group after the other, each the smallest that may settle that, and no more once it is settled:
the answer is that of all repeats.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from softsim.errors import SceneError
from softsim.scene.measures import Measure
from softsim.scene.quantities import Quantity
from softsim.scene.reporting import did_you_mean
from softsim.scene.tree import Tree, nearest
from softsim.study.cases import Value
from softsim.study.factors import Factor, Interval, NumberFactor
from softsim.study.measures import MeasureColumn, number_column
from softsim.study.schema import BisectionDesign

FOUND, OPEN, OUTSIDE = "found", "open", "outside"
NOT_MONOTONE, UNDECIDED = "not monotone", "undecided"
"""What is known of a boundary: it lies in a bracket; runs are missing; both ends and the middle
answer alike; the middle answers otherwise than both ends; all runs at a level have failed."""

ROUNDING = 1e-9
"""By which a sum of measures may miss the share and still reach it."""

Answers = Mapping[float, Sequence[float | None]]
"""Level -> the measure in each repeat that was run, in their order; None where that has failed."""


@dataclass(frozen=True)
class Bisection:
    """What is sought: the level of a factor in `interval` at which the mean of `measure`, from 0 to
    1, over the repeats crosses `share`. tolerance: width of the bracket, in the factor's unit.
    """

    factor: str
    measure: str
    share: float
    tolerance: float
    interval: Interval
    repeats: int

    @classmethod
    def read(cls, held: Mapping[str, Any] | None) -> "Bisection | None":
        """From what `asdict` has made of it; None for none. Raises KeyError, TypeError."""
        if held is None:
            return None
        return cls(**{**held, "interval": Interval(**held["interval"])})

    def middle(self, low: float, high: float) -> float:
        """The level between two others, half-way or by equal ratios."""
        return replace(self.interval, low=low, high=high).at(0.5)

    def halvings(self, low: float, high: float) -> int:
        """How often a bracket is halved at most, the wider part being left each time. ValueError:
        its ends are as close as numbers of six digits are, and not within the tolerance.
        """
        count = 0
        while high - low > self.tolerance:
            middle = self.middle(low, high)
            if not low < middle < high:
                raise ValueError(f"no number of six digits lies between {low:g} and {high:g}")
            low, high = max((low, middle), (middle, high), key=lambda part: part[1] - part[0])
            count += 1
        return count

    @property
    def most_runs(self) -> int:
        """Runs that a cell takes at most: both ends, and the middles."""
        return (2 + self.halvings(self.interval.low, self.interval.high)) * self.repeats

    def reached(self, values: Sequence[float | None]) -> bool | None:
        """Whether the mean over all repeats that do not fail reaches the share, whatever those
        that are missing will give; None where that is not settled, or all have failed.
        """
        total, count, left = self._standing(values)
        if count == 0:
            return None
        needed = self.share * count - ROUNDING
        if total >= needed:
            return True
        return False if total + left < needed else None

    def missing(self, values: Sequence[float | None]) -> int:
        """The least number of further repeats that may settle it; 0 if it is, or none is left."""
        total, count, left = self._standing(values)
        if left == 0 or self.reached(values) is not None:
            return 0
        needed = self.share * count - ROUNDING
        return min(left, math.ceil(needed - total), math.floor(total + left - needed) + 1)

    def _standing(self, values: Sequence[float | None]) -> tuple[float, int, int]:
        """Sum of the measure so far, repeats that have not failed, repeats not run."""
        known = [value for value in values if value is not None]
        left = self.repeats - len(values)
        return sum(known), len(known) + left, left


@dataclass(frozen=True)
class Boundary:
    """What is known of the boundary in a cell: it lies between low and high, if anywhere.

    state: FOUND, OPEN ...; asked: the levels that are missing next; further: levels at most after
    these.
    """

    low: float
    high: float
    state: str
    asked: tuple[float, ...] = ()
    further: int = 0


def boundary(sought: Bisection, answers: Answers) -> Boundary:
    """What the answers so far tell."""

    def reached(level: float) -> bool | None:
        return sought.reached(answers.get(level, ()))

    def unsettled(*levels: float, further: int = 0) -> Boundary:
        if any(len(answers.get(level, ())) == sought.repeats for level in levels):
            return Boundary(low, high, UNDECIDED)
        return Boundary(low, high, OPEN, levels, further)

    low, high = sought.interval.low, sought.interval.high
    halvings = sought.halvings(low, high)
    missing = [level for level in (low, high) if reached(level) is None]
    if missing:
        return unsettled(*missing, further=halvings)
    middle, begin = sought.middle(low, high), reached(low)
    if begin == reached(high):
        if reached(middle) is None:
            return unsettled(middle)
        return Boundary(low, high, OUTSIDE if reached(middle) == begin else NOT_MONOTONE)
    while high - low > sought.tolerance:
        middle = sought.middle(low, high)
        if reached(middle) is None:
            return unsettled(middle, further=sought.halvings(low, high) - 1)
        low, high = (middle, high) if reached(middle) == begin else (low, middle)
    return Boundary(low, high, FOUND)


def runs_left(sought: Bisection, answers: Answers) -> int:
    """How many runs a cell still takes at most."""
    found = boundary(sought, answers)
    asked = sum(sought.repeats - len(answers.get(level, ())) for level in found.asked)
    return asked + found.further * sought.repeats


def cells(sought: Bisection, factors: Sequence[Factor]) -> list[dict[str, Value]]:
    """The combinations of the values of the other factors, by name, the last varying fastest."""
    others = {f.axis.name: f.space for f in factors if f.axis.name != sought.factor}
    levels = [space for space in others.values() if not isinstance(space, Interval)]
    return [dict(zip(others, values, strict=True)) for values in itertools.product(*levels)]


def bisection_of(
    design: BisectionDesign,
    factors: Sequence[Factor],
    repeats: int,
    columns: Sequence[MeasureColumn],
    produced: Mapping[str, Measure],
    tree: Tree,
) -> Bisection:
    """What a study with this design seeks. columns: its measures; produced: name -> what a run
    tells; tree: what the study says.

    Raises
    ------
    SceneError: no such factor or measure, one that cannot be bisected or has no share, a tolerance
    that is none.
    """
    at = {key: nearest(tree, ("design", key))[0] for key in ("factor", "measure", "tolerance")}
    factor = _bisected(design.factor, factors, at["factor"], tree)
    interval = factor.space
    assert isinstance(interval, Interval)  # _bisected has seen to it
    column = number_column(design.measure, columns, at["measure"])
    if not (column.of in produced and produced[column.of].is_share):
        known = [one.name for one in columns if one.of in produced and produced[one.of].is_share]
        known = known or [name for name, measure in produced.items() if measure.is_share]
        raise SceneError(
            f"{column.name} is not between 0 and 1, so it cannot cross {design.share:g}",
            f"possible: {', '.join(known)}" if known else "", at["measure"].origin,
        )  # fmt: skip
    tolerance = _tolerance(factor, interval, at["tolerance"])
    sought = Bisection(
        design.factor, design.measure, design.share, tolerance, interval, repeats
    )  # fmt: skip
    try:
        sought.halvings(interval.low, interval.high)
    except ValueError as error:
        raise SceneError("too fine a tolerance", str(error), at["tolerance"].origin) from None
    return sought


def _bisected(name: str, factors: Sequence[Factor], named: Tree, tree: Tree) -> NumberFactor:
    """The factor that is bisected, a range; all others have values. SceneError."""
    known = {factor.axis.name: factor for factor in factors}
    if name not in known:
        hint = did_you_mean(name, list(known))
        raise SceneError(f"there is no factor {name!r} to bisect", hint, named.origin)
    found = known[name]
    places = {factor: nearest(tree, ("factors", factor))[0].key_origin for factor in known}
    if not isinstance(found, NumberFactor) or not isinstance(found.space, Interval):
        raise SceneError(
            f"{name} is bisected, so it needs a continuous range",
            "give it range or log_range, without a count", places[name],
        )  # fmt: skip
    for other, factor in known.items():
        if other != name and isinstance(factor.space, Interval):
            message = f"{other}: with a bisection, this factor needs a number of values"
            raise SceneError(message, "give a count, or values", places[other])
    return found


def _tolerance(factor: NumberFactor, interval: Interval, written: Tree) -> float:
    """The width of the bracket, in the factor's unit. SceneError: it is none."""
    reading = factor.reading
    if reading.quantity is not None:  # a difference is not within the bounds of the key
        reading = replace(reading, quantity=Quantity(reading.quantity.unit))
    tolerance, width = reading.number(written), interval.high - interval.low
    if not tolerance > 0.0:
        raise SceneError("a tolerance must be greater than 0", "", written.origin)
    if tolerance >= width:
        raise SceneError(
            f"with a tolerance of {reading.text(tolerance)} there is nothing to bisect",
            f"the range is {reading.text(width)} wide", written.origin,
        )  # fmt: skip
    return tolerance
