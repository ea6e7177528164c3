"""Cycles of a profile.

A cycle ends where the value has fallen and is about to rise again: a rest at the lowest value
belongs to the cycle before it.
"""

from dataclasses import dataclass

import numpy as np

from softsim.loads.profile import Profile

ROUND_OFF = 1e-9  # of a time: a cycle that ends within it of another time ends at that time


@dataclass(frozen=True)
class Cycle:
    """Times [s] at which the pressure begins to fall, has fallen, and the cycle ends."""

    fall_begin: float
    fall_end: float
    end: float

    def has_ended(self, time: float) -> bool:
        """Return True if the cycle has ended at `time` [s]."""
        return self.end <= time * (1.0 + ROUND_OFF)


def cycles_of(profile: Profile) -> list[Cycle]:
    """Return the cycles of a profile, one for each fall."""
    slope = np.diff(profile.values)
    edges = np.diff(np.concatenate([[False], slope < 0.0, [False]]).astype(int))
    cycles = []
    for first, last in zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True):
        end = last
        while end < len(slope) and slope[end] == 0.0:
            end += 1
        cycles.append(Cycle(*(float(profile.times[k]) for k in (first, last, end))))
    return cycles
