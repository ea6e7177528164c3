"""Pressure cycles, and the motion of a robot within them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from softsim.loads.pressure_control import Phase
from softsim.loads.profile import Cycle
from softsim.model import Model

# Forward progress [m] within a fall, beyond the recoil before it, that counts as motion. As the air
# leaves, the spikes, 5 mm high, draw the frame back by 1 to 2 mm; a robot whose motor stands still
# then springs forward to where the fall began, and overshoots by up to 0.7 mm. A fifth of a spike's
# height is above that, and far below a walk.
LEAST_PROGRESS = 1e-3
# The robot has set off when it has made this share of its progress, and has arrived but for it.
BEGUN, ARRIVED = 0.05, 0.95


def whole_cycles(model: Model, history: Mapping[str, np.ndarray]) -> list[Cycle]:
    """Return the cycles of the pressure in the robot's chamber that ended within a history."""
    if model.chamber is None:
        return []
    source = model.chamber.source
    if source.control is not None:
        return controlled_cycles(history)
    until = history["time"][-1]
    return [c for c in source.pressure_cycles if c.has_ended(until)]


def controlled_cycles(history: Mapping[str, np.ndarray]) -> list[Cycle]:
    """Return the finished cycles of a controlled pressure, from the columns cycle and phase.

    A row holds the phase in which it was measured: the last row of a deflation marks its end.
    """
    t, number, falls = history["time"], history["cycle"], history["phase"] == Phase.DEFLATION
    cycles = []
    for k in np.unique(number):
        fall = np.flatnonzero(falls & (number == k))
        if len(fall) > 0 and fall[-1] < len(t) - 1:
            begin, end = float(t[fall[0] - 1]), float(t[fall[-1]])
            cycles.append(Cycle(begin, end, end))
    return cycles


def fall_begins(pressure: np.ndarray) -> np.ndarray:
    """Return the rows at which a pressure (rows,) that rose or was constant begins to fall."""
    change = np.sign(np.diff(pressure))
    return np.flatnonzero((change[1:] < 0) & (change[:-1] >= 0)) + 1


@dataclass(frozen=True)
class Walk:
    """Rows of a history at which a forward motion of the robot started and ended."""

    onset: int
    end: int


def forward_walk(x: np.ndarray) -> Walk | None:
    """Return the forward motion in the positions x (rows,) [m]; None if there is none.

    Progress counts from the position to which the robot was drawn back before it walks: the walk
    is the largest rise of x over an earlier minimum. It must exceed the recoil before it by
    LEAST_PROGRESS, as elastic recoil alone explains less. Later backward sliding is ignored.
    """
    if len(x) == 0:
        return None
    farthest = int(np.argmax(x - np.minimum.accumulate(x)))
    lowest = int(np.argmin(x[: farthest + 1]))
    whole, recoil = x[farthest] - x[lowest], x[0] - x[lowest]
    if not whole >= recoil + LEAST_PROGRESS:
        return None
    share = (x[lowest : farthest + 1] - x[lowest]) / whole
    return Walk(lowest + int(np.argmax(share >= BEGUN)), lowest + int(np.argmax(share >= ARRIVED)))


def walk_pressures(
    cycle: Cycle, t: np.ndarray, x: np.ndarray, pressure: np.ndarray
) -> tuple[float | None, float | None]:
    """Return the pressures [Pa] at which the robot started and stopped within the fall of a cycle.

    They are P_M3^B and P_M3^S of the thesis, as found; None if the robot did not move.

    t [s], x [m], pressure [Pa]: columns (rows,) of the history.
    """
    fall = np.flatnonzero((t >= cycle.fall_begin) & (t <= cycle.fall_end * (1.0 + 1e-9)))
    walk = forward_walk(x[fall])
    if walk is None:
        return None, None
    return float(pressure[fall[walk.onset]]), float(pressure[fall[walk.end]])
