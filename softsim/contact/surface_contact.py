"""Contact of nodes with an obstacle: gap, normal force, friction and energy."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import index_field, real_field, vector_field
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, PerScenario, Samples, Stage
from softsim.contact.adhesion import Adhesion, NodalAdhesion
from softsim.contact.forces import (
    BEFORE_START,
    Dissipation,
    FrictionMemory,
    NodalForces,
    Penalty,
    PenaltyFields,
    WallFriction,
    normal_force,
    shear_force,
    slip,
)
from softsim.contact.wall import FixedFrame, Obstacle
from softsim.scene.walls import Contact

RESTS = 1e-6
"""Slip in an increment over elastic slip, below which a node at its friction limit is at rest.

It amounts to some um/s. A limit that approaches its value slowly lets a node creep, ever more
slowly.
"""


# A node may start this far inside a wall: rounding of a shape that just fits.
ALLOWED_PENETRATION = 1e-9


@dataclass(frozen=True)
class ContactData:
    """Nodes (k,) that may touch, with the constants of their contact and effective masses [kg]."""

    nodes: np.ndarray
    penalty: Penalty
    effective_mass: PerScenario[np.ndarray]
    friction_coefficient: PerScenario[float]


@dataclass(frozen=True)
class PenaltyStiffness:
    """Penalty stiffness (n,) [N/m] and mass (n,) [kg] that a contact has to move, per node."""

    settings: Contact
    penalty: np.ndarray
    effective_mass: np.ndarray

    def contact(self, nodes: np.ndarray, friction_coefficient: float) -> ContactData:
        """Return the contact data of `nodes` with `damping_ratio` times the critical damping."""
        k_n, m = self.penalty[nodes], self.effective_mass[nodes]
        moving = np.where(np.isfinite(m), m, 0.0)  # a fixed node needs no dashpot
        damping = 2.0 * self.settings.damping_ratio * np.sqrt(k_n * moving)
        return ContactData(
            nodes=nodes,
            penalty=Penalty.from_settings(self.settings, k_n, damping),
            effective_mass=m,
            friction_coefficient=friction_coefficient,
        )


class SurfaceContact(NodalForces, Dissipation):
    """Contact of a list of nodes with every surface of an obstacle.

    Parameters
    ----------
    nodes: the shared nodes. contact_nodes: their numbers (k,).
    obstacle: `count` surfaces (contact/wall.py). frame: the axes in which they stand still; anchors
        live there, so a frame that moves carries them.
    penalty: springs and dashpots of the nodes (k,). friction: of each scenario.
    return_times: a node that comes back within this time has chattered (scenarios,) [s].
    adhesions: adhesion of the nodes in each scenario; none where nothing adheres.

    Fields, (scenarios, k): those of contact/forces.py; friction_dissipation and
    damping_dissipation [J].
    """

    def __init__(
        self,
        nodes: Nodes,
        contact_nodes: np.ndarray,
        obstacle: Obstacle,
        frame: FixedFrame,
        penalty: Penalty,
        friction: WallFriction,
        return_times: np.ndarray,
        adhesions: Sequence[Adhesion] = (),
    ) -> None:
        scenarios, d = nodes.scenarios, nodes.dimension
        Dissipation.__init__(self, scenarios, len(contact_nodes))
        NodalForces.__init__(self, scenarios, len(contact_nodes), d)
        self.nodes, self.obstacle, self.frame = nodes, obstacle, frame
        self.surfaces = obstacle.count
        self.node = index_field(contact_nodes)
        self.penalty = PenaltyFields(penalty)
        self.friction_coefficient = real_field(friction.coefficient)
        self.memory = FrictionMemory(friction)
        self.return_time = real_field(return_times)
        self.first_slot = nodes.corner_forces.reserve(contact_nodes)

        shape = (scenarios, len(contact_nodes), self.surfaces)
        # The tangential stretch is zero while a node is away: its anchor follows it.
        self.anchor = vector_field(np.zeros((*shape, d)))
        self.touching = index_field(np.zeros(shape))
        # Forces in the last increment: of the normal dashpot, of friction (on the anchor).
        self.dashpot = real_field(np.zeros(shape))
        self.friction = vector_field(np.zeros((*shape, d)))
        # Of friction: its limit, and the time in contact that it remembers.
        self.friction_limit, self.age = (real_field(np.zeros(shape)) for _ in range(2))
        self.left_at = real_field(np.full(shape, BEFORE_START))
        self.adhesion = [NodalAdhesion(adhesions)] if adhesions else []  # none or one
        self.rates = [rate for adhesion in self.adhesion for rate in adhesion.rates]  # none or one
        self.reach = max((adhesion.farthest for adhesion in adhesions), default=0.0)
        frame.carry(self)

    def passes(self) -> dict[Stage, list[Pass]]:
        """Return the passes of an increment: those of frame and obstacle, and the contact."""
        # Frames steer, obstacles measure: no stage is in two of them.
        own = {Stage.MOVE: [Pass("contact", int(self.count), (self.push,))]}
        return self.frame.passes() | self.obstacle.passes() | own

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        of_rates = [rate.state_fields() for rate in self.rates]
        return {
            **{name: field for state in of_rates for name, field in state.items()},
            "anchor": self.anchor,
            "touching": self.touching,
            "dashpot": self.dashpot,
            "friction": self.friction,
            "friction_limit": self.friction_limit,
            "age": self.age,
            "left_at": self.left_at,
            **self.nodal_fields(),
            "friction_dissipation": self.friction_dissipation,
            "damping_dissipation": self.damping_dissipation,
            **self.obstacle.state_fields(),
            **self.frame.state_fields(),
        }

    def forget_work(self) -> None:
        """Set the work of the frame's motion to zero."""
        self.frame.forget_work()

    def forget_dissipation(self, scenario: int) -> None:
        """Set the dissipated energies and the statistics of the whole run to zero in a scenario."""
        super().forget_dissipation(scenario)
        self.forget_times(scenario)
        fields.write_row(self.left_at, scenario, BEFORE_START)

    def clear_forces(self) -> None:
        """Set all forces to zero; the next increment computes those that act.

        Otherwise those would stay that adhesion of an earlier step left on nodes outside the walls.
        """
        fields.write(self.force, 0.0)
        for component in self.nodes.corner_forces.component:
            in_slots = fields.read(component)
            in_slots[:, self.first_slot : self.first_slot + int(self.count)] = 0.0
            fields.write(component, in_slots)

    def forget_rates(self) -> None:
        """Return to the work of adhesion at rest, which a static procedure uses."""
        for rate in self.rates:
            rate.forget()

    def sampled(self) -> list[ti.Field]:
        """Return the fields that `readings` reads."""
        return self.frame.sampled()

    def readings(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the columns of the history, which are those of the frame."""
        return self.frame.readings(samples)

    @ti.func
    def push(self, s, i, t, dt):
        """Write the contact force of node i with all surfaces into the node's slot."""
        a = self.node[i]
        x = self.nodes.position[s, a]
        q = self.frame.local_position(s, x)
        surfaces = self.surfaces * self.obstacle.may_touch(s, i, q, self.reach)
        total = ti.Vector.zero(backend.real, self.nodes.dimension)
        normal_total, slipping_total, depth = ti.Vector([0.0, 0.0, 0.0])
        touched = 0  # now or in the last increment: else all is zero and stays so
        for _ in ti.static(self.adhesion):  # its force on a node outside may have to end
            touched = ti.cast(self.force[s, i].norm_sqr() > 0.0, ti.i32)
        for w in range(surfaces):
            gap, n = self.obstacle.gap_and_normal(s, i, w, q)
            if gap < 0.0:
                touched = 1
                v = self.frame.relative_velocity(s, x, self.nodes.velocity[s, a])
                # Elastic slip an increment ago; time since then before it touched.
                before = ti.Vector.zero(backend.real, self.nodes.dimension)
                outside = ti.cast(0.0, backend.real)
                if self.touching[s, i, w] == 0:
                    outside = dt - self._meet(s, i, w, q, gap, n, v, t, dt)
                else:
                    before = tangential(q - dt * v - self.anchor[s, i, w], n)
                N = normal_force(gap, v.dot(n), self.penalty.k_n[i], self.penalty.c_n[i])
                damping_force = N + self.penalty.k_n[i] * gap
                self.book_normal(s, i, self.dashpot[s, i, w], damping_force, dt * v.dot(n))
                self.dashpot[s, i, w] = damping_force
                friction, slips = self._friction(s, i, w, q, n, v, N, before, outside, t, dt)
                total += N * n - friction
                normal_total += N
                slipping_total += N * slips
                depth = ti.max(depth, -gap)
            elif self.touching[s, i, w] == 1:
                touched = 1
                v = self.frame.relative_velocity(s, x, self.nodes.velocity[s, a])
                self._leave(s, i, w, q, n, v, t, dt)
                for rate in ti.static(self.rates):
                    # Speeds have no meaning while bodies relax, and between static trial states.
                    if self.nodes.local_damping[s] == 0.0:
                        rate.leave(s, i, w, gap, v.dot(n), t, dt)
            for rate in ti.static(self.rates):
                dissipated = rate.separate(s, i, w, gap, t)
                self.damping_dissipation[s, i] = self.damping_dissipation[s, i] + dissipated
            for adhesion in ti.static(self.adhesion):
                attraction = adhesion.force(s, i, w, gap)
                if attraction > 0.0:
                    touched = 1
                    total -= attraction * n
        if touched == 1:
            force = self.frame.global_vector(s, total)
            self.nodes.corner_forces.write(s, self.first_slot + i, force)
            self.note(s, i, force, normal_total, slipping_total, depth, dt)

    @ti.func
    def _meet(self, s, i, w, q, gap, n, v, t, dt):
        """Start the contact of node i with surface w and return the time [s] it has been inside.

        The node, now at q inside the surface, was outside one increment ago. It is anchored where
        it crossed the surface: otherwise a node that chatters would slide without friction at each
        first touch.
        """
        inside = dt
        if v.dot(n) * dt < gap:
            inside = gap / v.dot(n)
        self.touching[s, i, w] = 1
        for rate in ti.static(self.rates):
            rate.meet(s, i, w)
        self.anchor[s, i, w] = q - inside * v
        away = t - self.left_at[s, i, w]
        if away > self.memory.time[s]:
            self.age[s, i, w] = 0.0
        if away < self.return_time[s]:
            self.returns[s, i] = self.returns[s, i] + 1
        return inside

    @ti.func
    def _friction(self, s, i, w, q, n, v, N, before, outside, t, dt):
        """Return the friction [N] on the anchor of node i at q, and 1 if the node slips, else 0.

        N: normal force [N] of surface w. before: elastic slip one increment ago. outside: time [s]
        since then before the node touched.
        """
        k_t, damping_rate = self.penalty.k_t[i], self.penalty.c_t[i] / dt
        stretch = tangential(q - self.anchor[s, i, w], n)
        age, last = self.age[s, i, w] + dt, self.friction_limit[s, i, w]
        instant = self.friction_coefficient[s] * N
        for adhesion in ti.static(self.adhesion):
            instant = adhesion.friction_limit(s, i, w, N, self.friction_coefficient[s])
        limit = self.memory.limit(s, last, instant, age, tangential(v, n).norm(), t, dt)
        self.age[s, i, w], self.friction_limit[s, i, w] = age, limit
        slipped = slip(stretch, before, k_t, damping_rate, limit)
        stretch -= slipped
        force = shear_force(stretch, before, k_t, damping_rate)
        slid = slipped + outside * tangential(v, n)
        self.book_tangential(s, i, self.friction[s, i, w], force, before, stretch, k_t, slid)
        self.anchor[s, i, w], self.friction[s, i, w] = q - stretch, force
        return force, ti.cast(slipped.norm() > RESTS * stretch.norm(), ti.i32)

    @ti.func
    def _leave(self, s, i, w, q, n, v, t, dt):
        """End the contact of node i with surface w; q is now outside, one increment ago inside."""
        nothing = ti.Vector.zero(backend.real, self.nodes.dimension)
        before, way = tangential(q - dt * v - self.anchor[s, i, w], n), dt * tangential(v, n)
        k_t, force_before = self.penalty.k_t[i], self.friction[s, i, w]
        self.book_normal(s, i, self.dashpot[s, i, w], 0.0, dt * v.dot(n))
        self.book_tangential(s, i, force_before, nothing, before, nothing, k_t, way + before)
        self.dashpot[s, i, w], self.friction[s, i, w] = 0.0, nothing
        self.touching[s, i, w], self.left_at[s, i, w] = 0, t

    @ti.func
    def stored_energy(self, s, part):
        """Return the energy in the penalty springs and of adhesion [J]."""
        total = ti.cast(0.0, backend.real)
        for i in range(self.count.first(part), self.count.first(part + 1)):
            q = self.frame.local_position(s, self.nodes.position[s, self.node[i]])
            for w in range(self.surfaces):
                gap, n = self.obstacle.gap_and_normal(s, i, w, q)
                if gap < 0.0 and self.touching[s, i, w] == 1:
                    stretch = q - self.anchor[s, i, w]
                    stretch -= stretch.dot(n) * n
                    total += 0.5 * self.penalty.k_n[i] * gap * gap
                    total += 0.5 * self.penalty.k_t[i] * stretch.dot(stretch)
                for adhesion in ti.static(self.adhesion):
                    total += adhesion.energy(s, i, w, gap)
        return total

    @ti.func
    def work_done(self, s, dt, part):
        """Return the work of the frame's motion so far [J]."""
        return self.frame.work_done(s, part)


@ti.func
def tangential(vector, n):
    """Return the part of a vector perpendicular to the unit vector n."""
    return vector - vector.dot(n) * n
