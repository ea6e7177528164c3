"""What a history says of how the robot moved.

A history has time [s], pressure [Pa] and frame_x [m], (rows,) each; with an air line the pressure
is that of the gauge. A run that failed has an empty one: its numbers are NaN.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from softsim.analysis.travel import LEAST_PROGRESS, Walk, fall_begins, forward_walk

NAN = float("nan")
MILLI = 1e3
History = Mapping[str, np.ndarray]

LEAST = LEAST_PROGRESS  # m: less is the spikes' recoil, no motion


@dataclass(frozen=True)
class Fall:
    """A fall of the pressure and the rise and hold before it, (rows,) each, of one history.

    time [s], pressure [Pa], x [m] along the pipe; began: the row where the fall begins.
    """

    time: np.ndarray
    pressure: np.ndarray
    x: np.ndarray
    began: int

    @property
    def displacement(self) -> float:
        """While the pressure falls [m]."""
        return float(self.x[-1] - self.x[self.began])

    @property
    def before(self) -> float:
        """Displacement [m] while the pressure rises and rests."""
        return float(self.x[self.began] - self.x[0])

    @property
    def mean_speed(self) -> float:
        """Over the whole cycle [m/s]."""
        return float((self.x[-1] - self.x[0]) / (self.time[-1] - self.time[0]))

    def displacement_above(self, pressure: float) -> float:
        """From the begin of the fall until it reaches `pressure` [Pa], or its end [m]."""
        return float(self.x[self._reached(pressure)] - self.x[self.began])

    def speed_above(self, pressure: float) -> float:
        """That displacement over the time of rise, rest and fall down to `pressure` [m/s]."""
        span = self.time[self._reached(pressure)] - self.time[0]
        return self.displacement_above(pressure) / float(span)

    def _reached(self, pressure: float) -> int:
        """The row at which the fall reaches `pressure` [Pa], or its end."""
        reached = np.flatnonzero(self.pressure[self.began :] <= pressure)
        return self.began + int(reached[0]) if len(reached) else len(self.pressure) - 1

    @property
    def walk(self) -> Walk | None:
        """Rows of the fall between which the robot moves forward; None without motion."""
        return forward_walk(self.x[self.began :])

    @property
    def onset_pressure(self) -> float:
        """P_M3^B as found [Pa]: where motion begins; NaN without motion."""
        return NAN if self.walk is None else float(self.pressure[self.began + self.walk.onset])

    @property
    def end_pressure(self) -> float:
        """P_M3^S as found [Pa]: where motion has ended; NaN without motion."""
        return NAN if self.walk is None else float(self.pressure[self.began + self.walk.end])

    @property
    def standstill(self) -> float:
        """Displacement [m] from the highest pressure to the onset; NaN without motion."""
        if self.walk is None:
            return NAN
        return float(self.x[self.began + self.walk.onset] - self.x[self.began])


def falls(history: History) -> list[Fall]:
    """The pressure cycles of a run, without one that is not finished; none of a run that failed."""
    if not history:
        return []
    t, p, x = history["time"], history["pressure"], history["frame_x"]
    # An air line keeps its gauge within a band around the wanted pressure, which falls steadily.
    wanted = history.get("wanted_pressure", p)
    change = np.sign(np.diff(wanted)).astype(int)
    found, first = [], 0
    for begin in fall_begins(wanted):
        # It ends where the pressure no longer falls.
        after = np.flatnonzero(change[begin:] >= 0)
        end = begin + int(after[0]) if len(after) else len(p) - 1
        whole = slice(first, end + 1)
        lowest = np.minimum.accumulate(p[begin : end + 1])  # so far, as the valve lets air out
        pressure = np.concatenate([p[first:begin], lowest])
        found.append(Fall(t[whole], pressure, x[whole], int(begin) - first))
        first = end
    return found


def displacement_while_falling(history: History) -> float:
    """Mean over the falls [m]; NaN where there is none."""
    found = [fall.displacement for fall in falls(history)]
    return float(np.mean(found)) if found else NAN


def speed_after(history: History, share: float) -> float:
    """Mean speed [m/s] along the pipe after a `share` of the run, in which it settles."""
    if not history:
        return NAN
    t, x = history["time"], history["frame_x"]
    late = t >= share * t[-1]
    return float((x[late][-1] - x[late][0]) / (t[late][-1] - t[late][0]))
