"""The axes of a rigid body, in which its outline stands still."""

import taichi as ti

from softsim.contact.frame import FixedFrame
from softsim.rigid.frame import RigidBodies


class BodyFrame(FixedFrame):
    """The axes of rigid body number `body`, from its centre of mass."""

    def __init__(self, bodies: RigidBodies, body: int) -> None:
        self.bodies, self.body = bodies, body

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
