"""Forces on nodes and rigid bodies: of fixed direction, of gravity, of vibration motors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import index_field, once, real_field, vector_field, write_row
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


# -------------------------------------------------------------------------------------------------
# Forces of a vibration motor: an eccentric mass, or a sinusoid of given amplitude.
#
# An eccentric mass m_e at radius r_e exerts the centrifugal force m_e r_e omega^2 in its direction.
# A motor that turns about the section's normal z exerts its whole rotating vector in the section;
# one that turns about the pipe's axis x (in the plane across the section) exerts only its y
# component; in space all components act. The weight m_e g belongs to the mass of the body.
#
# The force m_e r_e omega^2 (a cos(angle) + b sin(angle)), with a and b normal to the axis, turns
# from a to b. For positive rotation about x, y and z, a is y, z and x, and b is z, x and y. These
# are axes of the body that carries the motor and turn with it where it pitches or follows a bend. A
# sinusoidal force keeps its direction in space.
#
# The speed rises smoothly: omega(t) = 2 pi f (3 u^2 - 2 u^3) with u = t / spin_up, whose integral
# gives the angle in closed form; the force rises with omega^2.


@dataclass(frozen=True)
class RotorForce:
    """Force cos(angle) `cosine` + sin(angle) `sine`, both (d,) [N] at full speed.

    frequency [Hz], spin_up [s]; phase: the angle [rad] at `start` [s], where the rotation begins.
    """

    cosine: PerScenario[np.ndarray]
    sine: PerScenario[np.ndarray]
    frequency: PerScenario[float]
    spin_up: PerScenario[float]
    phase: PerScenario[float]
    start: PerScenario[float] = 0.0

    def turned(self, t: float) -> float:
        """Return the time [s] at full speed that gives the rotation reached at t [s]."""
        since = t - self.start
        if since >= self.spin_up:
            return since - 0.5 * self.spin_up
        u = since / self.spin_up
        return self.spin_up * u**3 * (1.0 - 0.5 * u)

    def at_phase(self, phase: float) -> "RotorForce":
        """Return the rotor with another initial angle [rad]."""
        return replace(self, phase=phase)

    def at_frequency(self, frequency: float, t: float) -> "RotorForce":
        """Return the rotor at another frequency [Hz] from t [s] on, with the same force.

        The angle is continuous at t.
        """
        skipped = 2.0 * np.pi * (self.frequency - frequency) * self.turned(t)
        return replace(self, frequency=frequency, phase=self.phase + skipped)


def eccentric_mass(
    mass: float,
    radius: float,
    frequency: float,
    axis: np.ndarray,
    sense: int,
    spin_up: float,
    phase: float,
    dimension: int,
) -> RotorForce:
    """Return the rotor of an eccentric mass [kg] at a radius [m] that turns about `axis` (3,).

    sense: 1 for positive rotation, -1 for negative. A model of two dimensions has the x and y
    components of its force.
    """
    amplitude = mass * radius * (2.0 * np.pi * frequency) ** 2
    cosine, sine = amplitude * across(axis)[:, :dimension]
    return RotorForce(cosine, sense * sine, frequency, spin_up, phase)


def across(axis: np.ndarray) -> np.ndarray:
    """Return two unit vectors (2, 3) a, b normal to an axis (3,) and right-handed with it.

    a is the projection of the coordinate axis that follows, in the order x, y, z, x, the one
    nearest to the given axis.
    """
    unit = axis / np.linalg.norm(axis)
    following = np.roll(np.eye(3), -1, axis=0)[np.abs(unit).argmax()]
    a = following - following.dot(unit) * unit
    a /= np.linalg.norm(a)
    return np.stack([a, np.cross(unit, a)])


def sinusoidal_force(
    amplitude: float, direction: np.ndarray, frequency: float, spin_up: float, phase: float
) -> RotorForce:
    """Return the force `amplitude` [N] along `direction` times the sine of the angle."""
    unit = np.asarray(direction) / np.linalg.norm(direction)
    return RotorForce(np.zeros_like(unit), amplitude * unit, frequency, spin_up, phase)


@dataclass(frozen=True, eq=False)
class Rotor(Load):
    """Vibration force on rigid body number `body`, along directions fixed in space."""

    body: int
    rotor: RotorForce

    def term(
        self, scenarios: Sequence["Rotor"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "RotorTerm":
        return RotorTerm(rigid_bodies, self.body, [load.rotor for load in scenarios])

    def at_frequency(self, now: RotorForce, frequency: float, t: float) -> RotorForce:
        """Return `now` at another frequency [Hz] from t [s] on; a sinusoid keeps its amplitude."""
        return now.at_frequency(frequency, t)


@dataclass(frozen=True, eq=False)
class CarriedRotor(Rotor):
    """Motor on rigid body number `body`, with force directions that turn with the body."""

    def term(
        self, scenarios: Sequence["Rotor"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "CarriedRotorTerm":
        return CarriedRotorTerm(rigid_bodies, self.body, [load.rotor for load in scenarios])

    def at_frequency(self, now: RotorForce, frequency: float, t: float) -> RotorForce:
        """Return `now` at another frequency f [Hz] from t [s] on, its force rising as f^2."""
        share = (frequency / self.rotor.frequency) ** 2
        cosine, sine = share * self.rotor.cosine, share * self.rotor.sine
        return replace(now.at_frequency(frequency, t), cosine=cosine, sine=sine)


class RotorTerm(Term):
    """Kernel class of vibration on rigid body number `body`, with one RotorForce per scenario."""

    def __init__(self, rigid_bodies: RigidBodies, body: int, rotors: list[RotorForce]) -> None:
        self.rigid_bodies, self.body = rigid_bodies, body
        self.cosine = vector_field(np.array([r.cosine for r in rotors]))
        self.sine = vector_field(np.array([r.sine for r in rotors]))
        self.speed = real_field(np.array([2.0 * np.pi * r.frequency for r in rotors]))
        self.spin_up = real_field(np.array([r.spin_up for r in rotors]))
        self.phase = real_field(np.array([r.phase for r in rotors]))
        self.start = real_field(np.array([r.start for r in rotors]))
        self.rotors = rotors

    def follow(self, scenario: int, rotor: RotorForce) -> None:
        """Replace the rotor of a scenario."""
        self.rotors[scenario] = rotor
        write_row(self.cosine, scenario, rotor.cosine)
        write_row(self.sine, scenario, rotor.sine)
        write_row(self.speed, scenario, 2.0 * np.pi * rotor.frequency)
        write_row(self.spin_up, scenario, rotor.spin_up)
        write_row(self.phase, scenario, rotor.phase)
        write_row(self.start, scenario, rotor.start)

    def pulls(self) -> list[Callable[..., None]]:
        return [self.pull]

    @ti.func
    def pull(self, s, i, t, dt):
        """Apply the force of time t; before its start the motor stands still."""
        spin_up, since = self.spin_up[s], t - self.start[s]
        share = ti.cast(1.0, backend.real)
        turned = since - 0.5 * spin_up
        if since < spin_up:
            u = since / spin_up
            share = u * u * (3.0 - 2.0 * u)
            turned = spin_up * u * u * u * (1.0 - 0.5 * u)
        if since < 0.0:
            share = 0.0
        angle = self.phase[s] + self.speed[s] * turned
        force = ti.cos(angle) * self.cosine[s] + ti.sin(angle) * self.sine[s]
        self.rigid_bodies.apply(s, self.body, share * share * self.in_space(s, force))

    @ti.func
    def in_space(self, s, force):
        """Return the force (d) [N] in space."""
        return force


class CarriedRotorTerm(RotorTerm):
    """Kernel class of a motor whose force directions turn with rigid body number `body`."""

    @ti.func
    def in_space(self, s, force):
        """Return the force (d) [N] in space of a force in the body's axes."""
        return self.rigid_bodies.to_space(s, self.body, force)


