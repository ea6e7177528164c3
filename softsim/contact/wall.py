"""What every fixed wall is to the rest of the program: in numpy, and as an obstacle in kernels."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
import taichi as ti


class Wall(ABC):
    """Fixed surfaces of one kind, free on one side."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Of the surfaces; before a dot, if there is one, the name of the wall in the scene."""

    @abstractmethod
    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Signed gap (n,) [m] of places x (n, d) to each surface, negative inside, by its name."""

    @abstractmethod
    def obstacle(self, alike: Sequence[Any], places: np.ndarray) -> "FixedFrame":
        """What kernels meet; alike: this wall in every scenario, this one first. places: of the
        contact nodes at the start (k, d) [m].
        """

    def touched_at_once(self) -> tuple[float, float]:
        """Most surfaces that one node can touch at once, and an upper bound of the largest
        eigenvalue of the sum of n (x) n over their normals n; both times the slope |grad g| of the
        gap where that is not 1.
        """
        return len(self.names), float(len(self.names))

    @abstractmethod
    def drawn(self) -> dict[str, np.ndarray]:
        """What a run's results keep of it for the figures, by the names that
        output/fields.FieldWriter.describe documents. Arrays of several walls are joined.
        """


@ti.data_oriented
class FixedFrame:
    """An obstacle that stands still, so that the place in its frame is the place in space. It has
    `count` surfaces, each with `gap_and_normal(s, i, w, x)`.
    """

    def state_fields(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps: none of a wall that remembers nothing."""
        return {}

    @ti.func
    def may_touch(self, s, i, x):
        """Whether contact node number i at x may touch, or touched when last asked: 0 spares the
        gaps. Asked once an increment, so a wall may remember here what it needs to know of the
        node. Of walls whose gap is as cheap: always 1.
        """
        return 1

    @ti.func
    def local_position(self, s, x):
        """Place in the obstacle's frame."""
        return x

    @ti.func
    def relative_velocity(self, s, x, v):
        """Velocity of a node relative to the wall, in the wall's frame."""
        return v

    @ti.func
    def global_vector(self, s, f):
        """A vector of the wall's frame in space."""
        return f
