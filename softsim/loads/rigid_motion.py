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
    """Component `axis` of rigid body number `body`, which is not free, is displaced by `profile`
    [m over s]. The history gets the force that moves it as `drive_force`, the mean over the
    interval.
    """

    body: int
    axis: int
    profile: Own[Profile]

    @property
    def columns(self) -> dict[str, str]:
        """The force that moves the body."""
        return {"drive_force": "N"}

    def term(
        self, alike: Sequence["RigidMotion"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "RigidMotionTerm":
        """The motion of the body."""
        table = ProfileTable([motion.profile for motion in alike])
        return RigidMotionTerm(rigid_bodies, self.body, self.axis, table)

    @property
    def last_change(self) -> float:
        """Time [s] at which its time course ends."""
        return float(self.profile.times[-1])

    def time_scaled(self, factor: float) -> "RigidMotion":
        """The motion, `factor` times as fast."""
        return replace(self, profile=self.profile.time_scaled(factor))


class RigidMotionTerm(Term):
    """Component `axis` of rigid body number `body` is displaced by `table` [m over s].

    As of nodes (loads/prescribed.py): the velocity of a step is (u(t) - u(t - dt)) / dt, and the
    drive's force is the opposite of what all others do to the body along it. Fields, (scenarios,):
    its `work` [J], trapezoidal, and its `impulse` [N s] since it was last cleared.
    """

    def __init__(
        self, rigid_bodies: RigidBodies, body: int, axis: int, table: ProfileTable
    ) -> None:
        self.rigid_bodies, self.body, self.axis, self.table = rigid_bodies, body, axis, table
        nothing = np.zeros(rigid_bodies.nodes.scenarios)
        self.work, self.impulse = real_field(nothing), real_field(nothing)

    def passes(self) -> dict[Stage, list[Pass]]:
        """Of an increment."""
        return {Stage.STEER: [Pass("loads", 1, (self.steer,))]}

    def state_fields(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        return {"work": self.work, "impulse": self.impulse}

    def forget_work(self) -> None:
        """No work is done before the first increment."""
        fields.write(self.work, 0.0)

    def impulses(self) -> list[ti.Field]:
        """Of the force."""
        return [self.impulse]

    def readings(self, scenario: int, interval: float) -> dict[str, float]:
        """The mean force of the drive [N]."""
        impulse = float(fields.read_row(self.impulse, scenario))
        return {"drive_force": impulse / interval if interval > 0.0 else 0.0}

    @ti.func
    def steer(self, s, i, t, dt):
        """Velocity of the step that ends at t, before the body drifts."""
        speed = (self.table.at(s, t) - self.table.at(s, t - dt)) / dt
        way = (self.rigid_bodies.velocity[s, self.body][self.axis] + speed) * dt
        force = self.rigid_bodies.held_force[s, self.body][self.axis]
        self.work[s] = self.work[s] - 0.5 * force * way
        self.impulse[s] = self.impulse[s] - force * dt
        self.rigid_bodies.velocity[s, self.body][self.axis] = speed

    @ti.func
    def work_done(self, s, dt, part):
        """Work so far [J], the last half step with the force of now."""
        way = self.rigid_bodies.velocity[s, self.body][self.axis] * dt
        force = self.rigid_bodies.held_force[s, self.body][self.axis]
        return once(part) * (self.work[s] - 0.5 * force * way)
