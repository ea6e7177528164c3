"""Force that takes a fraction of the robot's weight along its own axis off a rigid body.

A plane section represents a different fraction of a round robot along the axis than across it. Of
14 spikes around the circumference, the equivalent of 7 carries load across the axis (sum of cos^2),
and the section has these; along the axis all 14 hold. The section therefore has half of the grip
along the axis and, for the same balance, may carry half of the weight. The force -share (W.e) e
follows the body: e is its axis, W = m g the present weight of the whole robot.
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
    """Relief of rigid body number `body` from the weight of `mass` [kg] along its own x axis."""

    body: int
    mass: Own[float]

    def term(
        self, alike: Sequence["AxialRelief"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "AxialReliefTerm":
        return AxialReliefTerm(rigid_bodies, self.body, np.array([relief.mass for relief in alike]))


class AxialReliefTerm(Term):
    """Kernel class of the axial relief on rigid body number `body`, whose axis is its own x.

    masses: relieved fraction of the robot's mass (scenarios,) [kg].
    """

    def __init__(self, rigid_bodies: RigidBodies, body: int, masses: np.ndarray) -> None:
        self.rigid_bodies, self.body = rigid_bodies, body
        self.mass = real_field(masses)

    def pulls(self) -> list[Callable[..., None]]:
        return [self.pull]

    @ti.func
    def pull(self, s, i, t, dt):
        """Apply the force along the body's present axis."""
        along_x = ti.Vector.zero(backend.real, self.rigid_bodies.dimension)
        along_x[0] = 1.0
        axis = self.rigid_bodies.to_space(s, self.body, along_x)
        weight = self.mass[s] * self.rigid_bodies.nodes.gravity[s]
        self.rigid_bodies.apply(s, self.body, -weight.dot(axis) * axis)
