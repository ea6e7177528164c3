"""Element results in numpy: volume ratio, stretch, von Mises stress, nodal pressure."""

from dataclasses import dataclass

import numpy as np

from softsim.elements.geometry import nodal_sums
from softsim.elements.region import Region


@dataclass(frozen=True)
class ElementMeasures:
    """Results of the elements of a region.

    Per element (m,): J [-], largest principal stretch [-], I1_bar [-], von Mises stress [Pa] and
    shear stiffness [Pa] as in `Law.shear_stiffness` (law alone).

    nodal_pressure (n,) [Pa]: -kappa (J_a - 1), J_a of all elements around a node, positive in
    compression; NaN outside the region. Where elements have one pressure each it is their mean.
    """

    J: np.ndarray
    stretch: np.ndarray
    I1_bar: np.ndarray
    von_mises: np.ndarray
    shear_stiffness: np.ndarray
    nodal_pressure: np.ndarray


def measure_elements(region: Region, x: np.ndarray) -> ElementMeasures:
    """Return the results of a region's elements with its body's nodes at x (n, d) [m]."""
    volume, cells, material = region.volumes, region.cells, region.material
    # A failed run is measured too: places that are no numbers give measures that are none.
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        F = region.deformation(x)
        J = np.linalg.det(F)
        b = np.einsum("eij,ekj->eik", F, F)
        principal = principal_values(b)
        b_bar = (np.abs(J) ** (-2.0 / 3.0))[:, None] * principal
        # tau / J is the deviator of the Cauchy stress.
        von_mises = np.sqrt(1.5 * (material.law.stress(b_bar) ** 2).sum(axis=1)) / np.abs(J)
        shear_stiffness = material.law.shear_stiffness(b_bar)
        stretch = np.sqrt(principal[:, 0])
        share = 1.0 / cells.shape[1]
        current = nodal_sums(cells, (J * volume * share)[:, None], len(x))
        rest = nodal_sums(cells, (volume * share)[:, None], len(x))
        pressure = -material.bulk_modulus * (current / rest - 1.0)
    return ElementMeasures(J, stretch, b_bar.sum(axis=1), von_mises, shear_stiffness, pressure)


def cauchy_stress(region: Region, x: np.ndarray) -> np.ndarray:
    """Return the Cauchy stress (m, 6) [Pa] of a region's elements: xx, yy, zz, xy, yz, zx.

    x (n, d) [m]: positions of the body's nodes. The stress is that of the law and of the mean of
    the nodal pressures, without Maxwell branches; NaN where the position of a node is NaN.
    """
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        F = region.deformation(x)
        J = np.linalg.det(F)
        b = np.nan_to_num(np.einsum("eij,ekj->eik", F, F), posinf=0.0, neginf=0.0)
        squares, axes = np.linalg.eigh(b)
        tau = region.material.law.stress((np.abs(J) ** (-2.0 / 3.0))[:, None] * squares)
        pressure = measure_elements(region, x).nodal_pressure[region.cells].mean(axis=1)
        stress = np.einsum("eik,ek,ejk->eij", axes, tau / J[:, None], axes)
    stress -= pressure[:, None, None] * np.eye(3)
    return stress[:, [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]


def principal_values(tensors: np.ndarray) -> np.ndarray:
    """Return the eigenvalues (m, 3), falling, of symmetric tensors (m, 3, 3).

    In closed form (Smith 1961, Comm. ACM 4:168); numpy's solver takes fifty times as long on many
    small matrices. NaN where a tensor contains NaN. Where two eigenvalues are equal each keeps
    half the digits (the arc cosine near 1), their sum and product all.
    """
    mean = np.trace(tensors, axis1=1, axis2=2) / 3.0
    deviator = tensors - mean[:, None, None] * np.eye(3)
    size = np.sqrt((deviator**2).sum(axis=(1, 2)) / 6.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        half_determinant = np.where(size > 0.0, np.linalg.det(deviator) / (2.0 * size**3), 0.0)
    angle = np.arccos(np.clip(half_determinant, -1.0, 1.0)) / 3.0
    angles = angle[:, None] - np.array([0.0, 2.0, -2.0]) * np.pi / 3.0
    return mean[:, None] + 2.0 * size[:, None] * np.cos(angles)
