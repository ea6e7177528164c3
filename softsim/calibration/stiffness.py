"""The stiffness with which spikes hold a frame in its pipe, from a small displacement of it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Move:
    """A displacement of the frame along `axis` by `distance` [m], from `begin` to `end` [s].

    Forces are read in the `rest` [s] before it and in the last `rest` before `until` [s].
    """

    axis: str
    distance: float
    begin: float
    end: float
    until: float
    rest: float


@dataclass(frozen=True)
class Stiffness:
    """Force over displacement [N/m], and how far the force still swings, over its change [-]."""

    value: float
    unrest: float


def stiffness(history: Mapping[str, np.ndarray], move: Move) -> Stiffness:
    """Stiffness along a move's axis: by how much the walls push back, over the distance."""
    time, force = history["time"], history[f"wall_force_{move.axis}"]
    before = force[(time > move.begin - move.rest) & (time <= move.begin)]
    after = force[(time > move.until - move.rest) & (time <= move.until)]
    change = float(before.mean() - after.mean())
    swing = 0.5 * float(np.ptp(after))
    return Stiffness(change / move.distance, abs(swing / change) if change else np.inf)
