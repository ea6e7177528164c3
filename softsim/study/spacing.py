"""All that a factor can be: values, or an interval."""

import math
from dataclasses import dataclass

import numpy as np

from softsim.study.case import Value


@dataclass(frozen=True)
class Interval:
    """The numbers from `low` to `high`, both included; logarithmic: in equal ratios."""

    low: float
    high: float
    logarithmic: bool = False
    is_whole: bool = False

    def at(self, share: float) -> float:
        """The number at a share of the way, from 0 to below 1."""
        if self.is_whole:
            return self.low + int(share * (self.high - self.low + 1))
        if self.logarithmic:
            return rounded(self.low * (self.high / self.low) ** share)
        return rounded(self.low + share * (self.high - self.low))

    def levels(self, count: int) -> tuple[float, ...]:
        """`count` numbers, evenly spaced, of which the first and last are the ends."""
        space = np.geomspace if self.logarithmic else np.linspace
        inner = [rounded(float(number)) for number in space(self.low, self.high, count)[1:-1]]
        return (self.low, *inner, self.high)


Space = tuple[Value, ...] | Interval


def at(space: Space, share: float) -> Value:
    """The value at a share from 0 to below 1: values have equal parts of it."""
    return space.at(share) if isinstance(space, Interval) else space[int(share * len(space))]


def rounded(number: float) -> float:
    """To six digits: what is between two ends is a choice, and reads better so."""
    return float(f"{number:.6g}") if math.isfinite(number) else number
