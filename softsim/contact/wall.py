"""What every wall is to the rest of the program: in numpy, and as an obstacle in kernels."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
import taichi as ti

from softsim.contact.frame import FixedFrame
from softsim.term import Pass, Stage


class Wall(ABC):
    """Surfaces of one kind, free on one side, in the axes of their frame."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Of the surfaces; before a dot, if there is one, the name of the wall in the scene."""

    @abstractmethod
    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Signed gap (n,) [m] of places x (n, d) to each surface, negative inside, by its name."""

    @abstractmethod
    def obstacle(self, alike: Sequence[Any], places: np.ndarray) -> "Obstacle":
        """What kernels meet; alike: this wall in every scenario, this one first. places: of the
        contact nodes at the start (k, d) [m].
        """

    def steepest(self) -> float:
        """Largest slope |grad g| of the gap: 1 where it is a distance."""
        return 1.0

    def thickness(self) -> float:
        """Return the thickness [m] of the wall where it is thinnest: a node deeper than half of it
        leaves on the other side. Infinite where that cannot happen or is not known.
        """
        return float("inf")

    def frame(self, alike: Sequence[Any]) -> FixedFrame:
        """The axes in which the wall stands still: those of space, unless it moves."""
        return FixedFrame()

    def least_gap(self, x: np.ndarray) -> np.ndarray:
        """Lower bound (n,) [m] of the gap of places x (n, d) to the nearest surface at any time."""
        return np.asarray(np.min(list(self.gaps(x).values()), axis=0))

    def offset(self, time: float) -> np.ndarray:
        """How far the wall is from where it is at rest (3,) [m] at a time [s]."""
        return np.zeros(3)

    def time_scaled(self, factor: float) -> "Wall":
        """The wall with its time course, if it has one, played `factor` times as fast."""
        return self

    @property
    def columns(self) -> dict[str, str]:
        """Columns that its contact adds to the history -> unit."""
        return {}

    def touched_at_once(self) -> tuple[float, float]:
        """Most surfaces that one node can touch at once, and an upper bound of the largest
        eigenvalue of the sum of n (x) n over their normals n; both times the slope |grad g| of the
        gap where that is not 1.
        """
        return len(self.names), float(len(self.names))

    def corners(self) -> np.ndarray:
        """Convex corners (c, d) [m] that may get between the nodes of a surface, where it has some
        and is in the plane.
        """
        return np.zeros((0, 2))

    @abstractmethod
    def drawn(self) -> dict[str, np.ndarray]:
        """What a run's results keep of it for the figures, by the names that
        output/fields.FieldWriter.describe documents. Arrays of several walls are joined.
        """


class Obstacle:
    """A wall in kernels: `count` surfaces, each with `gap_and_normal(s, i, w, q)` at a place q in
    the axes of the wall's frame.
    """

    count: int
    gap_and_normal: Any
    standoff: float = 0.0
    """Gap [m] at which something already touches: the radius of what is round about its node."""

    def passes(self) -> dict[Stage, list[Pass]]:
        """Passes of an increment: none of a wall that does not change in its frame."""
        return {}

    def state_fields(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps: none of a wall that remembers nothing."""
        return {}

    @ti.func
    def may_touch(self, s, i, q):
        """Whether contact node number i at q may touch, or touched when last asked: 0 spares the
        gaps. Asked once an increment, so a wall may remember here what it needs to know of the
        node. Of walls whose gap is as cheap: always 1.
        """
        return 1
