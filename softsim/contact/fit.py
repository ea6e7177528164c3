"""Interference fit: walls that start inside bodies and close on them while bodies settle."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim import backend
from softsim.contact.frame import FixedFrame
from softsim.contact.wall import Obstacle, Wall
from softsim.fields import real_field
from softsim.sharing import Own
from softsim.term import Pass, Stage


@dataclass(frozen=True, eq=False)
class FittedWall(Wall):
    """Wall that starts moved back by the overlap with the bodies and closes while they settle.

    Its surfaces are moved back by `overlap` (w,) [m] at first, so that they just touch the bodies,
    and return smoothly to their positions from the time `begin` [s] on, within `duration` [s],
    before t = 0.
    """

    wall: Wall
    overlap: Own[np.ndarray]
    begin: Own[float]
    duration: Own[float]

    @property
    def names(self) -> tuple[str, ...]:
        return self.wall.names

    @property
    def columns(self) -> dict[str, str]:
        return self.wall.columns

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Return the signed gap (n,) [m] of points x (n, d) to each surface before it closes."""
        gaps = self.wall.gaps(x)
        return {
            name: gaps[name] + overlap
            for name, overlap in zip(self.names, self.overlap, strict=True)
        }

    def least_gap(self, x: np.ndarray) -> np.ndarray:
        """Return a lower bound (n,) [m] of the gap at any time: that of the closed wall."""
        return self.wall.least_gap(x)

    def steepest(self) -> float:
        return self.wall.steepest()

    def obstacle(self, alike: Sequence["FittedWall"], places: np.ndarray) -> "FittedObstacle":
        return FittedObstacle(self.wall.obstacle([one.wall for one in alike], places), alike)

    def frame(self, alike: Sequence["FittedWall"]) -> FixedFrame:
        return self.wall.frame([one.wall for one in alike])

    def touched_at_once(self) -> tuple[float, float]:
        return self.wall.touched_at_once()

    def drawn(self) -> dict[str, np.ndarray]:
        """Return the drawing of the closed wall."""
        return self.wall.drawn()


class FittedObstacle(Obstacle):
    """Obstacle whose surfaces are moved back by `open` times the overlap.

    Fields: open (scenarios,) [-], from 1 to 0; overlap (scenarios, w) [m]; begin, duration
    (scenarios,) [s].
    """

    def __init__(self, obstacle: Obstacle, walls: Sequence[FittedWall]) -> None:
        self.inner, self.count = obstacle, obstacle.count
        self.open = real_field(np.zeros(len(walls)))
        self.overlap = real_field(np.array([wall.overlap for wall in walls]))
        self.begin = real_field(np.array([wall.begin for wall in walls]))
        self.duration = real_field(np.array([wall.duration for wall in walls]))

    def passes(self) -> dict[Stage, list[Pass]]:
        """Return the pass that updates `open` before forces are computed."""
        return {Stage.MEASURE: [Pass("contact", 1, (self.close,))]}

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the checkpoint fields of the wall, which is closed at t = 0."""
        return self.inner.state_fields()

    @ti.func
    def close(self, s, i, t, dt):
        """Compute the fraction of the overlap that is still open at time t."""
        u = ti.min(ti.max((t - self.begin[s]) / self.duration[s], 0.0), 1.0)
        self.open[s] = ti.cast(1.0 - u * u * (3.0 - 2.0 * u), backend.real)

    @ti.func
    def may_touch(self, s, i, q):
        """Return 1 if a node may touch the closed wall, which is the nearer one."""
        return self.inner.may_touch(s, i, q)

    @ti.func
    def gap_and_normal(self, s, i, w, q):
        """Return the signed gap [m] at q to surface w as it is now, and the unit normal."""
        gap, n = self.inner.gap_and_normal(s, i, w, q)
        return gap + self.open[s] * self.overlap[s, w], n
