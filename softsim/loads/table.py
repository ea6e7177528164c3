"""Profiles in Taichi fields: values of a table of points over time."""

import numpy as np
import taichi as ti

from softsim.errors import SimulationError
from softsim.fields import index_field, real_field, shape_of, write_row
from softsim.loads.profile import Profile

LEAST_ROOM = 8
"""Minimum capacity of a table in points, enough for a command mapped by the scale of a gauge."""


class ProfileTable:
    """Profiles in fields, one per scenario.

    They are linear between points, constant after the last, and zero before t = 0, when bodies
    settle without loads.
    """

    def __init__(self, profiles: list[Profile]) -> None:
        longest = max(LEAST_ROOM, *(len(p.times) for p in profiles))
        self.points = index_field(np.array([len(p.times) for p in profiles]))
        self.time = real_field(np.array([padded(p.times, longest) for p in profiles]))
        self.value = real_field(np.array([padded(p.values, longest) for p in profiles]))

    def follow(self, scenario: int, profile: Profile) -> None:
        """Replace the profile of a scenario.

        Raises SimulationError if it has more points than fit.
        """
        room = shape_of(self.time)[1]
        if len(profile.times) > room:
            raise SimulationError(
                f"a time history of {len(profile.times)} points, but there is room for {room}",
                hint="reduce the number of points of the gauge scale, or write a longer table in "
                "the scene",
            )
        write_row(self.points, scenario, len(profile.times))
        write_row(self.time, scenario, padded(profile.times, room))
        write_row(self.value, scenario, padded(profile.values, room))

    @ti.func
    def at(self, s, t):
        """Return the value at time t, by bisection."""
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
    """Return `values` with the last one repeated up to `length`."""
    return np.concatenate([values, np.full(length - len(values), values[-1])])
