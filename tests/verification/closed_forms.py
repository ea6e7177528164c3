"""Exact or numerically exact answers of solids at large strain, that finite-element results are
held against: homogeneous states, inflated tubes and spheres. Others: structural_forms.py.

Nothing here imports softsim: every answer comes from its own equations. SI units.

A solid is given by `c` = (C10, C20, C30) [Pa], missing constants being zero (neo-Hooke is (C10,)):
W = C10 k + C20 k^2 + C30 k^3 with k = I1_bar - 3 (Yeoh 1993, Rubber Chem. Technol. 66:754-771).
The nearly incompressible solid adds (kappa/2)(J - 1)^2, with kappa = 20 mu0 where none is given.
W' below is dW/dI1_bar. From these energies the principal Cauchy stresses are
sigma_i = 2 W' lambda_i^2 - q (incompressible, q from the boundary), and
sigma_i = 2 W' J^(-5/3) (lambda_i^2 - I1/3) + kappa (J - 1) (nearly incompressible); see Holzapfel
2000, Nonlinear Solid Mechanics, sections 6.3 to 6.5.
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

DEFAULT_BULK_RATIO = 20.0


# The law ------------------------------------------------------------------------------------------


def energy_density(I1_bar, c):
    """W(I1_bar) of the Yeoh law [J/m^3]."""
    k = I1_bar - 3.0
    return sum(constant * k ** (i + 1) for i, constant in enumerate(c))


def energy_slope(I1_bar, c):
    """W' = dW/dI1_bar [Pa]."""
    k = I1_bar - 3.0
    return sum((i + 1) * constant * k**i for i, constant in enumerate(c))


def default_bulk_modulus(c):
    """kappa = 20 mu0 = 40 C10 [Pa]: what ABAQUS/Explicit takes where none is given."""
    return DEFAULT_BULK_RATIO * 2.0 * c[0]


def cauchy_stress(stretches, c, kappa):
    """Principal Cauchy stresses [Pa] of the nearly incompressible solid, all three."""
    squares = np.square(stretches)
    J = np.prod(stretches)
    I1 = np.sum(squares)
    slope = energy_slope(J ** (-2.0 / 3.0) * I1, c)
    return 2.0 * slope * J ** (-5.0 / 3.0) * (squares - I1 / 3.0) + kappa * (J - 1.0)


def ogden_cauchy_stress(stretches, c, kappa):
    """As cauchy_stress, of Ogden's law with c = (moduli [Pa], exponents): W = sum 2 mu / alpha^2
    (l1^alpha + l2^alpha + l3^alpha - 3), l the stretches over J^(1/3). Mooney-Rivlin has the moduli
    2 C10, 2 C01 and the exponents 2, -2. Source: Ogden 1972, Proc. R. Soc. Lond. A 326:565-584.
    """
    J = np.prod(stretches)
    isochoric = np.asarray(stretches) * J ** (-1.0 / 3.0)
    tau = sum(2.0 * mu / alpha * isochoric**alpha for mu, alpha in zip(*c, strict=True))
    return (tau - tau.mean()) / J + kappa * (J - 1.0)


# Homogeneous tension ------------------------------------------------------------------------------


def uniaxial_stress(stretch, c):
    """Nominal stress [Pa] of an incompressible bar pulled along one axis, sides free.

    Stretches (s, s^-1/2, s^-1/2), I1 = s^2 + 2/s: P = 2 W' (s - s^-2).
    Source: Holzapfel 2000, section 6.5; Yeoh 1993.
    """
    return 2.0 * energy_slope(stretch**2 + 2.0 / stretch, c) * (stretch - stretch**-2)


def equibiaxial_stress(stretch, c):
    """Nominal stress [Pa] of an incompressible sheet pulled equally in its plane, faces free.

    Stretches (s, s, s^-2), I1 = 2 s^2 + s^-4: P = 2 W' (s - s^-5). Source: as uniaxial_stress.
    """
    return 2.0 * energy_slope(2.0 * stretch**2 + stretch**-4, c) * (stretch - stretch**-5)


def pure_shear_stress(stretch, c):
    """Nominal stress [Pa] of an incompressible sheet pulled along one axis, its width held.

    Stretches (s, 1, 1/s), I1 = s^2 + 1 + s^-2: P = 2 W' (s - s^-3). In plane strain this is plain
    tension with free sides. Source: as uniaxial_stress.
    """
    return 2.0 * energy_slope(stretch**2 + 1.0 + stretch**-2, c) * (stretch - stretch**-3)


