"""Modes of deformation, and where a law's stress stops rising in them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.materials.fitting import first_unstable_I1, instability_stretch
from softsim.materials.laws import (
    EQUIBIAXIAL,
    PLANAR,
    UNIAXIAL,
    MooneyRivlin,
    NeoHooke,
    Ogden,
    Yeoh,
)

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
    # Round-off of stresses up to 40 MPa.
    found = mode.nominal_stress(SOFTENING, stretch)
    assert found == pytest.approx(expected, rel=1e-15, abs=1e-9)


@pytest.mark.parametrize(
    ("mode", "lateral"),
    [(UNIAXIAL, lambda a: a**-0.5), (EQUIBIAXIAL, lambda a: a**-2.0), (PLANAR, lambda a: 1.0 / a)],
    ids=lambda value: getattr(value, "name", ""),
)
def test_nominal_stress_of_two_invariants_and_of_stretches(mode, lateral):
    """On the free face sigma = 0: P l = tau_l - tau_free. Mooney-Rivlin: P = 2 (C10 + C01 x)(l -
    free^2 / l) with x the square of the third stretch; Ogden: P l = sum 2 mu / alpha (l^alpha -
    free^alpha).
    """
    stretch = np.array([0.4, 1.0, 1.7, 4.0])
    free = lateral(stretch)
    third = 1.0 / (stretch * free)
    mooney, ogden = MooneyRivlin(30e3, 6e3), Ogden((60e3, 10e3), (1.7, -2.3))
    expected = 2.0 * (30e3 + 6e3 * third**2) * (stretch - free**2 / stretch)
    np.testing.assert_allclose(
        mode.nominal_stress(mooney, stretch), expected, rtol=1e-12, atol=1e-9
    )
    powers = [2.0 * m / a * (stretch**a - free**a) for m, a in ((60e3, 1.7), (10e3, -2.3))]
    expected = sum(powers) / stretch
    found = mode.nominal_stress(ogden, stretch)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-9)


LAWS = [SOFTENING, MooneyRivlin(30e3, 6e3), Ogden((60e3, 10e3), (1.7, -2.3))]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.name)
@given(stretch=st.floats(0.5, 4.0, allow_subnormal=False))
def test_stress_slope_is_the_derivative_of_the_stress(mode, law, stretch):
    h = 1e-5
    ends = mode.nominal_stress(law, np.array([stretch - h, stretch + h]))
    slope = mode.stress_slope(law, np.array(stretch))
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


def test_where_a_negative_second_constant_takes_the_shear_stiffness():
    """C10 = 1, C01 = -0.2 Pa: C10 + C01 b_k = 0 at b_k = 5. Of all deformations of one I1_bar
    uniaxial tension has the largest stretch: I1_bar = 5 + 2 / sqrt 5.
    """
    law = MooneyRivlin(1.0, -0.2)
    first = 5.0 + 2.0 / np.sqrt(5.0)
    assert first_unstable_I1(law, 10.0) == pytest.approx(first, abs=1e-6)
    assert first_unstable_I1(law, first - 1e-3) is None
    stretch = np.array([np.sqrt(5.0) - 1e-3, np.sqrt(5.0) + 1e-3])
    smallest = law.shear_stiffness(UNIAXIAL.squared_stretches(stretch))
    assert smallest[0] > 0.0 > smallest[1]


def test_positive_moduli_are_stable_in_every_mode():
    """Ogden's own constants for Treloar's rubber (1972, section 4), as ABAQUS writes them."""
    law = Ogden((409.5e3, 3e3, 10e3), (1.3, 5.0, -2.0))
    assert set(instability_stretch(law).values()) == {None}
    assert first_unstable_I1(law, 60.0) is None
