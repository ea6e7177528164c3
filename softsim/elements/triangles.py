"""What linear triangles of a section share, whatever happens across it.

In the plane F = sum_a x_a (x) grad N_a; across it F_zz is the element's own. Corner forces
    f_a = -V (P grad N_a + P_zz dF_zz/dx_a).
An element of this kind says what F_zz is (`stretch_across`, which stores what is needed to find it
again in `stored_stretch_across`) and what force P_zz puts on each corner along x (`force_across`).
"""

from typing import Any

import taichi as ti

from softsim import backend
from softsim.elements.linear import LinearElements


@ti.data_oriented
class Triangles(LinearElements):
    """Triangles of one body; parameters as for LinearElements."""

    stretch_across: Any
    stored_stretch_across: Any
    force_across: Any

    @ti.func
    def deform(self, s, b, t, dt):
        """F of each element from the corner positions, and its current volume J V."""
        x0 = self.tensors.lane(0.0)
        y0 = self.tensors.lane(0.0)
        x1 = self.tensors.lane(0.0)
        y1 = self.tensors.lane(0.0)
        x2 = self.tensors.lane(0.0)
        y2 = self.tensors.lane(0.0)
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
        g1x, g1y = self.gradient[0][0][b], self.gradient[0][1][b]
        g2x, g2y = self.gradient[1][0][b], self.gradient[1][1][b]
        xx = (x1 - x0) * g1x + (x2 - x0) * g2x
        xy = (x1 - x0) * g1y + (x2 - x0) * g2y
        yx = (y1 - y0) * g1x + (y2 - y0) * g2x
        yy = (y1 - y0) * g1y + (y2 - y0) * g2y
        self.F[0][s, b] = xx
        self.F[1][s, b] = xy
        self.F[2][s, b] = yx
        self.F[3][s, b] = yy
        zz = self.stretch_across(s, b, x0 + x1 + x2)
        self.current_volume[s, b] = (xx * yy - xy * yx) * zz * self.volume[b]

    @ti.func
    def deformation(self, s, b):
        """The F that `deform` stored."""
        return self.tensors.General(
            xx=self.F[0][s, b],
            xy=self.F[1][s, b],
            yx=self.F[2][s, b],
            yy=self.F[3][s, b],
            zz=self.stored_stretch_across(s, b),
        )

    @ti.func
    def stress_corners(self, s, b, t, dt):
        """Corner forces -V (P grad N_a + P_zz dF_zz/dx_a)."""
        P = self.first_piola(s, b, self.deformation(s, b))
        volume = self.volume[b]
        g1x, g1y = self.gradient[0][0][b], self.gradient[0][1][b]
        g2x, g2y = self.gradient[1][0][b], self.gradient[1][1][b]
        x1 = -volume * (P.xx * g1x + P.xy * g1y)
        y1 = -volume * (P.yx * g1x + P.yy * g1y)
        x2 = -volume * (P.xx * g2x + P.xy * g2y)
        y2 = -volume * (P.yx * g2x + P.yy * g2y)
        across = self.force_across(b, P)
        fx, fy = ti.static(self.nodes.corner_forces.component)
        row = self.first_row + 3 * b
        fx[s, row] = across - x1 - x2
        fy[s, row] = -y1 - y2
        fx[s, row + 1] = across + x1
        fy[s, row + 1] = y1
        fx[s, row + 2] = across + x2
        fy[s, row + 2] = y2
