"""Linear tetrahedra: edges d_i = x_i - x_0, corner forces f_i = -V S^ij d_j, f_0 = -sum f_i."""

import taichi as ti

from softsim.compute import backend
from softsim.compute.nodes import Nodes
from softsim.elements.geometry import Region
from softsim.elements.kinematics import SpaceMetric
from softsim.elements.one_point import OnePointElements


class SpaceElements(OnePointElements):
    """Elements in space; parameters as for OnePointElements."""

    def __init__(self, nodes: Nodes, region: Region, bulk_viscosity: float) -> None:
        super().__init__(nodes, region, SpaceMetric(), bulk_viscosity)

    @ti.func
    def volume_ratio(self, s, b):
        """Return J of block b."""
        ax, ay, az, bx, by, bz, cx, cy, cz = ti.static(self.edge)
        determinant = (
            ax[s, b] * (by[s, b] * cz[s, b] - bz[s, b] * cy[s, b])
            + ay[s, b] * (bz[s, b] * cx[s, b] - bx[s, b] * cz[s, b])
            + az[s, b] * (bx[s, b] * cy[s, b] - by[s, b] * cx[s, b])
        )
        return determinant * self.inverse_determinant[b]

    @ti.func
    def stretch(self, s, b):
        """Return C in the basis of the edges, and J."""
        C = self.metric.Symmetric(
            aa=self.dot(s, b, 0, 0),
            bb=self.dot(s, b, 1, 1),
            cc=self.dot(s, b, 2, 2),
            ab=self.dot(s, b, 0, 1),
            bc=self.dot(s, b, 1, 2),
            ca=self.dot(s, b, 2, 0),
        )
        return C, self.volume_ratio(s, b)

    @ti.func
    def dot(self, s, b, i: ti.template(), j: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return d_i . d_j."""
        return (
            self.edge[3 * i][s, b] * self.edge[3 * j][s, b]
            + self.edge[3 * i + 1][s, b] * self.edge[3 * j + 1][s, b]
            + self.edge[3 * i + 2][s, b] * self.edge[3 * j + 2][s, b]
        )

    @ti.func
    def sum_of_edges(self, s, b, S_1, S_2, S_3):
        """Return S_1 d_1 + S_2 d_2 + S_3 d_3, by component."""
        ax, ay, az, bx, by, bz, cx, cy, cz = ti.static(self.edge)
        x = S_1 * ax[s, b] + S_2 * bx[s, b] + S_3 * cx[s, b]
        y = S_1 * ay[s, b] + S_2 * by[s, b] + S_3 * cy[s, b]
        z = S_1 * az[s, b] + S_2 * bz[s, b] + S_3 * cz[s, b]
        return x, y, z


class Tetrahedra(SpaceElements):
    """Tetrahedra; parameters as for SpaceElements."""

    @ti.func
    def deform(self, s, b, t, dt):
        """Compute edges and current volumes from the nodal positions."""
        for k in ti.static(range(3)):
            d1 = self.metric.lane(0.0)
            d2 = self.metric.lane(0.0)
            d3 = self.metric.lane(0.0)
            for lane in ti.static(range(backend.lanes())):
                x0 = self.nodes.position[s, self.corner[b, 0, lane]][k]
                d1[lane] = self.nodes.position[s, self.corner[b, 1, lane]][k] - x0
                d2[lane] = self.nodes.position[s, self.corner[b, 2, lane]][k] - x0
                d3[lane] = self.nodes.position[s, self.corner[b, 3, lane]][k] - x0
            self.edge[k][s, b] = d1
            self.edge[3 + k][s, b] = d2
            self.edge[6 + k][s, b] = d3
        self.keep_volume(s, b, self.volume_ratio(s, b))

    @ti.func
    def stress_corners(self, s, b, t, dt):
        """Write the nodal forces of the stress."""
        S = self.stress(s, b)
        x1, y1, z1 = self.sum_of_edges(s, b, S.aa, S.ab, S.ca)
        x2, y2, z2 = self.sum_of_edges(s, b, S.ab, S.bb, S.bc)
        x3, y3, z3 = self.sum_of_edges(s, b, S.ca, S.bc, S.cc)
        # All of them first, then the stores: in between these would keep LLVM from vectorising.
        self.push_corner(s, b, 0, 0, x1 + x2 + x3)
        self.push_corner(s, b, 0, 1, y1 + y2 + y3)
        self.push_corner(s, b, 0, 2, z1 + z2 + z3)
        self.push_corner(s, b, 1, 0, -x1)
        self.push_corner(s, b, 1, 1, -y1)
        self.push_corner(s, b, 1, 2, -z1)
        self.push_corner(s, b, 2, 0, -x2)
        self.push_corner(s, b, 2, 1, -y2)
        self.push_corner(s, b, 2, 2, -z2)
        self.push_corner(s, b, 3, 0, -x3)
        self.push_corner(s, b, 3, 1, -y3)
        self.push_corner(s, b, 3, 2, -z3)
