"""What takes a share of a robot's weight along its own axis off a rigid body.

A plane section stands for another part of a round robot along the axis than across it: of 14 spikes
around, 7 carry across the axis (sum of cos^2), and the section has these, but all 14 hold along it.
So the section has half of the grip there, and for the same balance it may carry half of the weight.
The force -share (W.e) e follows the body: e is its axis, W = m g the present weight of the whole
robot.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim import backend
from softsim.fields import real_field
from softsim.loads.load import Load
from softsim.nodes import Nodes
from softsim.rigid.frame import RigidBodies
from softsim.sharing import Own
from softsim.term import Term


@dataclass(frozen=True, eq=False)
class AxialRelief(Load):
    """Takes the weight of `mass` [kg], as far as it lies along x of rigid body number `body`, off
    it.
    """

    body: int
    mass: Own[float]

    def term(
        self, alike: Sequence["AxialRelief"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "AxialReliefTerm":
        """Its force on the body."""
        return AxialReliefTerm(rigid_bodies, self.body, np.array([relief.mass for relief in alike]))


class AxialReliefTerm(Term):
    """On rigid body number `body`, whose axis is its own x. masses: share times the robot's mass
    (scenarios,) [kg].
    """

    def __init__(self, rigid_bodies: RigidBodies, body: int, masses: np.ndarray) -> None:
        self.rigid_bodies, self.body = rigid_bodies, body
        self.mass = real_field(masses)

    def pulls(self) -> list[Callable[..., None]]:
        """On the body."""
        return [self.pull]

    @ti.func
    def pull(self, s, i, t, dt):
        """Apply it as the body is turned now."""
        along_x = ti.Vector.zero(backend.real, self.rigid_bodies.dimension)
        along_x[0] = 1.0
        axis = self.rigid_bodies.to_space(s, self.body, along_x)
        weight = self.mass[s] * self.rigid_bodies.nodes.gravity[s]
        self.rigid_bodies.apply(s, self.body, -weight.dot(axis) * axis)
