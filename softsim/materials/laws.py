"""Laws of rubber: isotropic isochoric strain energies of the invariants of C_bar.

Every isotropic W(C_bar) with det C_bar = 1 is a function of I1_bar and I2_bar, one in principal
stretches too. `b`, here and wherever laws are used in numpy, are the squared isochoric principal
stretches (..., 3): I1_bar = sum b_k, I2_bar = sum 1/b_k. With W1 = dW/dI1_bar, W2 = dW/dI2_bar,
    tau_k = dW / d ln(stretch k) = 2 W1 dev(b)_k - 2 W2 dev(1/b)_k
is the deviatoric Kirchhoff stress (Holzapfel 2000, Nonlinear Solid Mechanics, section 6.5).

The functions that kernels use, with the constants as `c`, are written once for floats, numpy arrays
and Taichi lane vectors; they carry no annotations, because Taichi would read them.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, ClassVar

import numpy as np
from scipy import special

from softsim.errors import MaterialError

# -------------------------------------------------------------------------------------------------
# Elementary functions for laws, of floats and numpy arrays.
#
# Kernels use the same functions of lane vectors (elements/kinematics.py), compiled from the texts
# below: their arguments carry no annotations, which Taichi would read.

CLOSE = 3e-3
"""Difference of squared stretches below which a series is used: a second divided difference loses
eps / CLOSE^2 to rounding, and the series that stands for it CLOSE^5."""


class Functions:
    """Elementary functions, and functions of the principal stretches of isochoric deformations."""

    exp: Any
    log: Any
    sqrt: Any
    cos: Any
    acos: Any
    minimum: Any
    maximum: Any
    where: Any

    exp, log, sqrt, cos, acos = np.exp, np.log, np.sqrt, np.cos, np.arccos
    erf: Any = staticmethod(special.erf)
    minimum, maximum, where = np.minimum, np.maximum, staticmethod(np.where)

    def principal_logarithms(self, I1, I2):
        """Return ln c1 >= ln c2 >= ln c3 of the squared principal stretches.

        c1, c2, c3 are the roots of c^3 - I1 c^2 + I2 c - 1 = 0, by the angle of its three cosines
        (Smith 1961, Comm. ACM 4:168).
        """
        q = self.maximum((I1 * I1 - 3.0 * I2) / 9.0, 1e-30)
        r = (2.0 * I1 * I1 * I1 - 9.0 * I1 * I2 + 27.0) / 54.0
        size = self.sqrt(q)
        angle = self.acos(self.minimum(self.maximum(r / (q * size), -1.0), 1.0)) / 3.0
        c1 = I1 / 3.0 + 2.0 * size * self.cos(angle)
        # Two that are far below c1 lose digits to its size: their sum is (I2 - c2 c3) / c1.
        half = 0.5 * (I2 - 1.0 / c1) / c1
        below = half + self.sqrt(self.maximum(half * half - 1.0 / c1, 0.0))
        beside = I1 / 3.0 + 2.0 * size * self.cos(angle - 2.0943951023931953)
        u, v = self.log(c1), self.log(self.where(r > 0.0, below, beside))
        return u, v, -u - v  # c1 c2 c3 = 1

    def power_curvature(self, p, u, v, w):
        """Return the second divided difference of c^p at exp u >= exp v >= exp w with product 1.

        It is half the second derivative of c^p where all are equal.

        Where the three are close to their mean, the Taylor series there is used, in the complete
        homogeneous polynomials of the differences from it: h1 = 0, h2, h3, h4 = h2^2.
        """
        a, b, c = self.exp(u), self.exp(v), self.exp(w)
        mean = (a + b + c) / 3.0
        h2 = 0.5 * ((a - mean) * (a - mean) + (b - mean) * (b - mean) + (c - mean) * (c - mean))
        h3 = (a - mean) * (b - mean) * (c - mean)
        k = p * (p - 1.0) / 2.0
        k2 = k * (p - 2.0) * (p - 3.0) / 12.0
        k3 = k2 * (p - 4.0) / 5.0
        k4 = k3 * (p - 5.0) / 6.0
        near = mean ** (p - 2.0) * (k + k2 * h2 + k3 * h3 + k4 * h2 * h2)
        slopes = self.power_slope(p, u, v) - self.power_slope(p, v, w)
        return self.where(a - c < CLOSE, near, slopes / self.maximum(a - c, CLOSE))

    def power_slope(self, p, u, v):
        """Return (a^p - b^p) / (a - b) of a = exp u, b = exp v.

        With m = sqrt(a b), h = ln(a/b) / 2 it is m^(p-1) sinh(p h) / sinh h.
        """
        h = 0.5 * (u - v)
        ratio = self.sinh_ratio(p * h) / self.sinh_ratio(h)
        return p * self.exp(0.5 * (p - 1.0) * (u + v)) * ratio

    def erf_integral(self, x):
        """Return the integral of erf from 0 to x >= 0."""
        return x * self.erf(x) + (self.exp(-x * x) - 1.0) * 0.5641895835477563  # 1 / sqrt(pi)

    def sinh_ratio(self, x):
        """Return sinh x / x, by its series where |x| < 1: to x^14 / 15!."""
        s = x * x
        series = 1.0 + s / 6.0 * (1.0 + s / 20.0 * (1.0 + s / 42.0 * (1.0 + s / 72.0 * (
            1.0 + s / 110.0 * (1.0 + s / 156.0 * (1.0 + s / 210.0))))))  # fmt: skip
        far = self.where(s < 1.0, 1.0, x)
        return self.where(s < 1.0, series, (self.exp(far) - self.exp(-far)) / (2.0 * far))


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
    largest_constants: ClassVar[tuple[float, ...]] = (np.inf,)
    """Largest magnitude of each constant of a term in a fit from start values."""

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
    def energy(self, b: np.ndarray) -> np.ndarray:
        """Return W (...,) [J/m^3]."""

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

    def energy(self, b: np.ndarray) -> np.ndarray:
        """Return W (...,) [J/m^3]."""
        return np.asarray(self.energy_density(b.sum(axis=-1), self.constants))

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

    def energy(self, b: np.ndarray) -> np.ndarray:
        """Return W (...,) [J/m^3]."""
        I1_bar, I2_bar = b.sum(axis=-1), (1.0 / b).sum(axis=-1)
        return np.asarray(self.energy_density(I1_bar, I2_bar, self.constants, Functions()))

    def slopes(self, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return W1 and W2 (...,) [Pa]."""
        I1_bar, I2_bar = b.sum(axis=-1), (1.0 / b).sum(axis=-1)
        W1, W2 = self.energy_slopes(I1_bar, I2_bar, self.constants, Functions())
        return W1, W2


