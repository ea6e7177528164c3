"""The laws: isochoric strain energies W of rubber, and their names in scenes and commands.

A law is W with its derivatives (interface: materials/law.py). The functions take any number that
adds and multiplies: floats, numpy arrays, Taichi lane vectors (which is why they carry no
annotations: Taichi would read them).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from softsim.errors import MaterialError
from softsim.materials.law import FirstInvariantLaw, Law, TwoInvariantLaw, projected

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
