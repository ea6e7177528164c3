"""Fixed walls: gap and normal from analytic half spaces and cylindrical pipes."""

import numpy as np
import taichi as ti

from softsim.fields import real_field, vector_field


@ti.data_oriented
class FixedFrame:
    """Obstacles that stand still: the place in their frame is the place in space."""

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
class StraightWalls(FixedFrame):
    """Half spaces (half planes in a section), solid behind. points, normals: (scenarios, walls,
    d); the unit normals point into the free side.
    """

    def __init__(self, points: np.ndarray, normals: np.ndarray) -> None:
        self.count = points.shape[1]
        self.point = vector_field(points)
        self.normal = vector_field(normals)

    @ti.func
    def gap_and_normal(self, s, w, x):
        """Signed gap [m], negative inside the wall, and the wall's unit normal."""
        n = self.normal[s, w]
        return (x - self.point[s, w]).dot(n), n


@ti.data_oriented
class RoundPipes(FixedFrame):
    """Straight pipes of circular section in space, free inside.

    points: (scenarios, pipes, 3) on each axis. axes: (scenarios, pipes, 3), unit. radii:
    (scenarios, pipes) [m].
    """

    def __init__(self, points: np.ndarray, axes: np.ndarray, radii: np.ndarray) -> None:
        self.count = points.shape[1]
        self.point, self.axis = vector_field(points), vector_field(axes)
        self.radius = real_field(radii)

    @ti.func
    def gap_and_normal(self, s, w, x):
        """Signed gap [m], negative inside the wall, and the unit normal towards the axis."""
        d = x - self.point[s, w]
        d -= d.dot(self.axis[s, w]) * self.axis[s, w]
        distance = d.norm()
        return self.radius[s, w] - distance, -d / ti.max(distance, 1e-12)