class Tension(NamedTuple):
    """Nominal stress along the pull [Pa], stretch of the free direction(s), volume ratio."""

    stress: float
    lateral_stretch: float
    J: float


def _free_lateral_tension(stretches_for, stretch, incompressible_lateral, c, kappa, cauchy_stress):
    """Find the lateral stretch at which the last principal stress vanishes."""
    kappa = default_bulk_modulus(c) if kappa is None else kappa
    lateral = brentq(
        lambda s: cauchy_stress(stretches_for(s), c, kappa)[2],
        0.5 * incompressible_lateral,
        2.0 * incompressible_lateral,
        xtol=1e-15,
        rtol=1e-14,
    )
    stretches = stretches_for(lateral)
    J = float(np.prod(stretches))
    return Tension(float(J * cauchy_stress(stretches, c, kappa)[0] / stretch), lateral, J)


def nearly_incompressible_uniaxial(stretch, c, kappa=None, cauchy_stress=cauchy_stress):
    """As uniaxial_stress for W(I1_bar) + (kappa/2)(J - 1)^2.

    Stretches (s, t, t), with t from sigma_t = 0.
    """
    return _free_lateral_tension(
        lambda t: (stretch, t, t), stretch, stretch**-0.5, c, kappa, cauchy_stress
    )


def nearly_incompressible_equibiaxial(stretch, c, kappa=None, cauchy_stress=cauchy_stress):
    """As equibiaxial_stress for W(I1_bar) + (kappa/2)(J - 1)^2.

    Stretches (s, s, t), with t from sigma_t = 0.
    """
    return _free_lateral_tension(
        lambda t: (stretch, stretch, t), stretch, stretch**-2.0, c, kappa, cauchy_stress
    )


def nearly_incompressible_pure_shear(stretch, c, kappa=None, cauchy_stress=cauchy_stress):
    """As pure_shear_stress for W(I1_bar) + (kappa/2)(J - 1)^2.

    Stretches (s, 1, t), with t from sigma_t = 0. The plane-strain bar with free sides.
    """
    return _free_lateral_tension(
        lambda t: (stretch, 1.0, t), stretch, stretch**-1.0, c, kappa, cauchy_stress
    )


# Thick tube and sphere under internal pressure ----------------------------------------------------


def incompressible_tube_pressure(a, A, B, c):
    """Internal pressure [Pa] that opens a thick incompressible tube from inner radius A to a.

    Reference radii A < R < B, axial stretch 1, outside free. The volume gives
    r^2 = a^2 + R^2 - A^2, hoop stretch s = r/R, radial stretch 1/s, I1 = s^2 + s^-2 + 1.
    d(sigma_r)/dr = (sigma_theta - sigma_r)/r with sigma_theta - sigma_r = 2 W' (s^2 - s^-2),
    integrated from sigma_r(a) = -p to 0, with dr = (R/r) dR:
    p = int_A^B 2 W' (s^2 - s^-2) R/r^2 dR.
    Source: Green and Zerna 1968, Theoretical Elasticity, section 3.10; Rivlin 1949.
    """

    def integrand(R):
        r = np.sqrt(a**2 + R**2 - A**2)
        s = r / R
        slope = energy_slope(s**2 + s**-2 + 1.0, c)
        return 2.0 * slope * (s**2 - s**-2) * R / r**2

    return quad(integrand, A, B, epsabs=0.0, epsrel=1e-12)[0]


def incompressible_sphere_pressure(a, A, B, c):
    """Internal pressure [Pa] that opens a thick incompressible shell from inner radius A to a.

    The volume gives r^3 = a^3 + R^3 - A^3, hoop stretches s = r/R, radial stretch s^-2,
    I1 = 2 s^2 + s^-4. d(sigma_r)/dr = 2 (sigma_theta - sigma_r)/r with
    sigma_theta - sigma_r = 2 W' (s^2 - s^-4), and dr = (R/r)^2 dR:
    p = int_A^B 4 W' (s^2 - s^-4) R^2/r^3 dR.
    Source: Green and Zerna 1968, Theoretical Elasticity, section 3.10.
    """

    def integrand(R):
        r = np.cbrt(a**3 + R**3 - A**3)
        s = r / R
        slope = energy_slope(2.0 * s**2 + s**-4, c)
        return 4.0 * slope * (s**2 - s**-4) * R**2 / r**3

    return quad(integrand, A, B, epsabs=0.0, epsrel=1e-12)[0]


