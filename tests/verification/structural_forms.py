"""Exact or numerically exact answers of linear elasticity and of waves, that finite-element results
are held against: cantilevers, a ring between plates, indented bodies, bars, a block on a slope.

Nothing here imports softsim: every answer comes from its own equations. SI units; those of solids
at large strain: closed_forms.py.
"""

from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.integrate import solve_bvp
from scipy.linalg import expm
from scipy.optimize import brentq

# Cantilevers --------------------------------------------------------------------------------------


def rectangle_shear_coefficient(nu):
    """Timoshenko's shear coefficient of a rectangle: 10 (1 + nu)/(12 + 11 nu).

    In plane strain put nu/(1 - nu) for nu (and E/(1 - nu^2) for E): 10/(12 - nu).
    Source: Cowper 1966, J. Appl. Mech. 33:335-340.
    """
    return 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu)


def euler_bernoulli_frequency(length, height, E, rho):
    """First bending frequency [Hz] of a slender cantilever of rectangular section.

    2 pi f = beta^2 / L^2 sqrt(EI/(rho A)), beta = 1.8751 the first root of
    cosh(beta) cos(beta) = -1, I/A = h^2/12. For plane strain give E/(1 - nu^2) as E.
    Source: any text on vibration, e.g. Timoshenko 1974, Vibration Problems in Engineering.
    """
    beta = brentq(lambda b: np.cosh(b) * np.cos(b) + 1.0, 1.5, 2.0)
    return beta**2 / length**2 * height * np.sqrt(E / (12.0 * rho)) / (2.0 * np.pi)


def timoshenko_frequency(length, height, E, G, rho, shear_coefficient):
    """First bending frequency [Hz] of a cantilever with shear and rotary inertia.

    Deflection w, rotation psi, shear force Q = k G A (w' - psi), moment M = E I psi':
    Q' = -rho A omega^2 w, M' = -Q - rho I omega^2 psi; w = psi = 0 at the root, Q = M = 0 at the
    tip. With y = (w, psi, Q, M), y' = S y, y(L) = exp(S L) y(0): the frequency equation is that
    the lower right 2 x 2 block of exp(S L) is singular. For plane strain give E/(1 - nu^2) as E.
    Source: Timoshenko 1921, Phil. Mag. 41:744-746.
    """
    inertia = height**2 / 12.0  # I/A; forces below are per section area
    bending, shear = E * inertia, shear_coefficient * G

    def tip_determinant(omega):
        # Lengths in L, Q in EI/L^2, M in EI/L: entries of order one.
        S = np.zeros((4, 4))
        S[0, 1] = 1.0
        S[0, 2] = bending / (shear * length**2)
        S[1, 3] = 1.0
        S[2, 0] = -rho * omega**2 * length**4 / bending
        S[3, 1] = -rho * inertia * omega**2 * length**2 / bending
        S[3, 2] = -1.0
        return np.linalg.det(expm(S)[2:, 2:])

    # Pure bending and pure shear both bound the frequency from above, Dunkerley's sum of the two
    # with rotary inertia from below; half of it leaves room for the last.
    slender = 2.0 * np.pi * euler_bernoulli_frequency(length, height, E, rho)
    stubby = np.pi / (2.0 * length) * np.sqrt(shear / rho)
    lower, upper = 0.5 / np.hypot(1.0 / slender, 1.0 / stubby), 1.001 * min(slender, stubby)
    trial = np.linspace(lower, upper, 60)
    values = np.array([tip_determinant(omega) for omega in trial])
    first = np.flatnonzero(values[:-1] * values[1:] <= 0.0)[0]
    return brentq(tip_determinant, trial[first], trial[first + 1], rtol=1e-13) / (2.0 * np.pi)


class Sag(NamedTuple):
    """Drop of the tip [m], horizontal distance of the tip from the root [m], tip angle [rad]."""

    drop: float
    reach: float
    angle: float


