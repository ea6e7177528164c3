"""Interface of a law: an isotropic isochoric strain energy of the invariants of C_bar.

Every isotropic W(C_bar) with det C_bar = 1 is a function of I1_bar and I2_bar, one in principal
stretches too. `b`, here and wherever laws are used in numpy, are the squared isochoric principal
stretches (..., 3): I1_bar = sum b_k, I2_bar = sum 1/b_k. With W1 = dW/dI1_bar, W2 = dW/dI2_bar,
    tau_k = dW / d ln(stretch k) = 2 W1 dev(b)_k - 2 W2 dev(1/b)_k
is the deviatoric Kirchhoff stress (Holzapfel 2000, Nonlinear Solid Mechanics, section 6.5).

The functions that kernels use, with the constants as `c`, are written once for floats, numpy arrays
and Taichi lane vectors; they carry no annotations, because Taichi would read them.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from softsim.materials.functions import Functions

DEVIATOR = np.eye(3) - 1.0 / 3.0
"""P: subtracts the mean of three principal values."""


class Law(ABC):
    """Law with its constants, which are fields with the names used in scenes."""

    depends_on_I2: ClassVar[bool]
    """True for a TwoInvariantLaw; kernels of other laws do not compute I2_bar."""
    pure_numbers: ClassVar[tuple[str, ...]] = ()
    """Names of dimensionless fields; the others are in Pa."""
    most_terms: ClassVar[int]
    """Largest number of terms that can be fitted."""

    @classmethod
    def of_constants(cls, constants: Sequence[float]) -> "Law":
        """Return the law with these `constants`; constants that are left out are zero."""
        return cls(*constants)

    @classmethod
    def starts(cls, terms: int, modulus: float) -> list[tuple[float, ...]]:
        """Return start values of a fit, for an initial shear modulus of about `modulus` [Pa].

        terms: number of terms. The list is empty where the stress is linear in the constants.
        """
        return []

    @property
    @abstractmethod
    def constants(self) -> tuple[float, ...]:
        """Constants that the energy density and its derivatives take as `c`."""

    @property
    @abstractmethod
    def initial_shear_modulus(self) -> float:
        """mu0 = 2 (W1 + W2) at rest [Pa]."""

    @property
    def initial_stiffening(self) -> float:
        """Additional modulus [Pa] beside mu0 in the stable time step of a single element."""
        return 0.0

    @abstractmethod
    def slopes(self, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return W1 and W2 (...,) [Pa]."""

    @abstractmethod
    def stiffness(self, b: np.ndarray) -> np.ndarray:
        """Return H = d2W / d ln(stretch i) d ln(stretch k) (..., 3, 3) [Pa]."""

    def extra_stress(self, b: np.ndarray) -> np.ndarray:
        """Return the principal Kirchhoff stresses (..., 3) [Pa] up to a pressure."""
        W1, W2 = self.slopes(b)
        return 2.0 * (W1[..., None] * b - W2[..., None] / b)

    def stress(self, b: np.ndarray) -> np.ndarray:
        """Return the deviatoric principal Kirchhoff stresses tau_k (..., 3) [Pa]."""
        return self.extra_stress(b) @ DEVIATOR

    def shear_stiffness(self, b: np.ndarray) -> np.ndarray:
        """Return the smallest W1 + W2 b_k (...,) [Pa], which is (tau_i - tau_j) / (b_i - b_j) / 2.

        Where it is not positive, the greater stretch has not the greater stress (Baker and Ericksen
        1954, J. Wash. Acad. Sci. 44:33-35).
        """
        W1, W2 = self.slopes(b)
        return (W1[..., None] + W2[..., None] * b).min(axis=-1)


class FirstInvariantLaw(Law):
    """Law W(I1_bar)."""

    depends_on_I2 = False

    @property
    @abstractmethod
    def energy_density(self) -> Any:
        """W(I1_bar, c) [J/m^3]."""

    @property
    @abstractmethod
    def energy_slope(self) -> Any:
        """W' = dW/dI1_bar(I1_bar, c) [Pa]."""

    @property
    @abstractmethod
    def energy_curvature(self) -> Any:
        """W'' = d2W/dI1_bar2(I1_bar, c) [Pa]."""

    @property
    def initial_stiffening(self) -> float:
        """4 I1_bar W'' at rest, where W' rises from there."""
        return max(12.0 * float(self.energy_curvature(3.0, self.constants)), 0.0)

    def slopes(self, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return W1 = W' and W2 = 0 (...,) [Pa]."""
        W1 = np.asarray(self.energy_slope(b.sum(axis=-1), self.constants))
        return W1, np.zeros_like(W1)

    def stiffness(self, b: np.ndarray) -> np.ndarray:
        """Return H = 4 W' P diag(b) P + 4 W'' e e^T with e = dev b."""
        I1_bar, e = b.sum(axis=-1)[..., None, None], b @ DEVIATOR
        slope = self.energy_slope(I1_bar, self.constants)
        curvature = self.energy_curvature(I1_bar, self.constants)
        outer = e[..., :, None] * e[..., None, :]
        return 4.0 * slope * projected(b) + 4.0 * curvature * outer


class TwoInvariantLaw(Law):
    """Law W(I1_bar, I2_bar); `m`: the `Functions` of the arguments' kind."""

    depends_on_I2 = True

    @property
    @abstractmethod
    def energy_density(self) -> Any:
        """W(I1_bar, I2_bar, c, m) [J/m^3]."""

    @property
    @abstractmethod
    def energy_slopes(self) -> Any:
        """(W1, W2)(I1_bar, I2_bar, c, m) [Pa]."""

    def slopes(self, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return W1 and W2 (...,) [Pa]."""
        I1_bar, I2_bar = b.sum(axis=-1), (1.0 / b).sum(axis=-1)
        W1, W2 = self.energy_slopes(I1_bar, I2_bar, self.constants, Functions())
        return W1, W2


def projected(values: np.ndarray) -> np.ndarray:
    """Return P diag(values) P (..., 3, 3) of principal values (..., 3)."""
    return DEVIATOR @ (values[..., None] * DEVIATOR)
