"""Plane strain: F_zz = 1.

Kinematics in the plane in elements/plane_elements.py, material in
elements/material_points.py, volumetric part in elements/one_point.py.
"""

from dataclasses import dataclass

import numpy as np

from softsim.compute.nodes import Nodes
from softsim.elements.geometry import Geometry, Region, edge_lengths
from softsim.elements.one_point import OnePointElements
from softsim.elements.plane_elements import Across, section_elements


@dataclass(frozen=True)
class PlaneStrain(Geometry):
    """Plate of given thickness [m] without out-of-plane strain."""

    thickness: float
    name = "plane_strain"
    dimension = 2

    def of_cells(self, numbers: np.ndarray, thickness: float | None) -> "PlaneStrain":
        """Return the geometry with another thickness [m] if given."""
        return self if thickness is None else PlaneStrain(thickness)

    def depths(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return the thickness (1, 1) [m]."""
        return np.array([[self.thickness]])

    @property
    def facet_factor(self) -> float:
        """Thickness [m]."""
        return self.thickness

    @staticmethod
    def facet_volume_and_gradient(x, thickness, m):
        """Return the volume of an edge's prism to the origin, and the forces of 1 Pa on its ends,
        half of the edge's area each.
        """
        a, b = x[0], x[1]
        volume = 0.5 * thickness * (a[1] * b[0] - a[0] * b[1])
        half = 0.5 * thickness * m.vector([a[1] - b[1], b[0] - a[0]])
        return volume, [half, half]

    def corner_areas(self, x: np.ndarray, edges: np.ndarray) -> np.ndarray:
        """Return the tributary area (k, 2) [m^2] of each end of edges (k, 2)."""
        return 0.5 * self.thickness * np.repeat(edge_lengths(x, edges)[:, None], 2, axis=1)

    def elements(self, nodes: Nodes, region: Region, bulk_viscosity: float) -> OnePointElements:
        return section_elements(nodes, region, bulk_viscosity, Across())
