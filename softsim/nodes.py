"""Nodes of all bodies and the corner forces that force terms write: what every term shares.

A force term never adds to a node directly. It writes the force on each corner of each of its
cells into a slot of its own, and each node then sums its slots in a fixed order: no atomics, the
same bits on every run, and the same text on one core and on a GPU.
"""

import numpy as np
import taichi as ti

from softsim import backend
from softsim.fields import index_field, lane_field, real_field, vector_field


@ti.data_oriented
class CornerForces:
    """Slots of corner forces: per component a field (scenarios, rows) of lane vectors [N].

    Terms claim rows while the model is built; `allocate` then makes the fields and the lists that
    tell each node its slots.
    """

    def __init__(self, dimension: int) -> None:
        self.dimension = dimension
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

    def claim_corners(self, corner_nodes: np.ndarray) -> int:
        """Claim slots for the corners (k, c) of k facets: `lanes` facets share a block of c rows.

        Corner c of facet i is lane i % lanes of row first + c_count (i // lanes) + c.
        """
        lanes, (count, corners) = backend.lanes(), corner_nodes.shape
        padded = np.full((backend.lane_blocks(count) * lanes, corners), -1)
        padded[:count] = corner_nodes
        return self.claim(by_lane(padded, lanes).reshape(-1, lanes))

    def owners(self, first_row: int) -> np.ndarray:
        """Node of each slot from `first_row` on, -1 where it is padding."""
        return np.concatenate(self._nodes).ravel()[first_row * backend.lanes() :]

    def allocate(self, scenarios: int, node_count: int) -> None:
        """Make the fields; node a has the slots slot[start[a]] .. slot[start[a + 1]]."""
        lanes = backend.lanes()
        self.lane_bits = lanes.bit_length() - 1
        self.lane_mask = lanes - 1
        self.component = [lane_field((scenarios, self.rows)) for _ in range(self.dimension)]
        owner = np.concatenate(self._nodes).ravel()
        order = np.argsort(owner, kind="stable")
        order = order[owner[order] >= 0]
        start = np.searchsorted(owner[order], np.arange(node_count + 1))
        self.start = index_field(start)
        self.slot = index_field(order)

    @ti.func
    def read(self, s, first_row, corners: ti.template(), i, corner):  # type: ignore[valid-type]  # Taichi wants an instance
        """Force in the slot of corner `corner` of facet i, see `claim_corners`."""
        row = first_row + corners * (i >> ti.static(self.lane_bits)) + corner
        force = ti.Vector.zero(backend.real, self.dimension)
        for k in ti.static(range(self.dimension)):
            force[k] = self.component[k][s, row][i & ti.static(self.lane_mask)]
        return force

    @ti.func
    def write(self, s, first_row, corners: ti.template(), i, corner, force):  # type: ignore[valid-type]  # Taichi wants an instance
        """Put `force` into the slot of corner `corner` of facet i."""
        row = first_row + corners * (i >> ti.static(self.lane_bits)) + corner
        for k in ti.static(range(self.dimension)):
            self.component[k][s, row][i & ti.static(self.lane_mask)] = force[k]

    @ti.func
    def slot_force(self, s, slot):
        """Force in slot number `slot`."""
        force = ti.Vector.zero(backend.real, self.dimension)
        for k in ti.static(range(self.dimension)):
            force[k] = self.component[k][s, slot >> ti.static(self.lane_bits)][
                slot & ti.static(self.lane_mask)
            ]
        return force

    @ti.func
    def total(self, s, a):
        """Sum of the forces in node a's slots."""
        force = ti.Vector.zero(backend.real, self.dimension)
        for k in range(self.start[a], self.start[a + 1]):
            force += self.slot_force(s, self.slot[k])
        return force


def by_lane(corners: np.ndarray, lanes: int) -> np.ndarray:
    """Corner lists (cells, corners) in the order of the lane fields: (blocks, corners, lanes)."""
    return np.ascontiguousarray(
        corners.reshape(-1, lanes, corners.shape[1]).transpose(0, 2, 1), dtype=np.int32
    )


