"""Material of a body: isochoric law, bulk modulus, Maxwell branches, softening and density."""

from dataclasses import dataclass

import numpy as np

from softsim.materials.laws import Functions, Law
from softsim.units import format_quantity

# ABAQUS/Explicit takes this ratio kappa / mu0 where no compressibility is given.
DEFAULT_BULK_RATIO = 20.0

# -------------------------------------------------------------------------------------------------
# Mullins effect: softening of a law by the largest energy density so far.
#
# Ogden and Roxburgh 1999, Proc. R. Soc. Lond. A 455:2861-2877, with the constants of ABAQUS's
# *MULLINS EFFECT. W is the isochoric energy density of the law at a material point, W_m its largest
# value so far. The stress of the law is multiplied by
#     eta = 1 - erf(x) / r,    x = (W_m - W) / s,    s = m + beta W_m,
# which is 1 on the first loading, W = W_m. At constant W_m this stress is the gradient of
#     U = int_0^W eta dw = W - (s / r) [g(W_m / s) - g(x)],   g(x) = x erf x + exp(-x^2) / sqrt(pi).
# The first loading does the work W_m, so
#     D = W_m - U(W_m) = (s / r) [g(W_m / s) - g(0)]
# is dissipated. It rises with W_m alone. After complete unloading U = 0: there is no permanent set.
#
# The functions with the constants as `c` serve floats, numpy arrays and Taichi lane vectors, as
# those of materials/laws.py; they carry no annotations, because Taichi would read them.

LEAST_SCALE = 1e-9
"""Smallest s [J/m^3], that of a strain of about 1e-7: it matters at rest if m = 0."""


@dataclass(frozen=True)
class Mullins:
    """Constants r > 1 [-], m [J/m^3] and beta [-], of which m or beta is greater than 0."""

    r: float
    m: float
    beta: float

    @property
    def constants(self) -> tuple[float, ...]:
        """r, m, beta, which the functions below take as `c`."""
        return (self.r, self.m, self.beta)

    @property
    def least_factor(self) -> float:
        """1 - 1/r, below which eta never falls."""
        return 1.0 - 1.0 / self.r

    def steepest_slope(self, W: np.ndarray) -> np.ndarray:
        """Return d eta / dW [m^3/J] at energy densities W where unloading begins, W_m = W.

        For larger W_m it is smaller.
        """
        scale = np.maximum(self.m + self.beta * W, LEAST_SCALE)
        return np.asarray(2.0 / (np.sqrt(np.pi) * self.r * scale))

    @staticmethod
    def factor(W, peak, c, f):
        """Return eta [-]; peak: W_m, f: the `Functions` of the arguments' kind."""
        scale = f.maximum(c[1] + c[2] * peak, LEAST_SCALE)
        return 1.0 - f.erf((peak - W) / scale) / c[0]

    @staticmethod
    def stored(W, peak, c, f):
        """Return U [J/m^3]."""
        scale = f.maximum(c[1] + c[2] * peak, LEAST_SCALE)
        lost = f.erf_integral(peak / scale) - f.erf_integral((peak - W) / scale)
        return W - scale / c[0] * lost

    @staticmethod
    def dissipated(peak, c, f):
        """Return D [J/m^3]."""
        scale = f.maximum(c[1] + c[2] * peak, LEAST_SCALE)
        return scale / c[0] * f.erf_integral(peak / scale)


# -------------------------------------------------------------------------------------------------
# The material: law, branches, softening and density.


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
