"""Quadrilaterals of a section, with one integration point and two bending modes.

The hourglass mode and its forces: elements/hourglass.py, in the notation of which
    q_i = e_i . h~,   U = V/2 1/3 sum_i E' (q_i / |D_i|)^2,
for fibres along xi_i, whose strain q_i / |D_i| xi_j grows across them, where int xi_j^2 dV = V/3;
E' is their modulus in plane strain. In rectangles that is the exact energy of bending.
"""

import taichi as ti

from softsim.elements.across import Across, SectionElements
from softsim.elements.hourglass import (
    HourglassElements,
    HourglassSprings,
    fibre_scales,
    hourglass_modes,
)
from softsim.elements.one_point import followed_by_zeros, lane_tables, padded
from softsim.elements.quadrature import PARENT_CORNERS
from softsim.elements.region import Region
from softsim.fields import lane_field
from softsim.nodes import Nodes


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
