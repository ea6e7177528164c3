"""Upper bound of the stiffness of the elements of a region in any configuration.

Arrays have the elements last, (..., m), because numpy is fast on few long rows.
"""

from dataclasses import dataclass

import numpy as np

from softsim.elements.geometry import Hoop, Region, nodal_sums, principal_values
from softsim.elements.hourglass import HourglassStiffness
from softsim.materials.laws import FirstInvariantLaw, Law
from softsim.materials.material import Material, Mullins
from softsim.mesh.mesh import batches

# -------------------------------------------------------------------------------------------------
# Upper bound of an element's tangent stiffness, for the time step.
#
# With h = grad u in the present configuration, b_bar = J^(-2/3) F F^T, e = dev b_bar, the second
# variation of W(I1_bar) and of the pressure's work p J per reference volume is
#     W'  [ 2 tr(h b_bar h^T) + I1_bar (4/9 (tr h)^2 + 2/3 tr h^2) - 8/3 tr h (b_bar : h) ]
#     + 4 W'' (e : h)^2  +  p J [ (tr h)^2 - tr h^2 ],
# initial stress included. With q = 2/3 I1_bar W' - p J the terms in tr h^2 are q tr h^2 <= |q|
# |h|^2; the other terms act on tr h and e : h alone, by a matrix (in the orthonormal basis I/sqrt
# 3, e/|e|)
#     [ 3 p J - 4/3 I1_bar W'    -4/sqrt 3 W' |e| ]
#     [ symmetric                     4 W'' |e|^2 ],
# whose largest eigenvalue is r. So the variation is at most
#     2 W' tr(h b_bar h^T) + (|q| + max(r, 0)) |h|^2,  where tr(h b_bar h^T) = J^(-2/3) |Grad u|^2.
# At rest that is 2 mu0 |grad u|^2, while the exact variation is 2 mu0 |dev sym grad u|^2.
#
# Of W(I1_bar, I2_bar) the variation is taken along the principal axes of b_bar (Ogden 1984,
# Non-linear Elastic Deformations, section 6.1), with H and W1, W2 of materials/laws.py and the
# total Kirchhoff stress tau, p J included. It splits into the normal components h_ii, with the
# matrix
#     H_ij + p J - tau_i delta_ij,
# and the pairs (h_ij, h_ji), with
#     [ a b_j    a b_j - tau_j ]
#     [ sym.     a b_i         ],    a = 2 W1 + 2 W2 b_k,  k the third axis.
# 2 max(W1, 0) tr(h b_bar h^T) is split off again, which subtracts 2 max(W1, 0) b_j from the factor
# of h_ij^2. The largest eigenvalue of the remainder is the other part of the bound. It is no less
# than tau_i - 2 max(W1, 0) b_i, because F_zz of a ring has a second variation of its own.
#
# Softening (materials/material.py) multiplies W1, W2, H and the deviator of tau by eta, and adds
# d eta/dW (tau : h)^2 <= d eta/dW |tau|^2 |h|^2. The bounds are convex in eta: at the ends of its
# range they are largest. d eta/dW is taken where unloading begins. Its term rises from zero with
# the first strain E, where W = mu0 |E|^2 and tau = 2 mu0 E, by more than the step in use allows: so
# it is taken at a strain that is larger by ALLOWED_STRAIN.
#
# A Maxwell branch adds the variation of a law with W' = mu/2, with its metric F A F^T J^(-2/3) in
# place of b_bar. In an element that was deformed straight from rest that metric lies between b_bar
# (unrelaxed) and I (relaxed); the bound covers both ends and all states between them.

ALLOWED_STRAIN = 0.06
"""Root sum of squares of the strains since an estimate, which may reduce the step by 8 %.

A step in use has a margin of 10 %. Of an incompressible plane element it is a stretch of 4 %.
"""

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
    if material.mullins is None:
        return _of_law(material, 1.0, J, b_bar, pressure)
    least = material.mullins.least_factor
    ends = [_of_law(material, eta, J, b_bar, pressure) for eta in (least, 1.0)]
    stiffer = _stiffening(material, material.mullins, b_bar)
    return TangentBound(
        np.maximum(ends[0].material, ends[1].material),
        np.maximum(ends[0].spatial, ends[1].spatial) + stiffer,
    )


