"""Complex shear modulus of a viscoelastic solid in a frequency band.

The modulus is mu(omega) = mu' + i mu'': mu' is the storage modulus, mu''/mu' the loss factor. Each
of three descriptions gives complex moduli at some frequencies, to which Maxwell branches are fitted
(softsim/materials/maxwell_fit.py).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from softsim.errors import MaterialError

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
