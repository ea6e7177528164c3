"""Contact laws: spring and dashpot along the normal, Coulomb friction with memory.

Friction is a spring and a dashpot from a slip anchor, limited to mu N. It is written as
elastoplasticity (Wriggers, Computational Contact Mechanics, ch. 5): the path of a node along the
surface is the sum of the elastic slip s, which a spring and a dashpot resist, and the plastic slip,
which begins where their force reaches mu N and moves the anchor:

    T = k_t s + c_t ds/dt,  |T| <= mu N.

A node that sticks is held by a spring, so it cannot creep, as it would under a velocity-regularised
law. The dashpot acts on the elastic slip alone (as ABAQUS/Explicit's contact damping), so it does
not act on a node that slides steadily.

With a limit that follows N at once, an elastic body without damping excites itself while sliding:
slip coincides with small N, and oscillations of mesh and body grow (Adams 1995; Renardy 1992). A
limit with memory prevents this (Prakash and Clifton 1993; Cochard and Rice 2000; Rubin and Ampuero
2007),

    dL/dt = (mu N - L) (1 / t* + |V| / d)   while in contact,  |T| <= L,

with a time t* at rest and a slip length d at the speed V; it starts as the mean of mu N.
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import Number, index_field, real_field, vector_field
from softsim.compute.term import Term
from softsim.scene.walls import Contact

BEFORE_START = -1e30
"""Time of events that have not happened yet [s], before any time of a run."""


@dataclass(frozen=True)
class Penalty:
    """Springs and dashpots of contact at points (k,): k_n, k_t [N/m] and c_n, c_t [N s/m]."""

    k_n: np.ndarray
    k_t: np.ndarray
    c_n: np.ndarray
    c_t: np.ndarray

    @classmethod
    def from_settings(cls, settings: Contact, k_n: np.ndarray, c_n: np.ndarray) -> "Penalty":
        """Return the penalty with the tangential constants that the settings give."""
        k_t = settings.tangential_stiffness_ratio * k_n
        return cls(k_n, k_t, c_n, settings.tangential_damping_fraction * c_n)

    def repeated(self, count: int) -> "Penalty":
        """Return the penalty of `count` points that are all like the only one of this penalty."""
        constants = (self.k_n, self.k_t, self.c_n, self.c_t)
        return Penalty(*(np.repeat(constant, count) for constant in constants))

    def stiffness_with_dashpots(self, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Return k_n + 2 c_n / dt and k_t + 2 c_t / dt (k,) [N/m], see solver/stable_step.py."""
        return self.k_n + 2.0 * self.c_n / dt, self.k_t + 2.0 * self.c_t / dt

    def largest_stiffness(self, dt: float) -> np.ndarray:
        """Return the larger of both stiffnesses with dashpots (k,) [N/m]."""
        return np.maximum(*self.stiffness_with_dashpots(dt))


class PenaltyFields:
    """Springs and dashpots of contact points in kernels."""

    def __init__(self, penalty: Penalty) -> None:
        self.k_n, self.k_t = real_field(penalty.k_n), real_field(penalty.k_t)
        self.c_n, self.c_t = real_field(penalty.c_n), real_field(penalty.c_t)


@dataclass(frozen=True)
class WallFriction:
    """Friction on walls in each scenario, arrays (scenarios,).

    coefficient: mu [-]. memory: t* of the friction limit [s]. slip_length: d of the limit [m].
    """

    coefficient: np.ndarray
    memory: np.ndarray
    slip_length: np.ndarray


@ti.func
def normal_force(gap, gap_rate, k_n, c_n):
    """Return N = max(0, -k_n g - c_n dg/dt) where g < 0, else 0 [N]."""
    force = gap * 0.0
    if gap < 0.0:
        force = ti.max(0.0, -k_n * gap - c_n * gap_rate)
    return force


@ti.func
def shear_force(stretch, before, stiffness, damping_rate):
    """Return k_t s + c_t (s - s_0) / dt [N] of the elastic slip s [m], s_0 one increment ago.

    The force pulls the node back. damping_rate: c_t / dt [N/m].
    """
    return stiffness * stretch + damping_rate * (stretch - before)


@ti.func
def slip(stretch, before, stiffness, damping_rate, friction_limit):
    """Return the slip vector [m] by which the anchor follows so that |T| is at its limit.

    It is zero when sticking. stretch: elastic slip without it [m]; before: one increment ago.
    """
    trial = shear_force(stretch, before, stiffness, damping_rate)
    size = trial.norm()
    result = stretch * 0.0
    if size > friction_limit:
        result = trial * ((1.0 - friction_limit / size) / (stiffness + damping_rate))
    return result


@ti.func
def limit_with_memory(last, instant, age, memory, slip_length, speed, dt):
    """Return the friction limit L [N] after an increment.

    last: L before it. instant: mu N. age: time in contact [s], this increment included. memory: t*
    [s], zero where L is mu N. slip_length: d [m].
    """
    forgets_in = memory / (1.0 + memory * speed / slip_length)
    return last + (instant - last) * (dt / ti.max(dt, ti.min(forgets_in, age)))


class FrictionMemory:
    """Memory of the friction limit on walls in kernels."""

    def __init__(self, friction: WallFriction) -> None:
        self.time = real_field(friction.memory)
        self.slip_length = real_field(friction.slip_length)

    @ti.func
    def limit(self, s, last, instant, age, speed, t, dt):
        """Return the friction limit [N] after an increment that ends at time t."""
        memory = self.time[s]
        if t < 0.0:  # bodies settle, as if they lay there for long: the limit has followed
            memory = 0.0
        return limit_with_memory(last, instant, age, memory, self.slip_length[s], speed, dt)