def elastica_sag(length, bending_stiffness, weight_per_length=0.0, tip_force=0.0):
    """Large static deflection of an inextensible cantilever, horizontal at its root.

    theta(s) is the slope downwards, EI theta' the moment; loads stay vertical:
    EI theta'' = -(tip_force + weight_per_length (L - s)) cos(theta), theta(0) = 0, theta'(L) = 0,
    x' = cos(theta), drop' = sin(theta). For plane strain EI = E/(1 - nu^2) b h^3/12.
    Source: Bisshopp and Drucker 1945, Q. Appl. Math. 3:272-275 (tip force); Rohde 1953, Q. Appl.
    Math. 11:337-338 (own weight).
    """
    weight = weight_per_length * length**3 / bending_stiffness
    force = tip_force * length**2 / bending_stiffness

    def slopes(s, y):
        theta, curvature, _, _ = y
        return [
            curvature,
            -(force + weight * (1.0 - s)) * np.cos(theta),
            np.cos(theta),
            np.sin(theta),
        ]

    def ends(root, tip):
        return [root[0], tip[1], root[2], root[3]]

    s = np.linspace(0.0, 1.0, 41)
    solution = solve_bvp(slopes, ends, s, np.zeros((4, s.size)), tol=1e-9, max_nodes=20000)
    if not solution.success:
        raise RuntimeError(f"elastica_sag: {solution.message}")
    angle, _, reach, drop = solution.y[:, -1]
    return Sag(length * drop, length * reach, angle)


def pressed_ring_force(radius, bending_stiffness, height):
    """Force [N] between two plates that press an inextensible ring to a height: of its middle line,
    which is 2 `radius` high at rest.

    psi(s) is how far a quarter has turned from one plate, where psi = 0, to its middle, pi/2; half
    of the force acts on it: EI psi'' = force/2 cos(psi), and half the height is the integral of
    sin(psi). Raises RuntimeError where the ring is no longer convex at the plates.
    Source: Love 1927, Mathematical Theory of Elasticity, ch. XIX: the elastica, of a rod whose
    natural curvature is that of the ring.
    """
    length = 0.5 * np.pi * radius

    def slopes(s, y, load):
        psi, curvature, _ = y
        return [curvature, load[0] * np.cos(psi), np.sin(psi)]

    def ends(top, middle, load):
        return [top[0], middle[0] - 0.5 * np.pi, top[2], middle[2] - 0.5 * height / length]

    s = np.linspace(0.0, 1.0, 41)
    turned = 0.5 * np.pi * s
    guess = [turned, np.full_like(s, 0.5 * np.pi), 2.0 / np.pi * (1.0 - np.cos(turned))]
    solution = solve_bvp(slopes, ends, s, guess, p=[1.0], tol=1e-9, max_nodes=20000)
    if not solution.success or solution.y[1, 0] < 0.0:
        raise RuntimeError(f"pressed_ring_force: {solution.message}; {height} m is too flat")
    return float(2.0 * solution.p[0] * bending_stiffness / length**2)


# Indentation --------------------------------------------------------------------------------------


def hertz_force(depth, radius, E, nu):
    """Force [N] that presses a rigid sphere by `depth` into an elastic half space, no friction.

    F = 4/3 E/(1 - nu^2) sqrt(R) d^1.5, small strain, d << R.
    Source: Johnson 1985, Contact Mechanics, section 4.2.
    """
    return 4.0 / 3.0 * E / (1.0 - nu**2) * np.sqrt(radius) * depth**1.5


