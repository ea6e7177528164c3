"""Rigid bodies: mass, inertia, up to six degrees of freedom, nodes tied to them.

The equations of Newton and Euler, dp/dt = F and dL/dt = T about the centre of mass, are integrated
by the same central difference as the nodes: velocity and angular momentum L are at half steps, so L
is conserved to round-off in free flight. The angular velocity of a step is omega = R I^-1 R^T L
with the rotation R at its middle, which is predicted from its start; the orientation, a unit
quaternion, then rotates by exactly omega dt. A body of a plane model is the special case that
rotates about z only. The lumped mass of tied nodes belongs to the body, so momentum is conserved
between the skin and its frame.
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import index_field, matrix_field, real_field, vector_field
from softsim.compute.nodes import PARTS, Nodes, parts_of
from softsim.contact.wall import FixedFrame
from softsim.scene.names import Names

# -------------------------------------------------------------------------------------------------
# Data of a rigid body, in numpy.


def in_space(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (..., 2) or (..., 3) as vectors of space (..., 3)."""
    missing = 3 - vectors.shape[-1]
    return np.concatenate([vectors, np.zeros((*vectors.shape[:-1], missing))], axis=-1)


def point_inertia(mass: np.ndarray, arms: np.ndarray) -> np.ndarray:
    """Return the inertia tensor (3, 3) [kg m^2] of masses (k,) at arms (k, 3)."""
    squares = (arms**2).sum(axis=1)
    return (mass * squares).sum() * np.eye(3) - np.einsum("k,ki,kj->ij", mass, arms, arms)


@dataclass(frozen=True)
class RigidBodyData:
    """Data of one rigid body.

    mass [kg], inertia (3, 3) [kg m^2] about `centre`: without the tied nodes. centre, velocity:
    (d,) [m, m/s]. tied: node numbers. angular_velocity: (3,) [rad/s], in a plane model about z
    only. free: which of x, y, z and of the rotations about x, y, z may move. facets (f, d): of its
    mesh surface, of tied nodes without mass; faces (m, d): coarser ones of the same shape, for
    drawing. Neither has a row if the body has no such surface.
    """

    name: str
    mass: float
    inertia: np.ndarray
    centre: np.ndarray
    tied: np.ndarray
    velocity: np.ndarray
    angular_velocity: np.ndarray
    free: tuple[bool, ...]
    facets: np.ndarray
    faces: np.ndarray

    def with_tied_mass(
        self, points: np.ndarray, node_mass: np.ndarray
    ) -> tuple[float, np.ndarray, np.ndarray]:
        """Return mass, centre of mass (d,) and inertia about it, including the tied nodes."""
        m, x = node_mass[self.tied], points[self.tied]
        mass = self.mass + m.sum()
        centre = (self.mass * self.centre + m @ x) / mass
        inertia = (
            self.inertia
            + point_inertia(np.array([self.mass]), in_space((self.centre - centre)[None]))
            + point_inertia(m, in_space(x - centre))
        )
        return mass, centre, inertia


# -------------------------------------------------------------------------------------------------
# Rigid bodies of a model in kernels.


@dataclass(frozen=True)
class Pose:
    """Current pose of a rigid body.

    centre: position of the centre given in the scene (d,) [m]. orientation: quaternion
    (w, x, y, z).
    """

    centre: np.ndarray
    orientation: np.ndarray

    @property
    def angle(self) -> float:
        """Rotation about z [rad], continuous up to a whole turn in either direction."""
        return float(2.0 * np.arctan2(self.orientation[3], self.orientation[0]))

    @property
    def rotation_vector(self) -> np.ndarray:
        """Axis times angle (3,) [rad], continuous up to a whole turn."""
        w, v = self.orientation[0], self.orientation[1:]
        length = np.linalg.norm(v)
        if length == 0.0:
            return np.zeros(3)
        return 2.0 * np.arctan2(length, w) * v / length


