"""Spectra: what the three descriptions of one say of modulus and loss factor."""

import numpy as np
import pytest

from softsim.errors import MaterialError
from softsim.materials.material import constant_loss_factor, fractional, measured

BAND = (2.0, 5000.0)


def test_the_fractional_solid_is_the_measured_silicone():
    """Storage modulus over the static one, and loss factor, as tabulated for tau = 330 us, n = 0.32
    from mu = mu0 (1 + (i omega tau)^n) by hand: at 7.7, 192 and 1000 Hz.
    """
    spectrum = fractional(330e-6, 0.32, BAND)
    assert spectrum.band == pytest.approx(BAND)
    at = [np.interp(f, spectrum.frequency, spectrum.modulus) for f in (7.7, 192.0, 1000.0)]
    assert [m.real for m in at] == pytest.approx([1.23, 1.65, 2.11], abs=0.006)
    assert [m.imag / m.real for m in at] == pytest.approx([0.104, 0.217, 0.289], abs=0.0006)


def test_one_loss_factor_all_over_the_band():
    modulus = constant_loss_factor(0.2, BAND).modulus
    assert modulus.imag / modulus.real == pytest.approx(0.2)
    # Kramers and Kronig: the storage modulus rises as omega^n, n = (2/pi) atan(0.2) = 0.1257.
    assert modulus[-1].real / modulus[0].real == pytest.approx(2500.0**0.12567, rel=1e-4)


def test_a_table_counts_by_its_ratio_to_the_long_term_modulus():
    spectrum = measured([(1.0, 60e3, 0.1), (10.0, 70e3, 0.2)], 50e3)
    assert spectrum.band == (1.0, 10.0)
    assert spectrum.modulus == pytest.approx([1.2 + 0.12j, 1.4 + 0.28j])


def test_nothing_swings_softer_than_it_rests():
    with pytest.raises(
        MaterialError, match="at 10 Hz, 49 kPa, is not greater than the long-term modulus"
    ):
        measured([(1.0, 60e3, 0.1), (10.0, 49e3, 0.2)], 50e3)
