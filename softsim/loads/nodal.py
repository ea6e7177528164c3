"""A force on a set of nodes, shared by lumped mass, fixed in direction, ramped in smoothly."""

import numpy as np
import taichi as ti

from softsim import backend
from softsim.nodes import Nodes, index_field, real_field, vector_field


@ti.data_oriented
class NodalForce:
    """Total `forces` (scenarios, 2) [N] on `loaded` nodes (k,), in full after `ramp` [s]."""

    def __init__(self, nodes: Nodes, loaded: np.ndarray, forces: np.ndarray, ramp: float) -> None:
        lanes = backend.lanes()
        self.nodes, self.count = nodes, len(loaded)
        self.node = index_field(loaded)
        mass = nodes.mass.to_numpy()[loaded]
        self.share = real_field(mass / mass.sum())
        self.total = vector_field(forces)
        self.ramp = real_field(np.array([ramp]))
        self.work = ti.field(backend.real, shape=(nodes.scenarios, self.count))
        padded = np.full(backend.lane_blocks(self.count) * lanes, -1)
        padded[: self.count] = loaded
        self.first_row = nodes.corner_forces.claim(padded.reshape(-1, lanes))

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        return {"work": self.work}

    @ti.func
    def work_done(self, s):
        """Work so far [J]."""
        total = ti.cast(0.0, backend.real)
        for i in range(self.count):
            total += self.work[s, i]
        return total

    @ti.func
    def push(self, s, i, t, dt):
        """The node's share of the force at time t; it rises as u^2 (3 - 2 u)."""
        bits = ti.static(self.nodes.corner_forces.lane_bits)
        mask = ti.static(self.nodes.corner_forces.lane_mask)
        rise = ti.cast(1.0, backend.real)
        if t < self.ramp[0]:
            u = t / self.ramp[0]
            rise = u * u * (3.0 - 2.0 * u)
        force = rise * self.share[i] * self.total[s]
        row = self.first_row + (i >> bits)
        # The slot still holds the force of the last increment: work by the trapezoidal rule.
        before = ti.Vector(
            [
                self.nodes.corner_forces.x[s, row][i & mask],
                self.nodes.corner_forces.y[s, row][i & mask],
            ]
        )
        self.nodes.corner_forces.x[s, row][i & mask] = force[0]
        self.nodes.corner_forces.y[s, row][i & mask] = force[1]
        velocity = self.nodes.velocity[s, self.node[i]]
        self.work[s, i] = self.work[s, i] + 0.5 * dt * (before + force).dot(velocity)
