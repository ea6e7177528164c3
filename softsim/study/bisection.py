"""Bisection for a boundary: the level of a factor at which a measure crosses a threshold.

In each cell, a combination of the values of the other factors, both ends of the range are run
first. If their answers agree, the boundary lies outside or there is more than one, so the middle is
run too. Otherwise a bracket is halved until it is as narrow as the tolerance. The method assumes
that the answer changes only once; it cannot detect further changes inside the range.

The answer at a level is yes if the mean of the measure over its repeats reaches the threshold
`share`. Repeats are run group by group, each group the smallest that may decide the answer, and no
more once it is decided: the answer is that of all repeats.
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
from softsim.scene.text import Tree, nearest
from softsim.study.cases import Value
from softsim.study.factors import Factor, Interval, NumberFactor
from softsim.study.measures import MeasureColumn, number_column
from softsim.study.schema import BisectionDesign

FOUND, OPEN, OUTSIDE = "found", "open", "outside"
NOT_MONOTONE, UNDECIDED = "not monotone", "undecided"
"""States of a boundary: it lies in a bracket; runs are missing; both ends and the middle have the
same answer; the middle has another answer than both ends; all runs at a level have failed."""

ROUNDING = 1e-9
"""Tolerance by which a sum of measures may miss the threshold and still reach it."""

Answers = Mapping[float, Sequence[float | None]]
"""Level -> the measure in each repeat that was run, in order; None for a failed repeat."""


@dataclass(frozen=True)
class Bisection:
    """Definition of a bisection.

    It seeks the level of a factor in `interval` at which the mean of `measure`, from 0 to 1, over
    the repeats crosses `share`. tolerance: width of the bracket, in the factor's unit.
    """

    factor: str
    measure: str
    share: float
    tolerance: float
    interval: Interval
    repeats: int

    @classmethod
    def read(cls, held: Mapping[str, Any] | None) -> "Bisection | None":
        """Return the bisection from its `asdict` form, or None. Raises KeyError, TypeError."""
        if held is None:
            return None
        return cls(**{**held, "interval": Interval(**held["interval"])})

    def middle(self, low: float, high: float) -> float:
        """Return the level between two others, half-way or by equal ratios."""
        return replace(self.interval, low=low, high=high).at(0.5)

    def halvings(self, low: float, high: float) -> int:
        """Return the largest number of halvings of a bracket, if each leaves the wider part.

        Raises ValueError if the tolerance is finer than the spacing of numbers with six digits.
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
        """Largest number of runs of a cell: both ends, and the middles, times the repeats."""
        return (2 + self.halvings(self.interval.low, self.interval.high)) * self.repeats

    def reached(self, values: Sequence[float | None]) -> bool | None:
        """Return True if the mean over all repeats that do not fail reaches `share`.

        The answer holds whatever the missing repeats give; None if it is not decided yet, or if
        all repeats have failed.
        """
        total, count, left = self._standing(values)
        if count == 0:
            return None
        needed = self.share * count - ROUNDING
        if total >= needed:
            return True
        return False if total + left < needed else None

    def missing(self, values: Sequence[float | None]) -> int:
        """Return the fewest repeats that may decide the answer; 0 if decided, or none are left."""
        total, count, left = self._standing(values)
        if left == 0 or self.reached(values) is not None:
            return 0
        needed = self.share * count - ROUNDING
        return min(left, math.ceil(needed - total), math.floor(total + left - needed) + 1)

    def _standing(self, values: Sequence[float | None]) -> tuple[float, int, int]:
        """Return the sum of the measure so far, the repeats not failed, and the repeats not run."""
        known = [value for value in values if value is not None]
        left = self.repeats - len(values)
        return sum(known), len(known) + left, left


@dataclass(frozen=True)
class Boundary:
    """Present state of the boundary in a cell: it lies between low and high, if anywhere.

    state: FOUND, OPEN ... asked: the levels to run next. further: largest number of levels after
    these.
    """

    low: float
    high: float
    state: str
    asked: tuple[float, ...] = ()
    further: int = 0


def boundary(sought: Bisection, answers: Answers) -> Boundary:
    """Return the state of the boundary after the answers so far."""

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
    """Return the largest number of runs that a cell still takes."""
    found = boundary(sought, answers)
    asked = sum(sought.repeats - len(answers.get(level, ())) for level in found.asked)
    return asked + found.further * sought.repeats


def cells(sought: Bisection, factors: Sequence[Factor]) -> list[dict[str, Value]]:
    """Return the combinations of the other factors' values by name, the last varying fastest."""
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
    """Return the bisection of a study with this design.

    columns: measures of the study. produced: name -> measure of a run. tree: the study's file.

    Raises
    ------
    SceneError: no such factor or measure, one that cannot be bisected or is not between 0 and 1, an
    invalid tolerance.
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
    """Return the bisected factor.

    Raises SceneError if it is not a continuous range, or another factor is one.
    """
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
    """Return the width of the bracket, in the factor's unit. Raises SceneError if it is invalid."""
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
