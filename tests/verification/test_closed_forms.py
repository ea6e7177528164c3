"""The closed forms themselves, each against something that does not share its derivation."""

import closed_forms as cf
import numpy as np
import pytest
import structural_forms as sf
from numpy.polynomial.legendre import leggauss
from scipy.integrate import quad
from scipy.linalg import eigh
from scipy.optimize import minimize

DRAGON_SKIN_10 = (36e3, 250.0, 23.0)
A, B = 7.5e-3, 8.5e-3

TENSIONS = [
    (cf.uniaxial_stress, cf.nearly_incompressible_uniaxial, lambda s: (s, s**-0.5, s**-0.5), 1),
    (cf.equibiaxial_stress, cf.nearly_incompressible_equibiaxial, lambda s: (s, s, s**-2), 2),
    (cf.pure_shear_stress, cf.nearly_incompressible_pure_shear, lambda s: (s, 1.0, 1.0 / s), 1),
]


def elastic_constants(mu, kappa):
    """Young's modulus and Poisson's ratio."""
    return 9.0 * kappa * mu / (3.0 * kappa + mu), (3.0 * kappa - 2.0 * mu) / (
        6.0 * kappa + 2.0 * mu
    )


def central_difference(function, x, step):
    return (function(x + step) - function(x - step)) / (2.0 * step)


@pytest.mark.parametrize(("stress", "_", "stretches", "pulls"), TENSIONS)
@pytest.mark.parametrize("stretch", [0.8, 1.3, 2.5])
def test_tension_does_the_work_of_the_energy(stress, _, stretches, pulls, stretch):
    """dW/ds = (number of pulled axes) P."""

    def energy(s):
        return cf.energy_density(np.sum(np.square(stretches(s))), DRAGON_SKIN_10)

    work = central_difference(energy, stretch, 1e-5)
    assert pulls * stress(stretch, DRAGON_SKIN_10) == pytest.approx(work, rel=1e-7)


@pytest.mark.parametrize(("_", "nearly", "stretches", "pulls"), TENSIONS)
@pytest.mark.parametrize("stretch", [0.8, 1.3, 2.5])
def test_nearly_incompressible_tension_does_the_work_of_the_energy(
    _, nearly, stretches, pulls, stretch
):
    """The free stretch minimises W, so that dW/ds = (number of pulled axes) P there too."""
    kappa = cf.default_bulk_modulus(DRAGON_SKIN_10)

    def energy(s):
        lateral = nearly(s, DRAGON_SKIN_10).lateral_stretch
        pulled = np.array(stretches(s))
        free = pulled == stretches(s)[2]
        all_three = np.where(free, lateral, pulled)
        J = np.prod(all_three)
        I1_bar = J ** (-2.0 / 3.0) * np.sum(all_three**2)
        return cf.energy_density(I1_bar, DRAGON_SKIN_10) + 0.5 * kappa * (J - 1.0) ** 2

    work = central_difference(energy, stretch, 1e-5)
    assert pulls * nearly(stretch, DRAGON_SKIN_10).stress == pytest.approx(work, rel=1e-6)


@pytest.mark.parametrize(("stress", "nearly", "_", "pulls"), TENSIONS)
def test_tension_tends_to_incompressible(stress, nearly, _, pulls):
    """The difference falls as 1/kappa."""
    exact = stress(2.0, DRAGON_SKIN_10)
    off = [nearly(2.0, DRAGON_SKIN_10, k).stress / exact - 1.0 for k in (1e8, 1e9)]
    assert abs(off[1]) < 2e-4
    assert off[0] / off[1] == pytest.approx(10.0, rel=0.02)


def test_tension_at_small_strain():
    """Hooke: E, E/(1 - nu), E/(1 - nu^2)."""
    E, nu = elastic_constants(2.0 * DRAGON_SKIN_10[0], cf.default_bulk_modulus(DRAGON_SKIN_10))
    moduli = (E, E / (1.0 - nu), E / (1.0 - nu**2))
    for (_, nearly, _, _), modulus in zip(TENSIONS, moduli, strict=True):

        def stress(s, nearly=nearly):
            return nearly(s, DRAGON_SKIN_10).stress

        assert central_difference(stress, 1.0, 1e-4) == pytest.approx(modulus, rel=1e-6)


