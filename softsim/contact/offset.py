"""Wall offset by the radius of a round body whose centre line is tested for contact."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.contact.frame import FixedFrame
from softsim.contact.wall import Obstacle, Wall
from softsim.term import Pass, Stage


@dataclass(frozen=True)
class OffsetWall(Wall):
    """Surfaces of a wall, offset by `radius` [m] into the free side."""

    wall: Wall
    radius: float

    @property
    def names(self) -> tuple[str, ...]:
        return self.wall.names

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Return the signed gap (n,) [m] of balls of the radius at points x (n, d), by surface."""
        return {name: gap - self.radius for name, gap in self.wall.gaps(x).items()}

    def obstacle(self, alike: Sequence["OffsetWall"], places: np.ndarray) -> "OffsetObstacle":
        walls = [one.wall for one in alike]
        return OffsetObstacle(self.wall.obstacle(walls, places), self.radius)

    def steepest(self) -> float:
        return self.wall.steepest()

    def frame(self, alike: Sequence["OffsetWall"]) -> FixedFrame:
        return self.wall.frame([one.wall for one in alike])

    def least_gap(self, x: np.ndarray) -> np.ndarray:
        """Return a lower bound (n,) [m] of the gap of balls at points x (n, d) at any time."""
        return self.wall.least_gap(x) - self.radius

    def touched_at_once(self) -> tuple[float, float]:
        return self.wall.touched_at_once()

    def drawn(self) -> dict[str, np.ndarray]:
        """Return the drawing of the wall without the offset."""
        return self.wall.drawn()


class OffsetObstacle(Obstacle):
    """Obstacle offset by a radius [m]."""

    def __init__(self, obstacle: Obstacle, radius: float) -> None:
        self.inner, self.standoff, self.count = obstacle, radius, obstacle.count
        obstacle.standoff = radius

    def passes(self) -> dict[Stage, list[Pass]]:
        return self.inner.passes()

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return self.inner.state_fields()

    @ti.func
    def may_touch(self, s, i, q):
        return self.inner.may_touch(s, i, q)

    @ti.func
    def gap_and_normal(self, s, i, w, q):
        """Return the signed gap [m] of a ball about q, and the unit normal."""
        gap, n = self.inner.gap_and_normal(s, i, w, q)
        return gap - self.standoff, n
