"""The backbone: links of constant length between nodes, which resist bending."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dpbsv


@dataclass(frozen=True, eq=False)
class Links:
    """Massless links of constant length, from node to node.

    lengths: (n - 1,) [m]. inverse_masses: of the nodes, (n,) [1/kg]. rate: alpha [1/s], at which
    errors of the lengths die out.
    """

    lengths: np.ndarray
    inverse_masses: np.ndarray
    rate: float

    @cached_property
    def diagonal(self) -> np.ndarray:
        """Of C M^-1 C^T (n - 1,) [1/kg]."""
        return self.inverse_masses[:-1] + self.inverse_masses[1:]

    def accelerations(self, forces: np.ndarray, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Of the nodes at p, moving with v, under forces besides those in the links; all (n,).

        Lagrange's equations with a multiplier for each length, m a = F + C^T lambda, C the unit
        vectors u of the links, and Baumgarte's stabilisation of R = l - L (Baumgarte 1972; thesis
        5.11 to 5.18):

            R'' + 2 alpha R' + alpha^2 R = 0,   R' = u.w,   R'' = u.w' + (|w|^2 - (u.w)^2) / l

        with w the relative velocity of a link's ends. Without the accelerations they are
        C M^-1 C^T lambda = u.w' - C M^-1 F, tridiagonal.
        """
        link, w = links(p), links(v)
        length = np.abs(link)
        u = link / length
        stretching = (u.conj() * w).real
        turning = np.abs(w) ** 2 - stretching**2
        error = length - self.lengths
        due = -turning / length - self.rate * (2.0 * stretching + self.rate * error)
        free = forces * self.inverse_masses
        missing = due - (u.conj() * links(free)).real
        matrix = np.empty((2, len(u)))
        matrix[0] = self.diagonal
        matrix[1, :-1] = -(u[:-1].conj() * u[1:]).real * self.inverse_masses[1:-1]
        _, tension, _ = dpbsv(matrix, missing, lower=1)
        return free + couples(tension * u) * self.inverse_masses

    def errors(self, p: np.ndarray) -> np.ndarray:
        """R, by how much links are too long (..., n - 1) [m]."""
        return np.abs(links(p)) - self.lengths


def links(p: np.ndarray) -> np.ndarray:
    """From the node behind to that in front (..., n - 1) [m]."""
    return p[..., :-1] - p[..., 1:]


def couples(forces: np.ndarray) -> np.ndarray:
    """Forces of links (..., n - 1) on the nodes in front and, opposite, behind: (..., n) [N]."""
    on_nodes = np.zeros((*forces.shape[:-1], forces.shape[-1] + 1), complex)
    on_nodes[..., :-1] = forces
    on_nodes[..., 1:] -= forces
    return on_nodes


@dataclass(frozen=True)
class Tilt:
    """Each link resists its tilt psi against the ground, U = sum k psi^2 / 2 (thesis 5.4).

    stiffness: k [N m/rad].
    """

    stiffness: float

    def moments(self, d: np.ndarray) -> np.ndarray:
        """On the links d, turning them from x towards z (..., n - 1) [N m]."""
        return -self.stiffness * np.arctan2(d.imag, d.real)

    def energy(self, p: np.ndarray) -> np.ndarray:
        """(...) [J]."""
        return 0.5 * self.stiffness * (np.angle(links(p)) ** 2).sum(axis=-1)


@dataclass(frozen=True)
class Joint:
    """Each joint resists the angle between its links, U = sum k (psi_i - psi_(i+1))^2 / 2, as a
    body does that bends: it does not know where the ground is.

    stiffness: k [N m/rad].
    """

    stiffness: float

    def moments(self, d: np.ndarray) -> np.ndarray:
        """On the links d, turning them from x towards z (..., n - 1) [N m]."""
        moments = np.zeros(d.shape)
        bend = -self.stiffness * _between(d)
        moments[..., :-1] += bend
        moments[..., 1:] -= bend
        return moments

    def energy(self, p: np.ndarray) -> np.ndarray:
        """(...) [J]."""
        return 0.5 * self.stiffness * (_between(links(p)) ** 2).sum(axis=-1)


def _between(d: np.ndarray) -> np.ndarray:
    """psi_i - psi_(i+1) of links (..., n - 1), at the joints (..., n - 2)."""
    turn = d[..., :-1] * d[..., 1:].conj()
    return np.arctan2(turn.imag, turn.real)


Bending = Tilt | Joint
BENDINGS: dict[str, type[Bending]] = {"tilt": Tilt, "joint": Joint}


@dataclass(frozen=True)
class BendingForce:
    """What the moments of bending do to the nodes: -dU/dp, a couple at the ends of each link.

    As the energy says it; the thesis's 5.19 and 5.20 print the couple with the opposite sign, which
    would drive links away from where their energy is least.
    """

    bending: Bending

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n) [N]: M i d / l^2 on the node in front, its opposite on that behind."""
        d = links(p)
        return couples(1j * self.bending.moments(d) / d.conj())

    def energy(self, p: np.ndarray) -> np.ndarray:
        """(...) [J]."""
        return self.bending.energy(p)


@dataclass(frozen=True)
class WaveForce:
    """A wave along the backbone pulls each node up where the one in front is higher, T sin(psi)
    (thesis 5.24). The thesis has no reaction on the node in front: momentum is not kept.

    tension: T [N].
    """

    tension: float

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n) [N]."""
        d = links(p)
        forces = np.zeros(p.shape, complex)
        forces[..., 1:] = 1j * self.tension * d.imag / np.abs(d)
        return forces
