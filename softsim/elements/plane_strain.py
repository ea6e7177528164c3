"""Plane strain: F_zz = 1.

Kinematics in the plane in elements/plane_elements.py, material in
elements/material_points.py, volumetric part in elements/one_point.py.
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute.fields import real_field
from softsim.compute.nodes import Nodes
from softsim.elements.geometry import Facets, Geometry, Region, edge_lengths
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

    def enclosed_volume(self, x: np.ndarray, facets: np.ndarray) -> float:
        """Return the volume [m^3] on the free side of a closed chain of edges (k, 2)."""
        a, b = x[facets[:, 0]], x[facets[:, 1]]
        return 0.5 * self.thickness * float((a[:, 1] * b[:, 0] - a[:, 0] * b[:, 1]).sum())

    def corner_areas(self, x: np.ndarray, edges: np.ndarray) -> np.ndarray:
        """Return the tributary area (k, 2) [m^2] of each end of edges (k, 2)."""
        return 0.5 * self.thickness * np.repeat(edge_lengths(x, edges)[:, None], 2, axis=1)

    def volume_gradient(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """Return d(enclosed volume)/dx at the nodes (k, 2, d) [m^2]: forces of 1 Pa."""
        d = x[facets[:, 1]] - x[facets[:, 0]]
        half = 0.5 * self.thickness * np.stack([-d[:, 1], d[:, 0]], axis=1)
        return np.stack([half, half], axis=1)

    def elements(self, nodes: Nodes, region: Region, bulk_viscosity: float) -> OnePointElements:
        return section_elements(nodes, region, bulk_viscosity, Across())

    def facets(self, nodes: Nodes, facets: np.ndarray) -> Facets:
        return PlaneFacets(nodes, facets, self.thickness)


class PlaneFacets(Facets):
    """Edges (k, 2) of a section of given `thickness` [m]."""

    def __init__(self, nodes: Nodes, facets: np.ndarray, thickness: float) -> None:
        super().__init__(nodes, facets)
        self.thickness = real_field(np.array([thickness]))

    @ti.func
    def unit_forces(self, s, i):
        """Return the forces (node, component) of a pressure of 1 Pa on facet i [m^2].

        They are half of h (-dy, dx) at each end.
        """
        d = self.nodes.position[s, self.node[i, 1]] - self.nodes.position[s, self.node[i, 0]]
        half = 0.5 * self.thickness[0]
        return ti.Matrix([[-half * d[1], half * d[0]], [-half * d[1], half * d[0]]])

    @ti.func
    def volume(self, s, i):
        """Return the chamber volume [m^3] that facet i bounds: its prism to the origin."""
        a = self.nodes.position[s, self.node[i, 0]]
        b = self.nodes.position[s, self.node[i, 1]]
        return 0.5 * self.thickness[0] * (a[1] * b[0] - a[0] * b[1])
