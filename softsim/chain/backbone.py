"""Backbone of a chain: links of constant length between nodes, with bending stiffness."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dposv

from softsim.chain.lattice import Lattice, dot, size, upwards
from softsim.errors import StabilityError


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