# -------------------------------------------------------------------------------------------------
# Energy dissipated by contact, node by node, for every kind of contact.
#
# The work of every contact force is integrated by the trapezoidal rule, consistent with central
# differences. Of the work of the friction force T over the displacement d of an increment, in which
# the elastic slip changes by e, the spring stores k_t s . e with the mean s. The rest is exactly
#
#     friction  T . (d - e),    dashpot  (T - k_t s) . e,
#
# where T and s are means over both ends of the increment and d - e is the slip. When a node leaves,
# both drop to zero.


class Dissipation(Term):
    """Dissipated energies of `count` nodes in each scenario.

    Fields, (scenarios, count): friction_dissipation and damping_dissipation [J].
    """

    def __init__(self, scenarios: int, count: int) -> None:
        self.count = Number(count)
        self.friction_dissipation = real_field(np.zeros((scenarios, count)))
        self.damping_dissipation = real_field(np.zeros((scenarios, count)))

    def forget_dissipation(self, scenario: int) -> None:
        """Set the dissipated energies of a scenario to zero."""
        fields.write_row(self.friction_dissipation, scenario, 0.0)
        fields.write_row(self.damping_dissipation, scenario, 0.0)

    @ti.func
    def book_normal(self, s, i, dashpot_before, dashpot, way):
        """Add the work of the normal dashpot over an increment.

        Arguments are the dashpot forces [N] at both ends of the increment, in which the gap grew by
        `way` [m].
        """
        work = 0.5 * (dashpot_before + dashpot) * way
        self.damping_dissipation[s, i] = self.damping_dissipation[s, i] - work

    @ti.func
    def book_tangential(self, s, i, force_before, force, before, stretch, stiffness, slipped):
        """Add the work of friction and of the tangential dashpot over an increment.

        Arguments are the forces T [N] and elastic slips s [m] at both ends of the increment, in
        which the node `slipped` [m] along the surface.
        """
        mean_force, elastic_way = 0.5 * (force_before + force), stretch - before
        mean_dashpot = mean_force - 0.5 * stiffness * (before + stretch)
        self.friction_dissipation[s, i] = self.friction_dissipation[s, i] + mean_force.dot(slipped)
        self.damping_dissipation[s, i] = self.damping_dissipation[s, i] + mean_dashpot.dot(
            elastic_way
        )

    @ti.func
    def dissipated_energy(self, s, part):
        """Return the energy dissipated so far by friction and by damping [J]."""
        energy = ti.Vector([0.0, 0.0])
        for i in range(self.count.first(part), self.count.first(part + 1)):
            energy[0] += self.friction_dissipation[s, i]
            energy[1] += self.damping_dissipation[s, i]
        return energy


# -------------------------------------------------------------------------------------------------
# Forces, impulses and contact times of the nodes that may touch walls.


class NodalForces:
    """Contact forces of nodes, their impulses and statistics.

    Fields, (scenarios, touched_count): normal_force [N] and force (d) [N] now; normal_impulse, its
    part carried while slipping slipping_impulse, and impulse (d), all [N s] since they were last
    cleared; over the whole run contact_time [s], returns (the number of times that a node
    chattered) and penetration, the largest depth of a node [m].
    """

    def __init__(self, scenarios: int, count: int, dimension: int) -> None:
        self.touched_count, self.dimension = Number(count), dimension
        numbers, vectors = np.zeros((scenarios, count)), np.zeros((scenarios, count, dimension))
        self.normal_force, self.force = real_field(numbers), vector_field(vectors)
        self.normal_impulse, self.impulse = real_field(numbers), vector_field(vectors)
        self.slipping_impulse, self.contact_time = real_field(numbers), real_field(numbers)
        self.penetration, self.returns = real_field(numbers), index_field(numbers)

    def nodal_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return {
            "contact_time": self.contact_time,
            "penetration": self.penetration,
            "returns": self.returns,
            "normal_force": self.normal_force,
            "force": self.force,
            "normal_impulse": self.normal_impulse,
            "slipping_impulse": self.slipping_impulse,
            "impulse": self.impulse,
        }

    @property
    def pressing_force(self) -> ti.Field:
        """Normal forces (scenarios, k) [N] of the nodes, or of what touches in their place."""
        return self.normal_force

    def impulses(self) -> list[ti.Field]:
        """Return the fields of the impulses of each node."""
        return [self.normal_impulse, self.slipping_impulse, self.impulse]

    def forget_times(self, scenario: int) -> None:
        """Set the statistics of the whole run to zero in a scenario."""
        fields.write_row(self.contact_time, scenario, 0)
        fields.write_row(self.penetration, scenario, 0)
        fields.write_row(self.returns, scenario, 0)

    @ti.func
    def note(self, s, i, force, normal, slipping, depth, dt):
        """Record the force [N] of node i and its penetration.

        normal, slipping [N]: its normal force, and the part of that carried while slipping. depth
        [m]: its penetration.
        """
        self.penetration[s, i] = ti.max(self.penetration[s, i], depth)
        self.force[s, i] = force
        self.normal_force[s, i] = normal
        self.normal_impulse[s, i] = self.normal_impulse[s, i] + normal * dt
        self.slipping_impulse[s, i] = self.slipping_impulse[s, i] + slipping * dt
        self.impulse[s, i] = self.impulse[s, i] + force * dt
        if normal > 0.0:
            self.contact_time[s, i] = self.contact_time[s, i] + dt

    @ti.func
    def total_force(self, s):
        """Return the sum of the forces on the nodes now (d) [N]."""
        total = ti.Vector.zero(backend.real, self.dimension)
        for i in range(self.touched_count.read()):
            total += self.force[s, i]
        return total