def projected(values: np.ndarray) -> np.ndarray:
    """Return P diag(values) P (..., 3, 3) of principal values (..., 3)."""
    return DEVIATOR @ (values[..., None] * DEVIATOR)


# -------------------------------------------------------------------------------------------------
# Homogeneous deformations of an incompressible sheet or bar: their stress and its slope.
#
# Each is one stretch l and principal stretches l^a that multiply to 1, so that W is a function of l
# alone. The nominal stress on an axis that is pulled is then dW/dl over the number of pulled axes
# (Ogden 1984, Non-linear Elastic Deformations, section 7.2; Holzapfel 2000, Nonlinear Solid
# Mechanics, section 6.5). For uniaxial tension that is P = 2 (l - l^-2) (W1 + W2 / l).


@dataclass(frozen=True)
class Mode:
    """Mode of deformation, with principal stretches that are powers of the applied stretch.

    name: in texts; exponents: of the three principal stretches, with the sum 0; an axis with the
    exponent 1 is a pulled one.
    """

    name: str
    exponents: tuple[float, float, float]

    def squared_stretches(self, stretch: np.ndarray) -> np.ndarray:
        """Return b (..., 3) [-] at stretches (...,)."""
        return stretch[..., None] ** (2.0 * np.array(self.exponents))

    def nominal_stress(self, law: Law, stretch: np.ndarray) -> np.ndarray:
        """Return the force over the undeformed area on a pulled axis [Pa]."""
        return self._energy_slope(law, stretch) / self._pulled_axes

    def stress_slope(self, law: Law, stretch: np.ndarray) -> np.ndarray:
        """Return d(nominal stress)/d(stretch) [Pa]: d2W/dl2 = (a . H a / l - dW/dl) / l."""
        a = np.array(self.exponents)
        change = law.stiffness(self.squared_stretches(stretch)) @ a @ a
        slope = (change / stretch - self._energy_slope(law, stretch)) / stretch
        return slope / self._pulled_axes

    @property
    def _pulled_axes(self) -> int:
        return self.exponents.count(1.0)

    def _energy_slope(self, law: Law, stretch: np.ndarray) -> np.ndarray:
        """Return dW/dl = a . tau / l [Pa]; exponents add up to 0, so a pressure has no effect."""
        tau = law.extra_stress(self.squared_stretches(stretch))
        return np.asarray(tau @ np.array(self.exponents) / stretch)


UNIAXIAL = Mode("uniaxial", (1.0, -0.5, -0.5))
EQUIBIAXIAL = Mode("equibiaxial", (1.0, 1.0, -2.0))
PLANAR = Mode("planar", (1.0, 0.0, -1.0))
"""Planar tension, also called pure shear: a wide sheet pulled between its long edges."""


