"""Element quantities that people look at, in numpy: volume ratio, stretch, von Mises stress."""

from dataclasses import dataclass

import numpy as np

from softsim.elements.geometry import nodal_sums
from softsim.elements.region import Region


@dataclass(frozen=True)
class ElementMeasures:
    """Per element (m,): J [-], largest principal stretch [-], I1_bar [-], von Mises stress [Pa]
    (law alone).

    nodal_pressure (n,) [Pa]: -kappa (J_a - 1), positive in compression; NaN beside the region.
    """

    J: np.ndarray
    stretch: np.ndarray
    I1_bar: np.ndarray
    von_mises: np.ndarray
    nodal_pressure: np.ndarray


def measure_elements(region: Region, x: np.ndarray) -> ElementMeasures:
    """Measure the elements of a region with its body's nodes now at x (n, d) [m]."""
    volume, cells, material = region.volumes, region.cells, region.material
    # A failed run is measured too: places that are no numbers give measures that are none.
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        F = region.deformation(x)
        J = np.linalg.det(F)
        b = np.einsum("eij,ekj->eik", F, F)
        trace = np.trace(b, axis1=1, axis2=2)
        scale = np.abs(J) ** (-2.0 / 3.0)
        I1_bar = scale * trace
        # Cauchy stress deviator 2 W' / J dev b_bar.
        factor = 2.0 * material.law.energy_slope(I1_bar, material.law.constants) * scale / J
        deviator = b - trace[:, None, None] / 3.0 * np.eye(3)
        von_mises = np.abs(factor) * np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2)))
        stretch = np.sqrt(largest_eigenvalue(b))
        share = 1.0 / cells.shape[1]
        current = nodal_sums(cells, (J * volume * share)[:, None], len(x))
        rest = nodal_sums(cells, (volume * share)[:, None], len(x))
        pressure = -material.bulk_modulus * (current / rest - 1.0)
    return ElementMeasures(J, stretch, I1_bar, von_mises, pressure)


def largest_eigenvalue(tensors: np.ndarray) -> np.ndarray:
    """Largest eigenvalue (m,) of symmetric tensors (m, 3, 3), in closed form (Smith 1961, Comm.
    ACM 4:168); numpy's solver takes fifty times as long on many small matrices. NaN where there
    is one in the tensor. Where two eigenvalues are equal it keeps half the digits (the arc cosine
    near 1), elsewhere all.
    """
    mean = np.trace(tensors, axis1=1, axis2=2) / 3.0
    deviator = tensors - mean[:, None, None] * np.eye(3)
    size = np.sqrt((deviator**2).sum(axis=(1, 2)) / 6.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        half_determinant = np.where(size > 0.0, np.linalg.det(deviator) / (2.0 * size**3), 0.0)
    return mean + 2.0 * size * np.cos(np.arccos(np.clip(half_determinant, -1.0, 1.0)) / 3.0)
