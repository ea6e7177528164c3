"""Straight, fixed walls: gap and normal from analytic half planes."""

import numpy as np
import taichi as ti

from softsim.nodes import vector_field


@ti.data_oriented
class StraightWalls:
    """Half planes, solid behind. points, normals: (scenarios, walls, 2); the unit normals point
    into the free side.
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

    @ti.func
    def local_position(self, s, x):
        """Fixed walls: the place in their frame is the place in space."""
        return x

    @ti.func
    def relative_velocity(self, s, x, v):
        """Velocity of a node relative to the wall, in the wall's frame."""
        return v

    @ti.func
    def global_vector(self, s, f):
        """A vector of the wall's frame in space."""
        return f
