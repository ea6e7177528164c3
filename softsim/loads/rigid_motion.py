"""Prescribed motion of a rigid body: its centre of mass follows a profile along one axis."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import taichi as ti

from softsim import fields
from softsim.fields import once, real_field
from softsim.loads.load import Load
from softsim.loads.profile import Profile
from softsim.loads.table import ProfileTable
from softsim.nodes import Nodes
from softsim.rigid.frame import RigidBodies
from softsim.sharing import Own
from softsim.term import Pass, Stage, Term


@dataclass(frozen=True, eq=False)
class RigidMotion(Load):
    """Prescribed displacement `profile` [m over s] of component `axis` of rigid body number `body`.

    The body is not free along this axis. The history records the force that moves it as
    `drive_force`, averaged over the interval.
    """

    body: int
    axis: int
    profile: Own[Profile]

    @property
    def columns(self) -> dict[str, str]:
        return {"drive_force": "N"}

    def term(
        self, alike: Sequence["RigidMotion"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "RigidMotionTerm":
        table = ProfileTable([motion.profile for motion in alike])
        return RigidMotionTerm(rigid_bodies, self.body, self.axis, table)

    @property
    def last_change(self) -> float:
        return float(self.profile.times[-1])

    def time_scaled(self, factor: float) -> "RigidMotion":
        return replace(self, profile=self.profile.time_scaled(factor))


class RigidMotionTerm(Term):
    """Kernel class that displaces rigid body number `body` along `axis` by `table` [m over s].

    As for nodes (loads/prescribed.py), the velocity of a step is (u(t) - u(t - dt)) / dt, and the
    driving force is the opposite of the sum of all other forces on the body along the axis. Fields
    (scenarios,): `work` [J] by the trapezoidal rule, and `impulse` [N s] since last cleared.
    """

    def __init__(
        self, rigid_bodies: RigidBodies, body: int, axis: int, table: ProfileTable
    ) -> None:
        self.rigid_bodies, self.body, self.axis, self.table = rigid_bodies, body, axis, table
        nothing = np.zeros(rigid_bodies.nodes.scenarios)
        self.work, self.impulse = real_field(nothing), real_field(nothing)

    def passes(self) -> dict[Stage, list[Pass]]:
        return {Stage.STEER: [Pass("loads", 1, (self.steer,))]}

    def state_fields(self) -> dict[str, ti.Field]:
        return {"work": self.work, "impulse": self.impulse}

    def forget_work(self) -> None:
        fields.write(self.work, 0.0)

    def impulses(self) -> list[ti.Field]:
        return [self.impulse]

    def readings(self, scenario: int, interval: float) -> dict[str, float]:
        """Return the mean driving force [N]."""
        impulse = float(fields.read_row(self.impulse, scenario))
        return {"drive_force": impulse / interval if interval > 0.0 else 0.0}

    @ti.func
    def steer(self, s, i, t, dt):
        """Set the velocity of the step that ends at t, before the position is updated."""
        speed = (self.table.at(s, t) - self.table.at(s, t - dt)) / dt
        way = (self.rigid_bodies.velocity[s, self.body][self.axis] + speed) * dt
        force = self.rigid_bodies.held_force[s, self.body][self.axis]
        self.work[s] = self.work[s] - 0.5 * force * way
        self.impulse[s] = self.impulse[s] - force * dt
        self.rigid_bodies.velocity[s, self.body][self.axis] = speed

    @ti.func
    def work_done(self, s, dt, part):
        """Return the work so far [J], with the present force for the last half step."""
        way = self.rigid_bodies.velocity[s, self.body][self.axis] * dt
        force = self.rigid_bodies.held_force[s, self.body][self.axis]
        return once(part) * (self.work[s] - 0.5 * force * way)
