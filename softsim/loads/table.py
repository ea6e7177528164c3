"""Profiles as Taichi reads them: the value of a table of points at a time."""

import numpy as np
import taichi as ti

from softsim.fields import index_field, real_field
from softsim.loads.profile import Profile


@ti.data_oriented
class ProfileTable:
    """One profile a scenario; linear between points, constant after the last, zero before t = 0,
    when bodies settle without loads.
    """

    def __init__(self, profiles: list[Profile]) -> None:
        longest = max(len(p.times) for p in profiles)
        self.points = index_field(np.array([len(p.times) for p in profiles]))
        self.time = real_field(np.array([padded(p.times, longest) for p in profiles]))
        self.value = real_field(np.array([padded(p.values, longest) for p in profiles]))

    @ti.func
    def at(self, s, t):
        """Value at time t, by bisection."""
        low = 0
        high = self.points[s] - 1
        while high - low > 1:
            middle = (low + high) // 2
            if self.time[s, middle] <= t:
                low = middle
            else:
                high = middle
        value = self.value[s, high]
        if t < self.time[s, high] and high > low:
            share = ti.max(0.0, (t - self.time[s, low]) / (self.time[s, high] - self.time[s, low]))
            value = self.value[s, low] + share * (self.value[s, high] - self.value[s, low])
        if t < 0.0:
            value = 0.0
        return value


def padded(values: np.ndarray, length: int) -> np.ndarray:
    """`values` with the last one repeated up to `length`."""
    return np.concatenate([values, np.full(length - len(values), values[-1])])