# -------------------------------------------------------------------------------------------------
# Rotors of a scene.


def eccentric_motor(
    loaded: LoadTargets, load: scene_loads.EccentricMass, keys: Keys
) -> CarriedRotor:
    """Return a vibration motor on a rigid body."""
    rotor = eccentric_mass(
        load.factor * load.eccentric_mass, load.radius, load.frequency,
        np.array(load.rotation_axis), load.sense, load.spin_up, load.phase,
        loaded.names.dimension,
    )  # fmt: skip
    begun = replace(rotor, start=loaded.names.beginning.of(keys))
    return CarriedRotor(shaken_body(loaded, load.acts_on, keys), begun)


def sinusoid(loaded: LoadTargets, load: scene_loads.SinusoidalForce, keys: Keys) -> Rotor:
    """Return a sinusoidal force on a rigid body."""
    direction = loaded.names.vector(load.direction, (*keys, "direction"))
    rotor = sinusoidal_force(load.amplitude, direction, load.frequency, load.spin_up, load.phase)
    begun = replace(rotor, start=loaded.names.beginning.of(keys))
    return Rotor(shaken_body(loaded, load.acts_on, keys), begun)


def shaken_body(loaded: LoadTargets, acts_on: str, keys: Keys) -> int:
    """Return the number of the rigid body on which a vibration acts."""
    names = loaded.names
    if names.scene.time.procedure == "static":
        raise names.loaded.error(
            keys,
            f"'{keys[-1]}' vibrates, so a static procedure cannot find an equilibrium",
            "leave the motor out, or write time.procedure: dynamic",
        )
    return names.rigid_number(acts_on, (*keys, "acts_on"))
