"""Least squares: constants that are known come back, and the library's come from its sources."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.errors import MaterialError
from softsim.materials.fitting import (
    TEST_MODES,
    TensileTest,
    fit_law,
    fit_tests,
    prediction_errors,
    read_tensile_test,
)
from softsim.materials.laws import (
    EQUIBIAXIAL,
    LARGEST_EXPONENT,
    UNIAXIAL,
    MooneyRivlin,
    NeoHooke,
    Ogden,
    Yeoh,
)
from softsim.materials.library import library_material

REFERENCE = Path(__file__).parents[2] / ".." / "shared" / "reference"
TENSILE = REFERENCE / "tensile"


def number(low, high):
    return st.floats(low, high, allow_subnormal=False)


def pulled(law, strain):
    return TensileTest(strain, UNIAXIAL.nominal_stress(law, 1.0 + strain), "made up")


@given(number(1e3, 1e6), number(0.0, 1e5), number(0.0, 1e4))
def test_the_constants_of_a_yeoh_solid_come_back(C10, C20, C30):
    fit = fit_law(pulled(Yeoh(C10, C20, C30), np.linspace(0.0, 2.0, 50)), Yeoh, max_strain=2.0)
    scale = C10 + C20 + C30
    assert fit.law.constants == pytest.approx((C10, C20, C30), abs=1e-9 * scale)
    assert fit.relative_residual < 1e-10
    assert fit.worst_error < 1e-8
    assert fit.r_squared == pytest.approx(1.0)


@given(number(1e3, 1e6))
def test_the_constant_of_a_neo_hookean_solid_comes_back(C10):
    fit = fit_law(pulled(NeoHooke(C10), np.linspace(0.0, 1.0, 20)), NeoHooke, max_strain=1.0)
    assert fit.law.constants == pytest.approx((C10,), rel=1e-12)


@given(number(1e3, 1e6), number(-9e2, 1e5))
def test_the_constants_of_a_mooney_rivlin_solid_come_back(C10, C01):
    test = pulled(MooneyRivlin(C10, C01), np.linspace(0.0, 1.0, 20))
    fit = fit_law(test, MooneyRivlin, max_strain=1.0)
    assert fit.law.constants == pytest.approx((C10, C01), abs=1e-9 * (C10 + abs(C01)))


@pytest.mark.parametrize(
    ("mu", "alpha", "terms"), [((40e3,), (3.0,), 1), ((40e3, 2e3), (1.8, -3.0), 2)]
)
def test_the_terms_of_an_ogden_solid_come_back(mu, alpha, terms):
    test = pulled(Ogden(mu, alpha), np.linspace(0.0, 2.0, 50))
    fit = fit_law(test, Ogden, max_strain=2.0, terms=terms)
    assert fit.law.mu == pytest.approx(mu, rel=1e-6)
    assert fit.law.alpha == pytest.approx(alpha, rel=1e-6)


def test_exponents_of_an_ogden_fit_have_a_largest_magnitude():
    """Noise of 1 % in one tension test: without a bound the best fit has an exponent of -10.4."""
    test = pulled(Yeoh(23e3, 2.3e3, 50.0), np.linspace(0.0, 1.0, 60))
    noise = 0.01 * test.stress.max() * np.random.default_rng(2).standard_normal(60)
    fit = fit_law(TensileTest(test.strain, test.stress + noise, "noisy"), Ogden, max_strain=1.0)
    assert 0.99 * LARGEST_EXPONENT < max(map(abs, fit.law.alpha)) <= LARGEST_EXPONENT
    assert min(fit.law.mu) > 0.0 and fit.relative_residual < 0.016


def test_three_terms_hold_a_rubber_in_every_mode():
    """Ogden's constants (1972) for Treloar's rubber, pulled to a stretch of 7: found again from
    the one curve, so that another mode is met as well.
    """
    rubber = Ogden((409.5e3, 3e3, 10e3), (1.3, 5.0, -2.0))
    fit = fit_law(pulled(rubber, np.linspace(0.0, 6.0, 60)), Ogden, max_strain=6.0)
    assert fit.worst_error < 1e-6
    stretch = np.linspace(1.1, 4.0, 20)
    expected = EQUIBIAXIAL.nominal_stress(rubber, stretch)
    np.testing.assert_allclose(EQUIBIAXIAL.nominal_stress(fit.law, stretch), expected, rtol=1e-4)


def test_a_negative_third_constant_comes_back():
    law = Yeoh(21.6e3, 3.03e3, -0.111e3)
    fit = fit_law(pulled(law, np.linspace(0.0, 2.0, 90)), Yeoh, max_strain=2.0)
    assert fit.law.constants == pytest.approx(law.constants, rel=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_noise_moves_the_constants_by_no_more_than_it_can(seed):
    """Noise of 1 % of the largest stress in 200 points: four deviations of what it does to each.

    The deviations are those of linear least squares, s^2 (A^T A)^-1, for points evenly in strain.
    """
    law, strain = Yeoh(23e3, 2.3e3, 50.0), np.linspace(0.1005, 1.5, 200)
    clean = pulled(law, strain).stress
    deviation = 0.01 * clean.max()
    noise = deviation * np.random.default_rng(seed).standard_normal(len(strain))
    fit = fit_law(TensileTest(strain, clean + noise, "noisy"), Yeoh, max_strain=2.0)
    A = np.stack([UNIAXIAL.nominal_stress(Yeoh(*unit), 1.0 + strain) for unit in np.eye(3)], axis=1)
    expected = deviation * np.sqrt(np.diag(np.linalg.inv(A.T @ A)))
    assert (np.abs(np.subtract(fit.law.constants, law.constants)) < 4.0 * expected).all()
    # First loading drops few points, so the residual is the noise.
    assert fit.residual == pytest.approx(deviation, rel=0.25)


def test_a_densely_sampled_part_has_no_more_say():
    """The same curve, which no neo-Hookean solid has, with 20 times as many points in one half."""
    law = Yeoh(23e3, 2.3e3)
    even = pulled(law, np.linspace(0.0, 2.0, 401))
    dense = pulled(law, np.r_[np.linspace(0.0, 1.0, 4000), np.linspace(1.005, 2.0, 200)])
    C10 = [fit_law(test, NeoHooke, max_strain=2.0).law.C10 for test in (even, dense)]
    assert C10[0] == pytest.approx(C10[1], rel=1e-3)


def test_two_terms_leave_the_third_constant_zero():
    fit = fit_law(pulled(Yeoh(1e4, 1e3, 10.0), np.linspace(0, 1, 50)), Yeoh, 1.0, terms=2)
    assert fit.law.C30 == 0.0
    assert 0.0 < fit.relative_residual < 0.01


def test_the_fit_ends_where_the_specimen_breaks():
    test = pulled(Yeoh(1e4, 1e3), np.linspace(0.0, 1.5, 61))
    stress = np.where(test.strain > 1.0, 0.0, test.stress)
    fit = fit_law(TensileTest(test.strain, stress, "broken"), Yeoh, max_strain=2.0)
    assert fit.max_strain == pytest.approx(1.0)
    assert fit.law.constants[0] == pytest.approx(1e4)


def test_slack_makes_C10_too_small_by_what_the_docstring_says():
    """1 % of slack before a Dragon Skin 10 begins to pull: C10 is 1 to 3 % too small."""
    strain = np.linspace(0.0, 1.5, 300)
    stress = UNIAXIAL.nominal_stress(Yeoh(23.5e3, 2.24e3), 1.0 + np.maximum(strain - 0.01, 0.0))
    fit = fit_law(TensileTest(strain, stress, "slack"), Yeoh, max_strain=1.5, terms=2)
    assert 0.01 < 1.0 - fit.law.C10 / 23.5e3 < 0.03


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"max_strain": 0.1}, "0 points to fit"),
        ({"max_strain": 0.5, "min_strain": 0.7}, "0 points to fit"),
        ({"max_strain": 0.2}, "at least 8 are needed"),
        ({"max_strain": float("nan")}, "0 points to fit"),
        ({"max_strain": 1.0, "terms": 4}, "this law has 3"),
        ({"max_strain": 1.0, "terms": 0}, "this law has 3"),
        ({"max_strain": 1.0, "min_strain": -0.1}, "is not positive"),
    ],
)
def test_ranges_that_are_refused(options, says):
    test = pulled(Yeoh(1e4, 1e3), np.linspace(0.0, 1.0, 51))
    with pytest.raises(MaterialError, match=says):
        fit_law(test, Yeoh, **options)


def test_a_curve_without_initial_stiffness_is_refused():
    """C10 = -100 Pa: the stress pulls all over the range, and pushes below it."""
    test = pulled(Yeoh(-100.0, 1e4), np.linspace(0.0, 1.0, 50))
    with pytest.raises(MaterialError, match=r"between strains of 0.102 and 1 gives C10 = -"):
        fit_law(test, Yeoh, max_strain=1.0)


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("dragon_skin_10_measured", "Dragon_Skin_10_MEDIUM"),
        ("dragon_skin_20", "Dragon_Skin_20"),
        ("dragon_skin_30_measured", "Dragon_Skin_30"),
        ("ecoflex_00_30", "Ecoflex_00-30"),
        ("ecoflex_00_50", "Ecoflex_00-50"),
    ],
)
def test_the_library_holds_what_its_source_gives(name, file):
    path = TENSILE / f"{file}.csv"
    if not path.is_file():
        pytest.skip(f"no reference data here: {path} (ODbL, not part of the project)")
    data = library_material(name)
    fit = fit_law(read_tensile_test(path), Yeoh, data.strain_range, terms=2)
    rounded = [float(f"{c:.3g}") for c in fit.law.constants]
    held = [data.C10, data.C20, data.C30]
    assert held == pytest.approx(rounded)
    assert re.search(rf"up to {100 * data.strain_range:.0f} % strain", data.source)
    assert fit.relative_residual < 0.025


def in_mode(law, mode, largest=1.0, points=40):
    strain = np.linspace(0.0, 0.6 if mode == "compression" else largest, points)
    blank = TensileTest(strain, strain, mode, mode=mode)
    return TensileTest(strain, blank.stress_of(law, strain), mode, mode=mode)


def test_the_stress_of_each_mode_is_its_closed_form():
    """Treloar 1975, The Physics of Rubber Elasticity, section 5.3, of a Mooney-Rivlin solid.

    In compression by e, the stress is that of the stretch 1 - e, counted positive.
    """
    C1, C2, e = 30e3, 8e3, 0.4
    for mode, stretch, expected in (
        ("uniaxial", 1 + e, lambda s: 2 * (s - s**-2) * (C1 + C2 / s)),
        ("equibiaxial", 1 + e, lambda s: 2 * (s - s**-5) * (C1 + C2 * s**2)),
        ("planar", 1 + e, lambda s: 2 * (s - s**-3) * (C1 + C2)),
        ("compression", 1 - e, lambda s: -2 * (s - s**-2) * (C1 + C2 / s)),
    ):
        test = TensileTest(np.array([e]), np.array([1.0]), "t", mode=mode)
        found = test.stress_of(MooneyRivlin(C1, C2), test.strain)
        assert found == pytest.approx(expected(stretch)), mode


@pytest.mark.parametrize("mode", TEST_MODES)
@pytest.mark.parametrize("law", [Yeoh(2e4, 1e3, 50.0), Ogden((3e4,), (2.5,))])
def test_the_curve_of_each_mode_is_met(law, mode):
    """Its stress, not its constants: planar tension does not tell alpha from -alpha."""
    fit = fit_law(in_mode(law, mode), type(law), 1.0, terms=None if type(law) is Yeoh else 1)
    assert fit.mode == mode
    assert fit.worst_error < 1e-6
    assert fit.law.initial_shear_modulus == pytest.approx(law.initial_shear_modulus, rel=1e-5)


def test_constants_come_back_from_all_modes_at_once():
    law = Ogden((30e3, 2e3), (1.8, -3.0))
    fits = fit_tests([in_mode(law, mode) for mode in TEST_MODES], Ogden, 1.0, terms=2)
    assert [fit.mode for fit in fits] == list(TEST_MODES)
    assert all(fit.law is fits[0].law and fit.relative_residual < 1e-6 for fit in fits)
    assert fits[0].law.mu == pytest.approx(law.mu, rel=1e-4)


def test_weights_pull_the_fit_towards_a_test():
    """Two specimens of different stiffness: the modulus goes from the mean to the one preferred."""
    soft, stiff = (in_mode(NeoHooke(C10), "uniaxial") for C10 in (10e3, 20e3))
    moduli = [
        fit_tests([soft, stiff], NeoHooke, 1.0, weights=weights)[0].law.C10
        for weights in (None, (1.0, 1.0), (1.0, 1e6), (1e6, 1.0))
    ]
    # Least squares of the relative errors C/10 - 1 and C/20 - 1.
    assert moduli[:2] == pytest.approx([12e3, 12e3])
    assert moduli[2:] == pytest.approx([20e3, 10e3], rel=1e-4)


@pytest.mark.parametrize("weights", [(1.0,), (1.0, 0.0), (1.0, -1.0), (1.0, float("nan"))])
def test_weights_must_be_positive_and_one_per_test(weights):
    tests = [in_mode(NeoHooke(1e4), "uniaxial"), in_mode(NeoHooke(1e4), "planar")]
    with pytest.raises(MaterialError, match="2 tests have the weights") as caught:
        fit_tests(tests, NeoHooke, 1.0, weights=weights)
    assert "one positive weight" in caught.value.hint


def test_a_law_that_lacks_I2_does_not_predict_the_other_modes():
    rubber = MooneyRivlin(20e3, 10e3)
    tests = [in_mode(rubber, mode) for mode in ("uniaxial", "equibiaxial")]
    assert prediction_errors(tests, MooneyRivlin, 1.0) == pytest.approx(np.zeros((2, 2)), abs=1e-9)
    errors = prediction_errors(tests, Yeoh, 1.0)
    assert errors[0, 0] < 0.02 and errors[1, 1] < 0.02
    assert errors[0, 1] > 0.3 and errors[1, 0] > 0.3


def test_a_test_without_a_stable_fit_predicts_nothing():
    good = in_mode(NeoHooke(10e3), "planar")
    bad = TensileTest(good.strain, 1e3 * good.strain**6, "late")
    errors = prediction_errors([good, bad], MooneyRivlin, 1.0)
    assert np.isfinite(errors[0]).all() and np.isnan(errors[1]).all()


def test_three_terms_of_Ogden_meet_the_rubber_of_Treloar_in_three_modes():
    """Treloar 1944, Trans. Faraday Soc. 40:59-70, up to a stretch of 5: within 2 % rms each."""
    path = REFERENCE / "measured" / "rubber_multiaxial" / "tests.csv"
    if not path.is_file():
        pytest.skip(f"no reference data here: {path}")
    modes = {"uniaxial": "uniaxial", "equibiaxial": "equibiaxial", "pure shear": "planar"}
    rows = [row for row in csv.DictReader(path.open()) if row["source"] == "Treloar_1944"]
    tests = []
    for name, mode in modes.items():
        points = [
            (float(r["stretch_1"]) - 1.0, 1e6 * float(r["nominal_stress_1_MPa"]))
            for r in rows if r["test"] == name and r["stretch_1"]
        ]  # fmt: skip
        tests.append(TensileTest(*np.array(points).T, name, mode=mode))
    fits = fit_tests(tests, Ogden, 4.0, min_strain=0.05)
    assert max(fit.relative_residual for fit in fits) < 0.02
    one = fit_tests(tests, Yeoh, 4.0, min_strain=0.05)
    assert max(fit.relative_residual for fit in one) > 0.04
