"""Laws: derivatives, constants, and the library."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.builder import library_material, library_names
from softsim.materials.material import bulk_modulus_from_poisson_ratio, maxwell_branches
from softsim.materials.yeoh import Yeoh

CONSTANTS = st.tuples(st.floats(1e3, 1e6), st.floats(-1e4, 1e5), st.floats(-1e3, 1e4))
INVARIANT = st.floats(3.0, 12.0)


@given(CONSTANTS, INVARIANT)
def test_slope_and_curvature_are_derivatives(c, I1_bar):
    """Yeoh is a cubic, so a central difference of W is off by C30 h^2 only."""
    h = 1e-3
    ends = [Yeoh.energy_density(I1_bar + sign * h, c) for sign in (1.0, -1.0)]
    scale = sum(abs(x) * 10.0**k for k, x in enumerate(c))
    slope = (ends[0] - ends[1]) / (2.0 * h)
    assert Yeoh.energy_slope(I1_bar, c) == pytest.approx(
        slope, abs=abs(c[2]) * h**2 + 1e-12 * scale / h
    )
    slopes = [Yeoh.energy_slope(I1_bar + sign * h, c) for sign in (1.0, -1.0)]
    curvature = (slopes[0] - slopes[1]) / (2.0 * h)
    assert Yeoh.energy_curvature(I1_bar, c) == pytest.approx(curvature, abs=1e-12 * scale / h)


def test_initial_shear_modulus_is_that_of_simple_shear():
    """W of a small simple shear g is mu g^2 / 2, and I1_bar - 3 = g^2."""
    law = Yeoh(36e3, 250.0, 23.0)
    g = 1e-4
    energy = law.energy_density(3.0 + g**2, law.constants)
    assert energy == pytest.approx(0.5 * law.initial_shear_modulus * g**2, rel=1e-6)


def test_uniaxial_stress_of_the_library_material_rises_over_its_strain_range():
    """Incompressible uniaxial tension: P = 2 (l - l^-2) W'. Stable where its slope is positive."""
    for name in library_names():
        data = library_material(name)
        c = (data.C10, data.C20, data.C30)
        stretch = np.linspace(1.0, 1.0 + data.strain_range, 400)
        I1 = stretch**2 + 2.0 / stretch
        stress = 2.0 * (stretch - stretch**-2) * Yeoh.energy_slope(I1, c)
        assert (np.diff(stress) > 0.0).all(), name


def test_bulk_modulus_of_linear_elasticity():
    assert bulk_modulus_from_poisson_ratio(3.0, 0.25) == pytest.approx(5.0)


def test_prony_shares_are_of_the_instantaneous_modulus():
    branches = maxwell_branches(60.0, [(0.25, 1.0), (0.15, 2.0)])
    instantaneous = 60.0 + sum(b.shear_modulus for b in branches)
    assert [b.shear_modulus / instantaneous for b in branches] == pytest.approx([0.25, 0.15])
    assert [b.relaxation_time for b in branches] == [1.0, 2.0]


def test_an_unknown_material_is_none():
    assert library_material("granite") is None