def layer_indentation_force(depth, radius, thickness, E, nu, bonded=True):
    """As hertz_force for a layer of finite thickness on a rigid base, wide against its thickness.

    Exact for small strain, a rigid paraboloid (a sphere for d << R) without friction, a layer
    bonded to its base or free to slide on it. With the surface's response L(u)/u to a pressure of
    wave number u/h (L = 1: half space), k(x) = int_0^inf (1 - L(u)) cos(u x) du and the contact
    radius a, phi(t) - 1/(pi h) int_0^a phi(s) [k((t - s)/h) + k((t + s)/h)] ds = d - t^2/R on
    0 < t < a, phi(a) = 0 and F = 2 E/(1 - nu^2) int_0^a phi dt. Resolved up to chi = 10.
    Source: Lebedev and Ufliand 1958, PMM 22:442-450; Hayes et al. 1972, J. Biomech. 5:541-551.
    """
    nodes, weights = leggauss(200)
    u, u_weights = 20.0 * (nodes + 1.0), 20.0 * weights  # 1 - L falls as u^2 exp(-2 u)
    if bonded:
        K = 3.0 - 4.0 * nu
        L = (2.0 * K * np.sinh(2.0 * u) - 4.0 * u) / (
            2.0 * K * np.cosh(2.0 * u) + 1.0 + K**2 + 4.0 * u**2
        )
    else:
        L = (np.cosh(2.0 * u) - 1.0) / (np.sinh(2.0 * u) + 2.0 * u)
    nodes, weights = leggauss(60)
    # Lengths along the surface in h, depths in h^2/R: only chi = sqrt(R d)/h is left.
    chi = np.sqrt(radius * depth) / thickness

    def solve(contact_radius):
        """The integral of phi, and phi at the edge of the contact."""
        t, t_weights = 0.5 * contact_radius * (nodes + 1.0), 0.5 * contact_radius * weights
        waves = np.cos(np.outer(np.append(t, contact_radius), u))
        # k(t - s) + k(t + s), the sum of the two cosines written as a product.
        kernel = 2.0 * (waves * (u_weights * (1.0 - L))) @ waves[:-1].T
        influence = kernel * t_weights / np.pi
        phi = np.linalg.solve(np.eye(t.size) - influence[:-1], chi**2 - t**2)
        return t_weights @ phi, chi**2 - contact_radius**2 + influence[-1] @ phi

    contact_radius = brentq(lambda a: solve(a)[1], 0.9 * chi, 2.0 * chi, rtol=1e-10)
    # Hertz is the same with phi = d - t^2/R: an integral of 2/3 chi^3.
    return hertz_force(depth, radius, E, nu) * solve(contact_radius)[0] / (2.0 / 3.0 * chi**3)


def dimitriadis_force(depth, radius, thickness, E, bonded=True):
    """As layer_indentation_force for an incompressible layer: the series in common use.

    Hertz times, bonded, 1 + 1.133 chi + 1.283 chi^2 + 0.769 chi^3 + 0.0975 chi^4, or, sliding,
    1 + 0.884 chi + 0.781 chi^2 + 0.386 chi^3 + 0.0048 chi^4, with chi = sqrt(R d)/h.
    For comparison only: bonded it is 1 % under the exact force at chi = 0.2, 8 % at 0.5 and 16 % at
    1, sliding 8 % above it at 0.5 and 22 % at 1.
    Source: Dimitriadis et al. 2002, Biophys. J. 82:2798-2810.
    """
    chi = np.sqrt(radius * depth) / thickness
    a, b, c, d = (1.133, 1.283, 0.769, 0.0975) if bonded else (0.884, 0.781, 0.386, 0.0048)
    correction = 1.0 + a * chi + b * chi**2 + c * chi**3 + d * chi**4
    return hertz_force(depth, radius, E, 0.5) * correction


# Waves --------------------------------------------------------------------------------------------


def bar_wave_speed(E, rho):
    """Speed [m/s] of a long wave along a thin bar, both sides free: sqrt(E/rho).

    Source: Achenbach 1973, Wave Propagation in Elastic Solids.
    """
    return np.sqrt(E / rho)


def plane_strain_bar_wave_speed(E, nu, rho):
    """Speed [m/s] of a long wave along a strip whose height is free and whose width is held.

    No stress across the height, no strain across the width: sigma = E/(1 - nu^2) strain, so
    c = sqrt(E/(rho (1 - nu^2))). Source: as bar_wave_speed.
    """
    return np.sqrt(E / (rho * (1.0 - nu**2)))


def confined_wave_speed(kappa, mu, rho):
    """Speed [m/s] of a plane compression wave, no lateral strain: sqrt((kappa + 4 mu/3)/rho).

    Source: as bar_wave_speed.
    """
    return np.sqrt((kappa + 4.0 / 3.0 * mu) / rho)


# Friction -----------------------------------------------------------------------------------------


def slope_pull(mu, slope):
    """Horizontal force over weight that just moves a block up a slope of tan(angle) = `slope`.

    Along the slope F cos = G sin + mu N, across it N = G cos + F sin, so
    F/G = (slope + mu)/(1 - mu slope): slope and friction angle add. A slope of 0.1 gives 0.1,
    0.202, 0.306, 0.412 for mu = 0, 0.1, 0.2, 0.3. Infinite or negative from mu slope = 1 on: no
    horizontal force moves the block. Source: statics, Coulomb's wedge.
    """
    return (slope + mu) / (1.0 - mu * slope)
