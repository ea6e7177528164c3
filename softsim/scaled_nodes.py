"""Nodes with selective mass scaling: kernels of mass_scaling.py.

A kick sums the forces on all nodes, then computes the correction of each group, then updates
velocities.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import taichi as ti

from softsim import backend
from softsim.fields import Number, index_field, real_field, vector_field
from softsim.mass_scaling import MassScaling
from softsim.nodes import Nodes


class ScaledNodes(Nodes):
    """Nodes in groups; a node without a group is its own group. more: arguments of `Nodes`.

    Fields, (scenarios, nodes): lag [m/s^2], reduction of the acceleration by mass scaling; drag
    [m/s^2], local damping over mass.
    """

    def __init__(self, scaling: MassScaling, *more: Any) -> None:
        super().__init__(*more)
        group = scaling.group_of_each
        members = np.argsort(group, kind="stable")
        self.groups = Number(int(group.max()) + 1)
        self.factor = real_field(np.array([scaling.factor]))
        self.member = index_field(members)
        self.first_member = index_field(np.searchsorted(group[members], np.arange(group.max() + 2)))
        self.mass_share = real_field(scaling.shares(self.lumped_mass)[members])
        at_rest = np.zeros((self.scenarios, int(self.count), self.dimension))
        self.lag, self.drag = vector_field(at_rest), vector_field(at_rest)

    def state_fields(self) -> dict[str, ti.Field]:
        return super().state_fields() | {"lag": self.lag, "drag": self.drag}

    def kicks(self) -> list[tuple[int, Callable[..., None]]]:
        """Return the functions for forces, corrections of groups, and velocities."""
        back, forward = (int(self.groups), self.hold_back), (int(self.count), self.accelerate)
        return [*super().kicks(), back, forward]

    @ti.func
    def take_force(self, s, a, t, dt):
        """Do nothing: velocities change once the forces on all nodes of a group are complete."""

    @ti.func
    def hold_back(self, s, g, t, dt):
        """Compute the reduction of accelerations in group g (mass_scaling.py)."""
        if ti.static(self.relaxes):
            self.resist(s, g)
        mean = ti.Vector.zero(backend.real, self.dimension)
        for k in range(self.first_member[g], self.first_member[g + 1]):
            mean += self.mass_share[k] * self.driven(s, self.member[k])
        for k in range(self.first_member[g], self.first_member[g + 1]):
            a = self.member[k]
            self.lag[s, a] = (1.0 - 1.0 / self.factor[0]) * (self.driven(s, a) - mean)

    @ti.func
    def driven(self, s, a):
        """Return f / m + g of the last force, less local damping [m/s^2]."""
        result = self.nodal_acceleration(s, a)
        if ti.static(self.relaxes):
            result -= self.drag[s, a]
        return result

    @ti.func
    def resist(self, s, g):
        """Compute the local damping of a group.

        The mean motion is damped by the resultant force on the group, the motion within it by the
        remaining forces. Otherwise forces within a group, which are slow to balance, would damp the
        motion of the whole group.
        """
        force = ti.Vector.zero(backend.real, self.dimension)
        speed, mean = force, force
        for k in range(self.first_member[g], self.first_member[g + 1]):
            force += self.mass_share[k] * self.nodal_acceleration(s, self.member[k])
            speed += self.mass_share[k] * self.velocity[s, self.member[k]]
        for k in range(self.first_member[g], self.first_member[g + 1]):
            a = self.member[k]
            self.drag[s, a] = self.resistance(
                s, self.nodal_acceleration(s, a) - force, self.velocity[s, a] - speed
            )
            mean += self.mass_share[k] * self.drag[s, a]
        for k in range(self.first_member[g], self.first_member[g + 1]):
            a = self.member[k]
            self.drag[s, a] = self.drag[s, a] + self.resistance(s, force, speed) - mean

    @ti.func
    def acceleration(self, s, a):
        return self.nodal_acceleration(s, a) - self.lag[s, a]

    @ti.func
    def damping(self, s, a):
        return self.drag[s, a]

    @ti.func
    def added_kinetic_energy(self, s, dt, part):
        """Return the kinetic energy [J] that mass scaling adds, of motion within groups."""
        energy = ti.cast(0.0, backend.real)
        for g in range(self.groups.first(part), self.groups.first(part + 1)):
            mean = ti.Vector.zero(backend.real, self.dimension)
            for k in range(self.first_member[g], self.first_member[g + 1]):
                mean += self.mass_share[k] * self.present_velocity(s, self.member[k], dt)
            for k in range(self.first_member[g], self.first_member[g + 1]):
                a = self.member[k]
                apart = self.present_velocity(s, a, dt) - mean
                energy += 0.5 * (self.factor[0] - 1.0) * self.mass[a] * apart.dot(apart)
        return energy
