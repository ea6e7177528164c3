"""What takes a share of a robot's weight along its own axis off a rigid body.

A plane section stands for another part of a round robot along the axis than across it: of 14 spikes
around, 7 carry across the axis (sum of cos^2), and the section has these, but all 14 hold along it.
So the section has half of the grip there, and for the same balance it may carry half of the weight.
The force -share (W.e) e follows the body: e is its axis, W = m g the present weight of the whole
robot.
"""

from typing import Any

import numpy as np
import taichi as ti

from softsim import backend
from softsim.fields import real_field


@ti.data_oriented
class AxialRelief:
    """On rigid body number `body`, whose axis is its own x. masses: share times the robot's mass
    (scenarios,) [kg].
    """

    count = 1

    def __init__(self, rigid_bodies: Any, body: int, masses: np.ndarray) -> None:
        self.rigid_bodies, self.body = rigid_bodies, body
        self.mass = real_field(masses)

    @ti.func
    def pull(self, s, i, t, dt):
        """Apply it as the body is turned now."""
        along_x = ti.Vector.zero(backend.real, self.rigid_bodies.dimension)
        along_x[0] = 1.0
        axis = self.rigid_bodies.to_space(s, self.body, along_x)
        weight = self.mass[s] * self.rigid_bodies.nodes.gravity[s]
        self.rigid_bodies.apply(s, self.body, -weight.dot(axis) * axis)
