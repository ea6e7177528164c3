"""Interface of walls: their geometry in numpy, and their obstacles in kernels."""

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
        """Names of the surfaces; before a dot, if any, the name of the wall in the scene."""

    @abstractmethod
    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Return the signed gap (n,) [m] of points x (n, d) to each surface, negative inside."""

    @abstractmethod
    def obstacle(self, alike: Sequence[Any], places: np.ndarray) -> "Obstacle":
        """Return the obstacle of the wall in kernels.

        alike: this wall in every scenario, this one first. places: positions of the contact nodes
        at the start (k, d) [m].
        """

    def steepest(self) -> float:
        """Return the largest slope |grad g| of the gap, 1 where it is a distance."""
        return 1.0

    def thickness(self) -> float:
        """Return the smallest thickness [m] of the wall.

        A node deeper than half of it leaves on the other side. Infinite where that cannot happen or
        is not known.
        """
        return float("inf")

    def frame(self, alike: Sequence[Any]) -> FixedFrame:
        """Return the axes in which the wall is at rest: those of space, unless it moves."""
        return FixedFrame()

    def least_gap(self, x: np.ndarray) -> np.ndarray:
        """Return a lower bound (n,) [m] of the gap of points x (n, d) at any time."""
        return np.asarray(np.min(list(self.gaps(x).values()), axis=0))

    def offset(self, time: float) -> np.ndarray:
        """Return the displacement (3,) [m] of the wall from its rest position at a time [s]."""
        return np.zeros(3)

    def time_scaled(self, factor: float) -> "Wall":
        """Return the wall with its time history, if it has one, `factor` times as fast."""
        return self

    @property
    def columns(self) -> dict[str, str]:
        """Columns that the contact with this wall adds to the history -> unit."""
        return {}

    def touched_at_once(self) -> tuple[float, float]:
        """Return the number of surfaces that a node can touch at once, and an eigenvalue bound.

        The second is an upper bound of the largest eigenvalue of the sum of n (x) n over their
        normals n; both are multiplied by the slope |grad g| of the gap where that is not 1.
        """
        return len(self.names), float(len(self.names))

    def corners(self) -> np.ndarray:
        """Return the convex corners (c, d) [m] that may lie between the nodes of a surface.

        Only walls with corners in the plane have some.
        """
        return np.zeros((0, 2))

    @abstractmethod
    def drawn(self) -> dict[str, np.ndarray]:
        """Return the arrays of the wall that a run's results store for the figures.

        Names are documented in output/fields.FieldWriter.describe. Arrays of several walls are
        joined.
        """


class Obstacle:
    """Wall in kernels.

    It has `count` surfaces, each with `gap_and_normal(s, i, w, q)` at a point q in the axes of the
    wall's frame.
    """

    count: int
    gap_and_normal: Any
    standoff: float = 0.0
    """Gap [m] at which contact begins: the radius of a round body about its node."""

    def passes(self) -> dict[Stage, list[Pass]]:
        """Return the passes of an increment, none for a wall that does not change in its frame."""
        return {}

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores, none for a wall without state."""
        return {}

    @ti.func
    def may_touch(self, s, i, q):
        """Return 0 if contact node i at q cannot touch and could not at the last call, else 1.

        0 saves the computation of the gaps. It is called once an increment, so a wall may update
        its data of the node here. Walls with a cheap gap always return 1.
        """
        return 1
