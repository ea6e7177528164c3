"""Linear triangles of a section whose rings resist being widened: two strips, one robot.

In the plane as elements/triangles.py says. Of a ring cell the hoop stretch is that of the diameters
between its corners c and the nodes c' opposite them (elements/diameters.py),
    F_zz = sum_c |x_c - x_c'| / D,   D = sum_c |X_c - X_c'|,
so its stress pulls at each of them with the tension V F_zz S_zz / D. Cells of single parts have
F_zz = 1.
"""

import numpy as np
import taichi as ti

from softsim import backend
from softsim.elements import geometry as shapes
from softsim.elements.diameters import Diameters
from softsim.elements.metric import PlaneMetric
from softsim.elements.triangles import Triangles
from softsim.fields import index_field, lane_data, lane_field
from softsim.materials.material import Material
from softsim.nodes import Nodes, by_lane
from softsim.term import Pass, Stage


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
        is_ring = geometry.is_ring
        # Both nodes of a diameter have its number: each is named after its smaller node.
        name = np.minimum(cells, geometry.opposite[cells])[is_ring]
        first, number = np.unique(name, return_inverse=True)
        number = number.reshape(name.shape)
        ends = first_node + np.stack([first, geometry.opposite[first]], axis=1)
        lanes = self.blocks * backend.lanes()
        self.diameters = Diameters(nodes, ends, number, np.flatnonzero(is_ring), lanes)
        place = np.full(cells.shape, self.diameters.nowhere)
        place[is_ring] = self.diameters.places[number]
        self.place = index_field(by_lane(self.padded(place)))
        self.hoop = lane_field((nodes.scenarios, self.blocks))
        # 1 / D of ring cells, and F_zz of the others.
        at_rest = geometry.diameters(points, cells).sum(axis=1)
        slope = np.divide(1.0, at_rest, out=np.zeros(len(cells)), where=is_ring)
        self.hoop_slope = lane_data(self.padded(slope))
        self.single = lane_data(self.padded(np.where(is_ring, 0.0, 1.0)))

    def passes(self) -> dict[Stage, list[Pass]]:
        """Of an increment: diameters are measured before it, and pulled at after it."""
        diameters = self.diameters
        return {
            Stage.MEASURE: [Pass("elements", diameters.blocks, (diameters.measure,))],
            **super().passes(),
            Stage.PULL: [Pass("elements", diameters.blocks, (diameters.pull,))],
        }

    @ti.func
    def stretch_across(self, s, b, x_sum, y_sum):
        """Store F_zz from the corners' diameters."""
        diameters = self.metric.lane(0.0)
        for lane in ti.static(range(backend.lanes())):
            for c in ti.static(range(3)):
                diameters[lane] += self.diameters.length[s, self.place[b, c, lane]]
        self.hoop[s, b] = self.single[b] + diameters * self.hoop_slope[b]

    @ti.func
    def stored_stretch_across(self, s, b):
        """F_zz."""
        return self.hoop[s, b]

    @ti.func
    def force_across(self, s, b, S):
        """Nothing on the corners alone: the diameters get V F_zz S_zz / D; S comes times V."""
        tension = self.hoop[s, b] * S.zz * self.hoop_slope[b]
        for lane in ti.static(range(backend.lanes())):
            self.diameters.tension[s, b * ti.static(backend.lanes()) + lane] = tension[lane]
        return self.metric.lane(0.0), self.metric.lane(0.0)
