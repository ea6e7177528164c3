"""Material of a body: isochoric law, bulk modulus, Maxwell branches, softening and density."""

from dataclasses import dataclass

import numpy as np

from softsim.materials.law import Functions, Law
from softsim.materials.mullins import Mullins
from softsim.units import format_quantity

# ABAQUS/Explicit takes this ratio kappa / mu0 where no compressibility is given.
DEFAULT_BULK_RATIO = 20.0


@dataclass(frozen=True)
class MaxwellBranch:
    """Maxwell branch: a spring in series with a dashpot.

    shear_modulus [Pa]: of the spring; relaxation_time [s].
    """

    shear_modulus: float
    relaxation_time: float


@dataclass(frozen=True)
class Material:
    """Nearly incompressible, viscoelastic solid.

    W = law(I1_bar) + (bulk_modulus / 2) (J - 1)^2 + the energy of the Maxwell branches.
    strain_range: largest engineering strain that the law was fitted on, or None.
    spectrum_error: largest relative error of the complex modulus of the branches within the
    spectrum that they were fitted to, or None where they were given.
    mullins: softening of the law, or None.
    """

    name: str
    law: Law
    bulk_modulus: float
    density: float
    branches: tuple[MaxwellBranch, ...] = ()
    strain_range: float | None = None
    spectrum_error: float | None = None
    mullins: Mullins | None = None

    @property
    def instantaneous_shear_modulus(self) -> float:
        """Shear modulus at rest under a sudden load [Pa]: the law's and that of all branches."""
        return self.law.initial_shear_modulus + sum(b.shear_modulus for b in self.branches)

    def stress(self, b: np.ndarray, peak_energy: np.ndarray | float = 0.0) -> np.ndarray:
        """Return the deviatoric principal Kirchhoff stresses (..., 3) [Pa] of the softened law.

        b (..., 3): squared isochoric principal stretches. peak_energy (...,) [J/m^3]: largest
        energy density so far, if it is larger than the present one.
        """
        tau = self.law.stress(b)
        if self.mullins is None:
            return tau
        W = np.maximum(self.law.energy(b), 0.0)
        peak = np.maximum(W, peak_energy)
        eta: np.ndarray = self.mullins.factor(W, peak, self.mullins.constants, Functions())
        return eta[..., None] * tau

    def storage_modulus(self, frequency: float) -> float:
        """Return mu' [Pa] of small vibrations at `frequency` [Hz] about the state at rest.

        It is the long-term modulus, that of the law, plus mu (omega tau)^2 / (1 + (omega tau)^2) of
        each branch.
        """
        stretched = [(2.0 * np.pi * frequency * b.relaxation_time) ** 2 for b in self.branches]
        return self.law.initial_shear_modulus + sum(
            b.shear_modulus * square / (1.0 + square)
            for b, square in zip(self.branches, stretched, strict=True)
        )

    @property
    def impedance(self) -> float:
        """Acoustic impedance rho c_d [Pa s/m] at rest under a sudden load.

        It is the stress of a compression wave over its particle velocity.
        """
        modulus = self.bulk_modulus + 4.0 / 3.0 * self.instantaneous_shear_modulus
        return float(np.sqrt(modulus * self.density))

    def describe(self) -> str:
        """Return a text with the name, the viscoelastic model and the softening."""
        softening = "" if self.mullins is None else f", softens with r = {self.mullins.r:g}"
        if not self.branches:
            return f"{self.name}, elastic{softening}"
        times = sorted(branch.relaxation_time for branch in self.branches)
        span = " to ".join(format_quantity(float(f"{t:.3g}"), "s") for t in (times[0], times[-1]))
        text = f"{self.name}{softening}, {len(times)} Maxwell branches of {span}"
        if self.spectrum_error is None:
            return text
        return f"{text}, fitted to the spectrum within {100.0 * self.spectrum_error:.2g} %"


def bulk_modulus_from_poisson_ratio(shear_modulus: float, poisson_ratio: float) -> float:
    """Return kappa = 2 mu (1 + nu) / (3 (1 - 2 nu)) [Pa]."""
    return 2.0 * shear_modulus * (1.0 + poisson_ratio) / (3.0 * (1.0 - 2.0 * poisson_ratio))