@pytest.mark.parametrize("a", [7.6e-3, 9e-3, 12e-3])
def test_incompressible_inflation_does_the_work_of_the_energy(a):
    """Pressure times the change of enclosed volume is the change of strain energy."""

    def tube_energy(a):
        def per_radius(R):
            s2 = (a**2 + R**2 - A**2) / R**2
            return cf.energy_density(s2 + 1.0 / s2 + 1.0, DRAGON_SKIN_10) * 2.0 * np.pi * R

        return quad(per_radius, A, B, epsrel=1e-13)[0]

    def sphere_energy(a):
        def per_radius(R):
            s = np.cbrt(a**3 + R**3 - A**3) / R
            return cf.energy_density(2.0 * s**2 + s**-4, DRAGON_SKIN_10) * 4.0 * np.pi * R**2

        return quad(per_radius, A, B, epsrel=1e-13)[0]

    tube = central_difference(tube_energy, a, 1e-7) / (2.0 * np.pi * a)
    sphere = central_difference(sphere_energy, a, 1e-7) / (4.0 * np.pi * a**2)
    assert cf.incompressible_tube_pressure(a, A, B, DRAGON_SKIN_10) == pytest.approx(tube, rel=1e-6)
    assert cf.incompressible_sphere_pressure(a, A, B, DRAGON_SKIN_10) == pytest.approx(
        sphere, rel=1e-6
    )


@pytest.mark.parametrize(
    ("inflation", "area"),
    [
        (cf.tube_inflation, lambda a: 2.0 * np.pi * a),
        (cf.sphere_inflation, lambda a: 4 * np.pi * a**2),
    ],
)
@pytest.mark.parametrize("a", [9e-3, 12e-3])
def test_inflation_does_the_work_of_the_energy(inflation, area, a):
    """As above for kappa = 20 mu0, where the wall's profile is itself solved for."""

    def energy(a):
        return inflation(a, A, B, DRAGON_SKIN_10).strain_energy

    work = central_difference(energy, a, 1e-5) / area(a)
    assert inflation(a, A, B, DRAGON_SKIN_10).pressure == pytest.approx(work, rel=1e-5)


@pytest.mark.parametrize(
    ("inflation", "incompressible"),
    [
        (cf.tube_inflation, cf.incompressible_tube_pressure),
        (cf.sphere_inflation, cf.incompressible_sphere_pressure),
    ],
)
def test_inflation_tends_to_incompressible(inflation, incompressible):
    """The difference falls as 1/kappa."""
    exact = incompressible(12e-3, A, B, DRAGON_SKIN_10)
    off = [inflation(12e-3, A, B, DRAGON_SKIN_10, k).pressure / exact - 1.0 for k in (1e8, 1e9)]
    assert abs(off[1]) < 2e-4
    assert off[0] / off[1] == pytest.approx(10.0, rel=0.02)


def test_inflation_at_small_strain():
    """Lame's thick tube (plane strain) and thick sphere, E and nu of kappa = 20 mu0."""
    E, nu = elastic_constants(2.0 * DRAGON_SKIN_10[0], cf.default_bulk_modulus(DRAGON_SKIN_10))
    opening = 1e-5 * A
    tube_compliance = (1.0 + nu) / E * A**2 / (B**2 - A**2) * ((1.0 - 2.0 * nu) * A + B**2 / A)
    sphere_compliance = (
        A**3 / (B**3 - A**3) / E * ((1.0 - 2.0 * nu) * A + (1.0 + nu) * B**3 / (2.0 * A**2))
    )
    tube = cf.tube_inflation(A + opening, A, B, DRAGON_SKIN_10).pressure
    sphere = cf.sphere_inflation(A + opening, A, B, DRAGON_SKIN_10).pressure
    # The next term is of the order of the strain, 1e-5, times a small number.
    assert tube == pytest.approx(opening / tube_compliance, rel=1e-4)
    assert sphere == pytest.approx(opening / sphere_compliance, rel=1e-4)


def ritz_frequency(length, height, E, G, rho, shear_coefficient, terms=8):
    """First frequency [Hz] of the Timoshenko cantilever from its energies.

    Deflection and rotation are sums of powers 1 to `terms` of x/L.
    """
    powers = np.arange(1, terms + 1)
    total = powers[:, None] + powers[None, :]
    mass = 1.0 / (total + 1.0)
    slope = np.outer(powers, powers) / (total - 1.0)
    mixed = -powers[:, None] / total  # w' against psi
    inertia, shear = height**2 / 12.0, shear_coefficient * G
    stiffness = np.block(
        [
            [shear / length * slope, shear * mixed],
            [shear * mixed.T, shear * length * mass + E * inertia / length * slope],
        ]
    )
    none = np.zeros_like(mass)
    inertias = rho * length * np.block([[mass, none], [none, inertia * mass]])
    return np.sqrt(eigh(stiffness, inertias, eigvals_only=True)[0]) / (2.0 * np.pi)


