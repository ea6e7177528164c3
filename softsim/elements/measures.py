"""Element quantities that people look at, in numpy: volume ratio, stretch, von Mises stress."""

from dataclasses import dataclass

import numpy as np

from softsim.elements.geometry import reference_gradients
from softsim.elements.solid import Solid


@dataclass(frozen=True)
class ElementMeasures:
    """Per element (m,): J [-], largest principal stretch [-], von Mises stress [Pa] (law alone).

    nodal_pressure (n,) [Pa]: -kappa (J_a - 1), positive in compression.
    """

    J: np.ndarray
    stretch: np.ndarray
    von_mises: np.ndarray
    nodal_pressure: np.ndarray


def measure_elements(
    points: np.ndarray, cells: np.ndarray, x: np.ndarray, material: Solid
) -> ElementMeasures:
    """Measure triangles with reference nodes `points` and present nodes `x`, both (n, 2) [m]."""
    gradients, area = reference_gradients(points, cells)
    F = np.einsum("eai,eaj->eij", x[cells], gradients)
    J = np.linalg.det(F)
    b = np.einsum("eij,ekj->eik", F, F)
    trace = b[:, 0, 0] + b[:, 1, 1]
    spread = np.hypot(b[:, 0, 0] - b[:, 1, 1], 2.0 * b[:, 0, 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        scale = np.abs(J) ** (-2.0 / 3.0)
        slope = material.law.energy_slope(scale * (trace + 1.0), material.law.constants)
        # Cauchy stress deviator 2 W' / J dev b_bar; its in-plane part and zz.
        factor = 2.0 * slope * scale / J
        mean = (trace + 1.0) / 3.0
        sxx, syy, szz = b[:, 0, 0] - mean, b[:, 1, 1] - mean, 1.0 - mean
        norm = sxx**2 + syy**2 + szz**2 + 2.0 * b[:, 0, 1] ** 2
        von_mises = np.abs(factor) * np.sqrt(1.5 * norm)
    corners = cells.ravel()
    current = np.bincount(corners, np.repeat(J * area, 3), minlength=len(points))
    rest = np.bincount(corners, np.repeat(area, 3), minlength=len(points))
    return ElementMeasures(
        J,
        np.sqrt(0.5 * (trace + spread)),
        von_mises,
        -material.bulk_modulus * (current / rest - 1.0),
    )
