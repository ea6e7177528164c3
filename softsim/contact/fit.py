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
    """A wall whose surfaces recede by `overlap` (w,) [m] at first, so that they just touch the
    bodies, and close to their places from the time `begin` [s] on within `duration` [s], smoothly.
    All of it is over at t = 0.
    """

    wall: Wall
    overlap: Own[np.ndarray]
    begin: Own[float]
    duration: Own[float]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the surfaces."""
        return self.wall.names

    @property
    def columns(self) -> dict[str, str]:
        """Columns of the wall."""
        return self.wall.columns

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Signed gap (n,) [m] of places x (n, d) to each surface before it closes, by its name."""
        gaps = self.wall.gaps(x)
        return {
            name: gaps[name] + overlap
            for name, overlap in zip(self.names, self.overlap, strict=True)
        }

    def least_gap(self, x: np.ndarray) -> np.ndarray:
        """Lower bound (n,) [m] of the gap at any time: that of the closed wall."""
        return self.wall.least_gap(x)

    def steepest(self) -> float:
        """Largest slope |grad g| of the gap."""
        return self.wall.steepest()

    def obstacle(self, alike: Sequence["FittedWall"], places: np.ndarray) -> "FittedObstacle":
        """Return the obstacle of the kernels."""
        return FittedObstacle(self.wall.obstacle([one.wall for one in alike], places), alike)

    def frame(self, alike: Sequence["FittedWall"]) -> FixedFrame:
        """The wall's."""
        return self.wall.frame([one.wall for one in alike])

    def touched_at_once(self) -> tuple[float, float]:
        """Return the surfaces that a node may touch at once."""
        return self.wall.touched_at_once()

    def drawn(self) -> dict[str, np.ndarray]:
        """The closed wall."""
        return self.wall.drawn()


class FittedObstacle(Obstacle):
    """An obstacle whose surfaces recede by `open` times the overlap. Fields: open (scenarios,) [-],
    from 1 to 0; overlap (scenarios, w) [m]; begin, duration (scenarios,) [s].
    """

    def __init__(self, obstacle: Obstacle, walls: Sequence[FittedWall]) -> None:
        self.inner, self.count = obstacle, obstacle.count
        self.open = real_field(np.zeros(len(walls)))
        self.overlap = real_field(np.array([wall.overlap for wall in walls]))
        self.begin = real_field(np.array([wall.begin for wall in walls]))
        self.duration = real_field(np.array([wall.duration for wall in walls]))

    def passes(self) -> dict[Stage, list[Pass]]:
        """Passes of an increment: the share of now, before forces are found."""
        return {Stage.MEASURE: [Pass("contact", 1, (self.close,))]}

    def state_fields(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps: those of the wall, which is closed at t = 0."""
        return self.inner.state_fields()

    @ti.func
    def close(self, s, i, t, dt):
        """Find the share of the overlap that is still open at time t."""
        u = ti.min(ti.max((t - self.begin[s]) / self.duration[s], 0.0), 1.0)
        self.open[s] = ti.cast(1.0 - u * u * (3.0 - 2.0 * u), backend.real)

    @ti.func
    def may_touch(self, s, i, q):
        """Return True if a node may touch the closed wall, which is the nearer one."""
        return self.inner.may_touch(s, i, q)

    @ti.func
    def gap_and_normal(self, s, i, w, q):
        """Signed gap [m] at q to surface w as it is now, and the unit normal."""
        gap, n = self.inner.gap_and_normal(s, i, w, q)
        return gap + self.open[s] * self.overlap[s, w], n
