"""Linear triangles of a section whose rings resist being widened: two strips, one robot.

In the plane as elements/triangles.py says. Of a ring cell the hoop stretch is that of the diameter
between its corners c and the nodes c' opposite them,
    F_zz = sum_c (y_c - y_c') / D,   D = sum_c (Y_c - Y_c'),
so dF_zz/dy_c = 1/D and dF_zz/dy_c' = -1/D: what pulls a corner inward pulls its opposite as much,
and a ring that moves as a whole feels nothing. Cells of single parts have F_zz = 1.
"""

import numpy as np
import taichi as ti

from softsim import backend
from softsim.elements import geometry as shapes
from softsim.elements.material import Material
from softsim.elements.metric import PlaneMetric
from softsim.elements.triangles import Triangles
from softsim.fields import index_field, lane_data, lane_field
from softsim.nodes import Nodes, by_lane


@ti.data_oriented
class RingSection(Triangles):
    """Ring cells and single ones of one body; parameters as for LinearElements."""

    def __init__(
        self,
        nodes: Nodes,
        first_node: int,
        geometry: shapes.RingSection,
        points: np.ndarray,
        cells: np.ndarray,
        material: Material,
        bulk_viscosity: float,
    ) -> None:
        super().__init__(
            nodes, first_node, geometry, PlaneMetric(), points, cells, material, bulk_viscosity
        )
        self.hoop = lane_field((nodes.scenarios, self.blocks))
        # 1 / D of ring cells, and F_zz of the others.
        self.hoop_gradient = lane_data(self.padded(geometry.hoop_slopes(points, cells)[:, 0]))
        self.single = lane_data(self.padded(np.where(geometry.is_ring, 0.0, 1.0)))
        opposite = self.padded(first_node + geometry.opposite[cells])
        self.opposite = index_field(by_lane(opposite))
        pushes = self.padded(geometry.is_ring) & (np.arange(len(opposite)) < len(cells))
        owner = np.where(pushes[:, None], opposite, -1)
        self.first_opposite_slot = nodes.corner_forces.claim(by_lane(owner))

    @ti.func
    def stretch_across(self, s, b, x_sum, y_sum):
        """Store F_zz from the corners' diameters."""
        diameters = y_sum
        for lane in ti.static(range(backend.lanes())):
            for c in ti.static(range(3)):
                diameters[lane] -= self.nodes.position[s, self.opposite[b, c, lane]][1]
        self.hoop[s, b] = self.single[b] + diameters * self.hoop_gradient[b]

    @ti.func
    def stored_stretch_across(self, s, b):
        """F_zz."""
        return self.hoop[s, b]

    @ti.func
    def force_across(self, s, b, S):
        """-V F_zz S_zz / D along y on each corner; S comes times V."""
        return self.metric.lane(0.0), -(self.hoop[s, b] * S.zz) * self.hoop_gradient[b]

    @ti.func
    def push_opposite(self, s, b, y):
        """The opposite of that on the nodes opposite the corners, into their slots."""
        for c in ti.static(range(3)):
            first = self.first_opposite_slot + (3 * b + c) * ti.static(backend.lanes())
            for lane in ti.static(range(backend.lanes())):
                self.nodes.corner_forces.component[1][s, first + lane] = -y[lane]
