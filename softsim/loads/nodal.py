"""Nodal forces of fixed direction that follow a profile: single, per area or per volume."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import index_field, once, real_field, vector_field
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, PerScenario, Stage, Term, WorkingTerm
from softsim.elements.geometry import nodal_sums
from softsim.loads.load import Load, LoadTargets, joined_facets, sized
from softsim.loads.profile import Profile, ProfileTable
from softsim.rigid import RigidBodies
from softsim.scene import loads as scene_loads
from softsim.scene.text import Keys


@dataclass(frozen=True, eq=False)
class NodalForce(Load):
    """Forces `forces` (k, d) [N] on `nodes` (k,), times the factor `share` over time."""

    nodes: np.ndarray
    forces: PerScenario[np.ndarray]
    share: PerScenario[Profile]

    def term(
        self, scenarios: Sequence["NodalForce"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "NodalForceTerm":
        forces = np.stack([load.forces for load in scenarios])
        return NodalForceTerm(
            nodes, self.nodes, forces, ProfileTable([load.share for load in scenarios])
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


# -------------------------------------------------------------------------------------------------
# Force that takes a fraction of the robot's weight along its own axis off a rigid body.
#
# A plane section represents a different fraction of a round robot along the axis than across it. Of
# 14 spikes around the circumference, the equivalent of 7 carries load across the axis (sum of
# cos^2), and the section has these; along the axis all 14 hold. The section therefore has half of
# the grip along the axis and, for the same balance, may carry half of the weight. The force -share
# (W.e) e follows the body: e is its axis, W = m g the present weight of the whole robot.


@dataclass(frozen=True, eq=False)
class AxialRelief(Load):
    """Relief of rigid body number `body` from the weight of `mass` [kg] along its own x axis."""

    body: int
    mass: PerScenario[float]

    def term(
        self, scenarios: Sequence["AxialRelief"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "AxialReliefTerm":
        return AxialReliefTerm(
            rigid_bodies, self.body, np.array([relief.mass for relief in scenarios])
        )


class AxialReliefTerm(Term):
    """Kernel class of the axial relief on rigid body number `body`, whose axis is its own x.

    masses: relieved fraction of the robot's mass (scenarios,) [kg].
    """

    def __init__(self, rigid_bodies: RigidBodies, body: int, masses: np.ndarray) -> None:
        self.rigid_bodies, self.body = rigid_bodies, body
        self.mass = real_field(masses)

    def pulls(self) -> list[Callable[..., None]]:
        return [self.pull]

    @ti.func
    def pull(self, s, i, t, dt):
        """Apply the force along the body's present axis."""
        along_x = ti.Vector.zero(backend.real, self.rigid_bodies.dimension)
        along_x[0] = 1.0
        axis = self.rigid_bodies.to_space(s, self.body, along_x)
        weight = self.mass[s] * self.rigid_bodies.nodes.gravity[s]
        self.rigid_bodies.apply(s, self.body, -weight.dot(axis) * axis)


# -------------------------------------------------------------------------------------------------
# Gravity that follows a profile, and the work of the weights while it changes.
#
# The weight of a mass m that has moved by u since the start has done the work m g.u if g is
# constant. If g changes, the trapezoidal rule sums m (g_0 + g_1)/2 . (u_1 - u_0) over the
# increments. Summation by parts turns that into m g.u with the present g, minus the sum of m (g_1 -
# g_0) . (u_0 + u_1)/2. This sum is the difference between the work of a constant gravity equal to
# the present one and the actual work; it grows only while gravity changes.


