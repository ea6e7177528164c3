"""What the ground does: limbs push, damp, rub and drive."""

from dataclasses import dataclass

import numpy as np

from softsim.chain.lattice import Lattice
from softsim.chain.vectors import level, size, upwards

LEAST_RATIO = 1e-100
"""Of a speed to that at which friction is full: below it tanh(r) / r is 1."""


@dataclass(frozen=True, eq=False)
class Weight:
    """Gravity on a slope: x runs up along it, z away from it.

    weights: m g of the nodes, (n,) [N]. slope: its angle [rad].
    """

    weights: np.ndarray
    slope: float

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n, d) [N]: m g (-sin, -cos). It acts in contact too, where the thesis's 5.6 takes
        it away and its 5.20 does not.
        """
        forces = np.zeros(p.shape)
        forces[..., 0] = -np.sin(self.slope) * self.weights
        forces[..., -1] = -np.cos(self.slope) * self.weights
        return forces

    def energy(self, p: np.ndarray) -> np.ndarray:
        """(...) [J]."""
        height = np.sin(self.slope) * p[..., 0] + np.cos(self.slope) * p[..., -1]
        return height @ self.weights


@dataclass(frozen=True, eq=False)
class Limbs:
    """Springs below the nodes, which push where z < 0 and never pull (thesis 5.5).

    stiffnesses: n_i k_z, of all limbs of a node together, (n,) [N/m].
    """

    stiffnesses: np.ndarray

    def pressing(self, p: np.ndarray) -> np.ndarray:
        """The force of the springs (..., n) [N]."""
        return self.stiffnesses * np.maximum(-p[..., -1], 0.0)

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n, d) [N]."""
        return upwards(self.pressing(p), p)

    def energy(self, p: np.ndarray) -> np.ndarray:
        """(...) [J]."""
        return 0.5 * (np.minimum(p[..., -1], 0.0) ** 2 @ self.stiffnesses)


@dataclass(frozen=True, eq=False)
class Thrust:
    """A pressed limb, which leans, also pushes forward (thesis 5.22, Fig 3.5).

    ratios: forward force over pressing force (n,): one half in the thesis, of the head alone.
    """

    limbs: Limbs
    ratios: np.ndarray
    lattice: Lattice

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n, d) [N]."""
        return (self.ratios * self.limbs.pressing(p))[..., None] * self.lattice.headings(p)


@dataclass(frozen=True)
class Damper:
    """-b z' on each node, wherever it is (thesis 5.20).

    coefficient: b [N s/m].
    """

    coefficient: float

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n, d) [N]."""
        return upwards(-self.coefficient * v[..., -1], v)


@dataclass(frozen=True)
class ContactDamper(Damper):
    """-b z' on nodes that touch the ground (thesis, text of Fig 5.7)."""

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n, d) [N]."""
        return super().on_nodes(t, p, v) * touching(p)[..., None]


DAMPERS = {"always": Damper, "contact": ContactDamper}


@dataclass(frozen=True, eq=False)
class Drag:
    """-b times the velocity along the ground (thesis 5.19, of the head alone).

    coefficients: b of the nodes (n,) [N s/m].
    """

    coefficients: np.ndarray

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n, d) [N]."""
        return -self.coefficients[:, None] * level(v)


@dataclass(frozen=True, eq=False)
class WeightFriction:
    """Coulomb's friction on nodes that touch, of their weight, mu m g cos(slope).

    The thesis's 5.21 has the size, mu m g, and no direction: it must be against the motion.
    limits: mu m g cos(slope) of the nodes, (n,) [N]. full_speed: v0 [m/s].
    """

    limits: np.ndarray
    full_speed: float

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n, d) [N]."""
        return (self.limits * touching(p))[..., None] * against(v, self.full_speed)


@dataclass(frozen=True, eq=False)
class NormalFriction:
    """Coulomb's friction of what presses on the ground, mu N against the motion, N of the springs.

    coefficients: mu of the nodes (n,). full_speed: v0 [m/s].
    """

    limbs: Limbs
    coefficients: np.ndarray
    full_speed: float

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n, d) [N]."""
        pressing = self.coefficients * self.limbs.pressing(p)
        return pressing[..., None] * against(v, self.full_speed)


def against(v: np.ndarray, full_speed: float) -> np.ndarray:
    """-tanh(|v| / v0) v / |v|, v the velocity along the ground (..., n, d): Coulomb's direction
    where nodes slide, made smooth about rest; in the plane -tanh(v / v0).
    """
    sliding = level(v) / full_speed
    ratio = np.maximum(size(sliding), LEAST_RATIO)
    return -(np.tanh(ratio) / ratio)[..., None] * sliding


def touching(p: np.ndarray) -> np.ndarray:
    """Which nodes touch the ground (..., n)."""
    return p[..., -1] <= 0.0
