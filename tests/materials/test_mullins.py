"""Mullins effect: relations of its functions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from softsim.materials.laws import Functions, Ogden
from softsim.materials.material import Material, Mullins

MULLINS = st.builds(Mullins, st.floats(1.05, 5.0), st.floats(10.0, 1e5), st.floats(0.0, 2.0))
ENERGY = st.floats(1.0, 1e6)


def of(function, *energies, mullins):
    return float(function(*energies, mullins.constants, Functions()))


@given(MULLINS, ENERGY, st.floats(0.0, 1.0))
def test_stored_energy_is_the_integral_of_the_factor(mullins, peak, fraction):
    W = fraction * peak
    integral, _ = quad(lambda w: of(mullins.factor, w, peak, mullins=mullins), 0.0, W, limit=200)
    stored = of(mullins.stored, W, peak, mullins=mullins)
    assert stored == pytest.approx(integral, rel=1e-7, abs=1e-9 * peak)


@given(MULLINS, ENERGY)
def test_the_first_loading_is_stored_or_dissipated(mullins, peak):
    assert of(mullins.factor, peak, peak, mullins=mullins) == 1.0
    stored = of(mullins.stored, peak, peak, mullins=mullins)
    lost = of(mullins.dissipated, peak, mullins=mullins)
    assert stored + lost == pytest.approx(peak, rel=1e-12)
    assert 0.0 <= lost < peak / mullins.r


@given(MULLINS, ENERGY, ENERGY)
def test_dissipation_rises_with_the_peak(mullins, one, other):
    low, high = sorted((one, other))
    lost = [of(mullins.dissipated, peak, mullins=mullins) for peak in (low, high)]
    assert lost[0] <= lost[1] * (1.0 + 1e-12)


@given(MULLINS, ENERGY, st.floats(0.0, 1.0))
def test_the_factor_and_its_slope_are_bounded(mullins, peak, fraction):
    W, step = fraction * peak, 1e-4 * peak
    factors = [of(mullins.factor, W + h, peak, mullins=mullins) for h in (0.0, -step)]
    assert mullins.least_factor <= factors[0] <= 1.0
    slope = (factors[0] - factors[1]) / step
    assert slope <= float(mullins.steepest_slope(np.array(W - step))) * (1.0 + 1e-9) + 1e-12 / step


def test_a_material_at_rest_has_its_whole_stiffness():
    """Also with m = 0, where the law has no scale of its own."""
    mullins = Mullins(2.0, 0.0, 0.5)
    assert of(mullins.factor, 0.0, 0.0, mullins=mullins) == 1.0


def test_the_stress_of_a_softened_material():
    law = Ogden((60e3, 10e3), (1.7, -2.3))
    virgin = Material("rubber", law, 1e6, 1000.0)
    softened = Material("rubber", law, 1e6, 1000.0, mullins=Mullins(2.0, 1e3, 0.1))
    b = np.array([[4.0, 0.5, 0.5], [1.44, 1.0 / 1.2, 1.0 / 1.2]])
    peak = law.energy(b)[0]
    ratio = softened.stress(b, peak) / virgin.stress(b)
    np.testing.assert_allclose(ratio[0], 1.0, rtol=1e-14)
    np.testing.assert_allclose(ratio[1], 0.5, rtol=1e-9)
