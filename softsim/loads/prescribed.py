"""Prescribed motion: one component of a set of nodes follows a profile."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import index_field, once, real_field
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, PerScenario, Samples, Stage, Term, WorkingTerm
from softsim.contact.forces import NodalForces
from softsim.contact.wall import FixedFrame, Obstacle, Wall
from softsim.loads.load import Load
from softsim.loads.profile import Profile, ProfileTable, built_profile, over_the_run
from softsim.rigid import RigidBodies, freedom
from softsim.scene.bodies import Prescribed, RigidMotionSpec, WallMotion
from softsim.scene.names import Names
from softsim.scene.text import Keys


@dataclass(frozen=True, eq=False)
class PrescribedMotion(Load):
    """Prescribed displacement `profile` [m over s] of component `axis` of `nodes`."""

    nodes: np.ndarray
    axis: int
    profile: PerScenario[Profile]

    def term(
        self, scenarios: Sequence["PrescribedMotion"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "PrescribedMotionTerm":
        profiles = [motion.profile for motion in scenarios]
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


# -------------------------------------------------------------------------------------------------
# Prescribed motion of a rigid body: its centre of mass follows a profile along one axis.


@dataclass(frozen=True, eq=False)
class RigidMotion(Load):
    """Prescribed displacement `profile` [m over s] of component `axis` of rigid body number `body`.

    The body is not free along this axis. The history records the force that moves it as
    `drive_force`, averaged over the interval.
    """

    body: int
    axis: int
    profile: PerScenario[Profile]

    @property
    def columns(self) -> dict[str, str]:
        return {"drive_force": "N"}

    def term(
        self, scenarios: Sequence["RigidMotion"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "RigidMotionTerm":
        table = ProfileTable([motion.profile for motion in scenarios])
        return RigidMotionTerm(rigid_bodies, self.body, self.axis, table)

    @property
    def last_change(self) -> float:
        return float(self.profile.times[-1])

    def time_scaled(self, factor: float) -> "RigidMotion":
        return replace(self, profile=self.profile.time_scaled(factor))


class RigidMotionTerm(Term):
    """Kernel class that displaces rigid body number `body` along `axis` by `table` [m over s].

    As for nodes, the velocity of a step is (u(t) - u(t - dt)) / dt, and the
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

    def readings(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the mean driving force [N]."""
        return {"drive_force": samples.mean(samples.read(self.impulse))}

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


# -------------------------------------------------------------------------------------------------
# Moving walls: a wall of any kind, displaced along one axis over time.


@dataclass(frozen=True, eq=False)
class MovingWall(Wall):
    """Wall `wall`, displaced along coordinate number `axis` by `displacement` [m over s] from rest.

    The history records the force that moves it, averaged over the interval.
    """

    wall: Wall
    axis: int
    displacement: PerScenario[Profile]

    @property
    def names(self) -> tuple[str, ...]:
        return self.wall.names

    @property
    def columns(self) -> dict[str, str]:
        """Column of the force that moves the wall -> unit."""
        return {force_column(self.names[0]): "N"}

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Return the signed gaps (n,) [m] of x (n, d) to the surfaces at rest, by name."""
        return self.wall.gaps(x)

    def least_gap(self, x: np.ndarray) -> np.ndarray:
        """Return a lower bound (n,) [m] of the gap at any time.

        A gap changes by at most `steepest` times the displacement.
        """
        farthest = float(np.abs(self.displacement.values).max())
        return self.wall.least_gap(x) - self.steepest() * farthest

    def steepest(self) -> float:
        return self.wall.steepest()

    def band(self) -> float:
        return self.wall.band()

    def thickness(self) -> float:
        return self.wall.thickness()

    def obstacle(self, scenarios: Sequence["MovingWall"], places: np.ndarray) -> Obstacle:
        """Return the kernel class of the wall, in the axes of the moving frame."""
        return self.wall.obstacle([moving.wall for moving in scenarios], places)

    def frame(self, scenarios: Sequence["MovingWall"]) -> "MovingFrame":
        """Return the axes that move with the wall."""
        table = ProfileTable([moving.displacement for moving in scenarios])
        return MovingFrame(force_column(self.names[0]), self.axis, table, len(scenarios))

    def offset(self, time: float) -> np.ndarray:
        """Return the displacement (3,) [m] at a time [s]; zero before t = 0."""
        return np.eye(3)[self.axis] * float(self.displacement.at(max(time, 0.0)))

    def time_scaled(self, factor: float) -> "MovingWall":
        return replace(self, displacement=self.displacement.time_scaled(factor))

    def touched_at_once(self) -> tuple[float, float]:
        return self.wall.touched_at_once()

    def corners(self) -> np.ndarray:
        return self.wall.corners()

    def drawn(self) -> dict[str, np.ndarray]:
        return self.wall.drawn()


def force_column(surface: str) -> str:
    """Return the name of the column with the force that moves the wall of a surface."""
    return f"{surface.partition('.')[0]}_drive_force"


class MovingFrame(FixedFrame):
    """Axes whose origin is displaced along `axis` by `table` [m over s], without rotation.

    With the forces F of its surfaces on the bodies in contact, the motion does the work F . u,
    summed by the trapezoidal rule as in the energy balance of the contact. Fields (scenarios,):
    present offset [m], displacement of the last step [m], speed in it [m/s], work [J] up to its
    middle.
    """

    def __init__(self, column: str, axis: int, table: ProfileTable, scenarios: int) -> None:
        self.column, self.axis, self.table = column, axis, table
        nothing = np.zeros(scenarios)
        self.offset, self.way, self.speed, self.work = (real_field(nothing) for _ in range(4))
        self.contacts: list[NodalForces] = []

    def carry(self, contact: NodalForces) -> None:
        """Register a contact of the surfaces."""
        self.contacts.append(contact)

    def passes(self) -> dict[Stage, list[Pass]]:
        return {Stage.STEER: [Pass("loads", 1, (self.steer,))]}

    def state_fields(self) -> dict[str, ti.Field]:
        return {
            "wall_offset": self.offset,
            "wall_way": self.way,
            "wall_speed": self.speed,
            "wall_work": self.work,
        }

    def speeds(self) -> list[ti.Field]:
        return [self.speed]

    def forget_work(self) -> None:
        fields.write(self.work, 0.0)

    def sampled(self) -> list[ti.Field]:
        return [contact.impulse for contact in self.contacts]

    def readings(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the mean force that moves the wall [N]: the force of the wall on the bodies."""
        impulse = np.zeros(len(samples))
        for contact in self.contacts:
            impulse += samples.read(contact.impulse)[:, :, self.axis].sum(axis=1)
        return {self.column: samples.mean(impulse)}

    @ti.func
    def steer(self, s, i, t, dt):
        """Move the frame to its position at the end t of the step, before nodes and bodies move."""
        offset = self.table.at(s, t)
        way = offset - self.offset[s]
        force = self._force(s)
        self.work[s] = self.work[s] + 0.5 * force * (self.way[s] + way)
        self.offset[s], self.way[s], self.speed[s] = offset, way, way / dt

    @ti.func
    def work_done(self, s, part):
        """Return the work of the motion so far [J]; its last half step has the present force."""
        work = ti.cast(0.0, backend.real)
        if part == 0:
            work = self.work[s] + 0.5 * self._force(s) * self.way[s]
        return work

    @ti.func
    def _force(self, s):
        """Return the present force of all contacts along the axis [N]."""
        force = ti.cast(0.0, backend.real)
        for contact in ti.static(self.contacts):
            force += contact.total_force(s)[self.axis]
        return force

    @ti.func
    def local_position(self, s, x):
        """Return a place x (d) in the frame's axes [m]."""
        q = x
        q[self.axis] -= self.offset[s]
        return q

    @ti.func
    def relative_velocity(self, s, x, v):
        """Return the velocity relative to the frame [m/s]."""
        u = v
        u[self.axis] -= self.speed[s]
        return u


# -------------------------------------------------------------------------------------------------
# Prescribed motions of a scene.


def prescribed(names: Names, held: np.ndarray) -> dict[str, PrescribedMotion]:
    """Return the prescribed motions by name.

    Raises SceneError if a component has two of them or is held otherwise.
    """
    taken = held.copy()
    result = {}
    for keys, condition in names.conditions(Prescribed):
        nodes = names.node_set(condition.nodes, (*keys, "nodes"))
        axis = names.axis(condition.direction, (*keys, "direction"))
        if taken[nodes, axis].any():
            raise names.loaded.error(
                (*keys, "nodes"),
                f"a node of '{condition.nodes}' is already fixed or prescribed along "
                f"{condition.direction}",
                "only one condition can prescribe a component",
            )
        taken[nodes, axis] = True
        profile = displacement(names, condition, keys)
        result[".".join(map(str, keys))] = PrescribedMotion(nodes, axis, profile)
    return result


def rigid_motions(names: Names) -> dict[str, RigidMotion]:
    """Return the prescribed motions of rigid bodies by name.

    Raises SceneError if a direction has two of them or cannot move.
    """
    result: dict[str, RigidMotion] = {}
    for keys, condition in names.conditions(RigidMotionSpec):
        body = names.rigid_number(condition.body, (*keys, "body"))
        axis = names.axis(condition.direction, (*keys, "direction"))
        if not freedom(names, condition.body)[axis] or (body, axis) in [
            (motion.body, motion.axis) for motion in result.values()
        ]:
            raise names.loaded.error(
                (*keys, "direction"),
                f"'{condition.body}' is already held or moved along {condition.direction}",
                f"free this direction (rigid_bodies.{condition.body}.free), and use only one "
                "condition for it",
            )
        profile = displacement(names, condition, keys)
        result[".".join(map(str, keys))] = RigidMotion(body, axis, profile)
    return result


def displacement(
    names: Names, motion: Prescribed | RigidMotionSpec | WallMotion, keys: Keys
) -> Profile:
    """Return a displacement [m over s of the whole run], which starts from zero."""
    if motion.displacement is None:
        return _integrated_velocity(names, motion.velocity, keys)
    profile = over_the_run(names, motion.displacement, keys)
    if profile.values[0] != 0.0 or profile.times[0] != names.beginning.of(keys):
        raise names.loaded.error(
            (*keys, "displacement"),
            "the displacement must start with [0 s, 0 mm]",
            "a jump at the start would mean an infinite velocity",
        )
    return profile


def _integrated_velocity(names: Names, velocity: Any, keys: Keys) -> Profile:
    """Return the displacement [m over s of the whole run] of a velocity."""
    start, time = names.beginning.of(keys), names.beginning.time
    end = time + names.scene.time.end - start
    return built_profile(velocity, end).integrated(end).delayed(start)
