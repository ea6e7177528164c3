"""Linear triangles revolved about the y axis; x is the radius, forces are those of whole rings.

In the plane as elements/triangles.py says, and the hoop stretch F_zz = r / R of the centroid, whose
radius is the mean of the corners', so dF_zz/dr_a = 1 / (3 R). V = 2 pi R A is the ring's volume.
Nodes on the axis stay on it (the builder holds their x).
"""

import numpy as np
import taichi as ti

from softsim.elements import geometry as shapes
from softsim.elements.metric import PlaneMetric
from softsim.elements.triangles import Triangles
from softsim.fields import lane_data, lane_field
from softsim.materials.material import Material
from softsim.nodes import Nodes


@ti.data_oriented
class Axisymmetric(Triangles):
    """Rings of one body; parameters as for LinearElements."""

    def __init__(
        self,
        nodes: Nodes,
        first_node: int,
        geometry: shapes.Axisymmetric,
        points: np.ndarray,
        cells: np.ndarray,
        material: Material,
        bulk_viscosity: float,
    ) -> None:
        super().__init__(
            nodes, first_node, geometry, PlaneMetric(), points, cells, material, bulk_viscosity
        )
        self.hoop = lane_field((nodes.scenarios, self.blocks))
        # d(hoop stretch)/d(radius of a corner): 1 / (3 R).
        self.hoop_gradient = lane_data(self.padded(geometry.hoop_gradient(points, cells)[:, 0, 0]))

    @ti.func
    def stretch_across(self, s, b, x_sum, y_sum):
        """Store F_zz = r / R from the sum of the corners' radii."""
        self.hoop[s, b] = x_sum * self.hoop_gradient[b]

    @ti.func
    def stored_stretch_across(self, s, b):
        """F_zz."""
        return self.hoop[s, b]

    @ti.func
    def force_across(self, s, b, S):
        """-V F_zz S_zz / (3 R) along x on each corner; S comes times V."""
        return -(self.hoop[s, b] * S.zz) * self.hoop_gradient[b], self.metric.lane(0.0)
