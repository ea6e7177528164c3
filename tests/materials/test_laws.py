"""Laws: derivatives, objectivity, constants, and the library."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.builder import library_material, library_names
from softsim.materials.laws import LAWS
from softsim.materials.material import Material, bulk_modulus_from_poisson_ratio
from softsim.materials.maxwell import MaxwellSeries
from softsim.materials.neo_hooke import NeoHooke
from softsim.materials.stability import first_unstable_I1, instability_stretch
from softsim.materials.yeoh import Yeoh


def number(low, high):
    return st.floats(low, high, allow_subnormal=False)


YEOH = st.builds(Yeoh, number(1e3, 1e6), number(-1e4, 1e5), number(-1e3, 1e4))
LAW = st.one_of(YEOH, st.builds(NeoHooke, number(1e3, 1e6)))
INVARIANT = number(3.0, 12.0)
# F = 1 + A with |A_ij| <= 0.3 has a positive determinant: no row of A sums up to 1.
GRADIENT = st.lists(number(-0.3, 0.3), min_size=9, max_size=9).map(
    lambda entries: np.eye(3) + np.reshape(entries, (3, 3))
)


def I1_bar(F):
    return np.linalg.det(F) ** (-2.0 / 3.0) * np.sum(F * F)


def energy(law, F):
    return law.energy_density(I1_bar(F), law.constants)


def size(law):
    """Scale of the energies in these tests [Pa]."""
    return sum(abs(c) * 10.0**k for k, c in enumerate(law.constants))


@given(LAW, INVARIANT)
def test_slope_and_curvature_are_derivatives(law, I1):
    """W is a cubic at most, so a central difference of it is off by C30 h^2 only."""
    h, c = 1e-3, law.constants
    cubic = abs(c[2]) if len(c) > 2 else 0.0
    ends = [law.energy_density(I1 + sign * h, c) for sign in (1.0, -1.0)]
    slope = (ends[0] - ends[1]) / (2.0 * h)
    rounding = 1e-12 * size(law) / h
    assert law.energy_slope(I1, c) == pytest.approx(slope, abs=cubic * h**2 + rounding)
    slopes = [law.energy_slope(I1 + sign * h, c) for sign in (1.0, -1.0)]
    curvature = (slopes[0] - slopes[1]) / (2.0 * h)
    assert law.energy_curvature(I1, c) == pytest.approx(curvature, abs=rounding)


@given(LAW, GRADIENT)
def test_stress_is_the_derivative_of_the_energy(law, F):
    """P = dW/dF = 2 W' J^(-2/3) (F - (tr F^T F / 3) F^-T), entry by entry."""
    J = np.linalg.det(F)
    slope = law.energy_slope(I1_bar(F), law.constants)
    inverse = np.linalg.inv(F).T
    stress = 2.0 * slope * J ** (-2.0 / 3.0) * (F - np.sum(F * F) / 3.0 * inverse)
    h = 1e-5
    differences = np.empty((3, 3))
    for entry in np.ndindex(3, 3):
        step = np.zeros((3, 3))
        step[entry] = h
        differences[entry] = (energy(law, F + step) - energy(law, F - step)) / (2.0 * h)
    # The truncation error goes with the third derivative, which grows as F^-T does.
    steep = np.abs(inverse).max() ** 3 * max(I1_bar(F) - 2.0, 1.0) ** 3
    assert stress == pytest.approx(differences, abs=1e-7 * size(law) * steep)


@given(LAW, GRADIENT, st.lists(number(-1.0, 1.0), min_size=4, max_size=4))
def test_a_rotation_changes_no_energy(law, F, quaternion):
    """W(Q F) = W(F) = W(F Q): objective and isotropic."""
    length = math.hypot(*quaternion)
    w, x, y, z = np.array(quaternion) / length if length > 1e-3 else (1.0, 0.0, 0.0, 0.0)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    Q = np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross
    expected = pytest.approx(energy(law, F), rel=1e-9, abs=1e-9 * size(law) * I1_bar(F))
    assert energy(law, Q @ F) == expected
    assert energy(law, F @ Q) == expected


@pytest.mark.parametrize("law", [Yeoh(36e3, 250.0, 23.0), NeoHooke(36e3)])
def test_initial_shear_modulus_is_that_of_simple_shear(law):
    """W of a small simple shear g is mu g^2 / 2, and I1_bar - 3 = g^2."""
    g = 1e-4
    energy_density = law.energy_density(3.0 + g**2, law.constants)
    assert energy_density == pytest.approx(0.5 * law.initial_shear_modulus * g**2, rel=1e-6)


@pytest.mark.parametrize("name", LAWS)
def test_arrays_in_arrays_out(name):
    """Kernels and the time step put whole arrays in, where a law's slope is constant too."""
    law, I1 = LAWS[name](1e3), np.linspace(3.0, 9.0, 5)
    for function in (law.energy_density, law.energy_slope, law.energy_curvature):
        assert np.shape(function(I1, law.constants)) == (5,)


@pytest.mark.parametrize("name", library_names())
def test_a_library_material_is_stable_over_its_strain_range(name):
    """Nominal stress rises in every mode, and W' > 0 at every I1 of the range."""
    data = library_material(name)
    law = Yeoh(data.C10, data.C20, data.C30)
    largest = 1.0 + data.strain_range
    assert set(instability_stretch(law, largest).values()) == {None}
    # Of all modes up to one stretch, equibiaxial tension has the largest I1.
    assert first_unstable_I1(law, 2.0 * largest**2 + largest**-4) is None
    assert data.source
    assert data.spectrum


def test_bulk_modulus_of_linear_elasticity():
    assert bulk_modulus_from_poisson_ratio(3.0, 0.25) == pytest.approx(5.0)


def test_prony_shares_are_of_the_instantaneous_modulus():
    branches = MaxwellSeries.of_prony([(0.25, 1.0), (0.15, 2.0)]).branches(60.0)
    instantaneous = 60.0 + sum(b.shear_modulus for b in branches)
    assert [b.shear_modulus / instantaneous for b in branches] == pytest.approx([0.25, 0.15])
    assert [b.relaxation_time for b in branches] == [1.0, 2.0]


def test_an_unknown_material_is_none():
    assert library_material("granite") is None


def test_the_impedance_is_that_of_a_sudden_load():
    """kappa + 4/3 (mu0 + branches) = 4 MPa at 1000 kg/m^3: c_d = 63.2 m/s."""
    branches = MaxwellSeries.of_prony([(1.0 / 3.0, 0.1)]).branches(1e6)  # 0.5 MPa
    material = Material("m", NeoHooke(5e5), 2e6, 1000.0, branches)
    assert material.law.initial_shear_modulus == pytest.approx(1e6)
    assert material.impedance == pytest.approx(1000.0 * math.sqrt(4e6 / 1000.0))
