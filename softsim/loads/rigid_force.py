"""Force of fixed direction at the centre of mass of a rigid body that follows a profile."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import taichi as ti

from softsim.fields import vector_field
from softsim.loads.load import Load
from softsim.loads.profile import Profile
from softsim.loads.table import ProfileTable
from softsim.nodes import Nodes
from softsim.rigid.frame import RigidBodies
from softsim.sharing import Own
from softsim.term import Term


@dataclass(frozen=True, eq=False)
class RigidForce(Load):
    """Force (d,) [N] times `share` at the centre of mass of rigid body number `body`."""

    body: int
    force: Own[np.ndarray]
    share: Own[Profile]

    def term(
        self, alike: Sequence["RigidForce"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "RigidForceTerm":
        forces = np.stack([load.force for load in alike])
        table = ProfileTable([load.share for load in alike])
        return RigidForceTerm(rigid_bodies, self.body, forces, table)

    @property
    def largest_force(self) -> float:
        """Largest magnitude of the force [N]."""
        return float(np.linalg.norm(self.force) * np.abs(self.share.values).max())

    @property
    def last_change(self) -> float:
        return float(self.share.times[-1])

    def time_scaled(self, factor: float) -> "RigidForce":
        return replace(self, share=self.share.time_scaled(factor))


class RigidForceTerm(Term):
    """Kernel class of `forces` (scenarios, d) [N] times `table` on rigid body number `body`."""

    def __init__(
        self, rigid_bodies: RigidBodies, body: int, forces: np.ndarray, table: ProfileTable
    ) -> None:
        self.rigid_bodies, self.body, self.table = rigid_bodies, body, table
        self.force = vector_field(forces)

    def pulls(self) -> list[Callable[..., None]]:
        return [self.pull]

    @ti.func
    def pull(self, s, i, t, dt):
        """Apply the force of time t."""
        self.rigid_bodies.apply(s, self.body, self.table.at(s, t) * self.force[s])
