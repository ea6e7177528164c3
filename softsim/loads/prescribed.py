"""Prescribed motion: one component of a set of nodes follows a profile."""

import numpy as np
import taichi as ti

from softsim import backend
from softsim.fields import index_field, real_field
from softsim.loads.table import ProfileTable
from softsim.nodes import Nodes


@ti.data_oriented
class PrescribedMotion:
    """Component `axis` of the `moved` nodes (k,) is displaced by `table` [m over s].

    The velocity of a step is (u(t) - u(t - dt)) / dt, so positions follow the profile exactly. The
    work of the support is booked by the trapezoidal rule: minus the nodal force times the way.
    """

    def __init__(self, nodes: Nodes, moved: np.ndarray, axis: int, table: ProfileTable) -> None:
        self.nodes, self.count, self.axis, self.table = nodes, len(moved), axis, table
        self.node = index_field(moved)
        self.work = real_field(np.zeros((nodes.scenarios, self.count)))

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        return {"work": self.work}

    @ti.func
    def steer(self, s, i, t, dt):
        """Velocity of the step that ends at t, before the nodes drift."""
        a = self.node[i]
        speed = (self.table.at(s, t) - self.table.at(s, t - dt)) / dt
        way = (self.nodes.velocity[s, a][self.axis] + speed) * dt
        self.work[s, i] = self.work[s, i] - 0.5 * self.nodes.force[s, a][self.axis] * way
        self.nodes.velocity[s, a][self.axis] = speed

    @ti.func
    def work_done(self, s, dt):
        """Work so far [J], the last half step with the force of now."""
        total = ti.cast(0.0, backend.real)
        for i in range(self.count):
            a = self.node[i]
            last_way = self.nodes.velocity[s, a][self.axis] * dt
            total += self.work[s, i] - 0.5 * self.nodes.force[s, a][self.axis] * last_way
        return total
