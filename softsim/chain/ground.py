"""Forces of the ground on a chain: weight, limbs, thrust, damping and friction."""

from dataclasses import dataclass

import numpy as np

from softsim.chain.lattice import Lattice, level, size, upwards

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
