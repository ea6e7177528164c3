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

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import Number, index_field, real_field, vector_field
from softsim.compute.term import PerScenario, Term

BEFORE_START = -1e30
"""Time of events that have not happened yet [s], before any time of a run."""


@ti.func
def normal_force(gap, gap_rate, penalty_stiffness, damping):
    """Return N = max(0, -k_n g - c_n dg/dt) where g < 0, else 0 [N]."""
    force = gap * 0.0
    if gap < 0.0:
        force = ti.max(0.0, -penalty_stiffness * gap - damping * gap_rate)
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


# -------------------------------------------------------------------------------------------------
# Adhesion: a reversible cohesive law with linear softening.
#
# A wall attracts a node with the force P, whose potential U depends on the gap g alone:
#
#     P = F,  U = F g - F h / 2                     where g <= 0,
#     P = F (1 - g / h),  U = -F h / 2 (1 - g/h)^2  where 0 < g < h,   both zero beyond.
#
# F is the pull-off stress times the node's area A. At rest without load the node is F / k_n deep in
# the wall; to pull it out of there takes the work of adhesion,
#
#     w A = F h / 2 + F^2 / (2 k_n),
#
# from which the range h follows, or F where h is given. So w does not depend on the penalty
# stiffness, which only decides which part of the separation lies inside the wall, F / k_n, and
# which outside, h. This is the model of Maugis (1992, J. Colloid Interface Sci. 150:243) with
# linear softening instead of a constant stress. The energy that is lost between approach and
# separation is that of the sudden jumps of an elastic body, not of the law. Bodies adhere to each
# other by the same law, of a point and the facet closest to it (contact/self_contact.py).
#
# Friction is limited to mu N, where N balances the attraction too. With a shear strength tau the
# load and the adhering area contribute separately instead (Derjaguin 1934, Z. Phys. 88:661):
# mu max(N - F, 0) + tau A as long as the node is in contact.


@dataclass(frozen=True)
class CohesiveLaw:
    """Adhesion per area: work w [J/m^2], with the pull-off stress s [Pa] or the range h [m].

    shear_strength: tau [Pa], or None where friction is mu N.
    """

    work: float
    pull_off_stress: float | None
    range: float | None
    shear_strength: float | None = None

    def stress(self, compliance: np.ndarray) -> np.ndarray:
        """Return s [Pa], with a given range the root of w = s h / 2 + s^2 c / 2.

        compliance: c = A / k_n of the penalty contact [m/Pa], of any shape.
        """
        if self.range is None:
            return np.full_like(compliance, self.pull_off_stress)
        half = 0.5 * self.range
        return np.asarray(
            2.0 * self.work / (half + np.sqrt(half**2 + 2.0 * self.work * compliance))
        )


