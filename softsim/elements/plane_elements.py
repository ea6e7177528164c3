"""Triangles and quadrilaterals of a section, for any out-of-plane kinematics; plane strain.

Triangles have edges d_a = x_1 - x_0 and d_b = x_2 - x_0 in the plane; F_zz is independent of them.
Nodal forces
    f_1 = -V (S^aa d_a + S^ab d_b),  f_2 = -V (S^ab d_a + S^bb d_b),  f_0 = -f_1 - f_2,
each with -V F_zz S_zz dF_zz/dx in addition. A quadrilateral has one integration point and hourglass
forces (elements/hourglass.py).
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import lane_field
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, Stage
from softsim.elements.geometry import PARENT_CORNERS, Geometry, Region, edge_lengths
from softsim.elements.hourglass import (
    HourglassElements,
    HourglassSprings,
    fibre_scales,
    hourglass_modes,
)
from softsim.elements.kinematics import PlaneMetric
from softsim.elements.one_point import OnePointElements, followed_by_zeros, lane_tables, padded

# -------------------------------------------------------------------------------------------------
# Elements of a plane section, their out-of-plane stretch F_zz and the force of its stress.
#
# In plane strain F_zz = 1, and the out-of-plane stress does no work. In sections with a hoop
# direction F_zz depends on the nodal positions, see elements/hoop.py.


class Across:
    """Out-of-plane kinematics of plane strain: F_zz = 1."""

    def __init__(self) -> None:
        self.lane = backend.lane_vector()

    def passes(self) -> dict[Stage, list[Pass]]:
        """Return the passes of an increment in addition to those of the elements."""
        return {}

    @ti.func
    def measure(self, s, b, x: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Store F_zz of block b where it is not constant; x: lane vector of x of each node."""

    @ti.func
    def stretch(self, s, b):
        """Return F_zz of block b."""
        return self.lane(1.0)

    @ti.func
    def tension(self, s, b, S):
        """Return the nodal force of the out-of-plane stress, V F_zz S_zz, divided by `weight`."""
        return self.lane(0.0)

    @ti.func
    def weight(self, b, corner: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return the factor of `tension` in the force on a node along -x [1/m]."""
        return self.lane(0.0)


class SectionElements(OnePointElements):
    """Elements of a section; across: out-of-plane kinematics, others as for OnePointElements."""

    def __init__(self, nodes: Nodes, region: Region, bulk_viscosity: float, across: Across) -> None:
        super().__init__(nodes, region, PlaneMetric(), bulk_viscosity)
        self.across = across

    def passes(self) -> dict[Stage, list[Pass]]:
        return stacked(super().passes(), self.across.passes())

    @ti.func
    def volume_ratio(self, s, b):
        """Return J of block b."""
        ax, ay, bx, by = ti.static(self.edge)
        area = ax[s, b] * by[s, b] - ay[s, b] * bx[s, b]
        return area * self.inverse_determinant[b] * self.across.stretch(s, b)

    @ti.func
    def stretch(self, s, b):
        """Return C in the basis of the edges, and J."""
        ax, ay, bx, by = ti.static(self.edge)
        zz = self.across.stretch(s, b)
        C = self.metric.Symmetric(
            aa=ax[s, b] * ax[s, b] + ay[s, b] * ay[s, b],
            bb=bx[s, b] * bx[s, b] + by[s, b] * by[s, b],
            ab=ax[s, b] * bx[s, b] + ay[s, b] * by[s, b],
            zz=zz * zz,
        )
        return C, self.volume_ratio(s, b)


def stacked(*of_stages: dict[Stage, list[Pass]]) -> dict[Stage, list[Pass]]:
    """Return the passes of several terms, merged stage by stage."""
    stages = {stage for passes in of_stages for stage in passes}
    return {stage: [p for passes in of_stages for p in passes.get(stage, [])] for stage in stages}


class Triangles(SectionElements):
    """Triangles; parameters as for SectionElements."""

    @ti.func
    def deform(self, s, b, t, dt):
        """Compute edges and current volumes from the nodal positions."""
        x0 = self.metric.lane(0.0)
        y0 = self.metric.lane(0.0)
        x1 = self.metric.lane(0.0)
        y1 = self.metric.lane(0.0)
        x2 = self.metric.lane(0.0)
        y2 = self.metric.lane(0.0)
        for lane in ti.static(range(backend.lanes())):
            p0 = self.nodes.position[s, self.corner[b, 0, lane]]
            p1 = self.nodes.position[s, self.corner[b, 1, lane]]
            p2 = self.nodes.position[s, self.corner[b, 2, lane]]
            x0[lane] = p0[0]
            y0[lane] = p0[1]
            x1[lane] = p1[0]
            y1[lane] = p1[1]
            x2[lane] = p2[0]
            y2[lane] = p2[1]
        ax, ay, bx, by = ti.static(self.edge)
        ax[s, b] = x1 - x0
        ay[s, b] = y1 - y0
        bx[s, b] = x2 - x0
        by[s, b] = y2 - y0
        self.across.measure(s, b, [x0, x1, x2])
        self.keep_volume(s, b, self.volume_ratio(s, b))

    @ti.func
    def stress_corners(self, s, b, t, dt):
        """Write the nodal forces of the stress."""
        S = self.stress(s, b)
        ax, ay, bx, by = ti.static(self.edge)
        x1 = -(S.aa * ax[s, b] + S.ab * bx[s, b])
        y1 = -(S.aa * ay[s, b] + S.ab * by[s, b])
        x2 = -(S.ab * ax[s, b] + S.bb * bx[s, b])
        y2 = -(S.ab * ay[s, b] + S.bb * by[s, b])
        around = self.across.tension(s, b, S)
        self.push_corner(s, b, 0, 0, -x1 - x2 - around * self.across.weight(b, 0))
        self.push_corner(s, b, 0, 1, -y1 - y2)
        self.push_corner(s, b, 1, 0, x1 - around * self.across.weight(b, 1))
        self.push_corner(s, b, 1, 1, y1)
        self.push_corner(s, b, 2, 0, x2 - around * self.across.weight(b, 2))
        self.push_corner(s, b, 2, 1, y2)


# -------------------------------------------------------------------------------------------------
# Quadrilaterals of a section, with one integration point and two bending modes.
#
# The hourglass mode and its forces: elements/hourglass.py, in the notation of which
#     q_i = e_i . h~,   U = V/2 1/3 sum_i E' (q_i / |D_i|)^2,
# for fibres along xi_i, whose strain q_i / |D_i| xi_j grows across them, where int xi_j^2 dV = V/3;
# E' is their modulus in plane strain. In rectangles that is the exact energy of bending.


class Quadrilaterals(HourglassElements, SectionElements):
    """Quadrilaterals; parameters as for SectionElements."""

    def __init__(self, nodes: Nodes, region: Region, bulk_viscosity: float, across: Across) -> None:
        super().__init__(nodes, region, bulk_viscosity, across)
        modes = hourglass_modes(region)
        scenarios, blocks = nodes.scenarios, int(self.blocks)
        self.springs = HourglassSprings(self.points, 2, scenarios, blocks)
        self.lean = lane_tables(padded(modes.lean[:, 0]))
        self.share = lane_tables(padded(modes.share[:, 0]))
        self.scale = lane_tables(followed_by_zeros(fibre_scales(modes)))
        self.mode = [lane_field((scenarios, blocks)) for _ in range(2)]  # h~

    @ti.func
    def deform(self, s, b, t, dt):
        """Compute edges, hourglass mode and current volumes from the nodal positions."""
        x0, y0 = self.corner_component(s, b, 0, 0), self.corner_component(s, b, 0, 1)
        x1, y1 = self.corner_component(s, b, 1, 0), self.corner_component(s, b, 1, 1)
        x2, y2 = self.corner_component(s, b, 2, 0), self.corner_component(s, b, 2, 1)
        x3, y3 = self.corner_component(s, b, 3, 0), self.corner_component(s, b, 3, 1)
        self.deform_component(s, b, 0, x0, x1, x2, x3)
        self.deform_component(s, b, 1, y0, y1, y2, y3)
        self.across.measure(s, b, [x0, x1, x2, x3])
        self.keep_volume(s, b, self.volume_ratio(s, b))

    @ti.func
    def deform_component(self, s, b, k: ti.template(), x0, x1, x2, x3):  # type: ignore[valid-type]  # Taichi wants an instance
        """Compute component k of d_1, d_2 and h~."""
        diagonal, other = x2 - x0, x1 - x3
        h = 0.25 * (x0 - x1 + x2 - x3)
        d1 = 0.25 * (diagonal + other) + self.lean[b, 0] * h
        d2 = 0.25 * (diagonal - other) + self.lean[b, 1] * h
        self.edge[k][s, b] = d1
        self.edge[2 + k][s, b] = d2
        self.mode[k][s, b] = h - self.share[b, 0] * d1 - self.share[b, 1] * d2

    @ti.func
    def stress_corners(self, s, b, t, dt):
        """Write the nodal forces of the stress and the hourglass mode."""
        S = self.stress(s, b)
        ax, ay, bx, by = ti.static(self.edge)
        hx, hy = ti.static(self.mode)
        inverse_a = 1.0 / ti.sqrt(ax[s, b] * ax[s, b] + ay[s, b] * ay[s, b])
        inverse_b = 1.0 / ti.sqrt(bx[s, b] * bx[s, b] + by[s, b] * by[s, b])
        e_ax, e_ay = ax[s, b] * inverse_a, ay[s, b] * inverse_a
        e_bx, e_by = bx[s, b] * inverse_b, by[s, b] * inverse_b
        q_a = e_ax * hx[s, b] + e_ay * hy[s, b]
        q_b = e_bx * hx[s, b] + e_by * hy[s, b]
        self.springs.amplitude[s, b, 0] = self.scale[b, 0] * q_a
        self.springs.amplitude[s, b, 1] = self.scale[b, 1] * q_b
        self.springs.load(s, b)
        p_a = self.scale[b, 0] * self.springs.force[s, b, 0]
        p_b = self.scale[b, 1] * self.springs.force[s, b, 1]
        Q_x, Q_y = p_a * e_ax + p_b * e_bx, p_a * e_ay + p_b * e_by
        r_a, r_b = p_a * inverse_a, p_b * inverse_b
        share_a, share_b = self.share[b, 0], self.share[b, 1]
        a_x = S.aa * ax[s, b] + S.ab * bx[s, b] + r_a * (hx[s, b] - q_a * e_ax) - share_a * Q_x
        a_y = S.aa * ay[s, b] + S.ab * by[s, b] + r_a * (hy[s, b] - q_a * e_ay) - share_a * Q_y
        b_x = S.ab * ax[s, b] + S.bb * bx[s, b] + r_b * (hx[s, b] - q_b * e_bx) - share_b * Q_x
        b_y = S.ab * ay[s, b] + S.bb * by[s, b] + r_b * (hy[s, b] - q_b * e_by) - share_b * Q_y
        h_x = Q_x + self.lean[b, 0] * a_x + self.lean[b, 1] * b_x
        h_y = Q_y + self.lean[b, 0] * a_y + self.lean[b, 1] * b_y
        around = self.across.tension(s, b, S)
        for c in ti.static(range(4)):
            i, j = ti.static(PARENT_CORNERS[4][c][0]), ti.static(PARENT_CORNERS[4][c][1])
            x = -0.25 * (i * a_x + j * b_x + i * j * h_x) - around * self.across.weight(b, c)
            y = -0.25 * (i * a_y + j * b_y + i * j * h_y)
            self.push_corner(s, b, c, 0, x)
            self.push_corner(s, b, c, 1, y)


# -------------------------------------------------------------------------------------------------
# Element class of a section by the number of nodes of its cells.

BY_CORNERS: dict[int, type[SectionElements]] = {3: Triangles, 4: Quadrilaterals}


def section_elements(
    nodes: Nodes, region: Region, bulk_viscosity: float, across: Across
) -> SectionElements:
    """Return the force term of a region's elements; bulk_viscosity: b1 [-]."""
    kind = BY_CORNERS[region.cells.shape[1]]
    return kind(nodes, region, bulk_viscosity, across)


# -------------------------------------------------------------------------------------------------
# Plane strain: F_zz = 1.


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
