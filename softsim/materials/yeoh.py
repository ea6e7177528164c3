"""Yeoh's law: W = C10 k + C20 k^2 + C30 k^3 with k = I1_bar - 3.

Yeoh 1993, Rubber Chem. Technol. 66:754-771; ABAQUS's *HYPERELASTIC, YEOH.

The functions take any number that adds and multiplies: floats, numpy arrays, Taichi lane vectors
(which is why they carry no annotations: Taichi would read them).
"""

from dataclasses import dataclass

from softsim.materials.law import FirstInvariantLaw


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
