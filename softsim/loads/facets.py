"""Facets under pressure: the force of a unit pressure on their corners, and the volume they bound.

One class a kind of facet. The force is the gradient of the volume, so a load built on it follows
the deformation, does not depend on the time step, and on a closed surface adds up to nothing.
Facets have the material to their left (an edge) or behind them (a triangle): the chamber is on the
other side.
"""

from typing import Any

import numpy as np
import taichi as ti

from softsim.elements.geometry import Axisymmetric, PlaneStrain, RingSection, Solid
from softsim.fields import index_field, real_field
from softsim.nodes import Nodes


@ti.data_oriented
class PlaneFacets:
    """Edges (k, 2) of a section; `geometry` has its thickness [m]."""

    corners = 2

    def __init__(self, nodes: Nodes, facets: np.ndarray, geometry: Any) -> None:
        self.nodes, self.count, self.corner_nodes = nodes, len(facets), facets
        self.thickness = real_field(np.array([geometry.thickness]))
        self.node = index_field(facets)

    @ti.func
    def unit_forces(self, s, i):
        """Forces (corner, component) of a pressure of 1 Pa on facet i [m^2]: half of
        h (-dy, dx) on each end.
        """
        d = self.nodes.position[s, self.node[i, 1]] - self.nodes.position[s, self.node[i, 0]]
        half = 0.5 * self.thickness[0]
        return ti.Matrix([[-half * d[1], half * d[0]], [-half * d[1], half * d[0]]])

    @ti.func
    def volume(self, s, i):
        """What facet i adds to the volume of its chamber [m^3], seen from the origin."""
        a = self.nodes.position[s, self.node[i, 0]]
        b = self.nodes.position[s, self.node[i, 1]]
        return 0.5 * self.thickness[0] * (a[1] * b[0] - a[0] * b[1])


@ti.data_oriented
class RevolvedFacets:
    """Edges (k, 2) of a half section, revolved about the y axis: frustums of cones."""

    corners = 2

    def __init__(self, nodes: Nodes, facets: np.ndarray, geometry: Any) -> None:
        self.nodes, self.count, self.corner_nodes = nodes, len(facets), facets
        self.node = index_field(facets)

    @ti.func
    def unit_forces(self, s, i):
        """Forces of a pressure of 1 Pa on facet i, whole rings [m^2]: the gradient of `volume`."""
        a = self.nodes.position[s, self.node[i, 0]]
        b = self.nodes.position[s, self.node[i, 1]]
        third = ti.math.pi / 3.0
        rise = a[1] - b[1]
        square = third * (a[0] * a[0] + a[0] * b[0] + b[0] * b[0])
        return ti.Matrix(
            [
                [third * (2.0 * a[0] + b[0]) * rise, square],
                [third * (a[0] + 2.0 * b[0]) * rise, -square],
            ]
        )

    @ti.func
    def volume(self, s, i):
        """What facet i adds to the volume of its chamber [m^3]: the frustum down to the axis."""
        a = self.nodes.position[s, self.node[i, 0]]
        b = self.nodes.position[s, self.node[i, 1]]
        return ti.math.pi / 3.0 * (a[1] - b[1]) * (a[0] * a[0] + a[0] * b[0] + b[0] * b[0])


@ti.data_oriented
class RingFacets:
    """Edges of a section with the nodes opposite their ends (k, 4), over `geometry.sector` of the
    ring: parts of frusta. With the edge D = x_b - x_a, the diameters d_a = x_a - x_a' and d_b, and
    c = D x d = D_x d_y - D_y d_x, their volume is
        V = sector/24 [c_a (|d_a| + |d_b|/2) + c_b (|d_b| + |d_a|/2)],
    see elements/geometry.py. It turns with the section, so its gradient has no moment.
    """

    corners = 4

    def __init__(self, nodes: Nodes, facets: np.ndarray, geometry: Any) -> None:
        self.nodes, self.count, self.corner_nodes = nodes, len(facets), facets
        self.sector = real_field(np.array([geometry.sector]))
        self.node = index_field(facets)

    @ti.func
    def frustum(self, s, i):
        """D, d_a, d_b, |d_a|, |d_b|."""
        a = self.nodes.position[s, self.node[i, 0]]
        b = self.nodes.position[s, self.node[i, 1]]
        across_a = a - self.nodes.position[s, self.node[i, 2]]
        across_b = b - self.nodes.position[s, self.node[i, 3]]
        return b - a, across_a, across_b, across_a.norm(), across_b.norm()

    @ti.func
    def unit_forces(self, s, i):
        """Forces of a pressure of 1 Pa on facet i [m^2]: the gradient of `volume`."""
        D, d_a, d_b, l_a, l_b = self.frustum(s, i)
        part = self.sector[0] / 24.0
        weight_a, weight_b = part * (l_a + 0.5 * l_b), part * (l_b + 0.5 * l_a)
        c_a, c_b = D.cross(d_a), D.cross(d_b)
        normal = ti.Vector([-D[1], D[0]])  # d(D x d)/dd
        of_edge = weight_a * d_a + weight_b * d_b
        e = ti.Vector([of_edge[1], -of_edge[0]])  # d(D x d)/dD
        a = weight_a * normal + part * (c_a + 0.5 * c_b) / l_a * d_a
        b = weight_b * normal + part * (c_b + 0.5 * c_a) / l_b * d_b
        return ti.Matrix(
            [[a[0] - e[0], a[1] - e[1]], [b[0] + e[0], b[1] + e[1]], [-a[0], -a[1]], [-b[0], -b[1]]]
        )

    @ti.func
    def volume(self, s, i):
        """What facet i adds to the volume of its chamber [m^3], down to the axis."""
        D, d_a, d_b, l_a, l_b = self.frustum(s, i)
        c_a, c_b = D.cross(d_a), D.cross(d_b)
        return self.sector[0] / 24.0 * (c_a * (l_a + 0.5 * l_b) + c_b * (l_b + 0.5 * l_a))


@ti.data_oriented
class TriangleFacets:
    """Triangles (k, 3) in space, outward normal of the material by the right-hand rule."""

    corners = 3

    def __init__(self, nodes: Nodes, facets: np.ndarray, geometry: Any) -> None:
        self.nodes, self.count, self.corner_nodes = nodes, len(facets), facets
        self.node = index_field(facets)

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


FACETS: dict[type, Any] = {
    PlaneStrain: PlaneFacets,
    Axisymmetric: RevolvedFacets,
    RingSection: RingFacets,
    Solid: TriangleFacets,
}
