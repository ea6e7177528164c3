"""Linear plane-strain triangles: F_zz = 1.

Kinematics in the plane in elements/triangles.py, material in elements/material_points.py,
volumetric part in elements/nodal_pressure.py.
"""

import numpy as np
import taichi as ti

from softsim.elements import geometry as shapes
from softsim.elements.metric import PlaneMetric
from softsim.elements.triangles import Triangles
from softsim.materials.material import Material
from softsim.nodes import Nodes


@ti.data_oriented
class PlaneStrain(Triangles):
    """Triangles of one body, `geometry.thickness` deep; parameters as for LinearElements."""

    def __init__(
        self,
        nodes: Nodes,
        first_node: int,
        geometry: shapes.PlaneStrain,
        points: np.ndarray,
        cells: np.ndarray,
        material: Material,
        bulk_viscosity: float,
    ) -> None:
        super().__init__(
            nodes, first_node, geometry, PlaneMetric(), points, cells, material, bulk_viscosity
        )

    @ti.func
    def stretch_across(self, s, b, x_sum, y_sum):
        """F_zz needs no storing."""

    @ti.func
    def stored_stretch_across(self, s, b):
        """F_zz."""
        return self.metric.lane(1.0)

    @ti.func
    def force_across(self, s, b, S):
        """The stress across the section does no work."""
        return self.metric.lane(0.0), self.metric.lane(0.0)
