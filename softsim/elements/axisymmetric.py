"""Linear triangles revolved about the y axis; x is the radius, forces are those of whole rings.

In the plane as elements/triangles.py says, and the hoop stretch F_zz = r / R of the centroid, whose
radius is the mean of the corners', so dF_zz/dr_a = 1 / (3 R). V = 2 pi R A is the ring's volume.
Nodes on the axis stay on it (the builder holds their x).
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.elements.facets import Facets
from softsim.elements.geometry import Geometry, Hoop, edge_lengths, weighted_ends
from softsim.elements.linear import LinearElements
from softsim.elements.metric import PlaneMetric
from softsim.elements.region import Region
from softsim.elements.triangles import Triangles
from softsim.fields import lane_data, lane_field
from softsim.mesh.mesh import signed_volumes
from softsim.nodes import Nodes


class RevolvedHoop(Hoop):
    """Of triangles revolved about the y axis: F_zz = r / R of the centroid, whose radius is the
    mean of the corners'.
    """

    def stretch(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """F_zz (m,): present over reference radius."""
        return x[cells][:, :, 0].sum(axis=1) / points[cells][:, :, 0].sum(axis=1)

    def stencil(self, cells: np.ndarray) -> np.ndarray:
        """The corners (m, 3)."""
        return cells

    def gradient(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """dF_zz/dx / F_zz (m, 3, 2) [1/m]: 1 / (3 r) along the radius."""
        gradient = np.zeros((*cells.shape, 2))
        gradient[:, :, 0] = 1.0 / x[cells][:, :, 0].sum(axis=1, keepdims=True)
        return gradient

    def curvature(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """None (m, 3, 3): F_zz is linear in x."""
        return np.zeros((len(cells), 3, 3))


@dataclass(frozen=True)
class Axisymmetric(Geometry):
    """Triangles revolved about the y axis: x is the radius. Whole rings, 2 pi around.

    One integration point, the centroid, whose radius is the mean of the corners'.
    """

    name = "axisymmetric"
    dimension = 2

    @property
    def hoop(self) -> RevolvedHoop:
        """Every element goes around."""
        return RevolvedHoop()

    def volumes(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Volume of each ring (m,) [m^3], exact (Pappus): 2 pi r A."""
        radius = points[cells][:, :, 0].mean(axis=1)
        return 2.0 * np.pi * radius * signed_volumes(points, cells)

    def mass_shares(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Row sums of the consistent mass matrix: int N_a 2 pi r dA over the volume, so that
        weight and inertia do the work of the continuous body.
        """
        radius = points[cells][:, :, 0]
        total = radius.sum(axis=1, keepdims=True)
        return (radius + total) / (4.0 * total)

    def enclosed_volume(self, x: np.ndarray, facets: np.ndarray) -> float:
        """Volume [m^3] between a chain of edges (k, 2), revolved, and the axis."""
        a, b = x[facets[:, 0]], x[facets[:, 1]]
        squares = a[:, 0] ** 2 + a[:, 0] * b[:, 0] + b[:, 0] ** 2
        return np.pi / 3.0 * float(((a[:, 1] - b[:, 1]) * squares).sum())

    def corner_areas(self, x: np.ndarray, edges: np.ndarray) -> np.ndarray:
        """Area (k, 2) [m^2] of edges (k, 2) that each of their ends stands for: int N_a 2 pi r
        ds.
        """
        return (
            np.pi / 3.0 * edge_lengths(x, edges)[:, None] * weighted_ends(2.0 * x[edges][:, :, 0])
        )

    def volume_gradient(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """d(enclosed volume)/dx of the corners (k, 2, d) [m^2]: forces of a pressure of 1 Pa."""
        (a, za), (b, zb) = x[facets[:, 0]].T, x[facets[:, 1]].T
        squares = a**2 + a * b + b**2
        first = np.stack([(2.0 * a + b) * (za - zb), squares], axis=1)
        second = np.stack([(a + 2.0 * b) * (za - zb), -squares], axis=1)
        return np.pi / 3.0 * np.stack([first, second], axis=1)

    def elements(self, nodes: Nodes, region: Region, bulk_viscosity: float) -> LinearElements:
        """What computes their forces."""
        return AxisymmetricElements(nodes, region, PlaneMetric(), bulk_viscosity)

    def facets(self, nodes: Nodes, facets: np.ndarray) -> Facets:
        """What a pressure on facets, as `pressed` gives them, does."""
        return RevolvedFacets(nodes, facets)


@ti.data_oriented
class AxisymmetricElements(Triangles):
    """Rings; parameters as for LinearElements."""

    def __init__(
        self, nodes: Nodes, region: Region, metric: PlaneMetric, bulk_viscosity: float
    ) -> None:
        super().__init__(nodes, region, metric, bulk_viscosity)
        self.hoop = lane_field((nodes.scenarios, int(self.blocks)))
        # d(hoop stretch)/d(radius of a corner): 1 / (3 R).
        gradient = RevolvedHoop().gradient(region.points, region.cells)
        self.hoop_gradient = lane_data(self.padded(gradient[:, 0, 0]))

    @ti.func
    def stretch_across(self, s, b, x_sum, y_sum):
        """Store F_zz = r / R from the sum of the corners' radii."""
        self.hoop[s, b] = x_sum * self.hoop_gradient[b]

    @ti.func
    def stored_stretch_across(self, s, b):
        """F_zz."""
        return self.hoop[s, b]

    @ti.func
    def force_across(self, s, b, S):
        """-V F_zz S_zz / (3 R) along x on each corner; S comes times V."""
        return -(self.hoop[s, b] * S.zz) * self.hoop_gradient[b], self.metric.lane(0.0)


@ti.data_oriented
class RevolvedFacets(Facets):
    """Edges (k, 2) of a half section, revolved about the y axis: frustums of cones."""

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