@dataclass(frozen=True)
class Adhesion:
    """Adhesion of nodes to the surfaces of a wall.

    attraction (k, w) [N]: force F on a node that touches, zero where nothing adheres. reach (k, w)
    [m]: gap h at which it vanishes. zone (k, w) [m]: length E* w / s^2 of the cohesive zone at the
    rim of a contact, infinite where nothing adheres. shear (k, w) [N]: tau A of the laws with a
    shear strength; sheared (k, w) [N]: their part of F.
    """

    attraction: PerScenario[np.ndarray]
    reach: PerScenario[np.ndarray]
    zone: PerScenario[np.ndarray]
    shear: PerScenario[np.ndarray]
    sheared: PerScenario[np.ndarray]

    @classmethod
    def of_areas(
        cls, laws: Sequence[CohesiveLaw], areas: np.ndarray, k_n: np.ndarray, modulus: float
    ) -> "Adhesion":
        """Return the adhesion of nodes of which each law has an area A_j, areas (laws, k, w) [m^2].

        Forces and energies of the laws add up: F = sum of s_j A_j, w A = sum of w_j A_j. Each law
        has the part A_j / A of the node's penalty stiffness k_n (k,) [N/m], so that parts with one
        law are as the whole. modulus: E* of the softest material [Pa].
        """
        stiffness, area = k_n[:, None], areas.sum(axis=0)
        of_laws = list(zip(laws, areas, strict=True))
        forces = [law.stress(area / stiffness) * own for law, own in of_laws]
        force = np.sum(forces, axis=0)
        strong = [law.shear_strength is not None for law in laws]
        shear = np.sum([(law.shear_strength or 0.0) * own for law, own in of_laws], axis=0)
        sheared = np.sum(np.where(np.reshape(strong, (-1, 1, 1)), forces, 0.0), axis=0)
        energy = np.sum([law.work * own for law, own in of_laws], axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            # Where nothing attracts, any length will do.
            reach = np.where(force > 0.0, 2.0 * energy / force - force / stiffness, 1.0)
            zone = np.where(force > 0.0, modulus * energy * area / force**2, np.inf)
        return cls(force, reach, zone, shear, sheared)

    @property
    def farthest(self) -> float:
        """Upper bound [m] of the gap of attraction, a power of 2.

        It is a constant in the kernels of some walls, which nearly equal ranges reuse.
        """
        return power_of_two_above(float(self.reach[self.attraction > 0.0].max()))


def power_of_two_above(length: float) -> float:
    """Return the smallest power of 2 that is not below a positive length."""
    return float(2.0 ** np.ceil(np.log2(length)))


class NodalAdhesion:
    """Adhesion of nodes in kernels; one entry of `adhesions` a scenario."""

    def __init__(self, adhesions: Sequence[Adhesion]) -> None:
        self.attraction = real_field(np.stack([a.attraction for a in adhesions]))
        self.reach = real_field(np.stack([a.reach for a in adhesions]))
        self.shear = real_field(np.stack([a.shear for a in adhesions]))
        self.sheared = real_field(np.stack([a.sheared for a in adhesions]))

    @ti.func
    def force(self, s, i, w, gap):
        """Return the force P [N] with which surface w attracts node i."""
        return self.attraction[s, i, w] * self._closeness(s, i, w, gap)

    @ti.func
    def energy(self, s, i, w, gap):
        """Return the potential U [J] of node i and surface w, negative while they adhere."""
        closeness, depth = self._closeness(s, i, w, gap), ti.max(-gap, 0.0)
        outside = 0.5 * self.reach[s, i, w] * closeness * closeness
        return -self.attraction[s, i, w] * (outside + depth)

    @ti.func
    def friction_limit(self, s, i, w, N, mu):
        """Return the largest friction [N] of node i in contact with surface w.

        N: normal force [N], which balances the attraction.
        """
        return mu * ti.max(N - self.sheared[s, i, w], 0.0) + self.shear[s, i, w]

    @ti.func
    def _closeness(self, s, i, w, gap):
        """Return 1 - g / h, within 0 and 1."""
        return ti.min(ti.max(1.0 - gap / self.reach[s, i, w], 0.0), 1.0)

    def strengths(self) -> list[ti.Field]:
        """Return the fields in which the friction of the adhering area is linear."""
        return [self.shear]


@dataclass(frozen=True)
class PairLaws:
    """Adhesion between the groups of the surfaces of bodies.

    work w [J/m^2], stress s [Pa], range h [m] and shear_strength tau [Pa], (groups, groups) each: w
    is zero where nothing adheres, either s or h, tau is negative where friction is mu N. zone:
    shortest cohesive zone E* w / s^2 [m].
    """

    work: PerScenario[np.ndarray]
    stress: PerScenario[np.ndarray]
    range: PerScenario[np.ndarray]
    shear_strength: PerScenario[np.ndarray]
    zone: PerScenario[float]

    @property
    def farthest(self) -> float:
        """Upper bound [m] of the gap of attraction, a power of 2: a constant in kernels."""
        with np.errstate(divide="ignore", invalid="ignore"):
            of_stress = np.where(self.stress > 0.0, 2.0 * self.work / self.stress, 0.0)
        return power_of_two_above(float(np.maximum(of_stress, self.range).max()))


class PairAdhesion(NodalAdhesion):
    """Adhesion of `count` points of surfaces to facets; one entry of `laws` a scenario.

    Attraction and reach of a point are determined when it comes near a facet, and stay constant
    until it is out of reach, as its stiffness does.
    """

    def __init__(self, laws: Sequence[PairLaws], count: int) -> None:
        nothing = np.zeros((count, 1))
        of_points = Adhesion(nothing, nothing + 1.0, nothing + np.inf, nothing, nothing)
        super().__init__([of_points] * len(laws))
        self.work = real_field(np.stack([each.work for each in laws]))
        self.stress = real_field(np.stack([each.stress for each in laws]))
        self.range = real_field(np.stack([each.range for each in laws]))
        self.shear_strength = real_field(np.stack([each.shear_strength for each in laws]))

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return {
            "attraction": self.attraction,
            "reach": self.reach,
            "shear": self.shear,
            "sheared": self.sheared,
        }

    def strengths(self) -> list[ti.Field]:
        """Return the fields in which the friction of the adhering area is linear."""
        return [self.shear, self.shear_strength]

    @ti.func
    def adheres(self, s, one, other):
        """Return True if a group adheres to another."""
        return self.work[s, one, other] > 0.0

    @ti.func
    def meet(self, s, i, one, other, area, k_n):
        """Determine the adhesion of point i of group `one` to a facet of group `other`.

        area: A [m^2]. k_n: stiffness of the point [N/m].
        """
        F, reach, shear, sheared = ti.Vector([0.0, 1.0, 0.0, 0.0])
        if area > 0.0 and k_n > 0.0:
            work, half = self.work[s, one, other], 0.5 * self.range[s, one, other]
            stress = self.stress[s, one, other]
            if half > 0.0:
                stress = 2.0 * work / (half + ti.sqrt(half * half + 2.0 * work * area / k_n))
            F = stress * area
            reach = 2.0 * work * area / F - F / k_n
            if self.shear_strength[s, one, other] >= 0.0:
                shear, sheared = self.shear_strength[s, one, other] * area, F
        self.attraction[s, i, 0], self.reach[s, i, 0] = F, reach
        self.shear[s, i, 0], self.sheared[s, i, 0] = shear, sheared

    @ti.func
    def reach_of(self, s, i):
        """Return the gap [m] below which point i is attracted; zero if nothing attracts it."""
        reach = self.reach[s, i, 0]
        if self.attraction[s, i, 0] == 0.0:
            reach = 0.0
        return reach


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
