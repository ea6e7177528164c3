"""A force at the centre of mass of a rigid body, fixed in direction, over time a profile."""

from typing import Any

import numpy as np
import taichi as ti

from softsim.fields import vector_field
from softsim.loads.table import ProfileTable


@ti.data_oriented
class RigidForce:
    """`forces` (scenarios, d) [N] times `table` on rigid body number `body`."""

    count = 1

    def __init__(
        self, rigid_bodies: Any, body: int, forces: np.ndarray, table: ProfileTable
    ) -> None:
        self.rigid_bodies, self.body, self.table = rigid_bodies, body, table
        self.force = vector_field(forces)

    @ti.func
    def pull(self, s, i, t, dt):
        """Apply the force of time t."""
        self.rigid_bodies.apply(s, self.body, self.table.at(s, t) * self.force[s])
