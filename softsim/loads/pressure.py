"""Follower pressure on facets, and its reaction on the rigid body that closes the chamber.

The force on a facet from a to b (material to the left) is p h times the facet turned inwards,
(-dy, dx), half on each end: the gradient of p times the enclosed volume, so the load follows the
deformation and does not depend on the time step. On a closed chamber force and moment add up to
nothing; the body that closes it feels the opposite of what the facets feel.
"""

from typing import Any

import numpy as np
import taichi as ti

from softsim import backend
from softsim.loads.profile import Profile
from softsim.nodes import Nodes, index_field, real_field

OPEN = -1


@ti.data_oriented
class FollowerPressure:
    """Pressure on facets (k, 2).

    profiles: pressure on the facets [Pa over s], one a scenario. body: number of the rigid body
    that closes the chamber, or `OPEN`. thickness: of the plane model [m].
    """

    def __init__(
        self,
        nodes: Nodes,
        rigid_bodies: Any,
        facets: np.ndarray,
        thickness: float,
        profiles: list[Profile],
        body: int = OPEN,
    ) -> None:
        scenarios, lanes = nodes.scenarios, backend.lanes()
        self.nodes, self.rigid_bodies, self.body = nodes, rigid_bodies, body
        self.count = len(facets)
        self.facet = index_field(facets)
        self.thickness = real_field(np.array([thickness]))
        longest = max(len(p.times) for p in profiles)
        self.points = index_field(np.array([len(p.times) for p in profiles]))
        self.time = real_field(np.array([padded(p.times, longest) for p in profiles]))
        self.value = real_field(np.array([padded(p.values, longest) for p in profiles]))
        self.pressure = ti.field(backend.real, shape=scenarios)
        self.work = ti.field(backend.real, shape=(scenarios, self.count))

        # Facet i has its ends in rows 2 (i / lanes) and 2 (i / lanes) + 1.
        blocks = backend.lane_blocks(self.count)
        owner = np.full((blocks * lanes, 2), -1)
        owner[: self.count] = facets
        owner = owner.reshape(blocks, lanes, 2).transpose(0, 2, 1).reshape(-1, lanes)
        self.first_row = nodes.corner_forces.claim(owner)
        if body != OPEN:
            slots = self.first_row * lanes + np.flatnonzero(owner.ravel() >= 0)
            rigid_bodies.react(body, slots, owner.ravel()[owner.ravel() >= 0])

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        return {"work": self.work}

    @ti.func
    def work_done(self, s):
        """Work so far [J]."""
        total = ti.cast(0.0, backend.real)
        for i in range(self.count):
            total += self.work[s, i]
        return total

    @ti.func
    def follow_profile(self, s, i, t, dt):
        """Pressure now, by bisection in the profile's table."""
        low = 0
        high = self.points[s] - 1
        while high - low > 1:
            middle = (low + high) // 2
            if self.time[s, middle] <= t:
                low = middle
            else:
                high = middle
        value = self.value[s, high]
        if t < self.time[s, high] and high > low:
            share = ti.max(0.0, (t - self.time[s, low]) / (self.time[s, high] - self.time[s, low]))
            value = self.value[s, low] + share * (self.value[s, high] - self.value[s, low])
        self.pressure[s] = value

    @ti.func
    def push_facets(self, s, i, t, dt):
        """p h (-dy, dx) / 2 on each end of facet i, and the work it does in this increment."""
        bits = ti.static(self.nodes.corner_forces.lane_bits)
        mask = ti.static(self.nodes.corner_forces.lane_mask)
        a = self.facet[i, 0]
        b = self.facet[i, 1]
        x_a = self.nodes.position[s, a]
        x_b = self.nodes.position[s, b]
        d = x_b - x_a
        half = 0.5 * self.pressure[s] * self.thickness[0] * ti.Vector([-d[1], d[0]])
        row = self.first_row + 2 * (i >> bits)
        # The slot still holds the force of the last increment: work by the trapezoidal rule.
        before = ti.Vector(
            [
                self.nodes.corner_forces.x[s, row][i & mask],
                self.nodes.corner_forces.y[s, row][i & mask],
            ]
        )
        for end in ti.static(range(2)):
            self.nodes.corner_forces.x[s, row + end][i & mask] = half[0]
            self.nodes.corner_forces.y[s, row + end][i & mask] = half[1]
        velocity = self.nodes.velocity[s, a] + self.nodes.velocity[s, b]
        if ti.static(self.body != OPEN):
            velocity -= self.rigid_bodies.velocity_at(s, self.body, x_a)
            velocity -= self.rigid_bodies.velocity_at(s, self.body, x_b)
        self.work[s, i] = self.work[s, i] + 0.5 * dt * (before + half).dot(velocity)


def padded(values: np.ndarray, length: int) -> np.ndarray:
    """`values` with the last one repeated up to `length`."""
    return np.concatenate([values, np.full(length - len(values), values[-1])])
