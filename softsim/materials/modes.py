"""Homogeneous deformations of an incompressible sheet or bar: their stress and its slope.

Each is one stretch l and principal stretches l^a that multiply to 1, so that W is a function of l
alone. The nominal stress on an axis that is pulled is then dW/dl over the number of pulled axes
(Ogden 1984, Non-linear Elastic Deformations, section 7.2; Holzapfel 2000, Nonlinear Solid
Mechanics, section 6.5). For uniaxial tension that is P = 2 (l - l^-2) dW/dI1, I1 = l^2 + 2/l.
"""

from dataclasses import dataclass

import numpy as np

from softsim.materials.laws import Law


@dataclass(frozen=True)
class Mode:
    """A mode of deformation by its principal stretches, powers of the stretch that is driven.

    name: for people; exponents: of the three principal stretches, they add up to 0, and an axis
    with exponent 1 is one that is pulled.
    """

    name: str
    exponents: tuple[float, float, float]

    def I1(self, stretch: np.ndarray) -> np.ndarray:
        """First invariant [-]: the sum of the squared principal stretches."""
        return np.asarray(sum(stretch ** (2.0 * a) for a in self.exponents))

    def nominal_stress(self, law: Law, stretch: np.ndarray) -> np.ndarray:
        """Force over undeformed area on a pulled axis [Pa]."""
        slope = law.energy_slope(self.I1(stretch), law.constants)
        return slope * self._I1_slope(stretch) / self._pulled_axes

    def stress_slope(self, law: Law, stretch: np.ndarray) -> np.ndarray:
        """d(nominal stress)/d(stretch) [Pa]."""
        I1, c = self.I1(stretch), law.constants
        change = (
            law.energy_curvature(I1, c) * self._I1_slope(stretch) ** 2
            + law.energy_slope(I1, c) * self._I1_curvature(stretch)
        )  # fmt: skip
        return change / self._pulled_axes

    @property
    def _pulled_axes(self) -> int:
        return self.exponents.count(1.0)

    def _I1_slope(self, stretch: np.ndarray) -> np.ndarray:
        return np.asarray(sum(2.0 * a * stretch ** (2.0 * a - 1.0) for a in self.exponents))

    def _I1_curvature(self, stretch: np.ndarray) -> np.ndarray:
        return np.asarray(
            sum(2.0 * a * (2.0 * a - 1.0) * stretch ** (2.0 * a - 2.0) for a in self.exponents)
        )


UNIAXIAL = Mode("uniaxial", (1.0, -0.5, -0.5))
EQUIBIAXIAL = Mode("equibiaxial", (1.0, 1.0, -2.0))
PLANAR = Mode("planar", (1.0, 0.0, -1.0))
"""Planar tension, also called pure shear: a wide sheet pulled between its long edges."""
