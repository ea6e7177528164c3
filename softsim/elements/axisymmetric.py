"""Linear triangles revolved about the y axis; x is the radius, forces are those of whole rings.

F as in the plane, and the hoop stretch F_zz = r / R of the centroid, whose radius is the mean of
the corners'. With the ring's volume V = 2 pi R A the corner forces are
    f_a = -V (P grad N_a + P_zz / (3 R) e_r),
the gradient of the element's energy. Nodes on the axis stay on it (the builder holds their x).
"""

import numpy as np
import taichi as ti

from softsim import backend
from softsim.elements import geometry
from softsim.elements.linear import LinearElements, lane_data
from softsim.elements.material import Material
from softsim.elements.tensors import PlaneTensors
from softsim.nodes import Nodes


@ti.data_oriented
class Axisymmetric(LinearElements):
    """Rings of one body; parameters as for LinearElements."""

    def __init__(
        self,
        nodes: Nodes,
        first_node: int,
        geometry: geometry.Axisymmetric,
        points: np.ndarray,
        cells: np.ndarray,
        material: Material,
        bulk_viscosity: float,
    ) -> None:
        super().__init__(
            nodes, first_node, geometry, PlaneTensors(), 5, points, cells, material, bulk_viscosity
        )
        # d(hoop stretch)/d(radius of a corner): 1 / (3 R).
        self.hoop_gradient = lane_data(self.padded(geometry.hoop_gradient(points, cells)))

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
        zz = (x0 + x1 + x2) * self.hoop_gradient[b]
        self.F[0][s, b] = xx
        self.F[1][s, b] = xy
        self.F[2][s, b] = yx
        self.F[3][s, b] = yy
        self.F[4][s, b] = zz
        self.current_volume[s, b] = (xx * yy - xy * yx) * zz * self.volume[b]

    @ti.func
    def deformation(self, s, b):
        """The F that `deform` stored."""
        return self.tensors.General(
            xx=self.F[0][s, b],
            xy=self.F[1][s, b],
            yx=self.F[2][s, b],
            yy=self.F[3][s, b],
            zz=self.F[4][s, b],
        )

    @ti.func
    def stress_corners(self, s, b, t, dt):
        """Corner forces -V (P grad N_a + P_zz / (3 R) e_r)."""
        P = self.first_piola(s, b, self.deformation(s, b))
        volume = self.volume[b]
        g1x, g1y = self.gradient[0][0][b], self.gradient[0][1][b]
        g2x, g2y = self.gradient[1][0][b], self.gradient[1][1][b]
        x1 = -volume * (P.xx * g1x + P.xy * g1y)
        y1 = -volume * (P.yx * g1x + P.yy * g1y)
        x2 = -volume * (P.xx * g2x + P.xy * g2y)
        y2 = -volume * (P.yx * g2x + P.yy * g2y)
        hoop = -volume * P.zz * self.hoop_gradient[b]
        fx, fy = ti.static(self.nodes.corner_forces.component)
        row = self.first_row + 3 * b
        fx[s, row] = hoop - x1 - x2
        fy[s, row] = -y1 - y2
        fx[s, row + 1] = hoop + x1
        fy[s, row + 1] = y1
        fx[s, row + 2] = hoop + x2
        fy[s, row + 2] = y2
