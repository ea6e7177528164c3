"""The Mooney-Rivlin law: W = C10 (I1_bar - 3) + C01 (I2_bar - 3).

Mooney 1940, J. Appl. Phys. 11:582-592; ABAQUS's *HYPERELASTIC, MOONEY-RIVLIN.
"""

from dataclasses import dataclass

import numpy as np

from softsim.materials.law import TwoInvariantLaw, projected


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
