"""Sections revolved about the y axis; x is the radius, forces are those of whole rings.

The in-plane kinematics is that of elements/plane_elements.py. The hoop
stretch is the mean of r / R over the ring's volume, int r dA / int R dA, so with the weights w_a =
int N_a dA / int R dA
    F_zz = sum_a w_a r_a,   dF_zz/dr_a = w_a.
Nodes on the axis stay on it (the builder holds their x).
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import lane_data, lane_field
from softsim.compute.nodes import Nodes
from softsim.elements.geometry import Geometry, Hoop, Region, edge_lengths, weighted_ends
from softsim.elements.one_point import OnePointElements, padded
from softsim.elements.plane_elements import Across, section_elements
from softsim.elements.quadrature import quadrature


class RevolvedHoop(Hoop):
    """Hoop stretch of sections revolved about the y axis: F_zz = sum w_a r_a."""

    def stretch(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return F_zz (m,): current over reference radius."""
        return (self.weights(points, cells) * x[cells][:, :, 0]).sum(axis=1)

    def stencil(self, cells: np.ndarray) -> np.ndarray:
        """Return the nodes of the cells (m, corners)."""
        return cells

    def gradient(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return dF_zz/dx / F_zz (m, corners, 2) [1/m]: w_a / F_zz along the radius."""
        gradient = np.zeros((*cells.shape, 2))
        gradient[:, :, 0] = self.weights(points, cells) / self.stretch(points, cells, x)[:, None]
        return gradient

    def curvature(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return zeros (m, corners, corners): F_zz is linear in x."""
        return np.zeros((*cells.shape, cells.shape[1]))

    def weights(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return w_a (m, corners) [1/m]: int N_a dA / int R dA."""
        integrated = quadrature(points, cells)
        around = integrated.integrals(points[cells][:, :, 0]).sum(axis=1, keepdims=True)
        return integrated.integrals(np.ones((1, 1))) / around


@dataclass(frozen=True)
class Axisymmetric(Geometry):
    """Geometry of sections revolved about the y axis: x is the radius, elements are whole rings."""

    name = "axisymmetric"
    dimension = 2

    @property
    def hoop(self) -> RevolvedHoop:
        """Hoop stretch of all elements."""
        return RevolvedHoop()

    def depths(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return the circumference 2 pi r at the nodes (m, corners) [m] (Pappus)."""
        return 2.0 * np.pi * points[cells][:, :, 0]

    @staticmethod
    def facet_volume_and_gradient(x, factor, m):
        """Return the volume of an edge's frustum down to the axis, and its gradient at both ends.

        They are those of whole rings.
        """
        a, b = x[0], x[1]
        third = np.pi / 3.0
        rise, square = a[1] - b[1], a[0] * a[0] + a[0] * b[0] + b[0] * b[0]
        of_a = m.vector([third * (2.0 * a[0] + b[0]) * rise, third * square])
        of_b = m.vector([third * (a[0] + 2.0 * b[0]) * rise, -third * square])
        return third * rise * square, [of_a, of_b]

    def corner_areas(self, x: np.ndarray, edges: np.ndarray) -> np.ndarray:
        """Return the tributary area (k, 2) [m^2] of each end of edges (k, 2): int N_a 2 pi r ds."""
        return (
            np.pi / 3.0 * edge_lengths(x, edges)[:, None] * weighted_ends(2.0 * x[edges][:, :, 0])
        )

    def elements(self, nodes: Nodes, region: Region, bulk_viscosity: float) -> OnePointElements:
        return section_elements(
            nodes, region, bulk_viscosity, RevolvedAcross(region, nodes.scenarios)
        )


class RevolvedAcross(Across):
    """Out-of-plane kinematics of rings: F_zz of each block, and the weights w_a of its nodes."""

    def __init__(self, region: Region, scenarios: int) -> None:
        super().__init__()
        weights = RevolvedHoop().weights(region.points, region.cells)
        self.corner_weight = [lane_data(padded(column)) for column in weights.T]
        self.hoop = lane_field((scenarios, backend.lane_blocks(len(weights))))

    @ti.func
    def measure(self, s, b, x: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Compute F_zz from the radii of the nodes."""
        hoop = self.lane(0.0)
        for c in ti.static(range(len(x))):
            hoop += self.corner_weight[c][b] * x[c]
        self.hoop[s, b] = hoop

    @ti.func
    def stretch(self, s, b):
        return self.hoop[s, b]

    @ti.func
    def tension(self, s, b, S):
        """Return V F_zz S_zz."""
        return self.hoop[s, b] * S.zz

    @ti.func
    def weight(self, b, corner: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return w_a of a node."""
        return self.corner_weight[corner][b]
