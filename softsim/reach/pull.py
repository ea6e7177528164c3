"""Pulling force of a robot: the largest drag with which it still advances in each cycle.

It is found by bisection, in equal ratios, between LEAST and MOST; each step is a trial whether the
robot advances with a drag. A drag that stops the robot is assumed to stop it when larger, too. The
result is a bracket: the largest drag with which the robot advanced, and the least with which it did
not.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

LEAST, MOST = 0.01, 2.0
"""Range of the searched drags [N] on the robot.

A tenth of the PFR's weight, and twenty times it, which is its pulling force on a force gauge."""


@dataclass(frozen=True)
class Bracket:
    """Bracket of the pulling force, between low and high [N].

    high is infinite if the robot advanced with all drags that were tried, the largest of which lies
    below MOST by less than the required ratio. Both are zero if it does not advance without drag.
    """

    low: float
    high: float


def trials_left(seen: Mapping[float, bool], ratio: float) -> int:
    """Return the largest number of trials until the ends of the bracket differ by at most `ratio`.

    seen: drag -> True if the robot advanced with it.
    """
    low, high = bounds(seen)
    halvings = math.ceil(math.log2(max(1.0, math.log(high / low) / math.log(ratio))) - 1e-9)
    last = 0.0 not in seen and not any(seen.values())
    return max(0, halvings) + int(last)


def next_drag(seen: Mapping[float, bool], ratio: float) -> float | None:
    """Return the drag [N] of the next trial, or None if there is no more trial.

    It is the geometric mean of the bounds. If the robot advanced with none of the drags, 0 N
    follows last.
    """
    low, high = bounds(seen)
    if high / low > ratio * (1.0 + 1e-9):
        return math.sqrt(low * high)
    return 0.0 if not any(seen.values()) and 0.0 not in seen else None


def bounds(seen: Mapping[float, bool]) -> tuple[float, float]:
    """Return the lower and upper bound [N] of the limit, within LEAST and MOST."""
    low = max((drag for drag, moved in seen.items() if moved), default=LEAST)
    high = min((drag for drag, moved in seen.items() if not moved and drag > 0.0), default=MOST)
    return max(low, LEAST), high


def bracket(seen: Mapping[float, bool]) -> Bracket:
    """Return the bracket that results from the trials."""
    moved = [drag for drag, it_moved in seen.items() if it_moved]
    stood = [drag for drag, it_moved in seen.items() if not it_moved]
    if 0.0 in stood:
        return Bracket(0.0, 0.0)
    return Bracket(max(moved, default=0.0), min(stood, default=math.inf))
