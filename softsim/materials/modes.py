"""Homogeneous deformations of an incompressible sheet or bar: their stress and its slope.

Each is one stretch l and principal stretches l^a that multiply to 1, so that W is a function of l
alone. The nominal stress on an axis that is pulled is then dW/dl over the number of pulled axes
(Ogden 1984, Non-linear Elastic Deformations, section 7.2; Holzapfel 2000, Nonlinear Solid
Mechanics, section 6.5). For uniaxial tension that is P = 2 (l - l^-2) (W1 + W2 / l).
"""

from dataclasses import dataclass

import numpy as np

from softsim.materials.law import Law


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