class RigidBodies:
    """All rigid bodies of a model.

    Fields, (scenarios, bodies): centre (d) [m], orientation (quaternion w, x, y, z), rotation (3,
    3), velocity (d) [m/s] and angular_momentum (3) [kg m^2/s] (half a step behind),
    angular_velocity (3) [rad/s] of the last step, force (d) [N] and torque (3) [N m] (last sums, of
    the free components), held_force (d) [N] (of the others), applied_force (of the loads in this
    increment), spring_force and spring_torque (of the springs), applied_work and damping_work [J].
    """

    def __init__(self, nodes: Nodes, bodies: list[RigidBodyData], points: np.ndarray) -> None:
        self.nodes, self.count = nodes, len(bodies)
        d = self.dimension = nodes.dimension
        combined = [b.with_tied_mass(points, nodes.lumped_mass) for b in bodies]
        self.rest_centre = np.array([c for _, c, _ in combined]).reshape(-1, d)
        self.own_centre = np.array([b.centre for b in bodies]).reshape(-1, d)  # without tied nodes
        inertia = np.array([i for _, _, i in combined]).reshape(-1, 3, 3)
        self.rest = vector_field(self.rest_centre)
        self.mass = real_field(np.array([m for m, _, _ in combined]))
        self.inverse_inertia = matrix_field(np.linalg.inv(inertia))
        free = np.array([b.free for b in bodies], dtype=float).reshape(-1, 6)
        self.free = vector_field(free[:, :d])
        self.free_rotation = vector_field(free[:, 3:])
        shape = (nodes.scenarios, self.count)
        self.centre = vector_field(np.broadcast_to(self.rest_centre, (*shape, d)))
        self.orientation = vector_field(np.broadcast_to([1.0, 0.0, 0.0, 0.0], (*shape, 4)))
        self.rotation = matrix_field(np.broadcast_to(np.eye(3), (*shape, 3, 3)))
        omega = np.array([b.angular_velocity for b in bodies]).reshape(-1, 3)
        arms = [in_space(c - b.centre) for b, c in zip(bodies, self.rest_centre, strict=True)]
        velocities = np.array([b.velocity for b in bodies]).reshape(-1, d)
        velocities = velocities + np.cross(omega, np.reshape(arms, (-1, 3)))[:, :d]
        momenta = np.einsum("bij,bj->bi", inertia, omega)
        self.velocity = vector_field(np.broadcast_to(velocities, (*shape, d)))
        self.angular_momentum = vector_field(np.broadcast_to(momenta, (*shape, 3)))
        self.angular_velocity = vector_field(np.broadcast_to(omega, (*shape, 3)))
        self.force, self.held_force, self.applied_force, self.spring_force = (
            vector_field(np.zeros((*shape, d))) for _ in range(4)
        )
        self.torque, self.spring_torque = (vector_field(np.zeros((*shape, 3))) for _ in range(2))
        self.applied_work, self.damping_work = (real_field(np.zeros(shape)) for _ in range(2))

        parts = (nodes.scenarios, self.count * PARTS)
        self.force_part = vector_field(np.zeros((*parts, d)))
        self.torque_part = vector_field(np.zeros((*parts, 3)))
        tied = [b.tied for b in bodies]
        self.tied_count = sum(map(len, tied))
        self.body_of_tied = index_field(np.repeat(np.arange(self.count), list(map(len, tied))))
        self.tied_part = index_field(parts_of([len(t) for t in tied]))
        self.tied = index_field(np.concatenate([*tied, np.zeros(0, int)]))
        tied_arms = [points[t] - c for t, c in zip(tied, self.rest_centre, strict=True)]
        self.arm = vector_field(np.concatenate([*tied_arms, np.zeros((0, d))]))
        self._reactions: list[list[tuple[np.ndarray, np.ndarray]]] = [[] for _ in bodies]

    @property
    def pose_fields(self) -> list[ti.Field]:
        """Fields (scenarios, bodies, ...) from whose values `pose` follows."""
        return [self.centre, self.orientation, self.rotation]

    def pose(
        self, body: int, centre: np.ndarray, orientation: np.ndarray, rotation: np.ndarray
    ) -> Pose:
        """Return the pose of a body from its values of the `pose_fields`."""
        arm = self.own_centre[body] - self.rest_centre[body]
        return Pose(centre + rotation[: self.dimension, : self.dimension] @ arm, orientation)

    def react(self, body: int, first_slot: int, slot_nodes: np.ndarray) -> None:
        """Apply the opposite of the forces in the slots from `first_slot` on to `body`.

        The forces act at `slot_nodes`.
        """
        self._reactions[body].append((first_slot + np.arange(len(slot_nodes)), slot_nodes))

    def allocate(self) -> None:
        """Build the lists of reaction slots, after every term has reserved its slots."""
        none = np.zeros(0, int)
        slots = [np.concatenate([none, *(s for s, _ in r)]) for r in self._reactions]
        at = [np.concatenate([none, *(n for _, n in r)]) for r in self._reactions]
        self.reaction_part = index_field(parts_of([len(s) for s in slots]))
        self.reaction_slot = index_field(np.concatenate([none, *slots]))
        self.reaction_node = index_field(np.concatenate([none, *at]))

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        names = (
            "centre", "orientation", "rotation", "velocity", "angular_momentum",
            "angular_velocity", "force", "held_force", "torque", "applied_force", "spring_force",
            "spring_torque", "applied_work", "damping_work",
        )  # fmt: skip
        return {name: getattr(self, name) for name in names}

    def forget_loads(self) -> None:
        """Set the loads and spring forces of the last increment to zero."""
        for last in (self.applied_force, self.spring_force, self.spring_torque):
            fields.write(last, 0.0)

    # --- vectors in space and in the body's axes -------------------------------------------------

    @ti.func
    def to_space(self, s, r, q):
        """Transform a vector (d) from the body's axes to space."""
        result = ti.Vector.zero(backend.real, self.dimension)
        for i in ti.static(range(self.dimension)):
            for j in ti.static(range(self.dimension)):
                result[i] += self.rotation[s, r][i, j] * q[j]
        return result

    @ti.func
    def to_body(self, s, r, x):
        """Transform a vector (d) from space to the body's axes."""
        result = ti.Vector.zero(backend.real, self.dimension)
        for i in ti.static(range(self.dimension)):
            for j in ti.static(range(self.dimension)):
                result[i] += self.rotation[s, r][j, i] * x[j]
        return result

    @ti.func
    def lifted(self, q):
        """Return a vector (d) as one of space (3)."""
        result = ti.Vector([0.0, 0.0, 0.0])
        for i in ti.static(range(self.dimension)):
            result[i] = q[i]
        return result

    @ti.func
    def velocity_at(self, s, r, x):
        """Return the velocity of the body's material point now at x [m/s]."""
        turning = self.angular_velocity[s, r].cross(self.lifted(x - self.centre[s, r]))
        velocity = self.velocity[s, r]
        for i in ti.static(range(self.dimension)):
            velocity[i] += turning[i]
        return velocity

    @ti.func
    def displacement(self, s, r):
        """Return the displacement of the centre of mass since the start [m]."""
        return self.centre[s, r] - self.rest[r]

    @ti.func
    def turning_speed(self, r, R, L):
        """Return omega = R I^-1 R^T L without the rotations that are held."""
        return self.free_rotation[r] * (R @ (self.inverse_inertia[r] @ (R.transpose() @ L)))

    # --- one increment ---------------------------------------------------------------------------

    @ti.func
    def drift(self, s, r, t, dt):
        """Move the body by dt and reset the forces of loads and springs."""
        self.centre[s, r] = self.centre[s, r] + dt * self.velocity[s, r]
        q = self.orientation[s, r]
        L = self.angular_momentum[s, r]
        middle = turned(q, 0.5 * dt * self.turning_speed(r, rotation_matrix(q), L))
        omega = self.turning_speed(r, rotation_matrix(middle), L)
        q = turned(q, dt * omega)
        self.orientation[s, r] = q
        self.rotation[s, r] = rotation_matrix(q)
        self.angular_velocity[s, r] = omega
        self.applied_force[s, r] = ti.Vector.zero(backend.real, self.dimension)
        self.spring_force[s, r] = ti.Vector.zero(backend.real, self.dimension)
        self.spring_torque[s, r] = ti.Vector([0.0, 0.0, 0.0])

    @ti.func
    def place_tied(self, s, k, t, dt):
        """Set position and velocity of tied node number k."""
        a, r = self.tied[k], self.body_of_tied[k]
        x = self.centre[s, r] + self.to_space(s, r, self.arm[k])
        self.nodes.position[s, a] = x
        self.nodes.velocity[s, a] = self.velocity_at(s, r, x)

    @ti.func
    def apply(self, s, r, force):
        """Add a load at the centre of mass [N]."""
        self.applied_force[s, r] = self.applied_force[s, r] + force

    @ti.func
    def hold(self, s, r, force):
        """Add a spring's force at the centre of mass [N], which does not count as work of loads."""
        self.spring_force[s, r] = self.spring_force[s, r] + force

    @ti.func
    def hold_at(self, s, r, force, arm):
        """Add a spring's force at `arm` (d) [m] from the centre of mass, in space."""
        self.hold(s, r, force)
        self.twist(s, r, self.lifted(arm).cross(self.lifted(force)))

    @ti.func
    def twist(self, s, r, torque):
        """Add a spring's torque (3) [N m], which does not count as work of loads."""
        self.spring_torque[s, r] = self.spring_torque[s, r] + torque

    @ti.func
    def collect(self, s, i, t, dt):
        """Sum force and torque of a part of the tied nodes and of the reactions."""
        r = i // PARTS
        centre = self.centre[s, r]
        force = ti.Vector.zero(backend.real, self.dimension)
        torque = ti.Vector([0.0, 0.0, 0.0])
        for k in range(self.tied_part[i], self.tied_part[i + 1]):
            f = self.nodes.force[s, self.tied[k]]
            arm = self.nodes.position[s, self.tied[k]] - centre
            force += f
            torque += self.lifted(arm).cross(self.lifted(f))
        for k in range(self.reaction_part[i], self.reaction_part[i + 1]):
            f = -self.nodes.corner_forces.read(s, self.reaction_slot[k])
            arm = self.nodes.position[s, self.reaction_node[k]] - centre
            force += f
            torque += self.lifted(arm).cross(self.lifted(f))
        self.force_part[s, i] = force
        self.torque_part[s, i] = torque

    @ti.func
    def kick(self, s, r, t, dt):
        """Update the velocities by the collected forces, loads, springs and gravity."""
        force = self.applied_force[s, r] + self.spring_force[s, r]
        torque = self.spring_torque[s, r]
        for i in range(r * PARTS, (r + 1) * PARTS):
            force += self.force_part[s, i]
            torque += self.torque_part[s, i]
        force += self.mass[r] * self.nodes.gravity[s]
        self.force[s, r] = force * self.free[r]
        self.held_force[s, r] = force - self.force[s, r]
        self.torque[s, r] = torque * self.free_rotation[r]
        v, omega = self.velocity[s, r], self.angular_velocity[s, r]
        self.shift(s, r, t, dt)
        if ti.static(self.nodes.relaxes):
            self.damp(s, r, dt, v, omega)

    @ti.func
    def shift(self, s, r, t, dt):
        """Update the velocities by dt with the last force and torque, and add the loads' work."""
        before = self.velocity[s, r]
        after = before + dt / self.mass[r] * self.force[s, r]
        self.velocity[s, r] = after
        self.angular_momentum[s, r] = self.angular_momentum[s, r] + dt * self.torque[s, r]
        self.applied_work[s, r] = self.applied_work[s, r] + 0.5 * dt * (
            self.applied_force[s, r].dot(before + after)
        )

    @ti.func
    def damp(self, s, r, dt, v, omega):
        """Apply the local damping of force and torque, as for nodes (Nodes.shift_damped).

        v, omega: velocities before the update, which it opposes.
        """
        share = self.nodes.local_damping[s]
        f_d = share * ti.abs(self.force[s, r]) * ti.math.sign(v)
        T_d = share * ti.abs(self.torque[s, r]) * ti.math.sign(omega)
        after = self.velocity[s, r] - dt / self.mass[r] * f_d
        self.velocity[s, r] = after
        self.angular_momentum[s, r] = self.angular_momentum[s, r] - dt * T_d
        work = dt * (0.5 * f_d.dot(v + after) + T_d.dot(omega))
        self.damping_work[s, r] = self.damping_work[s, r] + work

    # --- what observers ask ----------------------------------------------------------------------

    @ti.func
    def kinetic_energy(self, s, dt):
        """Return the kinetic energy of all bodies [J] at the time of their positions.

        Velocities are taken half an update of dt earlier. Prescribed components do not count: their
        drive does work against forces only.
        """
        energy = ti.cast(0.0, backend.real)
        for r in range(self.count):
            v = self.velocity[s, r] - 0.5 * dt / self.mass[r] * self.force[s, r]
            v *= self.free[r]
            L = self.angular_momentum[s, r] - 0.5 * dt * self.torque[s, r]
            omega = self.turning_speed(r, self.rotation[s, r], L)
            energy += 0.5 * self.mass[r] * v.dot(v) + 0.5 * omega.dot(L)
        return energy

    @ti.func
    def weight_work(self, s):
        """Return the work of all bodies' weight since the start [J]."""
        work = ti.cast(0.0, backend.real)
        for r in range(self.count):
            work += self.mass[r] * self.displacement(s, r).dot(self.nodes.gravity[s])
        return work

    @ti.func
    def damped_energy(self, s):
        """Return the energy dissipated by local damping so far [J]."""
        energy = ti.cast(0.0, backend.real)
        for r in range(self.count):
            energy += self.damping_work[s, r]
        return energy

    @ti.func
    def work_done(self, s, dt):
        """Return the work of the loads on all bodies [J] up to the time of the positions.

        It excludes the second half of the last update of dt.
        """
        work = ti.cast(0.0, backend.real)
        for r in range(self.count):
            v = self.velocity[s, r] - 0.25 * dt / self.mass[r] * self.force[s, r]
            work += self.applied_work[s, r] - 0.5 * dt * self.applied_force[s, r].dot(v)
        return work


