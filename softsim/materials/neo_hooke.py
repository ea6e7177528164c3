"""The neo-Hookean law: W = C10 (I1_bar - 3).

Rivlin 1948, Phil. Trans. R. Soc. A 240:459-490; ABAQUS's *HYPERELASTIC, NEO HOOKE. Its stress
rises in every mode of deformation, and it does not stiffen: good to strains of some 50 %.

The functions take any number that adds and multiplies: floats, numpy arrays, Taichi lane vectors
(which is why they carry no annotations: Taichi would read them).
"""

from dataclasses import dataclass

from softsim.materials.law import FirstInvariantLaw


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
