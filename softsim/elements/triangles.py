"""Linear triangles of a section, for any out-of-plane kinematics.

Edges d_a = x_1 - x_0 and d_b = x_2 - x_0 in the plane; F_zz is independent of them. Nodal
forces
    f_1 = -V (S^aa d_a + S^ab d_b),  f_2 = -V (S^ab d_a + S^bb d_b),  f_0 = -f_1 - f_2,
each with -V F_zz S_zz dF_zz/dx in addition (elements/across.py).
"""

import taichi as ti

from softsim import backend
from softsim.elements.across import SectionElements


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
