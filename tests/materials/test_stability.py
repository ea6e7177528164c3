"""Modes of deformation, and where a law's stress stops rising in them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.materials.modes import EQUIBIAXIAL, PLANAR, UNIAXIAL
from softsim.materials.neo_hooke import NeoHooke
from softsim.materials.stability import first_unstable_I1, instability_stretch
from softsim.materials.yeoh import Yeoh

MODES = [UNIAXIAL, EQUIBIAXIAL, PLANAR]
SOFTENING = Yeoh(21.6e3, 3.03e3, -0.111e3)  # Dragon Skin 10 up to 200 %, three terms


@pytest.mark.parametrize(
    ("mode", "stress", "I1"),
    [
        (UNIAXIAL, lambda a: a - a**-2, lambda a: a**2 + 2 / a),
        (EQUIBIAXIAL, lambda a: a - a**-5, lambda a: 2 * a**2 + a**-4),
        (PLANAR, lambda a: a - a**-3, lambda a: a**2 + 1 + a**-2),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_nominal_stress_in_closed_form(mode, stress, I1):
    stretch = np.array([0.4, 1.0, 1.7, 4.0])
    slope = SOFTENING.energy_slope(I1(stretch), SOFTENING.constants)
    assert mode.squared_stretches(stretch).sum(axis=-1) == pytest.approx(I1(stretch))
    expected = 2.0 * stress(stretch) * slope
    assert mode.nominal_stress(SOFTENING, stretch) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.name)
@given(stretch=st.floats(0.5, 4.0, allow_subnormal=False))
def test_stress_slope_is_the_derivative_of_the_stress(mode, stretch):
    h = 1e-5
    ends = mode.nominal_stress(SOFTENING, np.array([stretch - h, stretch + h]))
    slope = mode.stress_slope(SOFTENING, np.array(stretch))
    assert slope == pytest.approx((ends[1] - ends[0]) / (2.0 * h), rel=1e-5, abs=1.0)


def test_neo_hooke_is_stable_in_every_mode():
    """A balloon of it has a limit pressure, but that is the balloon's."""
    assert set(instability_stretch(NeoHooke(1e4)).values()) == {None}
    assert first_unstable_I1(NeoHooke(1e4), 1e3) is None


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.name)
def test_the_stress_peaks_where_it_is_said_to(mode):
    found = instability_stretch(SOFTENING)[f"{mode.name} tension"]
    stretch = np.linspace(1.0, 5.0, 400001)
    peak = stretch[np.argmax(mode.nominal_stress(SOFTENING, stretch))]
    assert found == pytest.approx(peak, abs=2e-5)


def test_a_search_ends_where_it_is_told_to():
    assert set(instability_stretch(SOFTENING, largest_stretch=2.0).values()) == {None}


def test_compression_is_searched_downwards():
    """C10 = 1, C20 = -0.2 Pa: W' = 0 at I1 = 5.5; the stress peaks before, nearest to rest."""
    law = Yeoh(1.0, -0.2)
    found = instability_stretch(law)["compression"]
    stretch = np.linspace(found + 1e-4, 1.0, 1000)
    assert 0.2 < found < 1.0
    assert (np.diff(UNIAXIAL.nominal_stress(law, stretch)) > 0.0).all()
    assert float(UNIAXIAL.stress_slope(law, np.array(found - 1e-4))) < 0.0


def test_where_the_shear_stiffness_is_gone():
    assert first_unstable_I1(Yeoh(1.0, -0.2), 10.0) == pytest.approx(5.5, abs=1e-6)
    assert first_unstable_I1(Yeoh(1.0, -0.2), 5.0) is None
