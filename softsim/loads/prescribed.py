"""Prescribed motion: one component of a set of nodes follows a profile."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import taichi as ti

from softsim import backend
from softsim.fields import index_field
from softsim.loads.load import Load
from softsim.loads.profile import Profile
from softsim.loads.table import ProfileTable
from softsim.nodes import Nodes
from softsim.rigid.frame import RigidBodies
from softsim.sharing import Own
from softsim.term import Pass, Stage, WorkingTerm


@dataclass(frozen=True, eq=False)
class PrescribedMotion(Load):
    """Prescribed displacement `profile` [m over s] of component `axis` of `nodes`."""

    nodes: np.ndarray
    axis: int
    profile: Own[Profile]

    def term(
        self, alike: Sequence["PrescribedMotion"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "PrescribedMotionTerm":
        profiles = [motion.profile for motion in alike]
        return PrescribedMotionTerm(nodes, self.nodes, self.axis, ProfileTable(profiles))

    @property
    def last_change(self) -> float:
        return float(self.profile.times[-1])

    def time_scaled(self, factor: float) -> "PrescribedMotion":
        return replace(self, profile=self.profile.time_scaled(factor))


class PrescribedMotionTerm(WorkingTerm):
    """Kernel class that displaces component `axis` of the `moved` nodes (k,) by `table` [m over s].

    The velocity of a step is (u(t) - u(t - dt)) / dt, so positions follow the profile exactly. The
    work of the support is summed by the trapezoidal rule: minus the nodal force times the
    displacement.
    """

    def __init__(self, nodes: Nodes, moved: np.ndarray, axis: int, table: ProfileTable) -> None:
        super().__init__(nodes.scenarios, len(moved))
        self.nodes, self.axis, self.table = nodes, axis, table
        self.node = index_field(moved)

    def passes(self) -> dict[Stage, list[Pass]]:
        return {Stage.STEER: [Pass("loads", int(self.count), (self.steer,))]}

    @ti.func
    def steer(self, s, i, t, dt):
        """Set the velocity of the step that ends at t, before positions are updated."""
        a = self.node[i]
        speed = (self.table.at(s, t) - self.table.at(s, t - dt)) / dt
        way = (self.nodes.velocity[s, a][self.axis] + speed) * dt
        self.work[s, i] = self.work[s, i] - 0.5 * self.nodes.force[s, a][self.axis] * way
        self.nodes.velocity[s, a][self.axis] = speed

    @ti.func
    def work_done(self, s, dt, part):
        """Return the work so far [J], with the present force for the last half step."""
        total = ti.cast(0.0, backend.real)
        for i in range(self.count.first(part), self.count.first(part + 1)):
            a = self.node[i]
            last_way = self.nodes.velocity[s, a][self.axis] * dt
            total += self.work[s, i] - 0.5 * self.nodes.force[s, a][self.axis] * last_way
        return total
