"""The outline of a rigid body, a rectangle that moves with it: gap and normal seen from outside."""

import numpy as np
import taichi as ti

from softsim.nodes import real_field, vector_field
from softsim.rigid.frame import RigidBodies


@ti.data_oriented
class Outline:
    """Rectangle of a rigid body as an obstacle for nodes outside it.

    half_size: (2,) half length and half height [m]. centre: (2,) of the rectangle in the body's
    own axes, measured from its reference point [m].
    """

    count = 1

    def __init__(
        self, bodies: RigidBodies, body: int, half_size: np.ndarray, centre: np.ndarray
    ) -> None:
        self.bodies, self.body = bodies, body
        self.half_size = real_field(half_size)
        self.centre = vector_field(np.asarray(centre)[None])

    @ti.func
    def gap_and_normal(self, s, w, q):
        """Signed gap to the nearest side [m] (the nearest corner is no case of its own: a soft
        skin lies on the sides) and that side's outward normal, both in the body's axes.
        """
        d = q - self.centre[0]
        outside_x = ti.abs(d[0]) - self.half_size[0]
        outside_y = ti.abs(d[1]) - self.half_size[1]
        gap = outside_y
        normal = ti.Vector([0.0, 1.0])
        if d[1] < 0.0:
            normal = ti.Vector([0.0, -1.0])
        if outside_x > outside_y:
            gap = outside_x
            normal = ti.Vector([1.0, 0.0])
            if d[0] < 0.0:
                normal = ti.Vector([-1.0, 0.0])
        return gap, normal

    @ti.func
    def local_position(self, s, x):
        """Place in the body's axes [m]."""
        return self.bodies.to_body(s, self.body, x - self.bodies.centre[s, self.body])

    @ti.func
    def relative_velocity(self, s, x, v):
        """Velocity relative to the body's material point at x, in the body's axes [m/s]."""
        return self.bodies.to_body(s, self.body, v - self.bodies.velocity_at(s, self.body, x))

    @ti.func
    def global_vector(self, s, f):
        """A vector of the body's axes in space."""
        return self.bodies.to_space(s, self.body, f)