class Inflation(NamedTuple):
    """Internal pressure [Pa], deformed outer radius [m], strain energy (tube J/m, sphere J)."""

    pressure: float
    outer_radius: float
    strain_energy: float


def _inflation(a, radii, laws, bulk_moduli, pressure_guess, hoops):
    """Shoot through the layers of the wall, between `radii`; `hoops` is the number of hoop
    directions: tube 1, sphere 2.
    """

    def stretches(radial, hoop):
        return (radial, hoop, hoop if hoops == 2 else 1.0)

    def radial_stretch(sigma_r, hoop, c, kappa):
        """Invert sigma_r(radial stretch), which rises from -inf to far above any stress here."""
        volume_preserving = hoop**-hoops
        return brentq(
            lambda s: cauchy_stress(stretches(s, hoop), c, kappa)[0] - sigma_r,
            0.2 * volume_preserving,
            5.0 * volume_preserving,
            xtol=1e-15,
            rtol=1e-14,
        )

    def slopes(R, y, c, kappa):
        r, sigma_r, _ = y
        hoop = r / R
        stretch = stretches(radial_stretch(sigma_r, hoop, c, kappa), hoop)
        sigma = cauchy_stress(stretch, c, kappa)
        J = np.prod(stretch)
        I1_bar = J ** (-2.0 / 3.0) * np.sum(np.square(stretch))
        density = energy_density(I1_bar, c) + 0.5 * kappa * (J - 1.0) ** 2
        shell = 2.0 * np.pi * R if hoops == 1 else 4.0 * np.pi * R**2
        return [stretch[0], hoops * (sigma[1] - sigma_r) / r * stretch[0], density * shell]

    def outer_face(pressure):
        state = (a, -pressure, 0.0)
        for *span, c, kappa in zip(radii, radii[1:], laws, bulk_moduli, strict=False):
            layer = solve_ivp(
                slopes, span, state, "DOP853", rtol=1e-10, atol=1e-14, args=(c, kappa)
            )
            state = layer.y[:, -1]  # place and radial stress go on in the next layer
        return state

    pressure = brentq(
        lambda p: outer_face(p)[1], 0.5 * pressure_guess, 1.5 * pressure_guess, rtol=1e-11
    )
    outer_radius, _, strain_energy = outer_face(pressure)
    return Inflation(pressure, outer_radius, strain_energy)


def tube_inflation(a, A, B, c, kappa=None):
    """As incompressible_tube_pressure for W(I1_bar) + (kappa/2)(J - 1)^2: an `Inflation`.

    Unknowns r(R) and sigma_r(R), with radial stretch s_r = dr/dR from sigma_r and the hoop stretch
    r/R: d(sigma_r)/dR = (sigma_theta - sigma_r) s_r / r, r(A) = a, sigma_r(A) = -p,
    sigma_r(B) = 0. Solved by shooting on p. Axial stretch 1, a > A.
    """
    kappa = default_bulk_modulus(c) if kappa is None else kappa
    guess = incompressible_tube_pressure(a, A, B, c)
    return _inflation(a, (A, B), (c,), (kappa,), guess, hoops=1)


def layered_tube_inflation(a, radii, laws):
    """As tube_inflation of bonded layers between reference `radii`, each of a law (constants) and
    its default bulk modulus: radius and radial stress are continuous.
    """
    rise = a**2 - radii[0] ** 2  # of the square of every radius, without compression
    guess = sum(
        incompressible_tube_pressure(np.sqrt(A**2 + rise), A, B, c)
        for A, B, c in zip(radii, radii[1:], laws, strict=False)
    )
    bulk_moduli = [default_bulk_modulus(c) for c in laws]
    return _inflation(a, radii, laws, bulk_moduli, guess, hoops=1)


def sphere_inflation(a, A, B, c, kappa=None):
    """As incompressible_sphere_pressure for W(I1_bar) + (kappa/2)(J - 1)^2: an `Inflation`.

    As tube_inflation with d(sigma_r)/dR = 2 (sigma_theta - sigma_r) s_r / r.
    """
    kappa = default_bulk_modulus(c) if kappa is None else kappa
    guess = incompressible_sphere_pressure(a, A, B, c)
    return _inflation(a, (A, B), (c,), (kappa,), guess, hoops=2)
