"""A force on a set of nodes, shared by lumped mass, fixed in direction, over time a profile."""

import numpy as np
import taichi as ti

from softsim import backend
from softsim.fields import index_field, real_field, vector_field
from softsim.loads.table import ProfileTable
from softsim.nodes import Nodes


@ti.data_oriented
class NodalForce:
    """Total `forces` (scenarios, d) [N] times `table` on `loaded` nodes (k,)."""

    def __init__(
        self, nodes: Nodes, loaded: np.ndarray, forces: np.ndarray, table: ProfileTable
    ) -> None:
        self.nodes, self.count, self.table = nodes, len(loaded), table
        self.node = index_field(loaded)
        mass = nodes.lumped_mass[loaded]
        self.share = real_field(mass / mass.sum())
        self.total = vector_field(forces)
        self.work = real_field(np.zeros((nodes.scenarios, self.count)))
        self.first_slot = nodes.corner_forces.claim(loaded)

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        return {"work": self.work}

    @ti.func
    def work_done(self, s, dt):
        """Work so far [J]."""
        total = ti.cast(0.0, backend.real)
        for i in range(self.count):
            total += self.work[s, i]
        return total

    @ti.func
    def push(self, s, i, t, dt):
        """The node's share of the force at time t."""
        force = self.table.at(s, t) * self.share[i] * self.total[s]
        # The slot still holds the force of the last increment: work by the trapezoidal rule.
        before = self.nodes.corner_forces.read(s, self.first_slot + i)
        self.nodes.corner_forces.write(s, self.first_slot + i, force)
        velocity = self.nodes.velocity[s, self.node[i]]
        self.work[s, i] = self.work[s, i] + 0.5 * dt * (before + force).dot(velocity)