@ti.func
def rotation_matrix(q):
    """Return the rotation matrix (3, 3) of a unit quaternion (w, x, y, z)."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return ti.Matrix(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


@ti.func
def turned(q, angle):
    """Return the orientation q rotated in space by the rotation vector `angle` (3) [rad]."""
    half = 0.5 * angle.norm()
    scale = 0.5 - half * half / 12.0  # sin(half) / (2 half); steps turn by little
    if half > 1e-3:
        scale = 0.5 * ti.sin(half) / half
    c, v = ti.cos(half), scale * angle
    x, y, z = v[0], v[1], v[2]
    product = ti.Vector(
        [
            c * q[0] - x * q[1] - y * q[2] - z * q[3],
            c * q[1] + x * q[0] + y * q[3] - z * q[2],
            c * q[2] + y * q[0] + z * q[1] - x * q[3],
            c * q[3] + z * q[0] + x * q[2] - y * q[1],
        ]
    )
    return product / product.norm()


# -------------------------------------------------------------------------------------------------
# Axes of a rigid body, in which its outline is at rest.


class BodyFrame(FixedFrame):
    """Axes of rigid body number `body`, with the origin at its centre of mass."""

    def __init__(self, bodies: RigidBodies, body: int) -> None:
        self.bodies, self.body = bodies, body

    @ti.func
    def local_position(self, s, x):
        """Return a position in the body's axes [m]."""
        return self.bodies.to_body(s, self.body, x - self.bodies.centre[s, self.body])

    @ti.func
    def relative_velocity(self, s, x, v):
        """Return the velocity [m/s] relative to the body's point at x, in the body's axes."""
        return self.bodies.to_body(s, self.body, v - self.bodies.velocity_at(s, self.body, x))

    @ti.func
    def global_vector(self, s, f):
        return self.bodies.to_space(s, self.body, f)