@ti.data_oriented
class Nodes:
    """Positions and half-step velocities of all nodes, and the central-difference update.

    Parameters
    ----------
    position, velocity: (scenarios, nodes, d). mass: (nodes,) [kg].
    is_free: (nodes, d), whether a component follows its own force: not where it is fixed,
        prescribed or tied to a rigid body.
    gravity: (scenarios, d) [m/s^2].
    local_damping: share of the unbalanced force that resists the motion, see `shift_damped`.

    Fields, (scenarios, nodes): position [m], velocity [m/s] (half a step behind `position` while
    forces are computed), force [N] (the last one summed), damping_work [J].
    """

    def __init__(
        self,
        position: np.ndarray,
        velocity: np.ndarray,
        mass: np.ndarray,
        is_free: np.ndarray,
        gravity: np.ndarray,
        local_damping: float,
    ) -> None:
        self.scenarios, self.count, self.dimension = position.shape
        self.local_damping = local_damping
        self.position = vector_field(position)
        self.velocity = vector_field(velocity)
        self.force = vector_field(np.zeros_like(position))
        self.lumped_mass = mass
        self.mass = real_field(mass)
        movable = np.where(mass > 0.0, mass, 1.0)[:, None]
        self.inverse_mass = vector_field(np.where(is_free, 1.0 / movable, 0.0))
        self.gravity = vector_field(gravity)
        self.rest = vector_field(position[0])
        self.damping_work = real_field(np.zeros((self.scenarios, self.count)))
        self.corner_forces = CornerForces(self.dimension)

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        fields = {
            "position": self.position,
            "velocity": self.velocity,
            "force": self.force,
            "damping_work": self.damping_work,
        }
        for name, component in zip("xyz", self.corner_forces.component, strict=False):
            fields[f"corner_forces_{name}"] = component
        return fields

    @ti.func
    def drift(self, s, a, t, dt):
        """x(n+1) = x(n) + dt v(n+1/2)."""
        self.position[s, a] = self.position[s, a] + dt * self.velocity[s, a]

    @ti.func
    def kick(self, s, a, t, dt):
        """v(n+3/2) = v(n+1/2) + dt (f / m + g), with f the sum of the node's corner forces."""
        self.force[s, a] = self.corner_forces.total(s, a)
        if ti.static(self.local_damping > 0.0):
            self.shift_damped(s, a, dt)
        else:
            self.shift(s, a, t, dt)

    @ti.func
    def acceleration(self, s, a):
        """f / m + g of the last force, zero in components that are not free [m/s^2]."""
        return self.inverse_mass[a] * (self.force[s, a] + self.mass[a] * self.gravity[s])

    @ti.func
    def shift(self, s, a, t, dt):
        """v += dt (f / m + g) with the last force."""
        self.velocity[s, a] = self.velocity[s, a] + dt * self.acceleration(s, a)

    @ti.func
    def shift_damped(self, s, a, dt):
        """As `shift`, against a damping force: the share of the unbalanced force that resists.

        Dynamic relaxation by local damping (Cundall 1987, in Analytical and Computational Methods
        in Engineering Rock Mechanics, ch. 4): f_d = -share |f| sign(v), component by component. It
        damps every mode by about share / pi of critical and leaves balanced motion alone.
        """
        before = self.velocity[s, a]
        free = self.acceleration(s, a)
        damping = ti.abs(free) * ti.math.sign(before) * self.local_damping
        after = before + dt * (free - damping)
        self.velocity[s, a] = after
        self.damping_work[s, a] = self.damping_work[s, a] + 0.5 * dt * self.mass[a] * damping.dot(
            before + after
        )

    @ti.func
    def kinetic_energy(self, s, dt):
        """Of the free components [J], at the time of their positions: v less half a kick of dt."""
        energy = ti.cast(0.0, backend.real)
        for a in range(self.count):
            v = self.velocity[s, a] - 0.5 * dt * self.acceleration(s, a)
            for i in ti.static(range(self.dimension)):
                if self.inverse_mass[a][i] > 0.0:
                    energy += 0.5 * self.mass[a] * v[i] * v[i]
        return energy

    @ti.func
    def weight_work(self, s):
        """Work of the free components' weight since the start [J]."""
        work = ti.cast(0.0, backend.real)
        for a in range(self.count):
            moved = self.position[s, a] - self.rest[a]
            for i in ti.static(range(self.dimension)):
                if self.inverse_mass[a][i] > 0.0:
                    work += self.mass[a] * moved[i] * self.gravity[s][i]
        return work

    @ti.func
    def damped_energy(self, s):
        """Taken out by local damping so far [J]."""
        energy = ti.cast(0.0, backend.real)
        for a in range(self.count):
            energy += self.damping_work[s, a]
        return energy

    @ti.func
    def mass_moment(self, s):
        """Sum of m x of all nodes [kg m]."""
        moment = ti.Vector.zero(backend.real, self.dimension)
        for a in range(self.count):
            moment += self.mass[a] * self.position[s, a]
        return moment
