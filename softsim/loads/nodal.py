"""Nodal forces of fixed direction that follow a profile: single, per area or per volume."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import taichi as ti

from softsim.fields import index_field, vector_field
from softsim.loads.load import Load
from softsim.loads.profile import Profile
from softsim.loads.table import ProfileTable
from softsim.nodes import Nodes
from softsim.rigid.frame import RigidBodies
from softsim.sharing import Own
from softsim.term import Pass, Stage, WorkingTerm


@dataclass(frozen=True, eq=False)
class NodalForce(Load):
    """Forces `forces` (k, d) [N] on `nodes` (k,), times the factor `share` over time."""

    nodes: np.ndarray
    forces: Own[np.ndarray]
    share: Own[Profile]

    def term(
        self, alike: Sequence["NodalForce"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "NodalForceTerm":
        forces = np.stack([load.forces for load in alike])
        return NodalForceTerm(
            nodes, self.nodes, forces, ProfileTable([load.share for load in alike])
        )

    def remark(self, points: np.ndarray) -> str:
        """Return the largest resultant and the number of nodes."""
        resultant = np.linalg.norm(self.forces.sum(axis=0)) * np.abs(self.share.values).max()
        return f"resultant of at most {resultant:.4g} N, on {len(self.nodes)} nodes"

    @property
    def largest_force(self) -> float:
        """Largest sum over time of the magnitudes of the forces [N]."""
        sizes = np.linalg.norm(self.forces, axis=1)
        return float(sizes.sum() * np.abs(self.share.values).max())

    @property
    def last_change(self) -> float:
        return float(self.share.times[-1])

    def time_scaled(self, factor: float) -> "NodalForce":
        return replace(self, share=self.share.time_scaled(factor))


class NodalForceTerm(WorkingTerm):
    """Kernel class of `forces` (scenarios, k, d) [N] times `table` on `loaded` nodes (k,)."""

    def __init__(
        self, nodes: Nodes, loaded: np.ndarray, forces: np.ndarray, table: ProfileTable
    ) -> None:
        super().__init__(nodes.scenarios, len(loaded))
        self.nodes, self.table = nodes, table
        self.node = index_field(loaded)
        self.force = vector_field(forces)
        self.first_slot = nodes.corner_forces.reserve(loaded)

    def passes(self) -> dict[Stage, list[Pass]]:
        return {Stage.MOVE: [Pass("loads", int(self.count), (self.push,))]}

    @ti.func
    def push(self, s, i, t, dt):
        """Write the force on the node at time t and add its work."""
        force = self.table.at(s, t) * self.force[s, i]
        # The slot still holds the force of the last increment: work by the trapezoidal rule.
        before = self.nodes.corner_forces.read(s, self.first_slot + i)
        self.nodes.corner_forces.write(s, self.first_slot + i, force)
        velocity = self.nodes.velocity[s, self.node[i]]
        self.work[s, i] = self.work[s, i] + 0.5 * dt * (before + force).dot(velocity)
