"""Inflation of a clamped cylindrical membrane: the reference of `inflation_radius`.

A tube of mid-surface radius R, wall H and length L, both ends clamped at radius R and at their
distance L, is inflated by a pressure P. Its material is incompressible with the strain energy
W(I1) of Yeoh; nothing here is shared with the finite elements.

With S along the undeformed meridian, r(S) and z(S) the deformed mid surface, phi the angle between
the meridian and the axis, the principal stretches are

    lambda_s = ds/dS,  lambda_theta = r / R,  lambda_3 = 1 / (lambda_s lambda_theta).

With w(lambda_s, lambda_theta) = W(I1), where I1 is the sum of their squares, the tensions per
deformed length are

    T_s = H / lambda_theta  dw/dlambda_s
        = 2 H W' (lambda_s / lambda_theta - 1 / (lambda_s lambda_theta)^3),
    T_theta = H / lambda_s  dw/dlambda_theta, likewise.

Equilibrium along the meridian and normal to it is (Adkins and Rivlin, Phil. Trans. R. Soc. A 244
(1952) 505; Green and Adkins, Large Elastic Deformations, 2nd ed. 1970, ch. 4):

    d(r T_s)/dr = T_theta,   T_s kappa_s + T_theta kappa_theta = P,
    kappa_s = -dphi/ds,  kappa_theta = cos(phi) / r.

The first one makes w - lambda_s dw/dlambda_s constant along the meridian of a cylinder, hence

    dlambda_s/dS = (w_theta - lambda_s w_s_theta) / (lambda_s w_ss)  dlambda_theta/dS.

Together with dr/dS = lambda_s sin(phi), dz/dS = lambda_s cos(phi) these are four equations for r,
z, phi and lambda_s over half the length. Boundary conditions are r = r_0, z = 0, phi = 0 at mid
length and r = R, z = L/2 at the clamp: the radius r_0 is prescribed and the pressure is the fifth
unknown, so that the solution passes the limit points. `scipy.integrate.solve_bvp` (collocation)
starts each radius from the solution at the radius before.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_bvp

POINTS = 41  # of the first mesh along half the length; solve_bvp refines it
RESIDUAL = 1e-5  # relative, of the collocation


@dataclass(frozen=True)
class Tube:
    """Clamped tube of a Yeoh material, incompressible: W = sum of C_i0 (I1 - 3)^i.

    radius: of the mid surface [m]. thickness: of the wall [m]. length: between the clamps [m].
    constants: C10, C20, C30 [Pa].
    """

    radius: float
    thickness: float
    length: float
    constants: tuple[float, float, float]

    def slopes(self, along: np.ndarray, hoop: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return dw/dlambda_s, dw/dlambda_theta and the second derivatives ss and s theta [Pa]."""
        c1, c2, c3 = self.constants
        through = 1.0 / (along * hoop)
        above = along**2 + hoop**2 + through**2 - 3.0
        first = c1 + above * (2.0 * c2 + 3.0 * c3 * above)
        second = 2.0 * c2 + 6.0 * c3 * above
        by_along = 2.0 * (along - through**2 / along)
        by_hoop = 2.0 * (hoop - through**2 / hoop)
        mixed = 4.0 * through**2 / (along * hoop)
        curved = 2.0 + 6.0 * through**2 / along**2
        return (
            first * by_along,
            first * by_hoop,
            first * curved + second * by_along**2,
            first * mixed + second * by_along * by_hoop,
        )


@dataclass(frozen=True)
class Inflation:
    """Path of equilibria of a tube.

    radius: of the mid surface at mid length (n,) [m]. outer_radius: of the wall there, radius plus
    half the deformed thickness (n,) [m]. pressure: (n,) [Pa]. along: meridional stretch at mid
    length (n,).
    """

    radius: np.ndarray
    outer_radius: np.ndarray
    pressure: np.ndarray
    along: np.ndarray


def inflate(tube: Tube, radii: Sequence[float] | np.ndarray) -> Inflation:
    """Return the equilibria at rising radii [m] of the mid surface at mid length.

    Raises RuntimeError if the collocation does not converge because the radii are too far apart.
    """
    half = 0.5 * tube.length / tube.radius
    place = half * (1.0 - np.linspace(1.0, 0.0, POINTS) ** 3)  # fine at the clamp
    # At small strains the tube is a cylinder that narrows to the clamp over a short length, where
    # the hoop strain turns into half of it along the meridian.
    strain = radii[0] / tube.radius - 1.0
    decay = np.sqrt(0.5 * strain)
    near = np.exp((place - half) / decay)
    state = np.array([
        1.0 + strain * (1.0 - near), place, -strain / decay * near, 1.0 + 0.5 * strain * near
    ])  # fmt: skip
    pressure = np.array([2.0 * (1.0 - (1.0 + strain) ** -4)])
    found = []
    for radius in radii:
        place, state, pressure = _solved(tube, radius / tube.radius, place, state, pressure)
        found.append((pressure[0], state[3, 0]))
    pressures, along = np.array(found).T
    middle = np.asarray(radii, dtype=float)
    through = tube.thickness / (along * middle / tube.radius)
    unit = tube.constants[0] * tube.thickness / tube.radius
    return Inflation(middle, middle + 0.5 * through, unit * pressures, along)


def _solved(
    tube: Tube, middle: float, place: np.ndarray, state: np.ndarray, pressure: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return mesh, (r, z, phi, lambda_s) and pressure at a radius from those at the radius before.

    Lengths are in units of R, stresses of C10, the pressure of C10 H / R.
    """

    def slope(_: np.ndarray, y: np.ndarray, p: np.ndarray) -> np.ndarray:
        radius, _, angle, along = y
        w_s, w_theta, w_ss, w_s_theta = (
            part / tube.constants[0] for part in tube.slopes(along, radius)
        )
        dr = along * np.sin(angle)
        dphi = (w_theta * np.cos(angle) - p[0] * along * radius) / w_s
        dalong = (w_theta - along * w_s_theta) / (along * w_ss) * dr
        return np.array([dr, along * np.cos(angle), dphi, dalong])

    def boundary(start: np.ndarray, end: np.ndarray, _: np.ndarray) -> np.ndarray:
        half = 0.5 * tube.length / tube.radius
        return np.array([start[0] - middle, start[1], start[2], end[0] - 1.0, end[1] - half])

    solution = solve_bvp(slope, boundary, place, state, p=pressure, tol=RESIDUAL)
    if not solution.success:
        raise RuntimeError(f"membrane at {middle:.4g} R: {solution.message}")
    return solution.x, solution.y, solution.p
