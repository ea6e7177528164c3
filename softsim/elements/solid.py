"""Bodies in space: elements/tetrahedra.py and hexahedra.py.

Material in elements/material_points.py, volumetric part in elements/one_point.py.
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.nodes import Nodes
from softsim.elements.geometry import Facets, Geometry, Region
from softsim.elements.hexahedra import Hexahedra
from softsim.elements.one_point import OnePointElements
from softsim.elements.tetrahedra import SpaceElements, Tetrahedra

BY_CORNERS: dict[int, type[SpaceElements]] = {4: Tetrahedra, 8: Hexahedra}


@dataclass(frozen=True)
class Solid(Geometry):
    """Geometry of tetrahedra and hexahedra in space."""

    name = "solid"
    dimension = 3

    def depths(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return one (1, 1)."""
        return np.ones((1, 1))

    def enclosed_volume(self, x: np.ndarray, facets: np.ndarray) -> float:
        """Return the volume [m^3] on the free side of a closed surface of facets.

        Facets are triangles (k, 3) or bilinear quadrilaterals (k, 4).
        """
        triangles, share = triangles_of(facets)
        a, b, c = x[triangles].transpose(1, 0, 2)
        return share * float(np.einsum("ki,ki->", a, np.cross(c, b))) / 6.0

    def corner_areas(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """Return the tributary area (k, corners) [m^2] of each node of facets."""
        triangles, share = triangles_of(facets)
        a, b, c = x[triangles].transpose(1, 0, 2)
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        return share * _at_corners(facets, area[:, None] / 3.0)[:, :, 0]

    def volume_gradient(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """Return d(enclosed volume)/dx at the nodes (k, corners, d) [m^2]: forces of 1 Pa."""
        triangles, share = triangles_of(facets)
        a, b, c = x[triangles].transpose(1, 0, 2)
        return share * _at_corners(facets, np.cross(c - a, b - a) / 6.0)

    def elements(self, nodes: Nodes, region: Region, bulk_viscosity: float) -> OnePointElements:
        return BY_CORNERS[region.cells.shape[1]](nodes, region, bulk_viscosity)

    def facets(self, nodes: Nodes, facets: np.ndarray) -> Facets:
        return FACETS[facets.shape[1]](nodes, facets)


# Corners of the triangles that facets are cut into, by the number of their corners. A quadrilateral
# is cut along both diagonals and halved: that is the volume under its bilinear surface, and favours
# neither diagonal.
TRIANGLES = {3: ((0, 1, 2),), 4: ((0, 1, 2), (2, 3, 0), (0, 1, 3), (1, 2, 3))}
SHARES = {3: 1.0, 4: 0.5}


def triangles_of(facets: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the triangles (k t, 3) of facets (k, corners), and the weight of each."""
    corners = facets.shape[1]
    return facets[:, TRIANGLES[corners]].reshape(-1, 3), SHARES[corners]


def _at_corners(facets: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the sums (k, corners, i) over the triangles at each node of their values (k t, i)."""
    k, corners = facets.shape
    of_facet = values.reshape(k, len(TRIANGLES[corners]), values.shape[1])
    touches = np.array([[float(c in t) for t in TRIANGLES[corners]] for c in range(corners)])
    return np.einsum("ct,kti->kci", touches, of_facet)


class TriangleFacets(Facets):
    """Triangles (k, 3) in space; the right-hand rule gives the outward normal of the material."""

    @ti.func
    def unit_forces(self, s, i):
        """Return the forces of a pressure of 1 Pa on facet i [m^2].

        They are a third of its area, against its normal, on each node.
        """
        f = self.third(s, i, 0, 1, 2)
        return ti.Matrix([[f[0], f[1], f[2]], [f[0], f[1], f[2]], [f[0], f[1], f[2]]])

    @ti.func
    def volume(self, s, i):
        """Return the chamber volume [m^3] that facet i bounds: the cone from the origin."""
        return self.cone(s, i, 0, 1, 2)

    @ti.func
    def third(self, s, i, j: ti.template(), k: ti.template(), n: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return a third of the area between three nodes, against its normal [m^2]."""
        a = self.nodes.position[s, self.node[i, j]]
        b = self.nodes.position[s, self.node[i, k]]
        c = self.nodes.position[s, self.node[i, n]]
        return (c - a).cross(b - a) / 6.0

    @ti.func
    def cone(self, s, i, j: ti.template(), k: ti.template(), n: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return the volume between three nodes and the origin [m^3]."""
        a = self.nodes.position[s, self.node[i, j]]
        b = self.nodes.position[s, self.node[i, k]]
        c = self.nodes.position[s, self.node[i, n]]
        return a.dot(c.cross(b)) / 6.0


class QuadrilateralFacets(TriangleFacets):
    """Quadrilaterals (k, 4) in space: half of each of the four triangles between their corners."""

    @ti.func
    def unit_forces(self, s, i):
        """Return the forces of a pressure of 1 Pa on facet i [m^2]."""
        forces = ti.Matrix.zero(backend.real, 4, 3)
        for t in ti.static(range(4)):
            j, k, n = ti.static(TRIANGLES[4][t])
            third = 0.5 * self.third(s, i, j, k, n)
            for component in ti.static(range(3)):
                forces[j, component] += third[component]
                forces[k, component] += third[component]
                forces[n, component] += third[component]
        return forces

    @ti.func
    def volume(self, s, i):
        """Return the chamber volume [m^3] that facet i bounds."""
        volume = ti.cast(0.0, backend.real)
        for t in ti.static(range(4)):
            j, k, n = ti.static(TRIANGLES[4][t])
            volume += 0.5 * self.cone(s, i, j, k, n)
        return volume


FACETS: dict[int, type[TriangleFacets]] = {3: TriangleFacets, 4: QuadrilateralFacets}
