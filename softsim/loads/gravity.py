"""Gravity that follows a profile, and the work of the weights while it changes.

The weight of a mass m that has moved by u since the start has done the work m g.u if g is constant.
If g changes, the trapezoidal rule sums m (g_0 + g_1)/2 . (u_1 - u_0) over the increments. Summation
by parts turns that into m g.u with the present g, minus the sum of m (g_1 - g_0) . (u_0 + u_1)/2.
This sum is the difference between the work of a constant gravity equal to the present one and the
actual work; it grows only while gravity changes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import taichi as ti

from softsim import backend
from softsim.fields import once, real_field, vector_field
from softsim.loads.load import Load
from softsim.loads.profile import Profile
from softsim.loads.table import ProfileTable
from softsim.nodes import Nodes
from softsim.rigid.frame import RigidBodies
from softsim.sharing import Own
from softsim.term import Pass, Stage, Term


@dataclass(frozen=True, eq=False)
class RisingGravity(Load):
    """Gravity `full` (d,) [m/s^2] times the factor `share` over time."""

    full: Own[np.ndarray]
    share: Own[Profile]

    def term(
        self, alike: Sequence["RisingGravity"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "RisingGravityTerm":
        full = np.stack([gravity.full for gravity in alike])
        table = ProfileTable([gravity.share for gravity in alike])
        return RisingGravityTerm(nodes, rigid_bodies, full, table)

    def time_scaled(self, factor: float) -> "RisingGravity":
        return replace(self, share=self.share.time_scaled(factor))


class RisingGravityTerm(Term):
    """Kernel class that sets the gravity of all nodes and rigid bodies to `table` times `full`.

    full: (scenarios, d) [m/s^2]. Before its first time the table has its first value.

    Fields: increase (scenarios, d) [m/s^2] within the last increment; missed_by_nodes (scenarios,
    nodes) and missed_by_bodies (scenarios, bodies) [J], the sums of m (g_1 - g_0) . (u_0 + u_1)/2.
    """

    def __init__(
        self, nodes: Nodes, rigid_bodies: RigidBodies, full: np.ndarray, table: ProfileTable
    ) -> None:
        self.nodes, self.rigid_bodies, self.table = nodes, rigid_bodies, table
        self.full = vector_field(full)
        self.increase = vector_field(np.zeros_like(full))
        self.missed_by_nodes = real_field(np.zeros((nodes.scenarios, int(nodes.count))))
        self.missed_by_bodies = real_field(np.zeros((nodes.scenarios, rigid_bodies.count)))

    def passes(self) -> dict[Stage, list[Pass]]:
        return {
            Stage.MEASURE: [Pass("loads", 1, (self.follow,))],
            Stage.MOVE: [
                Pass("loads", int(self.nodes.count), (self.miss_nodes,)),
                Pass("loads", self.rigid_bodies.count, (self.miss_bodies,)),
            ],
        }

    def state_fields(self) -> dict[str, ti.Field]:
        return {
            "gravity": self.nodes.gravity,
            "missed_by_nodes": self.missed_by_nodes,
            "missed_by_bodies": self.missed_by_bodies,
        }

    @ti.func
    def follow(self, s, i, t, dt):
        """Set gravity to that of time t, before any weight of this increment is computed."""
        now = self.table.at(s, t) * self.full[s]
        self.increase[s] = now - self.nodes.gravity[s]
        self.nodes.gravity[s] = now

    @ti.func
    def miss_nodes(self, s, a, t, dt):
        """Add m (g_1 - g_0) . (u_0 + u_1)/2 of the free components of a node."""
        middle = self.nodes.position[s, a] - 0.5 * dt * self.nodes.velocity[s, a]
        moved = middle - self.nodes.rest[a]
        work = ti.cast(0.0, backend.real)
        for k in ti.static(range(self.nodes.dimension)):
            if self.nodes.inverse_mass[a][k] > 0.0:
                work += self.nodes.mass[a] * self.increase[s][k] * moved[k]
        self.missed_by_nodes[s, a] = self.missed_by_nodes[s, a] + work

    @ti.func
    def miss_bodies(self, s, r, t, dt):
        """Add m (g_1 - g_0) . (u_0 + u_1)/2 of a rigid body."""
        moved = self.rigid_bodies.displacement(s, r) - 0.5 * dt * self.rigid_bodies.velocity[s, r]
        work = self.rigid_bodies.mass[r] * self.increase[s].dot(moved)
        self.missed_by_bodies[s, r] = self.missed_by_bodies[s, r] + work

    @ti.func
    def work_done(self, s, dt, part):
        """Return the work of all weights so far minus that under a constant present gravity [J]."""
        work = ti.cast(0.0, backend.real)
        for a in range(self.nodes.count.first(part), self.nodes.count.first(part + 1)):
            work -= self.missed_by_nodes[s, a]
        for r in range(self.rigid_bodies.count):
            work -= once(part) * self.missed_by_bodies[s, r]
        return work