# -------------------------------------------------------------------------------------------------
# Degrees of freedom of the rigid bodies of a scene.


# Of a model of each kind, in the order x, y, z, rotations about x, y, z.
PLANE_FREEDOM = (True, True, False, False, False, True)
AXIAL_FREEDOM = (False, True, False, False, False, False)
SPACE_FREEDOM = (True, True, True, True, True, True)
DIRECTIONS = ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")


def model_freedom(names: Names) -> tuple[bool, ...]:
    """Return the degrees of freedom that a rigid body has in this kind of model."""
    if names.dimension == 3:
        return SPACE_FREEDOM
    return AXIAL_FREEDOM if names.is_axisymmetric else PLANE_FREEDOM


def freedom(names: Names, name: str) -> tuple[bool, ...]:
    """Return True for the degrees of freedom of a rigid body that may move."""
    possible = model_freedom(names)
    asked = names.scene.rigid_bodies[name].free
    if asked is None:
        return possible
    turns = ("rotation_x", "rotation_y", "rotation_z")
    named = [d for word in asked for d in (turns if word == "rotation" else (word,))]
    for k, word in enumerate(asked):
        wanted = turns if word == "rotation" else (word,)
        if not any(possible[DIRECTIONS.index(d)] for d in wanted):
            there = ", ".join(d for d, yes in zip(DIRECTIONS, possible, strict=True) if yes)
            raise names.loaded.error(
                ("rigid_bodies", name, "free", k),
                f"'{name}' cannot move in {word} in this type of model",
                f"directions of a rigid body here: {there}",
            )
    return tuple(d in named and yes for d, yes in zip(DIRECTIONS, possible, strict=True))
