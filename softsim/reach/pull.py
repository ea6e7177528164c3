"""What a robot can pull: the largest drag with which it still gets on, cycle by cycle.

Sought by bisection, in equal ratios, between LEAST and MOST: whether a robot gets on with a drag is
a trial. Assumed: what stops it, stops it with any larger drag too. The bracket that is left, the
largest drag with which it got on and the least with which it did not, is the answer's band.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

LEAST, MOST = 0.01, 2.0
"""Between which drags [N] on the robot is sought: a tenth of the PFR's weight, and twenty times it,
what it pulls on a force gauge."""


@dataclass(frozen=True)
class Bracket:
    """The pull lies between low and high [N]; high is infinite where it got on with all that was
    tried, the largest of which lies below MOST by less than the ratio asked for.

    Both are zero where it does not get on without any drag.
    """

    low: float
    high: float


def trials_left(seen: Mapping[float, bool], ratio: float) -> int:
    """Trials, at most, until the bracket's ends differ by at most this `ratio`. seen: drag ->
    whether the robot got on with it.
    """
    low, high = bounds(seen)
    halvings = math.ceil(math.log2(max(1.0, math.log(high / low) / math.log(ratio))) - 1e-9)
    last = 0.0 not in seen and not any(seen.values())
    return max(0, halvings) + int(last)


def next_drag(seen: Mapping[float, bool], ratio: float) -> float | None:
    """The drag [N] of the next trial; None where there is nothing more to ask.

    The middle of what is left, in equal ratios. Where it got on with none of them, 0 N at last.
    """
    low, high = bounds(seen)
    if high / low > ratio * (1.0 + 1e-9):
        return math.sqrt(low * high)
    return 0.0 if not any(seen.values()) and 0.0 not in seen else None


def bounds(seen: Mapping[float, bool]) -> tuple[float, float]:
    """Between which drags [N] the limit lies, of LEAST to MOST."""
    low = max((drag for drag, moved in seen.items() if moved), default=LEAST)
    high = min((drag for drag, moved in seen.items() if not moved and drag > 0.0), default=MOST)
    return max(low, LEAST), high


def bracket(seen: Mapping[float, bool]) -> Bracket:
    """What trials have left of the range."""
    moved = [drag for drag, it_moved in seen.items() if it_moved]
    stood = [drag for drag, it_moved in seen.items() if not it_moved]
    if 0.0 in stood:
        return Bracket(0.0, 0.0)
    return Bracket(max(moved, default=0.0), min(stood, default=math.inf))
