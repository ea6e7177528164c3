"""Fixed walls in kernels: gap and normal from analytic half spaces and cylindrical pipes."""

from collections.abc import Sequence

import numpy as np
import taichi as ti

from softsim.contact.half_spaces import HalfSpaces
from softsim.contact.round_pipes import RoundPipes
from softsim.fields import real_field, vector_field


@ti.data_oriented
class FixedFrame:
    """Obstacles that stand still: the place in their frame is the place in space."""

    def memory(self) -> dict[str, ti.Field]:
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


@ti.data_oriented
class FlatObstacle(FixedFrame):
    """Half spaces (half planes in a section), solid behind; one entry of `walls` a scenario.

    places: of the contact nodes at the start (k, d) [m].
    """

    def __init__(self, walls: Sequence[HalfSpaces], places: np.ndarray) -> None:
        self.count = len(walls[0].names)
        self.point = vector_field(np.stack([w.points for w in walls]))
        self.normal = vector_field(np.stack([w.normals for w in walls]))

    @ti.func
    def gap_and_normal(self, s, i, w, x):
        """Signed gap [m] of contact node number i at x to wall w, negative inside, and the wall's
        unit normal.
        """
        n = self.normal[s, w]
        return (x - self.point[s, w]).dot(n), n


@ti.data_oriented
class RoundObstacle(FixedFrame):
    """Straight pipes of circular section in space, free inside; one entry of `walls` a scenario.

    places: of the contact nodes at the start (k, 3) [m].
    """

    def __init__(self, walls: Sequence[RoundPipes], places: np.ndarray) -> None:
        self.count = len(walls[0].names)
        self.point = vector_field(np.stack([w.points for w in walls]))
        self.axis = vector_field(np.stack([w.axes for w in walls]))
        self.radius = real_field(np.stack([w.radii for w in walls]))

    @ti.func
    def gap_and_normal(self, s, i, w, x):
        """Signed gap [m] of contact node number i at x to pipe w, negative inside the wall, and the
        unit normal towards the axis.
        """
        d = x - self.point[s, w]
        d -= d.dot(self.axis[s, w]) * self.axis[s, w]
        distance = d.norm()
        return self.radius[s, w] - distance, -d / ti.max(distance, 1e-12)