# -------------------------------------------------------------------------------------------------
# Neo-Hooke: W = C10 (I1_bar - 3).
#
# Rivlin 1948, Phil. Trans. R. Soc. A 240:459-490; ABAQUS's *HYPERELASTIC, NEO HOOKE. Its stress
# rises in every mode of deformation, and it does not stiffen: good to strains of some 50 %.


@dataclass(frozen=True)
class NeoHooke(FirstInvariantLaw):
    """Constant C10 [Pa] of the isochoric energy density."""

    C10: float

    most_terms = 1

    @property
    def constants(self) -> tuple[float, ...]:
        return (self.C10,)

    @property
    def initial_shear_modulus(self) -> float:
        """mu0 = 2 dW/dI1_bar at rest [Pa]."""
        return 2.0 * self.C10

    @staticmethod
    def energy_density(I1_bar, c):
        """Return W [J/m^3]."""
        return c[0] * (I1_bar - 3.0)

    @staticmethod
    def energy_slope(I1_bar, c):
        """Return dW/dI1_bar [Pa] with the type of I1_bar, such as a lane vector."""
        return c[0] + 0.0 * I1_bar

    @staticmethod
    def energy_curvature(I1_bar, c):
        """Return d2W/dI1_bar2 [Pa] with the type of I1_bar."""
        return 0.0 * I1_bar


# -------------------------------------------------------------------------------------------------
# Mooney-Rivlin: W = C10 (I1_bar - 3) + C01 (I2_bar - 3).
#
# Mooney 1940, J. Appl. Phys. 11:582-592; ABAQUS's *HYPERELASTIC, MOONEY-RIVLIN.


@dataclass(frozen=True)
class MooneyRivlin(TwoInvariantLaw):
    """Constants C10, C01 [Pa] of the isochoric energy density."""

    C10: float
    C01: float = 0.0

    most_terms = 2

    @property
    def constants(self) -> tuple[float, ...]:
        return (self.C10, self.C01)

    @property
    def initial_shear_modulus(self) -> float:
        """mu0 = 2 (C10 + C01) [Pa]."""
        return 2.0 * (self.C10 + self.C01)

    @staticmethod
    def energy_density(I1_bar, I2_bar, c, m):
        """Return W [J/m^3]."""
        return c[0] * (I1_bar - 3.0) + c[1] * (I2_bar - 3.0)

    @staticmethod
    def energy_slopes(I1_bar, I2_bar, c, m):
        """Return (dW/dI1_bar, dW/dI2_bar) [Pa] with the type of I1_bar, such as a lane vector."""
        return c[0] + 0.0 * I1_bar, c[1] + 0.0 * I1_bar

    def stiffness(self, b: np.ndarray) -> np.ndarray:
        """Return H = 4 C10 P diag(b) P + 4 C01 P diag(1/b) P."""
        return 4.0 * projected(self.C10 * b + self.C01 / b)


# -------------------------------------------------------------------------------------------------
# Yeoh: W = C10 k + C20 k^2 + C30 k^3 with k = I1_bar - 3.
#
# Yeoh 1993, Rubber Chem. Technol. 66:754-771; ABAQUS's *HYPERELASTIC, YEOH.


@dataclass(frozen=True)
class Yeoh(FirstInvariantLaw):
    """Constants C10, C20, C30 [Pa] of the isochoric energy density."""

    C10: float
    C20: float = 0.0
    C30: float = 0.0

    most_terms = 3

    @property
    def constants(self) -> tuple[float, ...]:
        return (self.C10, self.C20, self.C30)

    @property
    def initial_shear_modulus(self) -> float:
        """mu0 = 2 dW/dI1_bar at rest [Pa]."""
        return 2.0 * self.C10

    @staticmethod
    def energy_density(I1_bar, c):
        """Return W [J/m^3]."""
        k = I1_bar - 3.0
        return k * (c[0] + k * (c[1] + k * c[2]))

    @staticmethod
    def energy_slope(I1_bar, c):
        """Return dW/dI1_bar [Pa]."""
        k = I1_bar - 3.0
        return c[0] + k * (2.0 * c[1] + k * (3.0 * c[2]))

    @staticmethod
    def energy_curvature(I1_bar, c):
        """Return d2W/dI1_bar2 [Pa]."""
        k = I1_bar - 3.0
        return 2.0 * c[1] + 6.0 * c[2] * k


