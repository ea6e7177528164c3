"""Verdict on a body that crosses an obstacle: passed if its rear end gets past the goal in time.

The reason for a body that has not passed follows from the motion of its ends alone.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from softsim.model import Crossing

PASSED, STUCK = "passed", "stuck"
COLUMNS = {"rear_x": "m", "front_x": "m"}
LATE = 0.25  # share of a run by whose end it is told whether the body still moves
SLIPPED = 0.1  # of its length: the way back after which it has slipped
STANDS = 0.02  # of its length: what stands gains less in the LATE part of the run or its patience


def end_readings(crossing: Crossing, x: np.ndarray) -> dict[str, float]:
    """Return the positions of the body's rear and front end [m], with all nodes at x (n, d) [m]."""
    places = x[crossing.nodes, 0]
    return {"rear_x": float(places.min()), "front_x": float(places.max())}


class CrossingCondition:
    """Stop condition: the body has crossed, or has made no progress for its patience."""

    name = "crossing"

    def __init__(self, crossing: Crossing) -> None:
        self.crossing = crossing
        self.is_over = False
        self.farthest = -np.inf  # rear end when it last came farther [m]
        self.since = 0.0  # [s]

    def see_row(self, row: Mapping[str, float]) -> None:
        t, rear = row["time"], row["rear_x"]
        if rear > self.farthest + STANDS * (row["front_x"] - rear):
            self.farthest, self.since = rear, t
        has_stood = t - self.since > self.crossing.patience
        self.is_over |= rear > self.crossing.goal or has_stood


def crossing_report(crossing: Crossing, history: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """Return the verdict, `passed` as 1 or 0, its time [s], the farthest ends [m], a sentence."""
    t, rear, front = history["time"], history["rear_x"], history["front_x"]
    passed = bool(rear.max() > crossing.goal)
    when = float(t[np.argmax(rear > crossing.goal)]) if passed else None
    sentence = f"passed at {when:.4g} s" if passed else why_stuck(crossing, t, rear, front)
    return {
        "verdict": PASSED if passed else STUCK,
        "passed": float(passed),
        "time": when,
        "farthest_rear": float(rear.max()),
        "farthest_front": float(front.max()),
        "sentence": sentence,
    }


def why_stuck(crossing: Crossing, t: np.ndarray, rear: np.ndarray, front: np.ndarray) -> str:
    """Return why a body has not crossed: it slipped back, ran out of time, or stands still."""
    length = float(np.median(front - rear))
    back = rear.max() - rear[-1]
    place = f"its front is at x = {1e3 * front[-1]:.4g} mm"
    if back > SLIPPED * length:
        return f"stuck: slipped back by {1e3 * back:.3g} mm, {place}"
    late = t >= t[-1] - min(LATE * (t[-1] - t[0]), crossing.patience)
    gained = rear[late][-1] - rear[late][0]
    if gained > STANDS * length:
        return f"stuck: still moving at the end time, {place}"
    meets = front.max() > crossing.foot
    what = "at the obstacle" if meets else "before the obstacle, without thrust"
    return f"stuck: stands still {what}, {place}"
