"""Bodies in space: elements/tetrahedra.py and hexahedra.py.

Material in elements/material_points.py, volumetric part in elements/nodal_pressure.py.
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.elements.facets import Facets
from softsim.elements.geometry import Geometry
from softsim.elements.hexahedra import Hexahedra
from softsim.elements.one_point import OnePointElements
from softsim.elements.region import Region
from softsim.elements.tetrahedra import SpaceElements, Tetrahedra
from softsim.nodes import Nodes

BY_CORNERS: dict[int, type[SpaceElements]] = {4: Tetrahedra, 8: Hexahedra}


@dataclass(frozen=True)
class Solid(Geometry):
    """Tetrahedra and hexahedra in space."""

    name = "solid"
    dimension = 3

    def depths(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """One (1, 1)."""
        return np.ones((1, 1))

    def enclosed_volume(self, x: np.ndarray, facets: np.ndarray) -> float:
        """Volume [m^3] on the free side of a closed surface of triangles (k, 3)."""
        a, b, c = x[facets].transpose(1, 0, 2)
        return float(np.einsum("ki,ki->", a, np.cross(c, b))) / 6.0

    def corner_areas(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """Area (k, 3) [m^2] of triangles (k, 3) that each of their corners stands for."""
        a, b, c = x[facets].transpose(1, 0, 2)
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        return np.repeat(area[:, None] / 3.0, 3, axis=1)

    def volume_gradient(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """d(enclosed volume)/dx of the corners (k, 3, d) [m^2]: forces of a pressure of 1 Pa."""
        a, b, c = x[facets].transpose(1, 0, 2)
        return np.repeat(np.cross(c - a, b - a)[:, None] / 6.0, 3, axis=1)

    def elements(self, nodes: Nodes, region: Region, bulk_viscosity: float) -> OnePointElements:
        """What computes their forces."""
        return BY_CORNERS[region.cells.shape[1]](nodes, region, bulk_viscosity)

    def facets(self, nodes: Nodes, facets: np.ndarray) -> Facets:
        """What a pressure on facets, as `pressed` gives them, does."""
        return TriangleFacets(nodes, facets)


@ti.data_oriented
class TriangleFacets(Facets):
    """Triangles (k, 3) in space, outward normal of the material by the right-hand rule."""

    @ti.func
    def unit_forces(self, s, i):
        """Forces of a pressure of 1 Pa on facet i [m^2]: a third of its area, against its normal,
        on each corner.
        """
        a = self.nodes.position[s, self.node[i, 0]]
        b = self.nodes.position[s, self.node[i, 1]]
        c = self.nodes.position[s, self.node[i, 2]]
        f = (c - a).cross(b - a) / 6.0
        return ti.Matrix([[f[0], f[1], f[2]], [f[0], f[1], f[2]], [f[0], f[1], f[2]]])

    @ti.func
    def volume(self, s, i):
        """What facet i adds to the volume of its chamber [m^3]: the cone from the origin."""
        a = self.nodes.position[s, self.node[i, 0]]
        b = self.nodes.position[s, self.node[i, 1]]
        c = self.nodes.position[s, self.node[i, 2]]
        return a.dot(c.cross(b)) / 6.0
