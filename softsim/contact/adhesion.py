"""Adhesion: a reversible cohesive law with linear softening.

A wall attracts a node with the force P, whose potential U depends on the gap g alone:

    P = F,  U = F g - F h / 2                     where g <= 0,
    P = F (1 - g / h),  U = -F h / 2 (1 - g/h)^2  where 0 < g < h,   both zero beyond.

F is the pull-off stress times the node's area A. At rest without load the node is F / k_n deep in
the wall; to pull it out of there takes the work of adhesion,

    w A = F h / 2 + F^2 / (2 k_n),

from which the range h follows, or F where h is given. So w does not depend on the penalty
stiffness, which only decides which part of the separation lies inside the wall, F / k_n, and
which outside, h. This is the model of Maugis (1992, J. Colloid Interface Sci. 150:243) with
linear softening instead of a constant stress. The energy that is lost between approach and
separation is that of the sudden jumps of an elastic body, not of the law. Bodies adhere to each
other by the same law, of a point and the facet closest to it (contact/self_contact.py).

The work of adhesion may depend on the speed v of separation (Gent and Schultz 1972, J. Adhesion
3:281; Maugis and Barquins 1978, J. Phys. D 11:1989),

    w = w0 (1 + (v / v0)^n).

A force that followed the rate at each instant would have an infinite tangent at rest, as n < 1.
Instead the law stays conservative between two events. v is the mean speed at which the gap opens
from 0 to g1 = b h. When the gap passes g1, the rest of the softening, which starts at the force
P1 = F (1 - b), is extended by e, so that its work grows by P1 e / 2 = w0 A (v / v0)^n:

    P = P1 c,  U = P1 (e - (h - g1 + e) c^2) / 2,  c = 1 - (g - g1) / (h - g1 + e)   for g > g1.

Force and potential are continuous at g1. At the end of the extended range the potential is
P1 e / 2 > 0; it counts as dissipated from then on, and the range returns to h. It also does so
when the node touches before, without any dissipation. The speed is measured outside the wall:
inside, where the penalty contact of stiffness k_n unloads, a body of stiffness K leaves slower by
the factor K / (K + k_n).

Friction is limited to mu N, where N balances the attraction too. With a shear strength tau the
load and the adhering area contribute separately instead (Derjaguin 1934, Z. Phys. 88:661):
mu max(N - F, 0) + tau A as long as the node is in contact.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import index_field, real_field
from softsim.compute.term import PerScenario
from softsim.compute.vectors import KERNEL, NUMPY
from softsim.contact.forces import BEFORE_START

MEASURED_AT = 0.5
"""Gap g1 up to which the speed of separation is measured, over the range h [-]."""


@dataclass(frozen=True)
class SeparationRate:
    """Dependence of the work of adhesion on the speed v of separation, w0 (1 + (v / v0)^n).

    speed: v0 [m/s]. exponent: n [-]. fastest: speed [m/s] above which w is constant.
    """

    speed: float
    exponent: float
    fastest: float

    @property
    def largest(self) -> float:
        """Largest value of (v / v0)^n [-]."""
        return float((self.fastest / self.speed) ** self.exponent)


def stress_of_range(work, range_, compliance, m):
    """Return the stress s [Pa] with the range h: the root of w = s h / 2 + s^2 c / 2."""
    half = 0.5 * range_
    return 2.0 * work / (half + m.sqrt(half * half + 2.0 * work * compliance))


@dataclass(frozen=True)
class CohesiveLaw:
    """Adhesion per area: work w [J/m^2], with the pull-off stress s [Pa] or the range h [m].

    shear_strength: tau [Pa], or None where friction is mu N. rate: None where w is constant.
    """

    work: float
    pull_off_stress: float | None
    range: float | None
    shear_strength: float | None = None
    rate: SeparationRate | None = None

    def stress(self, compliance: np.ndarray) -> np.ndarray:
        """Return s [Pa], given or as the range gives it.

        compliance: c = A / k_n of the penalty contact [m/Pa], of any shape.
        """
        if self.range is None:
            return np.full_like(compliance, self.pull_off_stress)
        return np.asarray(stress_of_range(self.work, self.range, compliance, NUMPY))


@dataclass(frozen=True)
class RateDependence:
    """Dependence of the adhesion of nodes on the speed of separation, arrays (k, w).

    longest [m]: largest extension of the range, zero where it is constant. fastest [m/s]: speed at
    which it is reached. exponent [-].
    """

    longest: PerScenario[np.ndarray]
    fastest: PerScenario[np.ndarray]
    exponent: PerScenario[np.ndarray]

    @classmethod
    def of_areas(
        cls, laws: Sequence[CohesiveLaw], areas: np.ndarray, force: np.ndarray
    ) -> "RateDependence | None":
        """Return the rate dependence of nodes with the areas (laws, k, w) [m^2] of the laws.

        force: F (k, w) [N]. None where no law depends on the rate. Laws that do and have an area at
        the same node share one rate.
        """
        longest = np.zeros(force.shape)
        fastest, exponent = np.ones((2, *force.shape))
        for law, own in zip(laws, areas, strict=True):
            if law.rate is None:
                continue
            has = own > 0.0
            work = law.work * law.rate.largest * own[has]
            longest[has] += 2.0 * work / ((1.0 - MEASURED_AT) * force[has])
            fastest[has], exponent[has] = law.rate.fastest, law.rate.exponent
        return cls(longest, fastest, exponent) if longest.any() else None


@dataclass(frozen=True)
class Adhesion:
    """Adhesion of nodes to the surfaces of a wall.

    attraction (k, w) [N]: force F on a node that touches, zero where nothing adheres. reach (k, w)
    [m]: gap h at which it vanishes. zone (k, w) [m]: length E* w / s^2 of the cohesive zone at the
    rim of a contact, infinite where nothing adheres. shear (k, w) [N]: tau A of the laws with a
    shear strength; sheared (k, w) [N]: their part of F. rate: None where nothing depends on it.
    """

    attraction: PerScenario[np.ndarray]
    reach: PerScenario[np.ndarray]
    zone: PerScenario[np.ndarray]
    shear: PerScenario[np.ndarray]
    sheared: PerScenario[np.ndarray]
    rate: RateDependence | None = None

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
        rate = RateDependence.of_areas(laws, areas, force)
        return cls(force, reach, zone, shear, sheared, rate)

    @property
    def longest_reach(self) -> np.ndarray:
        """Gap (k, w) [m] at which the attraction vanishes after the fastest separation."""
        return self.reach if self.rate is None else self.reach + self.rate.longest

    @property
    def farthest(self) -> float:
        """Upper bound [m] of the gap of attraction, a power of 2.

        It is a constant in the kernels of some walls, which nearly equal ranges reuse.
        """
        return power_of_two_above(float(self.longest_reach[self.attraction > 0.0].max()))


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
        rates = [a.rate for a in adhesions if a.rate is not None]  # of all scenarios, or of none
        self.rates = [NodalRate(rates, self.attraction, self.reach)] if rates else []

    @ti.func
    def force(self, s, i, w, gap):
        """Return the force P [N] with which surface w attracts node i."""
        closeness = self._closeness(s, i, w, gap)
        for rate in ti.static(self.rates):
            if rate.acts(s, i, w, gap):
                closeness = rate.closeness(s, i, w, gap)
        return self.attraction[s, i, w] * closeness

    @ti.func
    def energy(self, s, i, w, gap):
        """Return the potential U [J] of node i and surface w, negative while they adhere.

        It becomes positive at the end of a separation that takes more than the work at rest.
        """
        closeness, depth = self._closeness(s, i, w, gap), ti.max(-gap, 0.0)
        outside = 0.5 * self.reach[s, i, w] * closeness * closeness
        for rate in ti.static(self.rates):
            if rate.acts(s, i, w, gap):
                outside = rate.path_left(s, i, w, gap)
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


class NodalRate:
    """Rate dependence of adhesion in kernels; one entry of `rates` a scenario.

    attraction, reach: fields of F and of the range h at rest. State, (scenarios, k, w): extension,
    which is e over the longest one [-], zero but during a separation; opened_at, the time [s] at
    which the gap last became positive, BEFORE_START where no speed is to be measured.
    """

    def __init__(
        self, rates: Sequence[RateDependence], attraction: ti.Field, reach: ti.Field
    ) -> None:
        self.attraction, self.reach = attraction, reach
        self.longest = real_field(np.stack([r.longest for r in rates]))
        self.fastest = real_field(np.stack([r.fastest for r in rates]))
        self.exponent = real_field(np.stack([r.exponent for r in rates]))
        shape = (len(rates), *rates[0].longest.shape)
        self.extension = real_field(np.zeros(shape))
        self.opened_at = real_field(np.full(shape, BEFORE_START))

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return {"adhesion_extension": self.extension, "adhesion_opened_at": self.opened_at}

    def forget(self) -> None:
        """Set all ranges to those at rest."""
        fields.write(self.extension, 0.0)
        fields.write(self.opened_at, BEFORE_START)

    @ti.func
    def acts(self, s, i, w, gap):
        """Return True if the force at this gap follows from an extended range."""
        return self.extension[s, i, w] > 0.0 and gap > MEASURED_AT * self.reach[s, i, w]

    @ti.func
    def closeness(self, s, i, w, gap):
        """Return P / F, where `acts`."""
        return (1.0 - MEASURED_AT) * self._closeness(s, i, w, gap)

    @ti.func
    def path_left(self, s, i, w, gap):
        """Return -U / F [m], where `acts`."""
        closeness, extension = self._closeness(s, i, w, gap), self._extension(s, i, w)
        length = (1.0 - MEASURED_AT) * self.reach[s, i, w] + extension
        return 0.5 * (1.0 - MEASURED_AT) * (length * closeness * closeness - extension)

    @ti.func
    def meet(self, s, i, w):
        """Return to the range at rest at the first touch."""
        self.extension[s, i, w], self.opened_at[s, i, w] = 0.0, BEFORE_START

    @ti.func
    def leave(self, s, i, w, gap, gap_rate, t, dt):
        """Begin to measure the speed of a node that was inside one increment ago."""
        if self.longest[s, i, w] > 0.0:
            outside = dt
            if gap_rate * dt > gap:
                outside = gap / gap_rate
            self.opened_at[s, i, w] = t - outside

    @ti.func
    def separate(self, s, i, w, gap, t):
        """Extend the range when the gap passes g1; return to the range at rest beyond its end.

        Return the energy [J] that is dissipated at the end, else zero.
        """
        opened_at, dissipated = self.opened_at[s, i, w], gap * 0.0
        if opened_at > BEFORE_START and gap > MEASURED_AT * self.reach[s, i, w]:
            speed_ratio = ti.min(gap / ((t - opened_at) * self.fastest[s, i, w]), 1.0)
            self.extension[s, i, w] = speed_ratio ** self.exponent[s, i, w]
            self.opened_at[s, i, w] = BEFORE_START
        extension = self._extension(s, i, w)
        if extension > 0.0 and gap > self.reach[s, i, w] + extension:
            self.extension[s, i, w] = 0.0
            force = (1.0 - MEASURED_AT) * self.attraction[s, i, w]
            dissipated = 0.5 * force * extension
        return dissipated

    @ti.func
    def _extension(self, s, i, w):
        """Return e [m]."""
        return self.extension[s, i, w] * self.longest[s, i, w]

    @ti.func
    def _closeness(self, s, i, w, gap):
        """Return c = 1 - (g - g1) / (h - g1 + e), at least 0."""
        reach, extension = self.reach[s, i, w], self._extension(s, i, w)
        length = (1.0 - MEASURED_AT) * reach + extension
        return ti.max(1.0 - (gap - MEASURED_AT * reach) / length, 0.0)


@dataclass(frozen=True)
class PairLaws:
    """Adhesion between the groups of the surfaces of bodies.

    Arrays (groups, groups): work w [J/m^2], zero where nothing adheres; either stress s [Pa] or
    range h [m]; shear_strength tau [Pa], negative where friction is mu N; portion of the area that
    the points of the first group contribute, the rest comes from those of the second. zone: length
    E* w / s^2 [m] of the cohesive zone that the facets, up to size [m], resolve worst.
    """

    work: PerScenario[np.ndarray]
    stress: PerScenario[np.ndarray]
    range: PerScenario[np.ndarray]
    shear_strength: PerScenario[np.ndarray]
    portion: np.ndarray
    zone: PerScenario[float]
    size: PerScenario[float]

    @property
    def farthest(self) -> float:
        """Upper bound [m] of the gap of attraction, a power of 2: a constant in kernels."""
        with np.errstate(divide="ignore", invalid="ignore"):
            of_stress = np.where(self.stress > 0.0, 2.0 * self.work / self.stress, 0.0)
        return power_of_two_above(float(np.maximum(of_stress, self.range).max()))


class PairAdhesion(NodalAdhesion):
    """Adhesion of `count` points of surfaces to facets; one entry of `laws` a scenario.

    State of a point, (scenarios, count): group of the facet that it is near, -1 for none yet, and
    the area [m^2] with which it adheres to that group, determined when it met it.
    """

    def __init__(self, laws: Sequence[PairLaws], count: int) -> None:
        self.stress_of_range = ti.func(stress_of_range)
        nothing = np.zeros((count, 1))
        of_points = Adhesion(nothing, nothing + 1.0, nothing + np.inf, nothing, nothing)
        super().__init__([of_points] * len(laws))
        self.work = real_field(np.stack([each.work for each in laws]))
        self.stress = real_field(np.stack([each.stress for each in laws]))
        self.range = real_field(np.stack([each.range for each in laws]))
        self.shear_strength = real_field(np.stack([each.shear_strength for each in laws]))
        self.portion = real_field(laws[0].portion)
        self.group = index_field(np.full((len(laws), count), -1))
        self.area = real_field(np.zeros((len(laws), count)))

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return {
            "adhering_group": self.group,
            "adhering_area": self.area,
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
    def law(self, s, one, other, compliance):
        """Return w [J/m^2], s [Pa], tau [Pa] and the part of s that tau replaces, of two groups.

        compliance: c = A / k_n [m/Pa].
        """
        work, reach = self.work[s, one, other], self.range[s, one, other]
        stress, tau, sheared = self.stress[s, one, other], self.shear_strength[s, one, other], 0.0
        if reach > 0.0:
            stress = self.stress_of_range(work, reach, compliance, KERNEL)
        if tau >= 0.0:
            sheared = stress
        return ti.Vector([work, stress, ti.max(tau, 0.0), sheared])

    @ti.func
    def act(self, s, i, law, k_n):
        """Let point i adhere by a law, as `law` returns it. k_n: its stiffness [N/m]."""
        area = self.area[s, i]
        if k_n == 0.0:
            area = 0.0
        F, reach = law[1] * area, ti.cast(1.0, backend.real)
        if F > 0.0:
            reach = 2.0 * law[0] * area / F - F / k_n
        self.attraction[s, i, 0], self.reach[s, i, 0] = F, reach
        self.shear[s, i, 0], self.sheared[s, i, 0] = law[2] * area, law[3] * area

    @ti.func
    def reach_of(self, s, i):
        """Return the gap [m] below which point i is attracted; zero if nothing attracts it."""
        reach = self.reach[s, i, 0]
        if self.attraction[s, i, 0] == 0.0:
            reach = 0.0
        return reach
