"""Fit of Maxwell branches to a spectrum, as few as its band and the allowed error require.

Relaxation times are evenly spread in their logarithm; the moduli, none of them negative, follow by
linear least squares on the complex modulus relative to the spectrum's (Schapery's collocation, with
more frequencies than branches), each frequency counting by the part of the band, in log frequency,
that it stands for. The ends of the spread are those of the least largest error.

The long-term modulus is that of the spectrum, it is not fitted: constants of a law come from slow
tests, and a body that is inflated slowly must be as soft as they say. So a slow branch, at the
lower end of the band, represents the relaxation of the spectrum below it.
"""

from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from scipy.optimize import nnls

from softsim.errors import MaterialError
from softsim.materials.maxwell import MaxwellSeries, branch_moduli
from softsim.materials.spectrum import Spectrum
from softsim.units import format_quantity

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
    columns, target = columns * weight[:, None], target * weight
    factors, _ = nnls(
        np.vstack([columns.real, columns.imag]), np.concatenate([target.real, target.imag])
    )
    return factors
