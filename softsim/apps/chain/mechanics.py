"""Mechanics of a chain: lattice, links, forces, and the accelerations and energies that result.

A force is a class with `on_nodes(t, p, v)`; one that stores energy also has `energy(p)`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.linalg import block_diag
from scipy.linalg.lapack import dposv

from softsim.errors import StabilityError

# -------------------------------------------------------------------------------------------------
# Functions of vectors (..., d) in the plane (x, z) or in space (x, y, z), last component up.


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the scalar products (...) of vectors."""
    return (a * b).sum(axis=-1)


def size(a: np.ndarray) -> np.ndarray:
    """Return the lengths (...) of vectors."""
    return np.sqrt(dot(a, a))


def level(a: np.ndarray) -> np.ndarray:
    """Return the vectors without their upward component (..., d)."""
    along = a.copy()
    along[..., -1] = 0.0
    return along


def upwards(sizes: np.ndarray, like: np.ndarray) -> np.ndarray:
    """Return upward vectors of these sizes (...), with as many components as `like`."""
    vectors = np.zeros(like.shape)
    vectors[..., -1] = sizes
    return vectors


# -------------------------------------------------------------------------------------------------
# Nodes and links of a chain with one line of nodes, or two lines side by side.
#
# A set of links is given by its incidence matrix (links, nodes): 1 at the node in front, -1 at that
# behind. `incidence @ p` are the link vectors, and `incidence.T @ f` the nodal forces of link
# forces f.


@dataclass(frozen=True, eq=False)
class Lattice:
    """Nodes at rest, in the plane or in space, and the links between them.

    places: (n, d) [m]. along: incidence of the links from head to rear, (a, n). joints: pairs of
    consecutive links of these, (j, 2). bars: incidence of all links with constrained lengths,
    (b, n). kept: constrained combinations of the bars' lengths, (c, b); lengths: their values (c,)
    [m]. chords: (n, n), for each node the vector from the node behind it to the one in front.
    """

    places: np.ndarray
    along: np.ndarray
    joints: np.ndarray
    bars: np.ndarray
    kept: np.ndarray
    lengths: np.ndarray
    chords: np.ndarray

    def headings(self, p: np.ndarray) -> np.ndarray:
        """Return the forward unit vector along the ground of each node at p (..., n, d) [m].

        It points from the node behind to the one in front on the same side (..., n, d); in the
        plane it is always x.
        """
        ahead = level(self.chords @ p)
        return ahead / size(ahead)[..., None]


def line(gaps: np.ndarray) -> Lattice:
    """Return nodes in the plane (x, z) with gaps (n - 1,) [m] between them, the first at x = 0."""
    count = len(gaps) + 1
    places = np.zeros((count, 2))
    places[1:, 0] = -np.cumsum(gaps)
    along = np.eye(count - 1, count) - np.eye(count - 1, count, k=1)
    joints = np.column_stack([np.arange(count - 2), np.arange(1, count - 1)])
    return Lattice(places, along, joints, along, np.eye(count - 1), gaps, _chords(along))


def ladder(gaps: np.ndarray, distance: float) -> Lattice:
    """Return two lines of nodes in space (x, y, z) at a distance [m], the left one first.

    Cross links keep the distance. In each field between two of them the diagonals stay equally
    long: the field keeps its right angles but can twist, and neither side is preferred. One
    diagonal of constant length would prefer a side; two would prevent twist and leave the tensions
    undetermined.
    """
    one = line(gaps)
    count = len(one.places)
    left, right = np.eye(count), -np.eye(count)
    across = np.hstack([left, right])
    leftwards = np.hstack([left[:-1], right[1:]])  # from behind on the right
    rightwards = np.hstack([left[1:], right[:-1]])
    along = block_diag(one.along, one.along)
    sides = [
        np.column_stack([one.places[:, 0], np.full(count, y), one.places[:, 1]])
        for y in (0.5 * distance, -0.5 * distance)
    ]
    equal = np.eye(count - 1)
    return Lattice(
        places=np.concatenate(sides),
        along=along,
        joints=np.concatenate([one.joints, one.joints + count - 1]),
        bars=np.concatenate([along, across, leftwards, rightwards]),
        kept=block_diag(np.eye(len(along) + count), np.hstack([equal, -equal])),
        lengths=np.concatenate([gaps, gaps, np.full(count, distance), np.zeros(count - 1)]),
        chords=block_diag(one.chords, one.chords),
    )


