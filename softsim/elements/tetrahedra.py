"""Linear tetrahedra.

F = sum_a x_a (x) grad N_a; corner forces f_a = -V P grad N_a.
Material in elements/material_points.py, volumetric part in elements/nodal_pressure.py.
"""

import numpy as np
import taichi as ti

from softsim import backend
from softsim.elements import geometry as shapes
from softsim.elements.linear import LinearElements
from softsim.elements.material import Material
from softsim.elements.tensors import SpaceTensors
from softsim.nodes import Nodes


@ti.data_oriented
class Tetrahedra(LinearElements):
    """Tetrahedra of one body; parameters as for LinearElements."""

    def __init__(
        self,
        nodes: Nodes,
        first_node: int,
        geometry: shapes.Solid,
        points: np.ndarray,
        cells: np.ndarray,
        material: Material,
        bulk_viscosity: float,
    ) -> None:
        super().__init__(
            nodes, first_node, geometry, SpaceTensors(), 9, points, cells, material, bulk_viscosity
        )

    @ti.func
    def deform(self, s, b, t, dt):
        """F of each element, row by row, from the corner positions, and its volume J V."""
        for i in ti.static(range(3)):
            d1 = self.tensors.lane(0.0)
            d2 = self.tensors.lane(0.0)
            d3 = self.tensors.lane(0.0)
            for lane in ti.static(range(backend.lanes())):
                x0 = self.nodes.position[s, self.corner[b, 0, lane]][i]
                d1[lane] = self.nodes.position[s, self.corner[b, 1, lane]][i] - x0
                d2[lane] = self.nodes.position[s, self.corner[b, 2, lane]][i] - x0
                d3[lane] = self.nodes.position[s, self.corner[b, 3, lane]][i] - x0
            for j in ti.static(range(3)):
                self.F[3 * i + j][s, b] = (
                    d1 * self.gradient[0][j][b]
                    + d2 * self.gradient[1][j][b]
                    + d3 * self.gradient[2][j][b]
                )
        F = self.deformation(s, b)
        self.current_volume[s, b] = self.tensors.determinant(F) * self.volume[b]

    @ti.func
    def deformation(self, s, b):
        """The F that `deform` stored."""
        return self.tensors.General(
            xx=self.F[0][s, b],
            xy=self.F[1][s, b],
            xz=self.F[2][s, b],
            yx=self.F[3][s, b],
            yy=self.F[4][s, b],
            yz=self.F[5][s, b],
            zx=self.F[6][s, b],
            zy=self.F[7][s, b],
            zz=self.F[8][s, b],
        )

    @ti.func
    def stress_corners(self, s, b, t, dt):
        """Corner forces -V P grad N_a."""
        P = self.first_piola(s, b, self.deformation(s, b))
        volume = self.volume[b]
        x0 = self.tensors.lane(0.0)
        y0 = self.tensors.lane(0.0)
        z0 = self.tensors.lane(0.0)
        fx, fy, fz = ti.static(self.nodes.corner_forces.component)
        row = self.first_row + 4 * b
        for c in ti.static(range(3)):
            gx = -volume * self.gradient[c][0][b]
            gy = -volume * self.gradient[c][1][b]
            gz = -volume * self.gradient[c][2][b]
            x = P.xx * gx + P.xy * gy + P.xz * gz
            y = P.yx * gx + P.yy * gy + P.yz * gz
            z = P.zx * gx + P.zy * gy + P.zz * gz
            x0 -= x
            y0 -= y
            z0 -= z
            fx[s, row + c + 1] = x
            fy[s, row + c + 1] = y
            fz[s, row + c + 1] = z
        fx[s, row] = x0
        fy[s, row] = y0
        fz[s, row] = z0