# -------------------------------------------------------------------------------------------------
# Ogden: W = sum 2 mu_i / alpha_i^2 (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3).
#
# l1, l2, l3 are the isochoric principal stretches, the constants those of ABAQUS's *HYPERELASTIC,
# OGDEN: mu0 = sum mu_i. Ogden 1972, Proc. R. Soc. Lond. A 326:565-584.
#
# As a function of the invariants: with c_k = l_k^2, the roots of c^3 - I1_bar c^2 + I2_bar c - 1,
# dc_k/dI1_bar = c_k^2 / ((c_k - c_i)(c_k - c_j)) and dc_k/dI2_bar = -c_k / (the same), so that
#     dW/dI1_bar =  sum mu_i / alpha_i [c1, c2, c3] of c^(alpha_i/2 + 1),
#     dW/dI2_bar = -sum mu_i / alpha_i [c1, c2, c3] of c^(alpha_i/2),
# [..] the second divided difference, which has a limit where stretches are equal.

START_EXPONENTS = (1.5, 5.0, -2.0, -5.0)
"""Start values of alpha in a fit; Ogden 1972 gives 1.3, 5 and -2 for rubber."""

LARGEST_EXPONENT = 10.0
"""Largest magnitude of alpha in a fit, twice that of Ogden's rubber.

Uniaxial tension hardly shows a negative exponent: without a bound, fits to it reach -44, which
multiplies the stress in other modes.
"""


@dataclass(frozen=True)
class Ogden(TwoInvariantLaw):
    """Moduli mu [Pa] and exponents alpha [-], in equal number."""

    mu: tuple[float, ...]
    alpha: tuple[float, ...]

    pure_numbers = ("alpha",)
    most_terms = 3
    largest_constants = (np.inf, LARGEST_EXPONENT)

    @classmethod
    def of_constants(cls, constants: Sequence[float]) -> "Ogden":
        """Return the law with mu_1, alpha_1, mu_2, alpha_2, ..."""
        return cls(tuple(constants[0::2]), tuple(constants[1::2]))

    @classmethod
    def starts(cls, terms: int, modulus: float) -> list[tuple[float, ...]]:
        """Return equal fractions of the modulus for every combination of the start exponents.

        Where moduli stay positive, as in a fit, the law is stable in shear at all stretches.
        """
        return [
            tuple(c for alpha in exponents for c in (modulus / terms, alpha))
            for exponents in combinations(START_EXPONENTS, terms)
        ]

    @property
    def constants(self) -> tuple[float, ...]:
        """mu_1 [Pa], alpha_1, mu_2, alpha_2, ..."""
        return tuple(c for term in zip(self.mu, self.alpha, strict=True) for c in term)

    @property
    def initial_shear_modulus(self) -> float:
        """mu0 = sum mu_i [Pa]."""
        return sum(self.mu)

    @staticmethod
    def energy_density(I1_bar, I2_bar, c, m):
        """Return W [J/m^3]."""
        u, v, w = m.principal_logarithms(I1_bar, I2_bar)
        W = 0.0 * I1_bar
        for i in range(len(c) // 2):
            half = 0.5 * c[2 * i + 1]
            W += 0.5 * c[2 * i] / (half * half) * (
                m.exp(half * u) + m.exp(half * v) + m.exp(half * w) - 3.0
            )  # fmt: skip
        return W

    @staticmethod
    def energy_slopes(I1_bar, I2_bar, c, m):
        """Return (dW/dI1_bar, dW/dI2_bar) [Pa]."""
        u, v, w = m.principal_logarithms(I1_bar, I2_bar)
        W1 = 0.0 * I1_bar
        W2 = 0.0 * I1_bar
        for i in range(len(c) // 2):
            half = 0.5 * c[2 * i + 1]
            share = 0.5 * c[2 * i] / half
            W1 += share * m.power_curvature(half + 1.0, u, v, w)
            W2 -= share * m.power_curvature(half, u, v, w)
        return W1, W2

    def extra_stress(self, b: np.ndarray) -> np.ndarray:
        """Return 2 sum mu_i / alpha_i l^alpha_i (..., 3) [Pa]."""
        alpha = np.array(self.alpha)
        return 2.0 * b[..., None] ** (0.5 * alpha) @ (np.array(self.mu) / alpha)

    def stiffness(self, b: np.ndarray) -> np.ndarray:
        """Return H = P diag(2 sum mu_i l^alpha_i) P."""
        powers = b[..., None] ** (0.5 * np.array(self.alpha))
        return projected(2.0 * powers @ np.array(self.mu))


# -------------------------------------------------------------------------------------------------
# Names of the laws.

LAWS: Mapping[str, type[Law]] = {
    "yeoh": Yeoh, "neo_hooke": NeoHooke, "mooney_rivlin": MooneyRivlin, "ogden": Ogden,
}  # fmt: skip
"""Name -> law, made from its fields in order."""


def named_law(name: str) -> type[Law]:
    """Return the law of this name, or raise MaterialError."""
    if name not in LAWS:
        raise MaterialError(f"there is no law '{name}'", hint=f"one of {', '.join(LAWS)}")
    return LAWS[name]