@pytest.mark.parametrize("height", [0.01, 0.03, 0.1])
def test_timoshenko_frequency_against_ritz(height):
    E, nu, rho = 263.8e3, 0.49, 1070.0
    beam = (0.1, height, E, E / (2.0 * (1.0 + nu)), rho, sf.rectangle_shear_coefficient(nu))
    assert sf.timoshenko_frequency(*beam) == pytest.approx(ritz_frequency(*beam), rel=1e-6)


def test_timoshenko_frequency_limits():
    """Slender: Euler and Bernoulli, off by (height/length)^2. Stiff in bending: a shear beam."""
    E, G, rho, k = 3e5, 1e5, 1000.0, 5.0 / 6.0
    slender = sf.euler_bernoulli_frequency(1.0, 0.01, E, rho)
    assert slender == pytest.approx(0.16154 * 0.01 * np.sqrt(E / rho), rel=1e-4)
    assert sf.timoshenko_frequency(1.0, 0.01, E, G, rho, k) == pytest.approx(slender, rel=1e-3)
    shear_beam = np.sqrt(k * G / rho) / 4.0
    assert sf.timoshenko_frequency(1.0, 0.1, 1e7 * E, G, rho, k) == pytest.approx(
        shear_beam, rel=1e-3
    )


def test_shear_coefficient_of_plane_strain():
    nu = 0.4
    effective = sf.rectangle_shear_coefficient(nu / (1.0 - nu))
    assert effective == pytest.approx(10.0 / (12.0 - nu), rel=1e-12)
    assert sf.rectangle_shear_coefficient(0.0) == pytest.approx(5.0 / 6.0)


def test_elastica_at_small_load():
    """w L^4/(8 EI) and F L^3/(3 EI)."""
    assert sf.elastica_sag(2.0, 3.0, weight_per_length=1e-3).drop == pytest.approx(
        1e-3 * 2.0**4 / (8.0 * 3.0), rel=1e-5
    )
    assert sf.elastica_sag(2.0, 3.0, tip_force=1e-3).drop == pytest.approx(
        1e-3 * 2.0**3 / (3.0 * 3.0), rel=1e-5
    )


@pytest.mark.parametrize(
    ("load", "drop", "shortening"),
    [(1.0, 0.30172, 0.05643), (2.0, 0.49346, 0.16064), (10.0, 0.81061, 0.55500)],
)
def test_elastica_under_tip_force(load, drop, shortening):
    """Elliptic integrals, tabulated by Mattiasson 1981, Int. J. Numer. Meth. Eng. 17:145-153."""
    sag = sf.elastica_sag(1.0, 1.0, tip_force=load)
    assert sag.drop == pytest.approx(drop, abs=1e-5)
    assert 1.0 - sag.reach == pytest.approx(shortening, abs=1e-5)


def test_pressed_ring_at_small_load():
    """Diameter shortened by (pi/4 - 2/pi) F R^3 / EI: Timoshenko, Strength of Materials II,
    section 12.
    """
    shortening = 1e-4
    slope = (0.25 * np.pi - 2.0 / np.pi) * 2.0**3 / 3.0
    assert sf.pressed_ring_force(2.0, 3.0, 4.0 - shortening) == pytest.approx(
        shortening / slope, rel=1e-3
    )


def test_elastica_under_its_weight_has_the_least_energy():
    """Slope angle as a polynomial, the sum of bending and potential energy minimised."""
    weight, force = 6.0, 1.5
    points, weights = leggauss(24)
    s, weights = 0.5 * (points + 1.0), 0.5 * weights
    powers = np.arange(1, 9)
    basis, slope = s[:, None] ** powers, powers * s[:, None] ** (powers - 1)

    def energy(coefficients):
        sin = np.sin(basis @ coefficients)
        bending = 0.5 * (slope @ coefficients) ** 2
        return weights @ (bending - (force + weight * (1.0 - s)) * sin)

    shape = minimize(energy, np.zeros(powers.size), method="BFGS", options={"gtol": 1e-7}).x
    sag = sf.elastica_sag(1.0, 1.0, weight_per_length=weight, tip_force=force)
    assert sag.drop == pytest.approx(weights @ np.sin(basis @ shape), abs=1e-4)
    assert sag.reach == pytest.approx(weights @ np.cos(basis @ shape), abs=1e-4)


