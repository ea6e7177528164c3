"""Laws: derivatives, objectivity, constants, and the library."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from softsim.materials.fitting import first_unstable_I1, instability_stretch
from softsim.materials.laws import (
    LAWS,
    FirstInvariantLaw,
    Functions,
    MooneyRivlin,
    NeoHooke,
    Ogden,
    Yeoh,
)
from softsim.materials.library import library_material, library_names
from softsim.materials.material import Material, MaxwellSeries, bulk_modulus_from_poisson_ratio


def number(low, high):
    return st.floats(low, high, allow_subnormal=False)


YEOH = st.builds(Yeoh, number(1e3, 1e6), number(-1e4, 1e5), number(-1e3, 1e4))
FIRST_INVARIANT = st.one_of(YEOH, st.builds(NeoHooke, number(1e3, 1e6)))
# Exponents beyond what any rubber was fitted with.
OGDEN = st.lists(
    st.tuples(number(1e3, 1e6), st.one_of(number(0.5, 8.0), number(-6.0, -0.5))),
    min_size=1,
    max_size=3,
).map(lambda terms: Ogden(*zip(*terms, strict=True)))
# C01 over C10 above -1: below, the solid has no stiffness at rest.
MOONEY_RIVLIN = st.builds(
    lambda C10, share: MooneyRivlin(C10, share * C10), number(1e3, 1e6), number(-0.9, 1.0)
)
LAW = st.one_of(FIRST_INVARIANT, MOONEY_RIVLIN, OGDEN)
EXAMPLES = [
    Yeoh(36e3, 250.0, 23.0), NeoHooke(36e3), MooneyRivlin(30e3, 6e3),
    Ogden((60e3, 10e3), (1.7, -2.3)), Ogden((72e3,), (3.1,)),
]  # fmt: skip
INVARIANT = number(3.0, 12.0)
# F = 1 + A with |A_ij| <= 0.3 has a positive determinant: no row of A sums up to 1.
GRADIENT = st.lists(number(-0.3, 0.3), min_size=9, max_size=9).map(
    lambda entries: np.eye(3) + np.reshape(entries, (3, 3))
)
LOGARITHMS = st.tuples(number(-1.2, 1.2), number(-1.2, 1.2)).map(
    lambda two: np.array([*two, -sum(two)])
)


def energy_of(law, I1, I2):
    if isinstance(law, FirstInvariantLaw):
        return law.energy_density(I1, law.constants)
    return law.energy_density(I1, I2, law.constants, Functions())


def I1_bar(F):
    return np.linalg.det(F) ** (-2.0 / 3.0) * np.sum(F * F)


def energy(law, F):
    inverse = np.linalg.inv(F)
    I2_bar = np.linalg.det(F) ** (2.0 / 3.0) * np.sum(inverse * inverse)
    return energy_of(law, I1_bar(F), I2_bar)


def energy_along(law, logarithms):
    """W at principal stretches that need not multiply to 1."""
    b = np.exp(2.0 * (logarithms - logarithms.mean()))
    return energy_of(law, b.sum(), (1.0 / b).sum())


def size(law):
    """Scale of the energies in these tests [Pa]."""
    return sum(abs(c) * 10.0**k for k, c in enumerate(law.constants))


@given(FIRST_INVARIANT, INVARIANT)
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
    """P = dW/dF = 2 J^(-2/3) (W1 dev b - W2 dev b^-1) F^-T, entry by entry."""
    J, inverse = np.linalg.det(F), np.linalg.inv(F).T
    b_bar = J ** (-2.0 / 3.0) * F @ F.T
    principal = np.linalg.eigvalsh(b_bar)
    W1, W2 = law.slopes(principal)
    fictitious = 2.0 * (W1 * b_bar - W2 * np.linalg.inv(b_bar))
    stress = (fictitious - np.trace(fictitious) / 3.0 * np.eye(3)) @ inverse
    h = 1e-5
    differences = np.empty((3, 3))
    for entry in np.ndindex(3, 3):
        step = np.zeros((3, 3))
        step[entry] = h
        differences[entry] = (energy(law, F + step) - energy(law, F - step)) / (2.0 * h)
    # The truncation error goes with the third derivative, which grows as F^-T does.
    steep = np.abs(inverse).max() ** 3 * max(I1_bar(F) - 2.0, 1.0) ** 3
    if not isinstance(law, FirstInvariantLaw):  # and with powers of the stretches
        steep *= np.max(law.stiffness(principal)) / law.initial_shear_modulus
    assert stress == pytest.approx(differences, abs=1e-7 * size(law) * steep)


@given(LAW, LOGARITHMS)
@example(Yeoh(1000.0, 69292.0, 0.0), np.zeros(3))
def test_principal_stress_and_stiffness_are_derivatives(law, logarithms):
    """Of W by the logarithms of the stretches, once and twice; at the ends of the range of a
    stretch of 1/11 to 11 too.
    """
    b = np.exp(2.0 * logarithms)
    scale = np.abs(law.stiffness(b)).max() + law.initial_shear_modulus

    def differences(h):
        first, second = np.empty(3), np.empty((3, 3))
        for i in range(3):
            step = h * np.eye(3)[i]
            ends = [logarithms + step, logarithms - step]
            first[i] = (energy_along(law, ends[0]) - energy_along(law, ends[1])) / (2.0 * h)
            stresses = [law.stress(np.exp(2.0 * (end - end.mean()))) for end in ends]
            second[i] = (stresses[0] - stresses[1]) / (2.0 * h)
        return first, second

    # Extrapolated (Richardson): what they lack goes with h^2 and, at rest, with the law's higher
    # constants, which its stiffness there does not tell.
    near, far = differences(1e-4), differences(2e-4)
    first, second = ((4.0 * n - f) / 3.0 for n, f in zip(near, far, strict=True))
    np.testing.assert_allclose(law.stress(b), first, atol=1e-6 * scale)
    np.testing.assert_allclose(law.stiffness(b), second, atol=1e-6 * scale)


@given(number(1e3, 1e6), number(0.0, 1e5), LOGARITHMS)
def test_ogden_holds_neo_hooke_and_mooney_rivlin(C10, C01, logarithms):
    """alpha = 2 is I1_bar, alpha = -2 is I2_bar."""
    b = np.exp(2.0 * logarithms)
    for ogden, same in (
        (Ogden((2.0 * C10,), (2.0,)), NeoHooke(C10)),
        (Ogden((2.0 * C10, 2.0 * C01), (2.0, -2.0)), MooneyRivlin(C10, C01)),
    ):
        scale = (C10 + C01) * b.max() / b.min()
        np.testing.assert_allclose(ogden.slopes(b), same.slopes(b), atol=1e-9 * (C10 + C01))
        np.testing.assert_allclose(ogden.stiffness(b), same.stiffness(b), atol=1e-12 * scale)
        assert energy_along(ogden, logarithms) == pytest.approx(
            energy_along(same, logarithms), abs=1e-12 * scale
        )


@pytest.mark.parametrize("alpha", [-7.0, -1.3, 0.5, 3.1, 8.0])
@pytest.mark.parametrize("apart", [0.0, 1e-9, 1e-6, 1e-4, 1e-3, 2e-3, 1e-2, 0.3])
@pytest.mark.parametrize("stretch", [0.2, 0.9999, 1.0, 1.003, 5.0])
def test_slopes_of_ogden_where_stretches_meet(alpha, apart, stretch):
    """Two stretches that are equal or nearly so, or all three: tau = 2 W1 dev b - 2 W2 dev 1/b is
    mu / alpha dev l^alpha, which needs no difference, to 1e-9 of its terms.
    """
    law = Ogden((1.0,), (alpha,))
    stretches = np.array([stretch * np.exp(apart), stretch, np.exp(-apart) / stretch**2])
    W1, W2 = law.slopes(stretches**2)
    found = 2.0 * (W1 * stretches**2 - W2 / stretches**2)
    power = 2.0 / alpha * stretches**alpha
    scale = np.abs(W1) * (stretches**2).max() + np.abs(W2) * (stretches**-2).max()
    np.testing.assert_allclose(
        found - found.mean(), power - power.mean(), atol=1e-9 * (scale + np.abs(power).max())
    )


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


@pytest.mark.parametrize("law", EXAMPLES)
def test_initial_shear_modulus_is_that_of_simple_shear(law):
    """W of a small simple shear g is mu g^2 / 2, and I1_bar - 3 = I2_bar - 3 = g^2."""
    g = 1e-4
    energy_density = energy_of(law, 3.0 + g**2, 3.0 + g**2)
    assert energy_density == pytest.approx(0.5 * law.initial_shear_modulus * g**2, rel=1e-6)


@pytest.mark.parametrize("law", EXAMPLES)
def test_constants_and_back(law):
    assert type(law).of_constants(law.constants) == law
    assert type(law) in LAWS.values()


@pytest.mark.parametrize("law", EXAMPLES)
def test_arrays_in_arrays_out(law):
    """Kernels and the time step put whole arrays in, where a law's slope is constant too."""
    b = np.ones((5, 3)) * [1.2, 1.0, 1.0 / 1.2]
    I1, I2 = b.sum(axis=1), (1.0 / b).sum(axis=1)
    assert np.shape(energy_of(law, I1, I2)) == (5,)
    assert [np.shape(slope) for slope in law.slopes(b)] == [(5,), (5,)]
    assert law.stress(b).shape == (5, 3)
    assert law.stiffness(b).shape == (5, 3, 3)
    assert law.shear_stiffness(b).shape == (5,)


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


def test_the_storage_modulus_is_that_of_the_series():
    series = MaxwellSeries.of_prony([(0.25, 1e-3), (0.15, 2e-2)])
    material = Material("m", NeoHooke(30.0), 1e3, 1000.0, series.branches(60.0))
    frequency = np.array([0.0, 10.0, 190.0, 1e6])
    moduli = [material.storage_modulus(f) for f in frequency]
    assert moduli == pytest.approx(60.0 * series.modulus(frequency).real)
    assert (moduli[0], moduli[-1]) == pytest.approx((60.0, 100.0), rel=1e-4)


def test_an_unknown_material_is_none():
    assert library_material("granite") is None


def test_the_impedance_is_that_of_a_sudden_load():
    """kappa + 4/3 (mu0 + branches) = 4 MPa at 1000 kg/m^3: c_d = 63.2 m/s."""
    branches = MaxwellSeries.of_prony([(1.0 / 3.0, 0.1)]).branches(1e6)  # 0.5 MPa
    material = Material("m", NeoHooke(5e5), 2e6, 1000.0, branches)
    assert material.law.initial_shear_modulus == pytest.approx(1e6)
    assert material.impedance == pytest.approx(1000.0 * math.sqrt(4e6 / 1000.0))
