"""Upper bound of an element's tangent stiffness, for the time step.

With h = grad u in the present configuration, b_bar = J^(-2/3) F F^T, e = dev b_bar, the second
variation of W(I1_bar) and of the pressure's work p J per reference volume is
    W'  [ 2 tr(h b_bar h^T) + I1_bar (4/9 (tr h)^2 + 2/3 tr h^2) - 8/3 tr h (b_bar : h) ]
    + 4 W'' (e : h)^2  +  p J [ (tr h)^2 - tr h^2 ],
initial stress included. With q = 2/3 I1_bar W' - p J the terms in tr h^2 are q tr h^2 <= |q| |h|^2;
what is left acts on tr h and e : h alone, by a matrix (in the orthonormal basis I/sqrt 3, e/|e|)
    [ 3 p J - 4/3 I1_bar W'    -4/sqrt 3 W' |e| ]
    [ symmetric                     4 W'' |e|^2 ],
whose largest eigenvalue is r. So the variation is at most
    2 W' tr(h b_bar h^T) + (|q| + max(r, 0)) |h|^2,  where tr(h b_bar h^T) = J^(-2/3) |Grad u|^2.
At rest that is 2 mu0 |grad u|^2, the exact one being 2 mu0 |dev sym grad u|^2.

A Maxwell branch adds what a law with W' = mu/2 would, its metric F A F^T J^(-2/3) in the place of
b_bar. In an element that came straight from rest that metric lies between b_bar (nothing has
relaxed) and I (all has); both ends are covered, and so is what lies between.
"""

from dataclasses import dataclass

import numpy as np

from softsim.materials.material import Material


@dataclass(frozen=True)
class TangentBound:
    """Moduli (m,) [Pa]: `material` of |Grad u|^2, `spatial` of |grad u|^2."""

    material: np.ndarray
    spatial: np.ndarray


def tangent_bound(
    material: Material, J: np.ndarray, I1_bar: np.ndarray, e_size: np.ndarray, pressure: np.ndarray
) -> TangentBound:
    """The bound for elements (m,) with these J, I1_bar, |e|, and pressure [Pa], positive in
    tension.
    """
    law, c = material.law, material.law.constants
    branches = sum(branch.shear_modulus for branch in material.branches)
    slope, curvature = law.energy_slope(I1_bar, c), law.energy_curvature(I1_bar, c)
    unrelaxed = slope + 0.5 * branches
    # I1_bar W' with all branches relaxed; of both ends the smaller one, as I1_bar >= 3.
    relaxed_product = I1_bar * slope + 3.0 * 0.5 * branches

    q = np.maximum(
        np.abs(2.0 / 3.0 * I1_bar * unrelaxed - pressure * J),
        np.abs(2.0 / 3.0 * relaxed_product - pressure * J),
    )
    first = 3.0 * pressure * J - 4.0 / 3.0 * relaxed_product
    second = 4.0 * curvature * e_size**2
    beside = 4.0 / np.sqrt(3.0) * np.maximum(unrelaxed, -slope) * e_size
    r = 0.5 * (first + second) + np.sqrt(0.25 * (first - second) ** 2 + beside**2)
    # A relaxed metric: I <= b_bar + (1 - lambda) I, lambda the smallest eigenvalue of b_bar, which
    # is at least I1_bar/3 - sqrt(2/3) |e|, and positive.
    missing = np.clip(1.0 - I1_bar / 3.0 + np.sqrt(2.0 / 3.0) * e_size, 0.0, 1.0)
    return TangentBound(
        2.0 * np.maximum(unrelaxed, 0.0) * np.abs(J) ** (-2.0 / 3.0),
        q + np.maximum(r, 0.0) + branches * missing,
    )
