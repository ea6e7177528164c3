"""A wall as a round thing meets it whose centre line touches: nearer by the radius."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.contact.frame import FixedFrame
from softsim.contact.wall import Obstacle, Wall
from softsim.term import Pass, Stage


@dataclass(frozen=True)
class OffsetWall(Wall):
    """The surfaces of a wall, moved by `radius` [m] into the free side."""

    wall: Wall
    radius: float

    @property
    def names(self) -> tuple[str, ...]:
        """Of the wall's surfaces."""
        return self.wall.names

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Signed gap (n,) [m] between a ball of the radius at places x (n, d) and each surface."""
        return {name: gap - self.radius for name, gap in self.wall.gaps(x).items()}

    def obstacle(self, alike: Sequence["OffsetWall"], places: np.ndarray) -> "OffsetObstacle":
        """In kernels."""
        walls = [one.wall for one in alike]
        return OffsetObstacle(self.wall.obstacle(walls, places), self.radius)

    def steepest(self) -> float:
        """Largest slope |grad g| of the gap."""
        return self.wall.steepest()

    def frame(self, alike: Sequence["OffsetWall"]) -> FixedFrame:
        """The wall's."""
        return self.wall.frame([one.wall for one in alike])

    def least_gap(self, x: np.ndarray) -> np.ndarray:
        """Lower bound (n,) [m] of the gap of balls at places x (n, d) at any time."""
        return self.wall.least_gap(x) - self.radius

    def touched_at_once(self) -> tuple[float, float]:
        """As of the wall."""
        return self.wall.touched_at_once()

    def drawn(self) -> dict[str, np.ndarray]:
        """The wall itself."""
        return self.wall.drawn()


class OffsetObstacle(Obstacle):
    """An obstacle that a ball of a radius [m] meets."""

    def __init__(self, obstacle: Obstacle, radius: float) -> None:
        self.inner, self.standoff, self.count = obstacle, radius, obstacle.count
        obstacle.standoff = radius

    def passes(self) -> dict[Stage, list[Pass]]:
        """Passes of an increment: those of the obstacle."""
        return self.inner.passes()

    def state_fields(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        return self.inner.state_fields()

    @ti.func
    def may_touch(self, s, i, q):
        """As the obstacle says of q."""
        return self.inner.may_touch(s, i, q)

    @ti.func
    def gap_and_normal(self, s, i, w, q):
        """Signed gap [m] of a ball about q, and the unit normal."""
        gap, n = self.inner.gap_and_normal(s, i, w, q)
        return gap - self.standoff, n
