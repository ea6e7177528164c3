"""What all linear elements share: lanes of corners, one material point, averaged nodal pressure.

An increment asks for four passes: `deform`, `press_nodes`, `average_pressure`, `stress_corners`.
"""

from typing import Any

import numpy as np
import taichi as ti

from softsim import backend
from softsim.elements.geometry import Geometry, nodal_sums, shape_gradients
from softsim.elements.material import Material
from softsim.elements.material_points import MaterialPoints
from softsim.elements.nodal_pressure import NodalPressure
from softsim.elements.tensors import inverse_cube_root
from softsim.fields import index_field, lane_data, lane_field
from softsim.nodes import Nodes, by_lane


@ti.data_oriented
class LinearElements:
    """All elements of one body.

    Parameters
    ----------
    nodes: the shared nodes; this body owns first_node .. first_node + len(points) - 1.
    geometry: of these elements. tensors: their tensors. F_components: numbers stored for F.
    points: reference positions (n, d) [m]. cells: (m, corners), numbered within the body.
    bulk_viscosity: b1 [-].
    """

    def __init__(
        self,
        nodes: Nodes,
        first_node: int,
        geometry: Geometry,
        tensors: Any,
        F_components: int,
        points: np.ndarray,
        cells: np.ndarray,
        material: Material,
        bulk_viscosity: float,
    ) -> None:
        scenarios, lanes = nodes.scenarios, backend.lanes()
        self.nodes, self.tensors = nodes, tensors
        self.first_node, self.node_count = first_node, len(points)
        self.corners = cells.shape[1]
        self.blocks = backend.lane_blocks(len(cells))

        # Padding repeats the last cell with zero volume and sends its forces nowhere.
        padded = self.padded(cells)
        volume = geometry.volumes(points, cells)
        padded_volume = self.padded(volume)
        padded_volume[len(cells) :] = 0.0
        self.corner = index_field(by_lane(padded + first_node, lanes))
        gradients = shape_gradients(points, padded)
        # Of corner 1, 2 (3); that of corner 0 is minus their sum.
        self.gradient = [
            [lane_data(gradients[:, c, i]) for i in range(geometry.dimension)]
            for c in range(1, self.corners)
        ]
        self.volume = lane_data(padded_volume)
        owner = np.where(np.arange(len(padded))[:, None] < len(cells), padded + first_node, -1)
        # A block's rows: corner 0, 1, 2 (3).
        self.first_row = nodes.corner_forces.claim(by_lane(owner, lanes).reshape(-1, lanes))

        self.points = MaterialPoints(material, tensors, scenarios, self.blocks)
        areas_or_volumes = np.abs(np.linalg.det(points[cells[:, 1:]] - points[cells[:, :1]]))
        measure = nodal_sums(cells, areas_or_volumes[:, None], len(points)) / (
            self.corners * (2.0 if geometry.dimension == 2 else 6.0)
        )
        size = measure ** (1.0 / geometry.dimension)
        self.pressure = NodalPressure(cells, volume, size, material, bulk_viscosity, scenarios)

        self.F = [lane_field((scenarios, self.blocks)) for _ in range(F_components)]
        self.current_volume = lane_field((scenarios, self.blocks))
        self.element_pressure = lane_field((scenarios, self.blocks))

    def padded(self, values: np.ndarray) -> np.ndarray:
        """Per-element values (m, ...) with the last one repeated up to whole lane vectors."""
        padding = self.blocks * backend.lanes() - len(values)
        return np.concatenate([values, np.repeat(values[-1:], padding, axis=0)])

    @property
    def branch_count(self) -> int:
        """Maxwell branches of the material."""
        return self.points.branch_count

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        return self.points.memory() | self.pressure.memory()

    def set_increment(self, dt: float) -> None:
        """Take the time step [s]."""
        self.points.set_increment(dt)

    # Of the element itself: `deform(s, b, t, dt)` stores F and the present volume J V of a block,
    # `deformation(s, b)` gives that F back, `stress_corners(s, b, t, dt)` writes corner forces.
    deform: Any
    deformation: Any
    stress_corners: Any

    # --- one increment, pass by pass; deform comes first, stress_corners last --------------------

    @ti.func
    def press_nodes(self, s, a, t, dt):
        """Pressure of node a."""
        self.pressure.press(s, a, dt, self.current_volume)

    @ti.func
    def average_pressure(self, s, b, t, dt):
        """Element pressure: the mean of its nodes (positive in tension)."""
        p = self.tensors.lane(0.0)
        for lane in ti.static(range(backend.lanes())):
            for c in ti.static(range(self.corners)):
                p[lane] += self.pressure.pressure[s, self.corner[b, c, lane] - self.first_node]
        self.element_pressure[s, b] = p * (1.0 / self.corners)

    @ti.func
    def first_piola(self, s, b, F):
        """P = J^(-2/3) (F M - (C : M) / 3 F^-T) + p J F^-T, M of `stress_metric`."""
        C = self.tensors.right_cauchy_green(F)
        r = inverse_cube_root(self.tensors.determinant(F))
        r2 = r * r
        M = self.points.stress_metric(s, b, C, r2)
        trace = self.tensors.contraction(C, M) * (1.0 / 3.0)
        h = self.element_pressure[s, b] - trace * (r2 * r2 * r)  # 1 / J = r^3
        return self.tensors.first_piola(F, r2, M, h)

    @ti.func
    def dissipate(self, s, b, t, dt):
        """Add what the Maxwell branches dissipate in dt, a few increments long."""
        F = self.deformation(s, b)
        r = inverse_cube_root(self.tensors.determinant(F))
        C = self.tensors.right_cauchy_green(F)
        self.points.dissipate(s, b, C, r * r, self.volume[b], dt)

    # --- what observers ask ----------------------------------------------------------------------

    @ti.func
    def stored_energy(self, s):
        """Energy [J] in the law, the Maxwell springs and the volume: ABAQUS's ALLSE."""
        in_elements = self.tensors.lane(0.0)
        for b in range(self.blocks):
            F = self.deformation(s, b)
            r = inverse_cube_root(self.tensors.determinant(F))
            C = self.tensors.right_cauchy_green(F)
            in_elements += self.points.stored_energy(s, b, C, r * r) * self.volume[b]
        return in_elements.sum() + self.pressure.stored_energy(s)

    @ti.func
    def dissipated_energy(self, s):
        """Dissipated by Maxwell dashpots and bulk viscosity so far [J]."""
        in_elements = self.tensors.lane(0.0)
        for b in range(self.blocks):
            in_elements += self.points.dissipation[s, b]
        return in_elements.sum() + self.pressure.dissipated_energy(s)
