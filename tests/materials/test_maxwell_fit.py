"""Maxwell branches that stand for a spectrum: as few as needed, within the stated error."""

import numpy as np
import pytest

from softsim.errors import MaterialError
from softsim.materials.material import (
    MaxwellSeries,
    Spectrum,
    best_fit,
    constant_loss_factor,
    fewest_branches,
    fractional,
)

SILICONE = fractional(330e-6, 0.32, (2.0, 5000.0))


def test_branches_are_found_again():
    """A spectrum made of three branches, evenly spread in log time, by exactly those."""
    made = MaxwellSeries(np.array([50e-3, 2e-3, 80e-6]), np.array([0.2, 0.5, 1.5]))
    frequency = np.geomspace(2.0, 5000.0, 60)
    fit = fewest_branches(Spectrum(frequency, made.modulus(frequency)), 1e-4)
    assert fit.series.relaxation_times == pytest.approx(made.relaxation_times, rel=1e-3)
    assert fit.series.moduli == pytest.approx(made.moduli, rel=1e-3)


@pytest.mark.parametrize(("allowed", "count"), [(0.1, 3), (0.05, 4), (0.02, 5)])
def test_as_few_as_the_error_needs(allowed, count):
    fit = fewest_branches(SILICONE, allowed)
    assert len(fit.series.moduli) == count
    assert fit.largest_error <= allowed < best_fit(SILICONE, count - 1).largest_error
    # Between the frequencies of the fit too.
    frequency = np.geomspace(2.0, 5000.0, 997)
    target = 1.0 + (2j * np.pi * frequency * 330e-6) ** 0.32
    assert np.abs(fit.series.modulus(frequency) / target - 1.0).max() < 1.01 * fit.largest_error


def test_the_long_term_modulus_is_kept():
    """Slow inflation meets the law's own stiffness: at 10 mHz the branches have relaxed."""
    slow = fewest_branches(SILICONE, 0.05).series.modulus(np.array([0.01]))
    assert slow.real == pytest.approx([1.0], abs=1e-4)


def test_a_loss_factor_alone():
    """Without a level the fit chooses it, so that three branches do for three decades."""
    fit = fewest_branches(constant_loss_factor(0.2, (2.0, 5000.0)), 0.05)
    assert len(fit.series.moduli) == 3
    modulus = fit.series.modulus(np.geomspace(2.0, 5000.0, 200))
    assert modulus.imag / modulus.real == pytest.approx(0.2, abs=0.042)
    # It stands above the long-term modulus: what loses, has relaxed.
    assert np.abs(fit.spectrum.modulus[0]) == pytest.approx(1.12, abs=0.01)


def test_a_band_too_wide_is_refused():
    with pytest.raises(
        MaterialError, match=r"between 0.001 Hz and 1000 kHz by 5.3 %; 5 % is allowed"
    ):
        fewest_branches(fractional(330e-6, 0.32, (1e-3, 1e6)), 0.05)


def test_shares_are_those_of_a_prony_series():
    series = MaxwellSeries.of_prony([(0.25, 1.0), (0.15, 2.0)])
    assert series.shares == pytest.approx([0.25, 0.15])
    assert series.moduli == pytest.approx([0.25 / 0.6, 0.15 / 0.6])
    assert MaxwellSeries.of_prony([]).branches(1.0) == ()