def test_hertz_stiffness_is_that_of_its_contact_circle():
    """Stiffness dF/dd = 2 E* contact radius, with contact radius sqrt(R d) (Johnson 1985)."""
    E, nu, radius, depth = 1e5, 0.45, 5e-3, 1e-4
    stiffness = central_difference(lambda d: sf.hertz_force(d, radius, E, nu), depth, 1e-8)
    expected = 2.0 * E / (1.0 - nu**2) * np.sqrt(radius * depth)
    assert stiffness == pytest.approx(expected, rel=1e-6)


def layer_ratio(chi, nu, bonded):
    """Force over Hertz's at chi = sqrt(R d)/h."""
    depth, radius = 1e-4, 5e-3
    thickness = np.sqrt(radius * depth) / chi
    force = sf.layer_indentation_force(depth, radius, thickness, 1e5, nu, bonded)
    return force / sf.hertz_force(depth, radius, 1e5, nu)


def test_thick_layer_tends_to_hertz():
    """1 + (2/pi) 1.168 chi for a layer that slides on its base (Lebedev and Ufliand 1958)."""
    for nu in (0.3, 0.5):
        slope = (layer_ratio(1e-3, nu, False) - 1.0) / 1e-3
        assert slope == pytest.approx(2.0 / np.pi * 1.168, rel=2e-3)


@pytest.mark.parametrize("bonded", [True, False])
def test_thin_layer_tends_to_a_bed_of_springs(bonded):
    """F = pi M R d^2 / h, with M the confined modulus if bonded, else E/(1 - nu^2).

    Only the contact's rim, about one thickness wide, is off.
    """
    nu = 0.3
    confined = (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
    modulus = confined if bonded else 1.0 / (1.0 - nu**2)

    def off(chi):
        springs = np.pi * modulus * chi / (4.0 / 3.0 / (1.0 - nu**2))
        return layer_ratio(chi, nu, bonded) / springs - 1.0

    assert abs(off(4.0)) < 1e-2
    assert abs(off(8.0)) < 0.5 * abs(off(4.0))


@pytest.mark.parametrize(("bonded", "off"), [(True, 0.17), (False, 0.23)])
def test_dimitriadis_is_near_the_exact_layer(bonded, off):
    """As near as its docstring says, for a layer not thinner than chi = 1."""
    E, radius, depth = 1e5, 5e-3, 1e-4
    for chi in (0.05, 0.2, 0.5, 1.0):
        thickness = np.sqrt(radius * depth) / chi
        series = sf.dimitriadis_force(depth, radius, thickness, E, bonded)
        exact = sf.layer_indentation_force(depth, radius, thickness, E, 0.5, bonded)
        assert series == pytest.approx(exact, rel=off * min(1.0, 2.0 * chi))


def test_wave_speeds():
    """The modulus of each is the small-strain slope of the large-strain law."""
    c, rho = DRAGON_SKIN_10, 1070.0
    kappa, mu = cf.default_bulk_modulus(c), 2.0 * c[0]
    E, nu = elastic_constants(mu, kappa)
    free = central_difference(lambda s: cf.nearly_incompressible_uniaxial(s, c).stress, 1.0, 1e-4)
    held = central_difference(lambda s: cf.nearly_incompressible_pure_shear(s, c).stress, 1.0, 1e-4)
    confined = E * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
    assert sf.bar_wave_speed(E, rho) == pytest.approx(np.sqrt(free / rho), rel=1e-6)
    assert sf.plane_strain_bar_wave_speed(E, nu, rho) == pytest.approx(
        np.sqrt(held / rho), rel=1e-6
    )
    assert sf.confined_wave_speed(kappa, mu, rho) == pytest.approx(
        np.sqrt(confined / rho), rel=1e-12
    )


@pytest.mark.parametrize(("mu", "pull"), [(0.0, 0.1), (0.1, 0.202), (0.2, 0.306), (0.3, 0.412)])
def test_slope_pull(mu, pull):
    """The rounded values, and that slope angle and friction angle add."""
    assert sf.slope_pull(mu, 0.1) == pytest.approx(pull, abs=5e-4)
    assert sf.slope_pull(mu, 0.1) == pytest.approx(np.tan(np.arctan(0.1) + np.arctan(mu)))
