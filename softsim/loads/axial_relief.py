"""What takes a share of a robot's weight along its own axis off a rigid body.

A plane section stands for another part of a round robot along the axis than across it: of 14 spikes
around, 7 carry across the axis (sum of cos^2), and the section has these, but all 14 hold along it.
So the section has half of the grip there, and for the same balance it may carry half of the weight.
The force -share (W.e) e follows the body: e is its axis, W the weight of the whole robot.
"""

from typing import Any

import numpy as np
import taichi as ti

from softsim import backend
from softsim.fields import vector_field


@ti.data_oriented
class AxialRelief:
    """On rigid body number `body`, whose axis is its own x. weights: share times the robot's weight
    (scenarios, d) [N].
    """

    count = 1

    def __init__(self, rigid_bodies: Any, body: int, weights: np.ndarray) -> None:
        self.rigid_bodies, self.body = rigid_bodies, body
        self.weight = vector_field(weights)

    @ti.func
    def pull(self, s, i, t, dt):
        """Apply it as the body is turned now."""
        along_x = ti.Vector.zero(backend.real, self.rigid_bodies.dimension)
        along_x[0] = 1.0
        axis = self.rigid_bodies.to_space(s, self.body, along_x)
        self.rigid_bodies.apply(s, self.body, -self.weight[s].dot(axis) * axis)
