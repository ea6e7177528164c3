"""Rigid bodies in the plane: mass, inertia, three degrees of freedom, nodes tied to them.

Newton and Euler in the plane, M dv/dt = F, I domega/dt = T about the centre of mass, by the same
central difference as the nodes. The lumped mass of tied nodes counts as mass of the body, so
momentum is kept to round-off between the skin and its frame.
"""

import numpy as np
import taichi as ti

from softsim import backend
from softsim.nodes import Nodes, index_field, real_field, vector_field
from softsim.rigid.body import RigidBodyData


@ti.data_oriented
class RigidBodies:
    """All rigid bodies of a model.

    Fields, (scenarios, bodies): centre [m], angle [rad], velocity [m/s] and angular_velocity
    [rad/s] (half a step behind), force [N] and torque [N m] (the last ones summed),
    applied_force, applied_torque (what loads put on the body this increment), applied_work [J].
    """

    def __init__(self, nodes: Nodes, bodies: list[RigidBodyData], points: np.ndarray) -> None:
        self.nodes, self.bodies, self.count = nodes, bodies, len(bodies)
        scenarios = nodes.scenarios
        node_mass = nodes.mass.to_numpy()
        combined = [b.with_tied_mass(points, node_mass) for b in bodies]
        self.rest_centre = np.array([c for _, c, _ in combined]).reshape(-1, 2)
        every = np.broadcast_to
        self.rest = vector_field(self.rest_centre)
        self.mass = real_field(np.array([m for m, _, _ in combined]))
        self.inertia = real_field(np.array([i for _, _, i in combined]))
        self.free = real_field(np.array([b.free for b in bodies], dtype=float).reshape(-1, 3))
        shape = (scenarios, self.count)
        self.centre = vector_field(every(self.rest_centre, (*shape, 2)))
        self.angle = real_field(np.zeros(shape))
        velocities = np.array(
            [
                b.velocity + b.angular_velocity * perpendicular(c - b.centre)
                for b, c in zip(bodies, self.rest_centre, strict=True)
            ]
        ).reshape(-1, 2)
        self.velocity = vector_field(every(velocities, (*shape, 2)))
        self.angular_velocity = real_field(
            every(np.array([b.angular_velocity for b in bodies]), shape)
        )
        zeros = np.zeros((*shape, 2))
        self.force, self.torque = vector_field(zeros), real_field(np.zeros(shape))
        self.applied_force, self.applied_torque = vector_field(zeros), real_field(np.zeros(shape))
        self.applied_work = real_field(np.zeros(shape))

        tied = [b.tied for b in bodies]
        self.tied_start = index_field(np.cumsum([0, *map(len, tied)]))
        self.tied = index_field(np.concatenate([*tied, np.zeros(0, int)]))
        arms = [points[t] - c for t, c in zip(tied, self.rest_centre, strict=True)]
        self.arm = vector_field(np.concatenate([*arms, np.zeros((0, 2))]))
        self._reactions: list[list[tuple[np.ndarray, np.ndarray]]] = [[] for _ in bodies]

    def react(self, body: int, slots: np.ndarray, slot_nodes: np.ndarray) -> None:
        """Let `body` feel the opposite of the forces in `slots`, which act at `slot_nodes`."""
        self._reactions[body].append((slots, slot_nodes))

    def allocate(self) -> None:
        """Make the lists of reaction slots, once every term has claimed its rows."""
        none = np.zeros(0, int)
        slots = [np.concatenate([none, *(s for s, _ in r)]) for r in self._reactions]
        at = [np.concatenate([none, *(n for _, n in r)]) for r in self._reactions]
        self.reaction_start = index_field(np.cumsum([0, *map(len, slots)]))
        self.reaction_slot = index_field(np.concatenate([none, *slots]))
        self.reaction_node = index_field(np.concatenate([none, *at]))

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        return {
            "centre": self.centre,
            "angle": self.angle,
            "velocity": self.velocity,
            "angular_velocity": self.angular_velocity,
            "force": self.force,
            "torque": self.torque,
            "applied_force": self.applied_force,
            "applied_torque": self.applied_torque,
            "applied_work": self.applied_work,
        }

    @ti.func
    def to_space(self, s, r, q):
        """A vector of the body's axes, in space."""
        c = ti.cos(self.angle[s, r])
        d = ti.sin(self.angle[s, r])
        return ti.Vector([c * q[0] - d * q[1], d * q[0] + c * q[1]])

    @ti.func
    def to_body(self, s, r, x):
        """A vector in space, in the body's axes."""
        c = ti.cos(self.angle[s, r])
        d = ti.sin(self.angle[s, r])
        return ti.Vector([c * x[0] + d * x[1], -d * x[0] + c * x[1]])

    @ti.func
    def velocity_at(self, s, r, x):
        """Velocity of the body's material point now at x [m/s]."""
        arm = x - self.centre[s, r]
        omega = self.angular_velocity[s, r]
        return self.velocity[s, r] + ti.Vector([-omega * arm[1], omega * arm[0]])

    @ti.func
    def drift(self, s, r, t, dt):
        """Move the body by dt and place its tied nodes; forget the last applied forces."""
        self.centre[s, r] = self.centre[s, r] + dt * self.velocity[s, r]
        self.angle[s, r] = self.angle[s, r] + dt * self.angular_velocity[s, r]
        self.applied_force[s, r] = ti.Vector([0.0, 0.0])
        self.applied_torque[s, r] = 0.0
        for k in range(self.tied_start[r], self.tied_start[r + 1]):
            a = self.tied[k]
            x = self.centre[s, r] + self.to_space(s, r, self.arm[k])
            self.nodes.position[s, a] = x
            self.nodes.velocity[s, a] = self.velocity_at(s, r, x)

    @ti.func
    def apply(self, s, r, force):
        """A load at the centre of mass [N]."""
        self.applied_force[s, r] = self.applied_force[s, r] + force

    @ti.func
    def kick(self, s, r, t, dt):
        """New velocities from the forces on tied nodes, the reactions, loads and gravity."""
        bits = ti.static(self.nodes.corner_forces.lane_bits)
        mask = ti.static(self.nodes.corner_forces.lane_mask)
        centre = self.centre[s, r]
        force = self.applied_force[s, r]
        torque = self.applied_torque[s, r]
        for k in range(self.tied_start[r], self.tied_start[r + 1]):
            f = self.nodes.force[s, self.tied[k]]
            arm = self.nodes.position[s, self.tied[k]] - centre
            force += f
            torque += arm[0] * f[1] - arm[1] * f[0]
        for k in range(self.reaction_start[r], self.reaction_start[r + 1]):
            slot = self.reaction_slot[k]
            fx = -self.nodes.corner_forces.x[s, slot >> bits][slot & mask]
            fy = -self.nodes.corner_forces.y[s, slot >> bits][slot & mask]
            arm = self.nodes.position[s, self.reaction_node[k]] - centre
            force += ti.Vector([fx, fy])
            torque += arm[0] * fy - arm[1] * fx
        force += self.mass[r] * self.nodes.gravity[s]
        force = ti.Vector([force[0] * self.free[r, 0], force[1] * self.free[r, 1]])
        torque *= self.free[r, 2]
        self.force[s, r] = force
        self.torque[s, r] = torque
        self.shift(s, r, t, dt)

    @ti.func
    def shift(self, s, r, t, dt):
        """Move the velocities by dt with the last force and torque, and book the loads' work."""
        before, omega = self.velocity[s, r], self.angular_velocity[s, r]
        after = before + dt / self.mass[r] * self.force[s, r]
        omega_after = omega + dt / self.inertia[r] * self.torque[s, r]
        self.velocity[s, r] = after
        self.angular_velocity[s, r] = omega_after
        self.applied_work[s, r] = self.applied_work[s, r] + 0.5 * dt * (
            self.applied_force[s, r].dot(before + after)
            + self.applied_torque[s, r] * (omega + omega_after)
        )

    @ti.func
    def kinetic_energy(self, s, dt):
        """Of all bodies [J], at the time of their positions: velocities less half a kick of dt."""
        energy = ti.cast(0.0, backend.real)
        for r in range(self.count):
            v = self.velocity[s, r] - 0.5 * dt / self.mass[r] * self.force[s, r]
            omega = self.angular_velocity[s, r] - 0.5 * dt / self.inertia[r] * self.torque[s, r]
            energy += 0.5 * self.mass[r] * v.dot(v) + 0.5 * self.inertia[r] * omega * omega
        return energy

    @ti.func
    def weight_work(self, s):
        """Work of all bodies' weight since the start [J]."""
        work = ti.cast(0.0, backend.real)
        for r in range(self.count):
            shift = self.centre[s, r] - self.rest[r]
            work += self.mass[r] * shift.dot(self.nodes.gravity[s])
        return work

    @ti.func
    def work_done(self, s, dt):
        """Work of the loads on all bodies [J] up to the time of the positions: without the second
        half of the last kick of dt.
        """
        work = ti.cast(0.0, backend.real)
        for r in range(self.count):
            v = self.velocity[s, r] - 0.25 * dt / self.mass[r] * self.force[s, r]
            omega = self.angular_velocity[s, r] - 0.25 * dt / self.inertia[r] * self.torque[s, r]
            ahead = self.applied_force[s, r].dot(v) + self.applied_torque[s, r] * omega
            work += self.applied_work[s, r] - 0.5 * dt * ahead
        return work


def perpendicular(arm: np.ndarray) -> np.ndarray:
    """The vector turned by a right angle, so that omega * perpendicular(arm) is a velocity."""
    return np.array([-arm[1], arm[0]])