def _chords(along: np.ndarray) -> np.ndarray:
    """Return the sum of the links that end at each node (n, n)."""
    return np.abs(along).T @ along


# -------------------------------------------------------------------------------------------------
# Backbone: links of constant length between nodes, with bending stiffness.


@dataclass(frozen=True, eq=False)
class Links:
    """Massless links between nodes with constraints on their lengths.

    lattice: nodes and links. inverse_masses: of the nodes, (n,) [1/kg]. rate: alpha [1/s], at which
    errors of the lengths decay.
    """

    lattice: Lattice
    inverse_masses: np.ndarray
    rate: float

    @cached_property
    def mobility(self) -> np.ndarray:
        """D M^-1 D^T (b, b) [1/kg] with the incidence D of the bars."""
        bars = self.lattice.bars
        return (bars * self.inverse_masses) @ bars.T

    def accelerations(self, forces: np.ndarray, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the accelerations of nodes at p with velocities v under forces; all (n, d).

        The forces are those besides the links' own. Lagrange's equations have a multiplier for each
        constrained length, m a = F + C^T lambda, with Baumgarte's stabilisation of R = S l - L
        (Baumgarte 1972; thesis 5.11 to 5.18):

            R'' + 2 alpha R' + alpha^2 R = 0,   l' = u.w,   l'' = u.w' + (|w|^2 - (u.w)^2) / l

        with u along a bar, w the relative velocity of its ends, S the constrained combinations of
        lengths, C = S u D. These accelerations give equations for lambda with the matrix
        C M^-1 C^T, where u D M^-1 D^T u^T is the mobility times the cosine of the angle between two
        bars.

        Raises StabilityError if they have no solution.
        """
        bars, kept = self.lattice.bars, self.lattice.kept
        bar, w = bars @ p, bars @ v
        length = size(bar)
        u = bar / length[:, None]
        stretching = dot(u, w)
        turning = dot(w, w) - stretching**2
        error = kept @ length - self.lattice.lengths
        free = forces * self.inverse_masses[:, None]
        due = kept @ (-turning / length - 2.0 * self.rate * stretching - dot(u, bars @ free))
        due -= self.rate**2 * error
        matrix = kept @ (self.mobility * (u @ u.T)) @ kept.T
        _, multipliers, failed = dposv(matrix, due)
        if failed and np.isfinite(due).all():
            raise StabilityError(
                "the links of the chain cannot keep their lengths: it has folded or twisted",
                "reduce time.increment, or reduce the motor force",
            )
        tension = multipliers @ kept
        return free + (bars.T @ (tension[:, None] * u)) * self.inverse_masses[:, None]

    def errors(self, p: np.ndarray) -> np.ndarray:
        """Return R, the errors of the constrained lengths (..., c) [m]."""
        return size(self.lattice.bars @ p) @ self.lattice.kept.T - self.lattice.lengths


@dataclass(frozen=True)
class Tilt:
    """Bending stiffness against the tilt psi of each link from the ground.

    U = sum k psi^2 / 2 (thesis 5.4).

    stiffness: k [N m/rad].
    """

    stiffness: float

    def pulls(self, d: np.ndarray, joints: np.ndarray) -> np.ndarray:
        """Return -dU/dd of links d (..., a, dim) [N], a couple in the vertical plane of a link."""
        along, up = d[..., :-1], d[..., -1]
        level = size(along)
        moment = -self.stiffness * np.arctan2(up, level)
        pulls = np.empty(d.shape)
        pulls[..., :-1] = -(moment * up / level)[..., None] * along
        pulls[..., -1] = moment * level
        return pulls / dot(d, d)[..., None]

    def energy(self, d: np.ndarray, joints: np.ndarray) -> np.ndarray:
        """Return the stored energy (...) [J]."""
        tilt = np.arctan2(d[..., -1], size(d[..., :-1]))
        return 0.5 * self.stiffness * (tilt**2).sum(axis=-1)


@dataclass(frozen=True)
class JointStiffness:
    """Bending stiffness against the angle theta between the links of each joint.

    U = sum k theta^2 / 2, which does not depend on the direction of the ground.

    stiffness: k [N m/rad].
    """

    stiffness: float

    def pulls(self, d: np.ndarray, joints: np.ndarray) -> np.ndarray:
        """Return -dU/dd of links d (..., a, dim) [N]: k theta / |d| towards the other link."""
        length = size(d)[..., None]
        u = d / length
        pulls = np.zeros(d.shape)
        for one, other in (joints.T, joints.T[::-1]):
            across, angle = _between(u[..., one, :], u[..., other, :])
            # theta / sin(theta), 1 where links are in line
            share = self.stiffness / np.sinc(angle / np.pi)
            pulls[..., one, :] += share[..., None] * across / length[..., one, :]
        return pulls

    def energy(self, d: np.ndarray, joints: np.ndarray) -> np.ndarray:
        """Return the stored energy (...) [J]."""
        u = d / size(d)[..., None]
        _, angle = _between(u[..., joints[:, 0], :], u[..., joints[:, 1], :])
        return 0.5 * self.stiffness * (angle**2).sum(axis=-1)


def _between(u: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the part of `other` normal to u (..., j, dim), and the angle between both (..., j)."""
    cosine = dot(u, other)
    across = other - cosine[..., None] * u
    return across, np.arctan2(size(across), cosine)


Bending = Tilt | JointStiffness
BENDINGS: dict[str, type[Bending]] = {"tilt": Tilt, "joint": JointStiffness}


@dataclass(frozen=True, eq=False)
class BendingForce:
    """Nodal forces of bending, -dU/dp, a couple at the ends of each link along the chain.

    The sign follows from the energy; 5.19 and 5.20 of the thesis print the couple with the opposite
    sign, which would drive links away from the minimum of their energy.
    """

    bending: Bending
    lattice: Lattice

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        along = self.lattice.along
        return along.T @ self.bending.pulls(along @ p, self.lattice.joints)

    def energy(self, p: np.ndarray) -> np.ndarray:
        return self.bending.energy(self.lattice.along @ p, self.lattice.joints)


@dataclass(frozen=True, eq=False)
class WaveForce:
    """Upward force T sin(psi) of a wave along the backbone on the node behind each link.

    psi is the tilt of the link (thesis 5.24). The thesis has no reaction on the node in front, so
    that momentum is not conserved.

    tension: T [N].
    """

    tension: float
    lattice: Lattice

    @cached_property
    def behind(self) -> np.ndarray:
        """Matrix (n, a) that is 1 for the node behind each link, else 0."""
        return np.maximum(-self.lattice.along.T, 0.0)

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        d = self.lattice.along @ p
        sines = d[..., -1] / size(d)
        return upwards(self.tension * (sines @ self.behind.T), p)


# -------------------------------------------------------------------------------------------------
# Forces of the ground: weight, limbs, thrust, damping and friction.

LEAST_RATIO = 1e-100
"""Least ratio r of a speed to that of full friction: below it tanh(r) / r is 1."""


@dataclass(frozen=True, eq=False)
class Weight:
    """Gravity on a slope: x runs up along it, z away from it.

    weights: m g of the nodes, (n,) [N]. slope: its angle [rad].
    """

    weights: np.ndarray
    slope: float

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the force on each node (..., n, d) [N], m g (-sin, -cos).

        It acts in contact too, as in 5.20 of the thesis, but not in its 5.6.
        """
        forces = np.zeros(p.shape)
        forces[..., 0] = -np.sin(self.slope) * self.weights
        forces[..., -1] = -np.cos(self.slope) * self.weights
        return forces

    def energy(self, p: np.ndarray) -> np.ndarray:
        height = np.sin(self.slope) * p[..., 0] + np.cos(self.slope) * p[..., -1]
        return height @ self.weights


@dataclass(frozen=True, eq=False)
class Limbs:
    """Springs below the nodes, which push if z < 0 and never pull (thesis 5.5).

    stiffnesses: n_i k_z, of all limbs of a node together, (n,) [N/m].
    """

    stiffnesses: np.ndarray

    def pressing(self, p: np.ndarray) -> np.ndarray:
        """Return the force of the springs (..., n) [N]."""
        return self.stiffnesses * np.maximum(-p[..., -1], 0.0)

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        return upwards(self.pressing(p), p)

    def energy(self, p: np.ndarray) -> np.ndarray:
        return 0.5 * (np.minimum(p[..., -1], 0.0) ** 2 @ self.stiffnesses)


@dataclass(frozen=True, eq=False)
class Thrust:
    """Forward force of the inclined limbs under pressure (thesis 5.22, Fig 3.5).

    ratios: forward force over pressing force (n,); in the thesis one half at the head, else 0.
    """

    limbs: Limbs
    ratios: np.ndarray
    lattice: Lattice

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        return (self.ratios * self.limbs.pressing(p))[..., None] * self.lattice.headings(p)


@dataclass(frozen=True)
class Damper:
    """Damping force -b z' on each node at any height (thesis 5.20).

    coefficient: b [N s/m].
    """

    coefficient: float

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        return upwards(-self.coefficient * v[..., -1], v)


@dataclass(frozen=True)
class ContactDamper(Damper):
    """Damping force -b z' on nodes that touch the ground (thesis, text of Fig 5.7)."""

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        return super().on_nodes(t, p, v) * touching(p)[..., None]


DAMPERS = {"always": Damper, "contact": ContactDamper}


@dataclass(frozen=True, eq=False)
class Drag:
    """Drag -b times the velocity along the ground (thesis 5.19, there of the head alone).

    coefficients: b of the nodes (n,) [N s/m].
    """

    coefficients: np.ndarray

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        return -self.coefficients[:, None] * level(v)


@dataclass(frozen=True, eq=False)
class WeightFriction:
    """Coulomb friction mu m g cos(slope) of the weight of nodes that touch the ground.

    5.21 of the thesis gives the magnitude mu m g without a direction; it is against the motion.
    limits: mu m g cos(slope) of the nodes, (n,) [N]. full_speed: v0 [m/s].
    """

    limits: np.ndarray
    full_speed: float

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        return (self.limits * touching(p))[..., None] * against(v, self.full_speed)


@dataclass(frozen=True, eq=False)
class NormalFriction:
    """Coulomb friction mu N against the motion, with the normal force N of the springs.

    coefficients: mu of the nodes (n,). full_speed: v0 [m/s].
    """

    limbs: Limbs
    coefficients: np.ndarray
    full_speed: float

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        pressing = self.coefficients * self.limbs.pressing(p)
        return pressing[..., None] * against(v, self.full_speed)


def against(v: np.ndarray, full_speed: float) -> np.ndarray:
    """Return -tanh(|v| / v0) v / |v| (..., n, d) of the velocity v along the ground.

    This is the direction of Coulomb friction, smoothed near rest; in the plane -tanh(v / v0).
    """
    sliding = level(v) / full_speed
    ratio = np.maximum(size(sliding), LEAST_RATIO)
    return -(np.tanh(ratio) / ratio)[..., None] * sliding


def touching(p: np.ndarray) -> np.ndarray:
    """Return an array (..., n) that is True for nodes that touch the ground."""
    return p[..., -1] <= 0.0


# -------------------------------------------------------------------------------------------------
# Motors that rotate eccentric masses in the upright plane of the heading of their nodes.

TURNS = {"counterclockwise": 1, "clockwise": -1}
"""Sense of rotation, seen with forward to the right and z up."""


@dataclass(frozen=True, eq=False)
class Motors:
    """Centripetal forces of eccentric masses, which start at the lowest point (thesis 3.1, 3.2).

    The masses and their weights are part of those of the nodes. moments: m_e e, zero where no motor
    runs, (n,) [kg m]. angular_velocities: w, negative for clockwise rotation, (n,) [rad/s].
    """

    moments: np.ndarray
    angular_velocities: np.ndarray
    lattice: Lattice

    def at(self, frequency: float) -> "Motors":
        """Return the motors at another frequency [Hz] with the same sense of rotation."""
        speeds = np.copysign(math.tau * frequency, self.angular_velocities)
        return replace(self, angular_velocities=speeds)

    @cached_property
    def forces(self) -> np.ndarray:
        """Magnitudes m_e e w^2 of the forces (n,) [N]."""
        return self.moments * self.angular_velocities**2

    @property
    def longest_turn(self) -> float:
        """Duration of one turn of the slowest motor [s]."""
        return float(math.tau / np.abs(self.angular_velocities).min())

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the forces (..., n, d) [N]: m_e e w^2 (sin wt forward, -cos wt up)."""
        angles = np.asarray(t)[..., None] * self.angular_velocities
        forces = (self.forces * np.sin(angles))[..., None] * self.lattice.headings(p)
        forces[..., -1] = -self.forces * np.cos(angles)
        return forces


# -------------------------------------------------------------------------------------------------
# Chain of nodes and links, with the forces on it.


class Force(Protocol):
    """Force on nodes at time t [s], positions p [m] and velocities v [m/s], (..., n, d) each."""

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the force on each node (..., n, d) [N]."""
        ...


class Conservative(Force, Protocol):
    """Conservative force, which has an energy."""

    def energy(self, p: np.ndarray) -> np.ndarray:
        """Return the stored energy (...) [J]."""
        ...


@dataclass(frozen=True, eq=False)
class Chain:
    """Chain with one or two lines of nodes, each from the front to the rear.

    masses: of the nodes (n,) [kg]. heads: numbers of the nodes with motors. links: between nodes.
    stores: conservative forces, by name. motors: on the heads. others: all other forces, by name.
    """

    masses: np.ndarray
    heads: np.ndarray
    links: Links
    stores: Mapping[str, Conservative]
    motors: Motors
    others: Mapping[str, Force]

    @property
    def node_count(self) -> int:
        """Number of nodes n."""
        return len(self.masses)

    def driven_at(self, frequency: float) -> "Chain":
        """Return the chain with its motors at another frequency [Hz]."""
        return replace(self, motors=self.motors.at(frequency))

    @cached_property
    def workers(self) -> dict[str, Force]:
        """All forces without an energy by name: the motors and the others."""
        return {"motor": self.motors, **self.others}

    @cached_property
    def _forces(self) -> list[Force]:
        return [*self.stores.values(), *self.workers.values()]

    def at_rest(self) -> np.ndarray:
        """Return the initial state, positions and velocities (2, n, d) [m, m/s].

        All limbs just touch the ground, and the front is at x = 0.
        """
        places = self.links.lattice.places
        return np.stack([places, np.zeros_like(places)])

    def rates(self, t: float, state: np.ndarray) -> np.ndarray:
        """Return the time derivatives of positions and velocities (2, n, d) [m/s, m/s^2]."""
        p, v = state
        forces = np.zeros_like(p)
        for force in self._forces:
            forces += force.on_nodes(t, p, v)
        return np.array([v, self.links.accelerations(forces, p, v)])

    def kinetic_energy(self, v: np.ndarray) -> np.ndarray:
        """Return the kinetic energy (...) [J]."""
        return 0.5 * (dot(v, v) @ self.masses)

    def power(self, name: str, t: np.ndarray, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the power (...) [W] of one of the workers, by name."""
        return dot(self.workers[name].on_nodes(t, p, v), v).sum(axis=-1)
