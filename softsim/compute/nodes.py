"""Nodes of all bodies, and the element nodal forces that force terms write.

A force term never adds to a node directly. It writes the force on each corner of each of its
cells to its own slot, and each node then sums its slots in a fixed order: there are no atomics,
results are the same to the bit on every run, and one source serves a CPU core and a GPU.
"""

from collections.abc import Callable

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import Number, index_field, real_field, rounded, vector_field

# A sum over many entries of one thing (a chamber's volume, the force on a rigid body) is made of so
# many parts, which workers or a GPU's threads sum side by side, in the same order whoever does it.
PARTS = 64


def parts_of(counts: list[int]) -> np.ndarray:
    """Return the starts of PARTS parts of each of several groups of entries.

    The last entry is the end of the last part.

    counts: entries of each group, one after another; the result is (PARTS len(counts) + 1,).
    """
    first = np.cumsum([0, *counts])
    starts = [a + n * np.arange(PARTS) // PARTS for a, n in zip(first[:-1], counts, strict=True)]
    return np.concatenate([*starts, first[-1:]])


class CornerForces:
    """Slots of corner forces: per component a field (scenarios, slots) [N].

    Component by component, because LLVM vectorises the elements' arithmetic back from stores of
    neighbouring lanes into neighbouring slots: with vectors in the slots it does not at all. Terms
    reserve slots while the model is built; `allocate` then creates the fields and the lists of
    slots of each node.
    """

    def __init__(self, dimension: int) -> None:
        self.dimension = dimension
        self._owners: list[np.ndarray] = []
        self.count = 0

    def reserve(self, owners: np.ndarray) -> int:
        """Reserve a slot for each entry of `owners`: the node it acts on, -1 for none.

        Returns the number of the first slot; the slots are in the order of the entries. It is a
        constant in kernels, as LLVM vectorises nothing else, and must not depend on the mesh, so
        the number of slots is rounded up.
        """
        first, spare = self.count, rounded(owners.size) - owners.size
        self._owners.append(np.pad(owners.ravel(), (0, spare), constant_values=-1))
        self.count = first + rounded(owners.size)
        return first

    def allocate(self, scenarios: int, node_count: int) -> None:
        """Create the fields, and the lists of slots of each node."""
        pad_entry = self.reserve(np.array([-1]))
        zeros = np.zeros((scenarios, self.count))
        self.component = [real_field(zeros) for _ in range(self.dimension)]
        owner = np.concatenate(self._owners)
        self.of_node = NodeLists(owner, np.arange(len(owner)), node_count, pad_entry)

    @ti.func
    def total(self, s, b):
        """Return the sum of the forces (d, lanes) in the slots of each node of block b."""
        force = ti.Matrix.zero(backend.real, self.dimension, ti.static(backend.lanes()))
        for row in range(self.of_node.start[b], self.of_node.start[b + 1]):
            for lane in ti.static(range(backend.lanes())):
                slot = self.of_node.entry[row, lane]
                for k in ti.static(range(self.dimension)):
                    force[k, lane] += self.component[k][s, slot]
        return force

    @ti.func
    def read(self, s, slot):
        """Return the force in a slot."""
        force = ti.Vector.zero(backend.real, self.dimension)
        for k in ti.static(range(self.dimension)):
            force[k] = self.component[k][s, slot]
        return force

    @ti.func
    def on_node(self, s, b, lane):
        """Return the sum of the forces in the slots of the node at block b and lane (NodeLists)."""
        force = ti.Vector.zero(backend.real, self.dimension)
        for row in range(self.of_node.start[b], self.of_node.start[b + 1]):
            force += self.read(s, self.of_node.entry[row, lane])
        return force

    @ti.func
    def write(self, s, slot, force):
        """Write a force to a slot."""
        for k in ti.static(range(self.dimension)):
            self.component[k][s, slot] = force[k]


class NodeLists:
    """Lists of the entries of each node, in blocks of `lanes` nodes.

    The nodes of a block sum their entries in lock step, padded by the entry `pad_entry`. To limit
    padding, nodes are sorted by their number of entries within windows of `WINDOW` neighbours; a
    loop of a different length for each node would cost a branch misprediction per node.

    Block b has the nodes node[b, lane], -1 in spare lanes at the end; its rows of entry[row, lane]
    are start[b] .. start[b + 1].
    """

    WINDOW = 64  # longer ones pad less but read farther apart: 256 is 1 % slower

    def __init__(
        self, owner: np.ndarray, entry: np.ndarray, node_count: int, pad_entry: int
    ) -> None:
        """Assign entry[k] to node owner[k] (-1: none); `pad_entry`: one with the value zero."""
        lanes, self.lane = backend.lanes(), backend.lane_vector()
        order = np.argsort(owner, kind="stable")
        first = np.searchsorted(owner[order], np.arange(node_count))
        degree = np.bincount(owner[owner >= 0], minlength=node_count)
        blocks = backend.lane_blocks(node_count)
        self.blocks = Number(blocks)
        listed_nodes = np.full(blocks * lanes, -1)
        listed_nodes[:node_count] = np.lexsort((degree, np.arange(node_count) // self.WINDOW))
        self.member = member = listed_nodes.reshape(-1, lanes)
        entries = np.where(member >= 0, degree[member], 0)
        rows = entries.max(axis=1)
        start = np.concatenate([[0], np.cumsum(rows)])
        block = np.repeat(np.arange(blocks), rows)
        step = (np.arange(start[-1]) - start[block])[:, None]
        listed = step < entries[block]
        place = np.where(listed, first[member[block]] + step, 0)
        self.node = index_field(member)
        self.start = index_field(start)
        self.entry = index_field(np.where(listed, entry[order[place]], pad_entry))

    @ti.func
    def sum(self, values: ti.template(), s, b):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return the sum of values[s, entry] over the entries of each node of block b."""
        total = self.lane(0.0)
        for row in range(self.start[b], self.start[b + 1]):
            part = self.lane(0.0)
            for lane in ti.static(range(backend.lanes())):
                part[lane] = values[s, self.entry[row, lane]]
            total += part
        return total

    def place_of(self, nodes: np.ndarray) -> np.ndarray:
        """Return block and lane (k, 2) of each of these nodes (k,)."""
        listed = self.member.ravel()
        found = np.empty(listed.max() + 1, dtype=int)
        found[listed[listed >= 0]] = np.flatnonzero(listed >= 0)
        return np.stack(np.divmod(found[nodes], self.member.shape[1]), axis=1)

    def by_block(self, values: np.ndarray) -> np.ndarray:
        """Return nodal values (n,) in the order of the blocks, zero in spare lanes."""
        return np.where(self.member >= 0, values[self.member], 0.0).ravel()


def by_lane(corners: np.ndarray) -> np.ndarray:
    """Return corner lists (cells, corners) of whole lane vectors as (blocks, corners, lanes)."""
    lanes = backend.lanes()
    return np.ascontiguousarray(
        corners.reshape(-1, lanes, corners.shape[1]).transpose(0, 2, 1), dtype=np.int32
    )


class Nodes:
    """Positions and half-step velocities of all nodes, and the central-difference update.

    Parameters
    ----------
    position, velocity: (scenarios, nodes, d). mass: (nodes,) [kg].
    is_free: (nodes, d), True for components that follow their own force, that is neither fixed,
        prescribed nor tied to a rigid body.
    gravity: (scenarios, d) [m/s^2], current value: loads/nodal.py may change it.
    local_damping: current fraction of the unbalanced force that resists the motion, see
        `resistance` (scenarios,) [-]. relaxes: True if there is ever any.

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
        local_damping: np.ndarray,
        relaxes: bool,
    ) -> None:
        self.scenarios, count, self.dimension = position.shape
        self.count = Number(count)
        self.relaxes = relaxes
        self.local_damping = real_field(local_damping)
        self.position = vector_field(position)
        self.velocity = vector_field(velocity)
        self.force = vector_field(np.zeros_like(position))
        self.lumped_mass = mass
        self.mass = real_field(mass)
        movable = np.where(mass > 0.0, mass, 1.0)[:, None]
        self.inverse_mass = vector_field(np.where(is_free, 1.0 / movable, 0.0))
        self.gravity = vector_field(gravity)
        self.rest = vector_field(position[0])
        self.damping_work = real_field(np.zeros((self.scenarios, count)))
        self.corner_forces = CornerForces(self.dimension)

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        kept = {
            "position": self.position,
            "velocity": self.velocity,
            "force": self.force,
            "damping_work": self.damping_work,
        }
        for name, component in zip("xyz", self.corner_forces.component, strict=False):
            kept[f"corner_forces_{name}"] = component
        return kept

    def kicks(self) -> list[tuple[int, Callable[..., None]]]:
        """Return the functions (s, i, t, dt) of a kick in order, with their numbers of indices."""
        return [(int(self.corner_forces.of_node.blocks), self.kick)]

    @ti.func
    def drift(self, s, a, t, dt):
        """Update x(n+1) = x(n) + dt v(n+1/2)."""
        self.position[s, a] = self.position[s, a] + dt * self.velocity[s, a]

    @ti.func
    def kick(self, s, b, t, dt):
        """Update v(n+3/2) = v(n+1/2) + dt (f / m + g) of the nodes of a block.

        f is the sum of each node's slots.
        """
        force = self.corner_forces.total(s, b)
        for lane in range(ti.static(backend.lanes())):  # unrolled it is traced eight times
            a = self.corner_forces.of_node.node[b, lane]
            if a >= 0:
                for k in ti.static(range(self.dimension)):
                    self.force[s, a][k] = force[k, lane]
                self.take_force(s, a, t, dt)

    @ti.func
    def take_force(self, s, a, t, dt):
        """Process the complete force on node `a`; forces on other nodes may still be pending."""
        self.accelerate(s, a, t, dt)

    @ti.func
    def accelerate(self, s, a, t, dt):
        """Update v += dt (f / m + g) with the last force, and with local damping if any."""
        if ti.static(self.relaxes):
            self.shift_damped(s, a, dt)
        else:
            self.shift(s, a, t, dt)

    @ti.func
    def nodal_acceleration(self, s, a):
        """Return f / m + g [m/s^2] of the last force and nodal mass, zero in fixed components."""
        return self.inverse_mass[a] * (self.force[s, a] + self.mass[a] * self.gravity[s])

    @ti.func
    def acceleration(self, s, a):
        """Return the acceleration by the last force without local damping [m/s^2]."""
        return self.nodal_acceleration(s, a)

    @ti.func
    def shift(self, s, a, t, dt):
        """Update v += dt times the acceleration by the last force."""
        self.velocity[s, a] = self.velocity[s, a] + dt * self.acceleration(s, a)

    @ti.func
    def resistance(self, s, acceleration, velocity):
        """Return the deceleration by local damping, a fraction of the unbalanced force [m/s^2].

        Dynamic relaxation by local damping (Cundall 1987, in Analytical and Computational Methods
        in Engineering Rock Mechanics, ch. 4): f_d = -share |f| sign(v), component by component. It
        damps every mode by about share / pi of critical and leaves balanced motion alone.
        """
        return ti.abs(acceleration) * ti.math.sign(velocity) * self.local_damping[s]

    @ti.func
    def damping(self, s, a):
        """Return the local damping force of a node over its mass [m/s^2]."""
        return self.resistance(s, self.nodal_acceleration(s, a), self.velocity[s, a])

    @ti.func
    def shift_damped(self, s, a, dt):
        """Update v as `shift` with local damping, and add its work to the energy balance."""
        before, damping = self.velocity[s, a], self.damping(s, a)
        after = before + dt * (self.acceleration(s, a) - damping)
        self.velocity[s, a] = after
        self.damping_work[s, a] = self.damping_work[s, a] + 0.5 * dt * self.mass[a] * damping.dot(
            before + after
        )

    @ti.func
    def present_velocity(self, s, a, dt):
        """Return the velocity at the time of the positions: half a kick of dt less."""
        return self.velocity[s, a] - 0.5 * dt * self.acceleration(s, a)

    @ti.func
    def kinetic_energy(self, s, dt, part):
        """Return the kinetic energy of the free components [J] at the time of their positions."""
        energy = ti.cast(0.0, backend.real)
        for a in range(self.count.first(part), self.count.first(part + 1)):
            v = self.present_velocity(s, a, dt)
            for i in ti.static(range(self.dimension)):
                if self.inverse_mass[a][i] > 0.0:
                    energy += 0.5 * self.mass[a] * v[i] * v[i]
        return energy + self.added_kinetic_energy(s, dt, part)

    @ti.func
    def added_kinetic_energy(self, s, dt, part):
        """Return the kinetic energy [J] of inertia in addition to the nodal masses."""
        return ti.cast(0.0, backend.real)

    @ti.func
    def weight_work(self, s, part):
        """Return the work of the free components' weight since the start [J]."""
        work = ti.cast(0.0, backend.real)
        for a in range(self.count.first(part), self.count.first(part + 1)):
            moved = self.position[s, a] - self.rest[a]
            for i in ti.static(range(self.dimension)):
                if self.inverse_mass[a][i] > 0.0:
                    work += self.mass[a] * moved[i] * self.gravity[s][i]
        return work

    @ti.func
    def damped_energy(self, s, part):
        """Return the energy dissipated by local damping so far [J]."""
        energy = ti.cast(0.0, backend.real)
        for a in range(self.count.first(part), self.count.first(part + 1)):
            energy += self.damping_work[s, a]
        return energy
