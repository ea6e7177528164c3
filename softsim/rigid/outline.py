"""Axes of a rigid body, in which its outline is at rest."""

import taichi as ti

from softsim.contact.frame import FixedFrame
from softsim.rigid.frame import RigidBodies


class BodyFrame(FixedFrame):
    """Axes of rigid body number `body`, with the origin at its centre of mass."""

    def __init__(self, bodies: RigidBodies, body: int) -> None:
        self.bodies, self.body = bodies, body

    @ti.func
    def local_position(self, s, x):
        """Return a position in the body's axes [m]."""
        return self.bodies.to_body(s, self.body, x - self.bodies.centre[s, self.body])

    @ti.func
    def relative_velocity(self, s, x, v):
        """Return the velocity [m/s] relative to the body's point at x, in the body's axes."""
        return self.bodies.to_body(s, self.body, v - self.bodies.velocity_at(s, self.body, x))

    @ti.func
    def global_vector(self, s, f):
        return self.bodies.to_space(s, self.body, f)
