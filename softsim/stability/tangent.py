"""Upper bound of an element's tangent stiffness, for the time step.

With h = grad u in the present configuration, b_bar = J^(-2/3) F F^T, e = dev b_bar, the second
variation of W(I1_bar) and of the pressure's work p J per reference volume is
    W'  [ 2 tr(h b_bar h^T) + I1_bar (4/9 (tr h)^2 + 2/3 tr h^2) - 8/3 tr h (b_bar : h) ]
    + 4 W'' (e : h)^2  +  p J [ (tr h)^2 - tr h^2 ],
initial stress included. With q = 2/3 I1_bar W' - p J the terms in tr h^2 are q tr h^2 <= |q| |h|^2;
the other terms act on tr h and e : h alone, by a matrix (in the orthonormal basis I/sqrt 3, e/|e|)
    [ 3 p J - 4/3 I1_bar W'    -4/sqrt 3 W' |e| ]
    [ symmetric                     4 W'' |e|^2 ],
whose largest eigenvalue is r. So the variation is at most
    2 W' tr(h b_bar h^T) + (|q| + max(r, 0)) |h|^2,  where tr(h b_bar h^T) = J^(-2/3) |Grad u|^2.
At rest that is 2 mu0 |grad u|^2, while the exact variation is 2 mu0 |dev sym grad u|^2.

Of W(I1_bar, I2_bar) the variation is taken along the principal axes of b_bar (Ogden 1984,
Non-linear Elastic Deformations, section 6.1), with H and W1, W2 of materials/law.py and the total
Kirchhoff stress tau, p J included. It splits into the normal components h_ii, with the matrix
    H_ij + p J - tau_i delta_ij,
and the pairs (h_ij, h_ji), with
    [ a b_j    a b_j - tau_j ]
    [ sym.     a b_i         ],    a = 2 W1 + 2 W2 b_k,  k the third axis.
2 max(W1, 0) tr(h b_bar h^T) is split off again, which subtracts 2 max(W1, 0) b_j from the factor of
h_ij^2. The largest eigenvalue of the remainder is the other part of the bound. It is no less than
tau_i - 2 max(W1, 0) b_i, because F_zz of a ring has a second variation of its own.

A Maxwell branch adds the variation of a law with W' = mu/2, with its metric F A F^T J^(-2/3) in
place of b_bar. In an element that was deformed straight from rest that metric lies between b_bar
(unrelaxed) and I (relaxed); the bound covers both ends and all states between them.
"""

from dataclasses import dataclass

import numpy as np

from softsim.elements.measures import principal_values
from softsim.materials.law import FirstInvariantLaw, Law
from softsim.materials.material import Material

AXES = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
"""Axes i, j of each pair, and the third axis k."""


@dataclass(frozen=True)
class TangentBound:
    """Upper bound of the tangent stiffness, as factors of two squared gradients.

    Moduli (m,) [Pa]: `material` of |Grad u|^2, `spatial` of |grad u|^2.
    """

    material: np.ndarray
    spatial: np.ndarray


def tangent_bound(
    material: Material, J: np.ndarray, b_bar: np.ndarray, pressure: np.ndarray
) -> TangentBound:
    """Return the bound for elements with J (m,), b_bar (3, 3, m) and pressure (m,) [Pa].

    The pressure is positive in tension.
    """
    law = material.law
    branches = sum(branch.shear_modulus for branch in material.branches)
    I1_bar = b_bar[0, 0] + b_bar[1, 1] + b_bar[2, 2]
    if isinstance(law, FirstInvariantLaw):
        slope = law.energy_slope(I1_bar, law.constants)
        curvature = law.energy_curvature(I1_bar, law.constants)
        return _of_first_invariant(slope, curvature, branches, J, b_bar, pressure)
    zero = np.zeros_like(J)
    beside = _of_first_invariant(zero, zero, branches, J, b_bar, zero)
    b = principal_values(np.moveaxis(b_bar, -1, 0))
    split = 2.0 * np.maximum(law.slopes(b)[0], 0.0)
    return TangentBound(
        split * np.abs(J) ** (-2.0 / 3.0) + beside.material,
        _largest_left(law, b, split, pressure * J) + beside.spatial,
    )


def _of_first_invariant(
    slope: np.ndarray,
    curvature: np.ndarray,
    branches: float,
    J: np.ndarray,
    b_bar: np.ndarray,
    pressure: np.ndarray,
) -> TangentBound:
    """Return the bound for a law W(I1_bar) with Maxwell branches.

    slope, curvature (m,) [Pa]: W' and W''. branches [Pa]: sum of the moduli of the branches.
    """
    I1_bar = b_bar[0, 0] + b_bar[1, 1] + b_bar[2, 2]
    e_squared = (b_bar**2).sum(axis=(0, 1)) - I1_bar**2 / 3.0
    e_size = np.sqrt(np.maximum(e_squared, 0.0))
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


def _largest_left(law: Law, b: np.ndarray, split: np.ndarray, pJ: np.ndarray) -> np.ndarray:
    """Return the bound (m,) [Pa] of the variation minus split tr(h b_bar h^T), over |h|^2.

    b (m, 3): principal values of b_bar. split (m,) [Pa]: factor of the term that is subtracted.
    The bound is at least 0.
    """
    W1, W2 = law.slopes(b)
    tau = law.stress(b) + pJ[:, None]
    taken = split[:, None] * b
    normal = law.stiffness(b) + pJ[:, None, None] - (tau + taken)[:, :, None] * np.eye(3)
    largest = [principal_values(normal)[:, 0], *(tau - taken).T]
    for i, j, k in AXES:
        a = 2.0 * (W1 + W2 * b[:, k])
        one, other = a * b[:, j] - taken[:, j], a * b[:, i] - taken[:, i]
        both = a * b[:, j] - tau[:, j]
        largest.append(0.5 * (one + other) + np.hypot(0.5 * (one - other), both))
    return np.maximum(np.max(largest, axis=0), 0.0)