@dataclass(frozen=True, eq=False)
class RisingGravity(Load):
    """Gravity `full` (d,) [m/s^2] times the factor `share` over time."""

    full: PerScenario[np.ndarray]
    share: PerScenario[Profile]

    def term(
        self, scenarios: Sequence["RisingGravity"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "RisingGravityTerm":
        full = np.stack([gravity.full for gravity in scenarios])
        table = ProfileTable([gravity.share for gravity in scenarios])
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


# -------------------------------------------------------------------------------------------------
# Force of fixed direction at the centre of mass of a rigid body that follows a profile.


@dataclass(frozen=True, eq=False)
class RigidForce(Load):
    """Force (d,) [N] times `share` at the centre of mass of rigid body number `body`."""

    body: int
    force: PerScenario[np.ndarray]
    share: PerScenario[Profile]

    def term(
        self, scenarios: Sequence["RigidForce"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "RigidForceTerm":
        forces = np.stack([load.force for load in scenarios])
        table = ProfileTable([load.share for load in scenarios])
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


# -------------------------------------------------------------------------------------------------
# Forces of a scene.


def nodal_force(
    loaded: LoadTargets,
    load: scene_loads.NodalForceSpec | scene_loads.DirectedNodalForce,
    keys: Keys,
) -> NodalForce:
    """Return a force on a node set."""
    names = loaded.names
    nodes = names.node_set(load.nodes, (*keys, "nodes"))
    if not loaded.is_free[nodes].any(axis=1).all():
        raise names.loaded.error(
            (*keys, "nodes"),
            f"a node of '{load.nodes}' is fixed or tied, so a force on it has no effect",
            "load free nodes, or apply the load to the rigid body",
        )
    share = loaded.mass[nodes] / loaded.mass[nodes].sum()
    force, factor = sized(loaded, load, "force", keys)
    return NodalForce(nodes, np.outer(share, force), factor)


def surface_traction(
    loaded: LoadTargets,
    load: scene_loads.SurfaceTraction | scene_loads.DirectedTraction,
    keys: Keys,
) -> NodalForce:
    """Return a force per area at rest on facets: on each corner int N_a t dA."""
    names = loaded.names
    facets = joined_facets(names, load.facets, keys)
    areas = np.zeros(facets.shape)
    for body, region, chosen in names.bounded(facets):
        of_body = facets[chosen] - body.first_node
        areas[chosen] = region.geometry.corner_areas(body.mesh.points, of_body)
    measure = nodal_sums(facets, areas, len(loaded.points))
    return distributed(measure, *sized(loaded, load, "traction", keys))


def body_force(
    loaded: LoadTargets, load: scene_loads.BodyForce | scene_loads.DirectedBodyForce, keys: Keys
) -> NodalForce:
    """Return a force per volume at rest on bodies, by their lumped volume."""
    names = loaded.names
    volumes = np.zeros(len(loaded.points))
    for k, name in enumerate(load.bodies):
        if name not in names.bodies:
            known = ", ".join(names.bodies)
            raise names.loaded.error(
                (*keys, "bodies", k), f"there is no body '{name}'", f"known: {known}"
            )
        for r in loaded.regions[name]:
            shares = r.geometry.mass_shares(r.points, r.cells) * r.volumes[:, None]
            volumes[r.nodes] += nodal_sums(r.cells, shares, len(r.points))
    return distributed(volumes, *sized(loaded, load, "density", keys))


def distributed(measure: np.ndarray, per_measure: np.ndarray, factor: Profile) -> NodalForce:
    """Return a force per area or volume on the nodes with a nonzero measure.

    measure: (n,) [m^2, m^3], area or volume of each node.
    """
    nodes = np.flatnonzero(measure)
    return NodalForce(nodes, np.outer(measure[nodes], per_measure), factor)


def rigid_force(
    loaded: LoadTargets,
    load: scene_loads.RigidForceSpec | scene_loads.DirectedRigidForce,
    keys: Keys,
) -> RigidForce:
    """Return a force on a rigid body."""
    names = loaded.names
    body = names.rigid_number(load.acts_on, (*keys, "acts_on"))
    return RigidForce(body, *sized(loaded, load, "force", keys))


def axial_relief(loaded: LoadTargets, load: scene_loads.AxialReliefSpec, keys: Keys) -> AxialRelief:
    """Return the relief of a rigid body from a fraction of the total weight along its axis."""
    body = loaded.names.rigid_number(load.acts_on, (*keys, "acts_on"))
    return AxialRelief(body, load.share * loaded.total_mass)
