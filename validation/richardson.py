"""Richardson's estimate: what a result would be on a mesh without end, and how far off it is.

From three meshes, each finer than the one before by the same ratio r, f = f_0 + C h^p: Roache,
J. Fluids Eng. 116 (1994) 405; order and value f_0 as in his equations 4 and 6, without the safety
factor.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

HIGHEST_ORDER = 4.0  # beyond it the three values lie too close together to tell an order


@dataclass(frozen=True)
class Estimate:
    """order: p. value: f_0, in the unit of the results."""

    order: float
    value: float


def estimate(results: Sequence[float], ratio: float) -> Estimate | None:
    """Of three results, the coarsest mesh first.

    None where they do not close in on a value from one side (the two steps differ in sign, or the
    second is not the smaller one), where the order is above HIGHEST_ORDER, or one is missing.
    """
    coarse, middle, fine = results
    first, second = middle - coarse, fine - middle
    if not 0.0 < second * first < first * first:
        return None
    order = math.log(first / second) / math.log(ratio)
    if order > HIGHEST_ORDER:
        return None
    return Estimate(order, fine + second / (ratio**order - 1.0))
