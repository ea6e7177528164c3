"""What a history says of how the robot moved.

A history has time [s], pressure [Pa] and frame_x [m], (rows,) each. A run that failed has an empty
one: its numbers are NaN.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

NAN = float("nan")
MILLI = 1e3
History = Mapping[str, np.ndarray]

WINDOW = 0.1  # s over which a speed is taken: six periods of the slowest vibration and more
MOVING = 0.2  # share of the highest of these speeds above which it counts as moving
LEAST = 1e-4  # m, a fall that brings less has no motion, and none of its pressures


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

    def _moving(self) -> np.ndarray:
        """Times [s] at the start of windows in which it moves, in order."""
        t = self.time[self.began :]
        ahead = np.interp(t + WINDOW, self.time, self.x) - self.x[self.began :]
        if self.displacement < LEAST:
            return np.zeros(0)
        return t[ahead > MOVING * ahead.max()]

    @property
    def onset_time(self) -> float:
        """When motion begins [s]."""
        moving = self._moving()
        return float(moving[0]) if len(moving) else NAN

    @property
    def onset_pressure(self) -> float:
        """P_M3^B as found [Pa]: where motion begins."""
        return self._pressure_at(self.onset_time)

    @property
    def end_pressure(self) -> float:
        """P_M3^S as found [Pa]: where motion ends."""
        moving = self._moving()
        return self._pressure_at(float(moving[-1]) + WINDOW) if len(moving) else NAN

    @property
    def standstill(self) -> float:
        """Displacement [m] from the highest pressure to the onset of motion."""
        if np.isnan(self.onset_time):
            return NAN
        return float(np.interp(self.onset_time, self.time, self.x) - self.x[self.began])

    def _pressure_at(self, time: float) -> float:
        return float(np.interp(time, self.time, self.pressure))


def falls(history: History) -> list[Fall]:
    """The pressure cycles of a run, without one that is not finished; none of a run that failed."""
    if not history:
        return []
    t, p, x = history["time"], history["pressure"], history["frame_x"]
    change = np.sign(np.diff(p)).astype(int)
    # A fall begins where a pressure that rose or rested falls, and ends where it no longer does.
    begins = np.flatnonzero((change[1:] < 0) & (change[:-1] >= 0)) + 1
    found, first = [], 0
    for begin in begins:
        after = np.flatnonzero(change[begin:] >= 0)
        end = begin + int(after[0]) if len(after) else len(p) - 1
        whole = slice(first, end + 1)
        found.append(Fall(t[whole], p[whole], x[whole], int(begin) - first))
        first = end
    return found


def displacement_while_falling(history: History) -> float:
    """Mean over the falls [m]."""
    return float(np.mean([fall.displacement for fall in falls(history)] or [NAN]))


def speed_after(history: History, share: float) -> float:
    """Mean speed [m/s] along the pipe after a `share` of the run, in which it settles."""
    if not history:
        return NAN
    t, x = history["time"], history["frame_x"]
    late = t >= share * t[-1]
    return float((x[late][-1] - x[late][0]) / (t[late][-1] - t[late][0]))