def _stiffening(material: Material, mullins: Mullins, b_bar: np.ndarray) -> np.ndarray:
    """Return d eta/dW |tau|^2 (m,) [Pa] where unloading begins, with ALLOWED_STRAIN more strain."""
    law, mu = material.law, material.law.initial_shear_modulus
    b = principal_values(np.moveaxis(b_bar, -1, 0))
    W = (np.sqrt(np.maximum(law.energy(b), 0.0)) + np.sqrt(mu) * ALLOWED_STRAIN) ** 2
    tau = np.linalg.norm(law.stress(b), axis=1) + 2.0 * mu * ALLOWED_STRAIN
    stiffer: np.ndarray = mullins.steepest_slope(W) * tau**2
    return stiffer


def _of_law(
    material: Material, eta: float, J: np.ndarray, b_bar: np.ndarray, pressure: np.ndarray
) -> TangentBound:
    """Return the bound for the law times a constant eta, with Maxwell branches."""
    law = material.law
    branches = sum(branch.shear_modulus for branch in material.branches)
    I1_bar = b_bar[0, 0] + b_bar[1, 1] + b_bar[2, 2]
    if isinstance(law, FirstInvariantLaw):
        slope = eta * law.energy_slope(I1_bar, law.constants)
        curvature = eta * law.energy_curvature(I1_bar, law.constants)
        return _of_first_invariant(slope, curvature, branches, J, b_bar, pressure)
    zero = np.zeros_like(J)
    beside = _of_first_invariant(zero, zero, branches, J, b_bar, zero)
    b = principal_values(np.moveaxis(b_bar, -1, 0))
    split = 2.0 * eta * np.maximum(law.slopes(b)[0], 0.0)
    return TangentBound(
        split * np.abs(J) ** (-2.0 / 3.0) + beside.material,
        _largest_left(law, eta, b, split, pressure * J) + beside.spatial,
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


def _largest_left(
    law: Law, eta: float, b: np.ndarray, split: np.ndarray, pJ: np.ndarray
) -> np.ndarray:
    """Return the bound (m,) [Pa] of the variation minus split tr(h b_bar h^T), over |h|^2.

    b (m, 3): principal values of b_bar. split (m,) [Pa]: factor of the term that is subtracted.
    The law is multiplied by eta. The bound is at least 0.
    """
    W1, W2 = (eta * slope for slope in law.slopes(b))
    tau = eta * law.stress(b) + pJ[:, None]
    taken = split[:, None] * b
    normal = eta * law.stiffness(b) + pJ[:, None, None] - (tau + taken)[:, :, None] * np.eye(3)
    largest = [principal_values(normal)[:, 0], *(tau - taken).T]
    for i, j, k in AXES:
        a = 2.0 * (W1 + W2 * b[:, k])
        one, other = a * b[:, j] - taken[:, j], a * b[:, i] - taken[:, i]
        both = a * b[:, j] - tau[:, j]
        largest.append(0.5 * (one + other) + np.hypot(0.5 * (one - other), both))
    return np.maximum(np.max(largest, axis=0), 0.0)


@dataclass(frozen=True)
class ElementStiffness:
    """Stiffness of elements (..., m) in one configuration.

    Movers are the nodes whose motion strains an element, its own nodes first: the stencil of the
    hoop strain (elements/geometry.py), else its own nodes only.

    volume_gradient (movers, d, m) [m^2]: derivative with respect to the position of a mover of the
        current volume that belongs to one pressure of the element.
    shape_stiffness (movers, movers, m) [N/m]: between movers, the same for every component.
    hoop_root (movers, d, r) [(N/m)^(1/2)]: its products are added to the stiffness of the elements
        `around` (r,), whose F_zz changes.
    """

    volume_gradient: np.ndarray
    shape_stiffness: np.ndarray
    hoop_root: np.ndarray
    around: np.ndarray

    def energies(self, u: np.ndarray, pressure: np.ndarray) -> np.ndarray:
        """Return twice the energy (m,) [J] for displacements u (d, movers, m) [m] of the movers.

        pressure (k, m) [Pa]: pressures of each element under this displacement.
        """
        dilation = np.einsum("aim,iam->m", self.volume_gradient, u)
        shape = np.einsum("abm,iam,ibm->m", self.shape_stiffness, u, u)
        energies = dilation * pressure.sum(axis=0) + shape
        hoop = np.einsum("air,iar->r", self.hoop_root, u[:, :, self.around])
        energies[self.around] += hoop**2
        return energies


class RegionStiffness:
    """Stiffness of the elements of one region, with the data that deformation does not change.

    cells (corners, m) and movers (movers, m): node numbers within the region. around (r,): elements
    whose F_zz changes. pressed (k, m): numbers of the elements' pressures
    (elements/one_point.py). pressure_volumes (n,) [m^3]: volume of each pressure, 1 for nodes
    outside the region; bulk_modulus [Pa]; bulk_viscosity (n,) [Pa s].
    """

    def __init__(self, region: Region, bulk_viscosity: float) -> None:
        self.region, self.cells = region, np.ascontiguousarray(region.cells.T, dtype=np.int32)
        self.corners, self.count = self.cells.shape
        self.volumes = region.volumes
        self.gradients = region.gradients.transpose(1, 2, 0)
        self.hourglass = None
        if region.has_hourglass_modes:
            self.hourglass = HourglassStiffness(region)
        self.hoop = region.geometry.hoop
        self.movers, self.around = self.cells, np.zeros(0, dtype=int)
        if self.hoop is not None:
            stencil = self.hoop.stencil(region.cells)
            self.movers = np.ascontiguousarray(stencil.T, dtype=np.int32)
            slopes = self.hoop.gradient(region.points, region.cells, region.points)
            self.around = np.flatnonzero(slopes.any(axis=(1, 2)))
        self.pressed = np.ascontiguousarray(region.pressure_points.T, dtype=np.int32)
        self.shares = len(self.pressed)
        sizes = region.pressure_sizes
        share = self.volumes[:, None] / self.shares
        volumes = nodal_sums(region.pressure_points, share, len(sizes))
        self.pressure_volumes = np.where(volumes > 0.0, volumes, 1.0)
        material = region.material
        self.bulk_modulus = material.bulk_modulus
        self.bulk_viscosity = bulk_viscosity * material.impedance * sizes

    def at(self, x: np.ndarray) -> ElementStiffness:
        """Return the stiffness with the body's nodes at x (n, d) [m]."""
        parts = batches(self.count)
        stretch = np.ones(self.count)
        if self.hoop is not None:
            stretch = self.hoop.stretch(self.region.points, self.region.cells, x)
        F = [self.deformation(x, stretch, batch) for batch in parts]
        J = np.concatenate([(f[0] * cofactors(f)[0]).sum(axis=0) for f in F])
        present = np.bincount(
            self.pressed.ravel(),
            np.broadcast_to(J * self.volumes / self.shares, self.pressed.shape).ravel(),
            len(self.pressure_volumes),
        )
        dilation = present / self.pressure_volumes - 1.0
        pressure = self.bulk_modulus * dilation[self.pressed].mean(axis=0)
        movers, d = len(self.movers), x.shape[1]
        gradient = np.zeros((movers, d, self.count))
        shape, hoop = np.zeros((movers, movers, self.count)), np.empty(self.count)
        for f, batch in zip(F, parts, strict=True):
            of_corners = self.stiffness(f, J[batch], pressure[batch], batch)
            gradient[: self.corners, :, batch] = of_corners[0]
            shape[: self.corners, : self.corners, batch] = of_corners[1]
            hoop[batch] = of_corners[2]
            if self.hourglass is not None:
                places = np.ascontiguousarray(x.T)[:, self.cells[:, batch]]
                shape[: self.corners, : self.corners, batch] += self.hourglass.at(places, batch)
        if self.hoop is None:
            return ElementStiffness(gradient, shape, gradient[:, :, :0], self.around)
        share = J * self.volumes / self.shares
        return self.with_hoop(self.hoop, x, gradient, shape, share[self.around], hoop[self.around])

    def with_hoop(
        self,
        hoop: Hoop,
        x: np.ndarray,
        volume_gradient: np.ndarray,
        shape_stiffness: np.ndarray,
        share: np.ndarray,
        stiffness: np.ndarray,
    ) -> ElementStiffness:
        """Add the effect of F_zz to a stiffness of all elements that was computed with F_zz fixed.

        share (r,) [m^3]: current volume that belongs to one pressure. stiffness (r,) [J]: V
        (material F_zz^2 + spatial), an upper bound of the factor of (dF_zz / F_zz)^2, and also of
        that of d^2F_zz / F_zz, which is V tau_zz, see RegionStiffness.
        """
        points, cells = self.region.points, self.region.cells
        gradient, curvature = (
            np.moveaxis(of_all[self.around], 0, -1)
            for of_all in (hoop.gradient(points, cells, x), hoop.curvature(x, cells))
        )
        volume_gradient[:, :, self.around] += share * gradient
        shape_stiffness[:, :, self.around] += stiffness * curvature
        root = np.sqrt(stiffness) * gradient
        return ElementStiffness(volume_gradient, shape_stiffness, root, self.around)

    def deformation(self, x: np.ndarray, stretch: np.ndarray, batch: slice) -> np.ndarray:
        """Return F (3, 3, batch) with the nodes at x (n, d) [m]; stretch (m,): F_zz of sections."""
        d, cells = x.shape[1], self.cells[:, batch]
        corners = np.ascontiguousarray(x.T)[:, cells]
        F = np.zeros((3, 3, cells.shape[1]))
        F[2, 2] = stretch[batch]
        F[:d, :d] = (corners[:, :, None] * self.gradients[:, :, batch]).sum(axis=1)
        return F

    def stiffness(
        self, F: np.ndarray, J: np.ndarray, pressure: np.ndarray, batch: slice
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return volume gradient, shape stiffness and hoop stiffness of a batch of elements.

        F (3, 3, batch): deformation gradient. pressure (batch,) [Pa]. The first two are those of
        ElementStiffness for the elements' own nodes with F_zz fixed; the third (batch,) [J] is the
        stiffness of F_zz, see `with_hoop`.
        """
        gradients, volumes = self.gradients[:, :, batch], self.volumes[batch]
        d = gradients.shape[1]
        with np.errstate(invalid="ignore", divide="ignore"):
            b_bar = np.abs(J) ** (-2.0 / 3.0) * (F[:, None] * F).sum(axis=2)
            present = (cofactors(F)[:d, :d] * gradients[:, None]).sum(axis=2) / J
        modulus = tangent_bound(self.region.material, J, b_bar, pressure)
        material, spatial = volumes * modulus.material, volumes * modulus.spatial

        share = J * volumes / self.shares
        shape = gram(gradients, material) + gram(present, spatial)
        return share * present, shape, material * F[2, 2] ** 2 + spatial


def gram(gradients: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return weight times grad N_a . grad N_b (corners, corners, m) for weights (m,).

    gradients (corners, d, m) [1/m].
    """
    return weight * (gradients[:, None] * gradients).sum(axis=2)


def cofactors(F: np.ndarray) -> np.ndarray:
    """Return J F^-T (3, 3, m) of F (3, 3, m), the cross products of its rows."""
    result = np.empty_like(F)
    for i in range(3):
        a, b = F[(i + 1) % 3], F[(i + 2) % 3]
        for j in range(3):
            k, n = (j + 1) % 3, (j + 2) % 3
            result[i, j] = a[k] * b[n] - a[n] * b[k]
    return result
