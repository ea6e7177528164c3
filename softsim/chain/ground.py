"""What the ground does: limbs push, damp, rub and drive."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Weight:
    """Gravity on a slope: x runs up along it, z away from it.

    weights: m g of the nodes, (n,) [N]. slope: its angle [rad].
    """

    weights: np.ndarray
    slope: float

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(n,) [N]: m g (-sin, -cos). It acts in contact too, where the thesis's 5.6 takes it away
        and its 5.20 does not.
        """
        return -1j * np.exp(-1j * self.slope) * self.weights

    def energy(self, p: np.ndarray) -> np.ndarray:
        """(...) [J]."""
        return (p * np.exp(1j * self.slope)).imag @ self.weights


@dataclass(frozen=True, eq=False)
class Limbs:
    """Springs below the nodes, which push where z < 0 and never pull (thesis 5.5).

    stiffnesses: n_i k_z, of all limbs of a node together, (n,) [N/m].
    """

    stiffnesses: np.ndarray

    def pressing(self, p: np.ndarray) -> np.ndarray:
        """The force of the springs (..., n) [N]."""
        return self.stiffnesses * np.maximum(-p.imag, 0.0)

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n) [N]."""
        return 1j * self.pressing(p)

    def energy(self, p: np.ndarray) -> np.ndarray:
        """(...) [J]."""
        return 0.5 * (np.minimum(p.imag, 0.0) ** 2 @ self.stiffnesses)


@dataclass(frozen=True, eq=False)
class Thrust:
    """A pressed limb, which leans, also pushes forward (thesis 5.22, Fig 3.5).

    ratios: forward force over pressing force (n,): one half in the thesis, of the head alone.
    """

    limbs: Limbs
    ratios: np.ndarray

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n) [N]."""
        return self.ratios * self.limbs.pressing(p)


@dataclass(frozen=True)
class Damper:
    """-b z' on each node, wherever it is (thesis 5.20).

    coefficient: b [N s/m].
    """

    coefficient: float

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n) [N]."""
        return -1j * self.coefficient * v.imag


@dataclass(frozen=True)
class ContactDamper(Damper):
    """-b z' on nodes that touch the ground (thesis, text of Fig 5.7)."""

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n) [N]."""
        return super().on_nodes(t, p, v) * touching(p)


DAMPERS = {"always": Damper, "contact": ContactDamper}


@dataclass(frozen=True, eq=False)
class Drag:
    """-b x' on the nodes (thesis 5.19, of the head alone).

    coefficients: b of the nodes (n,) [N s/m].
    """

    coefficients: np.ndarray

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n) [N]."""
        return -self.coefficients * v.real


@dataclass(frozen=True, eq=False)
class WeightFriction:
    """Coulomb's friction on nodes that touch, of their weight: -mu m g cos(slope) tanh(x' / v0).

    The thesis's 5.21 has the size, mu m g, and no direction: it must be against the motion. tanh
    makes the sign a smooth one.
    limits: mu m g cos(slope) of the nodes, (n,) [N]. full_speed: v0 [m/s].
    """

    limits: np.ndarray
    full_speed: float

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n) [N]."""
        return -self.limits * touching(p) * np.tanh(v.real / self.full_speed)


@dataclass(frozen=True, eq=False)
class NormalFriction:
    """Coulomb's friction of what presses on the ground: -mu N tanh(x' / v0), N of the springs.

    full_speed: v0 [m/s].
    """

    limbs: Limbs
    coefficient: float
    full_speed: float

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n) [N]."""
        return -self.coefficient * self.limbs.pressing(p) * np.tanh(v.real / self.full_speed)


def touching(p: np.ndarray) -> np.ndarray:
    """Which nodes touch the ground (..., n)."""
    return p.imag <= 0.0
