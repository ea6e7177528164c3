"""Nodes of all bodies and the corner forces that force terms write: what every term shares.

A force term never adds to a node directly. It writes the force on each corner of each of its
cells into a slot of its own, and each node then sums its slots in a fixed order: no atomics, the
same bits on every run, and the same text on one core and on a GPU.
"""

import numpy as np
import taichi as ti

from softsim import backend


class CornerForces:
    """Slots of corner forces: (scenarios, rows) lane vectors of x and y components [N].

    Terms claim rows while the model is built; `allocate` then makes the fields and the lists that
    tell each node its slots.
    """

    def __init__(self) -> None:
        self._nodes: list[np.ndarray] = []
        self.rows = 0

    def claim(self, corner_nodes: np.ndarray) -> int:
        """Claim a row for each row of `corner_nodes` (rows, lanes), -1 where a slot is padding.

        Returns the number of the first row.
        """
        first = self.rows
        self._nodes.append(np.asarray(corner_nodes, dtype=np.int32))
        self.rows += len(corner_nodes)
        return first

    def allocate(self, scenarios: int, node_count: int) -> None:
        """Make the fields: x, y, and for node a the slots slot[start[a]] .. slot[start[a + 1]]."""
        lanes = backend.lanes()
        self.lane_bits = lanes.bit_length() - 1
        self.lane_mask = lanes - 1
        self.x = backend.lane_field((scenarios, self.rows))
        self.y = backend.lane_field((scenarios, self.rows))
        owner = np.concatenate(self._nodes).ravel()
        order = np.argsort(owner, kind="stable")
        order = order[owner[order] >= 0]
        start = np.searchsorted(owner[order], np.arange(node_count + 1))
        self.start = index_field(start)
        self.slot = index_field(order)


def index_field(values: np.ndarray) -> ti.ScalarField:
    """An i32 field filled with `values` (at least one entry, so that it can be allocated)."""
    data = np.asarray(values, dtype=np.int32)
    field = ti.field(ti.i32, shape=data.shape if data.size else (1,) * data.ndim)
    if data.size:
        field.from_numpy(np.ascontiguousarray(data))
    return field


def real_field(values: np.ndarray) -> ti.ScalarField:
    """A real field filled with `values` (at least one entry, so that it can be allocated)."""
    data = np.asarray(values, dtype=np.float64)
    field = ti.field(backend.real, shape=data.shape if data.size else (1,) * data.ndim)
    if data.size:
        field.from_numpy(np.ascontiguousarray(data))
    return field


def vector_field(values: np.ndarray) -> ti.MatrixField:
    """A field of plane vectors filled with `values` (..., 2)."""
    data = np.asarray(values, dtype=np.float64)
    shape = data.shape[:-1] if data.size else (1,) * (data.ndim - 1)
    field = ti.Vector.field(2, backend.real, shape=shape)
    if data.size:
        field.from_numpy(np.ascontiguousarray(data))
    return field


@ti.data_oriented
class Nodes:
    """Positions and half-step velocities of all nodes, and the central-difference update.

    Fields, (scenarios, nodes): position [m], velocity [m/s] (half a step behind `position` while
    forces are computed), force [N] (the last one summed). mass [kg] (nodes). inverse_mass is zero
    for nodes that do not follow their own force: fixed ones and those tied to a rigid body.
    """

    def __init__(
        self,
        position: np.ndarray,
        velocity: np.ndarray,
        mass: np.ndarray,
        is_free: np.ndarray,
        gravity: np.ndarray,
    ) -> None:
        self.scenarios, self.count = position.shape[:2]
        self.position = vector_field(position)
        self.velocity = vector_field(velocity)
        self.force = vector_field(np.zeros_like(position))
        self.mass = real_field(mass)
        self.inverse_mass = real_field(np.where(is_free, 1.0 / np.where(is_free, mass, 1.0), 0.0))
        self.gravity = vector_field(gravity)
        self.rest = vector_field(position[0])
        self.corner_forces = CornerForces()

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        return {
            "position": self.position,
            "velocity": self.velocity,
            "force": self.force,
            "corner_forces_x": self.corner_forces.x,
            "corner_forces_y": self.corner_forces.y,
        }

    @ti.func
    def drift(self, s, a, t, dt):
        """x(n+1) = x(n) + dt v(n+1/2)."""
        self.position[s, a] = self.position[s, a] + dt * self.velocity[s, a]

    @ti.func
    def kick(self, s, a, t, dt):
        """v(n+3/2) = v(n+1/2) + dt (f / m + g), with f the sum of the node's corner forces."""
        bits = ti.static(self.corner_forces.lane_bits)
        mask = ti.static(self.corner_forces.lane_mask)
        fx = ti.cast(0.0, backend.real)
        fy = ti.cast(0.0, backend.real)
        for k in range(self.corner_forces.start[a], self.corner_forces.start[a + 1]):
            slot = self.corner_forces.slot[k]
            fx += self.corner_forces.x[s, slot >> bits][slot & mask]
            fy += self.corner_forces.y[s, slot >> bits][slot & mask]
        f = ti.Vector([fx, fy])
        self.force[s, a] = f
        inverse_mass = self.inverse_mass[a]
        if inverse_mass > 0.0:
            self.velocity[s, a] = self.velocity[s, a] + dt * (f * inverse_mass + self.gravity[s])

    @ti.func
    def shift(self, s, a, t, dt):
        """v += dt (f / m + g) with the last force."""
        inverse_mass = self.inverse_mass[a]
        if inverse_mass > 0.0:
            acceleration = inverse_mass * self.force[s, a] + self.gravity[s]
            self.velocity[s, a] = self.velocity[s, a] + dt * acceleration

    @ti.func
    def kinetic_energy(self, s, dt):
        """Of the free nodes [J], at the time of their positions: v less half a kick of dt."""
        energy = ti.cast(0.0, backend.real)
        for a in range(self.count):
            inverse_mass = self.inverse_mass[a]
            if inverse_mass > 0.0:
                acceleration = inverse_mass * self.force[s, a] + self.gravity[s]
                v = self.velocity[s, a] - 0.5 * dt * acceleration
                energy += 0.5 * self.mass[a] * v.dot(v)
        return energy

    @ti.func
    def weight_work(self, s):
        """Work of the free nodes' weight since the start [J]."""
        moved = ti.Vector([0.0, 0.0])
        for a in range(self.count):
            if self.inverse_mass[a] > 0.0:
                moved += self.mass[a] * (self.position[s, a] - self.rest[a])
        return moved.dot(self.gravity[s])

    @ti.func
    def mass_moment(self, s):
        """Sum of m x of all nodes [kg m]."""
        moment = ti.cast(0.0, backend.real)
        for a in range(self.count):
            moment += self.mass[a] * self.position[s, a][0]
        return moment
