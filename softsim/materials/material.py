"""Material of a body: isochoric law, bulk modulus, Maxwell branches, softening and density.

Maxwell branches may be given by a spectrum, to which they are fitted.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from softsim.errors import MaterialError
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


# -------------------------------------------------------------------------------------------------
# Maxwell branches in parallel with a spring, and their complex modulus.
#
# mu(omega) / mu_inf = 1 + sum m_k i omega tau_k / (1 + i omega tau_k), mu_inf the long-term
# modulus.


@dataclass(frozen=True, eq=False)
class MaxwellSeries:
    """Branches: relaxation times (k,) [s], and moduli (k,) over the long-term modulus."""

    relaxation_times: np.ndarray
    moduli: np.ndarray

    @classmethod
    def of_prony(cls, terms: Sequence[tuple[float, float]]) -> "MaxwellSeries":
        """Return the branches of a Prony series (g, relaxation time [s]).

        g is a fraction of the *instantaneous* modulus, as in ABAQUS's *VISCOELASTIC, TIME=PRONY;
        the law has the *long-term* modulus: m = g / (1 - sum g).
        """
        shares, times = np.reshape(terms, (-1, 2)).T
        return cls(times, shares / (1.0 - shares.sum()))

    @property
    def shares(self) -> np.ndarray:
        """g of each branch (k,): its fraction of the instantaneous modulus."""
        return self.moduli / (1.0 + self.moduli.sum())

    def modulus(self, frequency: np.ndarray) -> np.ndarray:
        """Return the complex modulus (n,) over the long-term one at frequencies (n,) [Hz]."""
        return 1.0 + branch_moduli(frequency, self.relaxation_times) @ self.moduli

    def branches(self, long_term_modulus: float) -> tuple[MaxwellBranch, ...]:
        """Return the branches of a law whose shear modulus at rest is `long_term_modulus` [Pa]."""
        return tuple(
            MaxwellBranch(float(modulus * long_term_modulus), float(time))
            for modulus, time in zip(self.moduli, self.relaxation_times, strict=True)
            if modulus > 0.0
        )


def branch_moduli(frequency: np.ndarray, relaxation_times: np.ndarray) -> np.ndarray:
    """Return the complex modulus (n, k) of branches of unit modulus.

    It is i omega tau / (1 + i omega tau).
    """
    turned = 2j * np.pi * frequency[:, None] * relaxation_times
    return turned / (1.0 + turned)


# -------------------------------------------------------------------------------------------------
# Complex shear modulus of a viscoelastic solid in a frequency band.
#
# The modulus is mu(omega) = mu' + i mu'': mu' is the storage modulus, mu''/mu' the loss factor.
# Each of three descriptions gives complex moduli at some frequencies, to which Maxwell branches are
# fitted.

POINTS_PER_DECADE = 20
"""Number of frequencies per decade at which a closed form is fitted: branches a decade apart leave
ripples that ten points a decade already resolve."""


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Complex shear modulus over frequency.

    frequency: rising (n,) [Hz]. modulus: complex (n,), over the long-term modulus, that of slow
    tests, where `has_level`; otherwise only the ratios of its values are known.
    """

    frequency: np.ndarray
    modulus: np.ndarray
    has_level: bool = True

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency [Hz]."""
        return float(self.frequency[0]), float(self.frequency[-1])


def fractional(relaxation_time: float, order: float, band: tuple[float, float]) -> Spectrum:
    """Return the spectrum of a fractional Kelvin-Voigt solid.

    mu / mu0 = 1 + (i omega tau)^n, mu0 the long-term modulus.

    relaxation_time: tau [s]; order: n, between 0 and 1; band: two frequencies [Hz].
    A spring beside a springpot (Bagley and Torvik 1983, AIAA J. 21:741-748; measured on silicones:
    Lanoy et al. 2020, PNAS, doi 10.1073/pnas.2010812117).
    """
    frequency = _within(band)
    return Spectrum(frequency, 1.0 + (2j * np.pi * frequency * relaxation_time) ** order)


def constant_loss_factor(loss_factor: float, band: tuple[float, float]) -> Spectrum:
    """Return the spectrum of a constant loss factor eta in a band [Hz].

    mu ~ (i omega)^n with n = (2/pi) atan(eta). A loss factor determines how the storage modulus
    grows within the band, not how far it has grown below, so the spectrum has no level: the fit
    chooses the level that few branches fit best.
    """
    frequency = _within(band)
    order = 2.0 / np.pi * np.arctan(loss_factor)
    return Spectrum(frequency, (1j * frequency / frequency[0]) ** order, has_level=False)


def measured(rows: Sequence[tuple[float, float, float]], long_term_modulus: float) -> Spectrum:
    """Return a spectrum measured in rows (frequency [Hz], storage modulus [Pa], loss factor).

    Frequencies must rise.

    long_term_modulus: of the same specimen and kind, shear or Young's, in slow tests [Pa].
    Raises MaterialError where a storage modulus is not above it.
    """
    frequency, storage, loss_factor = np.array(rows).T
    below = np.flatnonzero(storage <= long_term_modulus)
    if len(below):
        raise MaterialError(
            f"the storage modulus at {frequency[below[0]]:g} Hz, {storage[below[0]] / 1e3:.4g} "
            f"kPa, is not greater than the long-term modulus, {long_term_modulus / 1e3:.4g} "
            "kPa",
            hint="the default of long_term_modulus is the shear modulus of the law, 2 C10: set "
            "it to the value of the same specimen in slow tests",
        )
    return Spectrum(frequency, storage / long_term_modulus * (1.0 + 1j * loss_factor))


def _within(band: tuple[float, float]) -> np.ndarray:
    """Return the frequencies of a band, evenly spaced in their logarithm."""
    count = 2 + int(POINTS_PER_DECADE * np.log10(band[1] / band[0]))
    return np.geomspace(*band, count)


# -------------------------------------------------------------------------------------------------
# Fit of Maxwell branches to a spectrum, as few as its band and the allowed error require.
#
# Relaxation times are evenly spread in their logarithm; the moduli, none of them negative, follow
# by linear least squares on the complex modulus relative to the spectrum's (Schapery's collocation,
# with more frequencies than branches), each frequency counting by the part of the band, in log
# frequency, that it stands for. The ends of the spread are those of the least largest error.
#
# The long-term modulus is that of the spectrum, it is not fitted: constants of a law come from slow
# tests, and a body that is inflated slowly must be as soft as they say. So a slow branch, at the
# lower end of the band, represents the relaxation of the spectrum below it.

MOST_BRANCHES = 6
"""Each branch costs memory and time in every element: 6 meet a silicone over five decades within
2 %."""

SLOWEST, FASTEST = 8.0, 0.5
"""Bounds of the spread: the slowest relaxation time over 1 / omega at the lower end of the band,
the fastest over that at the upper end. A faster branch would stiffen the body beyond the band, and
cost time step, for little inside it."""

STARTS, NEARBY, FINEST = 16, np.linspace(-1.0, 1.0, 5), 1e-4
"""Trial values of each end of the spread, in log time: first over all of it, then ever closer to
the best so far, down to the finest."""


@dataclass(frozen=True, eq=False)
class MaxwellFit:
    """Fitted series, with its spectrum, whose modulus is relative to the long-term one."""

    series: MaxwellSeries
    spectrum: Spectrum

    @property
    def largest_error(self) -> float:
        """Largest relative error of the complex modulus [-]."""
        fitted = self.series.modulus(self.spectrum.frequency)
        return float(np.max(np.abs(fitted / self.spectrum.modulus - 1.0)))


def fewest_branches(spectrum: Spectrum, largest_error: float) -> MaxwellFit:
    """Return the fit with the fewest branches.

    The relative error of the complex modulus does not exceed `largest_error`.

    Raises
    ------
    MaterialError: MOST_BRANCHES branches are not enough.
    """
    for count in range(1, MOST_BRANCHES + 1):
        fit = best_fit(spectrum, count)
        if fit.largest_error <= largest_error:
            return fit
    low, high = (format_quantity(frequency, "Hz") for frequency in spectrum.band)
    raise MaterialError(
        f"{MOST_BRANCHES} Maxwell branches differ from the spectrum between {low} and {high} by "
        f"{100 * fit.largest_error:.2g} %; {100 * largest_error:.2g} % is allowed",
        hint="narrow the band to the frequencies of interest, or allow a larger largest_error",
    )


def best_fit(spectrum: Spectrum, count: int) -> MaxwellFit:
    """Return the best fit of `count` branches, evenly spaced in log time."""

    def fit(ends: tuple[float, float]) -> MaxwellFit:
        return _with_times(spectrum, np.exp(np.linspace(ends[0], ends[1], count)))

    def error(ends: tuple[float, float]) -> float:
        return fit(ends).largest_error

    low, high = (2.0 * np.pi * frequency for frequency in spectrum.band)
    slowest, fastest = np.log(SLOWEST / low), np.log(FASTEST / high)
    best = min(combinations(np.linspace(slowest, fastest, STARTS), 2), key=error)
    reach = (slowest - fastest) / STARTS
    # The error has kinks where another frequency becomes the worst: ever finer grids, no gradients.
    while reach > FINEST:
        slow, fast = (np.clip(end + reach * NEARBY, fastest, slowest) for end in best)
        best = min(product(slow, fast), key=error)
        reach *= 0.5
    return fit(best)


def _with_times(spectrum: Spectrum, times: np.ndarray) -> MaxwellFit:
    """Return the fit with given relaxation times [s]."""
    target = spectrum.modulus
    responses = branch_moduli(spectrum.frequency, times)
    weight = np.sqrt(np.gradient(np.log(spectrum.frequency))) / np.abs(target)
    if spectrum.has_level:
        moduli = _least_squares(responses, target - 1.0, weight)
        return MaxwellFit(MaxwellSeries(times, moduli), spectrum)
    columns = np.column_stack([np.ones(len(target)), responses])
    factors = _least_squares(columns, target, weight)
    level = factors[0]
    if level == 0.0:  # without a long-term modulus it is no solid: the error will tell
        level = 1.0
    levelled = Spectrum(spectrum.frequency, target / level)
    return MaxwellFit(MaxwellSeries(times, factors[1:] / level), levelled)


def _least_squares(columns: np.ndarray, target: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the factors (k,) >= 0 of complex columns (n, k) that best fit a target (n,)."""
    from scipy.optimize import nnls  # slow to import, and seldom needed

    columns, target = columns * weight[:, None], target * weight
    factors, _ = nnls(
        np.vstack([columns.real, columns.imag]), np.concatenate([target.real, target.imag])
    )
    return factors
