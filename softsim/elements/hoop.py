"""Sections with a hoop direction: their out-of-plane stretch follows from the nodal positions.

Revolved sections are whole rings. A ring section is a cut through a round robot that keeps its hoop
stiffness. The in-plane kinematics of both is that of elements/plane_elements.py.
"""

from dataclasses import dataclass, replace

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import index_field, lane_data, lane_field, real_field
from softsim.compute.nodes import NodeLists, Nodes, by_lane
from softsim.compute.term import Pass, Stage
from softsim.elements.geometry import (
    Geometry,
    Hoop,
    Region,
    edge_lengths,
    quadrature,
    weighted_ends,
)
from softsim.elements.one_point import OnePointElements, padded
from softsim.elements.plane_elements import Across, section_elements

# -------------------------------------------------------------------------------------------------
# Sections revolved about the y axis; x is the radius, forces are those of whole rings.
#
# The hoop stretch is the mean of r / R over the ring's volume, int r dA / int R dA, so with the
# weights w_a = int N_a dA / int R dA
#     F_zz = sum_a w_a r_a,   dF_zz/dr_a = w_a.
# Nodes on the axis stay on it (the builder holds their x).


class RevolvedHoop(Hoop):
    """Hoop stretch of sections revolved about the y axis: F_zz = sum w_a r_a."""

    def stretch(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return F_zz (m,): current over reference radius."""
        return (self.weights(points, cells) * x[cells][:, :, 0]).sum(axis=1)

    def stencil(self, cells: np.ndarray) -> np.ndarray:
        """Return the nodes of the cells (m, corners)."""
        return cells

    def gradient(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return dF_zz/dx / F_zz (m, corners, 2) [1/m]: w_a / F_zz along the radius."""
        gradient = np.zeros((*cells.shape, 2))
        gradient[:, :, 0] = self.weights(points, cells) / self.stretch(points, cells, x)[:, None]
        return gradient

    def curvature(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return zeros (m, corners, corners): F_zz is linear in x."""
        return np.zeros((*cells.shape, cells.shape[1]))

    def weights(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return w_a (m, corners) [1/m]: int N_a dA / int R dA."""
        integrated = quadrature(points, cells)
        around = integrated.integrals(points[cells][:, :, 0]).sum(axis=1, keepdims=True)
        return integrated.integrals(np.ones((1, 1))) / around


@dataclass(frozen=True)
class Axisymmetric(Geometry):
    """Geometry of sections revolved about the y axis: x is the radius, elements are whole rings."""

    name = "axisymmetric"
    dimension = 2

    @property
    def hoop(self) -> RevolvedHoop:
        """Hoop stretch of all elements."""
        return RevolvedHoop()

    def depths(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return the circumference 2 pi r at the nodes (m, corners) [m] (Pappus)."""
        return 2.0 * np.pi * points[cells][:, :, 0]

    @staticmethod
    def facet_volume_and_gradient(x, factor, m):
        """Return the volume of an edge's frustum down to the axis, and its gradient at both ends.

        They are those of whole rings.
        """
        a, b = x[0], x[1]
        third = np.pi / 3.0
        rise, square = a[1] - b[1], a[0] * a[0] + a[0] * b[0] + b[0] * b[0]
        of_a = m.vector([third * (2.0 * a[0] + b[0]) * rise, third * square])
        of_b = m.vector([third * (a[0] + 2.0 * b[0]) * rise, -third * square])
        return third * rise * square, [of_a, of_b]

    def corner_areas(self, x: np.ndarray, edges: np.ndarray) -> np.ndarray:
        """Return the tributary area (k, 2) [m^2] of each end of edges (k, 2): int N_a 2 pi r ds."""
        return (
            np.pi / 3.0 * edge_lengths(x, edges)[:, None] * weighted_ends(2.0 * x[edges][:, :, 0])
        )

    def elements(self, nodes: Nodes, region: Region, bulk_viscosity: float) -> OnePointElements:
        return section_elements(
            nodes, region, bulk_viscosity, RevolvedAcross(region, nodes.scenarios)
        )


class RevolvedAcross(Across):
    """Out-of-plane kinematics of rings: F_zz of each block, and the weights w_a of its nodes."""

    def __init__(self, region: Region, scenarios: int) -> None:
        super().__init__()
        weights = RevolvedHoop().weights(region.points, region.cells)
        self.corner_weight = [lane_data(padded(column)) for column in weights.T]
        self.hoop = lane_field((scenarios, backend.lane_blocks(len(weights))))

    @ti.func
    def measure(self, s, b, x: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Compute F_zz from the radii of the nodes."""
        hoop = self.lane(0.0)
        for c in ti.static(range(len(x))):
            hoop += self.corner_weight[c][b] * x[c]
        self.hoop[s, b] = hoop

    @ti.func
    def stretch(self, s, b):
        return self.hoop[s, b]

    @ti.func
    def tension(self, s, b, S):
        """Return V F_zz S_zz."""
        return self.hoop[s, b] * S.zz

    @ti.func
    def weight(self, b, corner: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return w_a of a node."""
        return self.corner_weight[corner][b]


# -------------------------------------------------------------------------------------------------
# Section of a round robot with hoop stiffness: two strips, opposite sides of its rings.
#
# The hoop stretch of a ring cell is that of the diameters between its corners c and the nodes c'
# opposite them,
#     F_zz = sum_c |x_c - x_c'| / D,   D = sum_c |X_c - X_c'|,
# so its stress pulls at each of them with the tension V F_zz S_zz / D. Cells of single parts have
# F_zz = 1. All corners have equal weights, which gives the mean over triangles and parallelograms.


# -------------------------------------------------------------------------------------------------
# Diameters of the rings of a section: their lengths, and the forces of hoop tension on their ends.
#
#     l = |x_c - x_c'|,  n = (x_c - x_c') / l    of the opposite nodes c and c'.
# The rings of cells around them pull with the tension T, along n on c' and against it on c: two
# forces on one line, so a ring has no resultant force or moment. l and n are computed
# once per diameter, because the cells at both its ends share it.


class Diameters:
    """Diameters of one body, a lane vector of them at a time.

    ends: (k, 2) nodes c, c'. rings: (r, corners) number of the diameter at each corner of each ring
    cell. cell: (r,) its number among `cell_count` lanes of all cells, with padding.

    length: (scenarios, places + 1) [m], at `places` (k,); the last one stays zero: no diameter.
    tension: (scenarios, cell_count + 1) [N] tension of each cell at each of its nodes, to be
    set before `pull`; the last one stays zero.
    """

    def __init__(
        self, nodes: Nodes, ends: np.ndarray, rings: np.ndarray, cell: np.ndarray, cell_count: int
    ) -> None:
        self.nodes, lanes = nodes, backend.lanes()
        cell_of_corner = np.repeat(cell, rings.shape[1])
        self.cells = lists = NodeLists(rings.ravel(), cell_of_corner, len(ends), cell_count)
        self.blocks = lists.blocks
        listed = lists.member.ravel()
        self.places = np.empty(len(ends), dtype=int)
        self.places[listed[listed >= 0]] = np.flatnonzero(listed >= 0)
        # Spare lanes measure the last diameter once more and pull at nothing.
        self.end = index_field(by_lane(ends[listed]))
        owners = np.where(listed[:, None] >= 0, ends[listed], -1)
        self.first_slot = nodes.corner_forces.reserve(by_lane(owners))
        blocks = int(self.blocks)
        self.length = real_field(np.zeros((nodes.scenarios, blocks * lanes + 1)))
        self.direction = [lane_field((nodes.scenarios, blocks)) for _ in range(2)]
        self.tension = real_field(np.zeros((nodes.scenarios, cell_count + 1)))

    @property
    def pad_slot(self) -> int:
        """Index of a length that stays zero."""
        return int(self.blocks) * backend.lanes()

    @ti.func
    def measure(self, s, b, t, dt):
        """Compute lengths and directions of a block."""
        x = self.cells.lane(0.0)
        y = self.cells.lane(0.0)
        for lane in ti.static(range(backend.lanes())):
            d = self.nodes.position[s, self.end[b, 0, lane]]
            d -= self.nodes.position[s, self.end[b, 1, lane]]
            x[lane] = d[0]
            y[lane] = d[1]
        length = ti.sqrt(x * x + y * y)
        inverse = 1.0 / length
        self.direction[0][s, b] = x * inverse
        self.direction[1][s, b] = y * inverse
        for lane in ti.static(range(backend.lanes())):
            self.length[s, b * ti.static(backend.lanes()) + lane] = length[lane]

    @ti.func
    def pull(self, s, b, t, dt):
        """Write the forces -T n and T n on the ends of a block's diameters, T summed over cells."""
        tension = self.cells.sum(self.tension, s, b)
        first = self.first_slot + 2 * b * ti.static(backend.lanes())
        second = first + ti.static(backend.lanes())
        x = tension * self.direction[0][s, b]
        y = tension * self.direction[1][s, b]
        for lane in range(ti.static(backend.lanes())):  # unrolled it takes seconds to compile
            force = ti.Vector([x[lane], y[lane]])
            self.nodes.corner_forces.write(s, first + lane, -force)
            self.nodes.corner_forces.write(s, second + lane, force)


@dataclass(frozen=True, eq=False)
class PairedHoop(Hoop):
    """Hoop stretch of ring cells; F_zz = 1 in single parts.

    The nodes c' are opposite the nodes c of a cell. opposite (n,), is_ring (m,) and the equation of
    F_zz: see RingSection.
    """

    opposite: np.ndarray
    is_ring: np.ndarray

    def stretch(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return F_zz (m,): current over reference diameter; one for single parts."""
        now, before = (self.diameters(at, cells).sum(axis=1) for at in (x, points))
        return now / before

    def stencil(self, cells: np.ndarray) -> np.ndarray:
        """Return the nodes (m, movers) whose motion strains each cell.

        These are its own, and for a ring cell the nodes opposite them; single parts list their own
        twice, without effect.
        """
        return np.hstack([cells, np.where(self.is_ring[:, None], self.opposite[cells], cells)])

    def gradient(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return dF_zz/dx / F_zz (m, movers, 2) [1/m] of these nodes.

        With the unit vector n_c from c' to c it is n_c / sum |x_c - x_c'| on c, the opposite on c'.
        """
        diameters = self.diameters(x, cells)
        direction = (x[cells] - x[self.opposite[cells]]) / diameters[:, :, None]
        gradient = direction / diameters.sum(axis=1)[:, None, None]
        gradient[~self.is_ring] = 0.0
        return np.concatenate([gradient, -gradient], axis=1)

    def curvature(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return the bound of d^2F_zz/dx^2 / F_zz (m, movers, movers) [1/m^2]: a motion that turns
        a diameter lengthens it, by
            d^2 |x_c - x_c'| = |t_c . (u_c - u_c')|^2 / |x_c - x_c'|,  t_c across the diameter;
        taken for every direction.
        """
        diameters = self.diameters(x, cells)
        turning = 1.0 / (diameters * diameters.sum(axis=1, keepdims=True))
        turning[~self.is_ring] = 0.0
        each = turning[:, :, None] * np.eye(cells.shape[1])
        return np.block([[each, -each], [-each, each]])

    def diameters(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return |x_c - x_c'| of the nodes (m, corners) [m].

        It is one metre for single parts, which may lie on the axis.
        """
        lengths = np.linalg.norm(x[cells] - x[self.opposite[cells]], axis=2)
        return np.where(self.is_ring[:, None], lengths, 1.0)


@dataclass(frozen=True, eq=False)
class RingSection(Geometry):
    """Geometry of a section of a robot that is round about its axis.

    The section consists of two strips, opposite sides of the same rings of skin, with single fins
    on them. At rest the axis is parallel to x.

    A full ring has hoop tension, a plane section has none. Opposite places are a diameter apart, so
    for a ring cell with the opposite nodes c' of its nodes c
        F_zz = sum_c |x_c - x_c'| / sum_c |X_c - X_c'|.
    The assumption is that rings stay round with these diameters, in the section's plane. A ring
    that moves or turns as a whole is not stretched. A strip represents `sector`
    [rad] of the ring's circumference; single parts on it represent a `thickness` [m] of that, in
    plane strain.

    opposite: node across the axis of each node (n,), numbered within the body. is_ring (m,): True
    for ring cells, in the order of a region's cells.
    """

    thickness: float
    sector: float
    opposite: np.ndarray
    is_ring: np.ndarray
    name = "ring_section"
    dimension = 2

    @property
    def hoop(self) -> PairedHoop:
        """Hoop stretch of the ring cells."""
        return PairedHoop(self.opposite, self.is_ring)

    def of_cells(self, numbers: np.ndarray, thickness: float | None) -> "RingSection":
        """Return the geometry of some cells, with another thickness [m] of single ones if given."""
        depth = self.thickness if thickness is None else thickness
        return replace(self, thickness=depth, is_ring=self.is_ring[numbers])

    def bounds_with(self, other: Geometry) -> bool:
        """Return True if both geometries have the same rings."""
        return isinstance(other, RingSection) and other.opposite is self.opposite

    def depths(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return the depth (m, corners) [m]: sector r of rings (Pappus), thickness of others."""
        radius = 0.5 * self.hoop.diameters(points, cells)
        return np.where(self.is_ring[:, None], self.sector * radius, self.thickness)

    def pressed(self, edges: np.ndarray, first_node: int) -> np.ndarray:
        """Return the nodes (k, 4) that a pressure on edges (k, 2) acts on.

        These are the ends of the edges and the nodes opposite, because the radius is half the
        distance between them.
        """
        return np.column_stack([edges, first_node + self.opposite[edges - first_node]])

    @property
    def facet_factor(self) -> float:
        """Sector [rad]."""
        return self.sector

    @staticmethod
    def facet_volume_and_gradient(x, sector, m):
        """Return the volume between an edge and the axis over the sector, and its gradient.

        It is that of frusta, sector/6 h (a^2 + a b + b^2) with radii a, b and the length h along
        the axis, in terms that turn with the section, so that its gradient has no moment: with the
        edge D = x_b - x_a, the diameters d_a = x_a - x_a' and d_b, and c = D x d = D_x d_y - D_y
        d_x it is
            V = sector/24 [c_a (|d_a| + |d_b|/2) + c_b (|d_b| + |d_a|/2)],
        since 2 a = |d_a| and 2 h a = c_a, or with d_b and b, where the diameters are parallel.
        """
        D, d_a, d_b = x[1] - x[0], x[0] - x[2], x[1] - x[3]
        l_a, l_b = m.norm(d_a), m.norm(d_b)
        c_a, c_b = D[0] * d_a[1] - D[1] * d_a[0], D[0] * d_b[1] - D[1] * d_b[0]
        part = sector / 24.0
        weight_a, weight_b = part * (l_a + 0.5 * l_b), part * (l_b + 0.5 * l_a)
        normal = m.vector([-D[1], D[0]])  # d(D x d)/dd
        of_edge = weight_a * d_a + weight_b * d_b
        e = m.vector([of_edge[1], -of_edge[0]])  # d(D x d)/dD
        a = weight_a * normal + part * (c_a + 0.5 * c_b) / l_a * d_a
        b = weight_b * normal + part * (c_b + 0.5 * c_a) / l_b * d_b
        return c_a * weight_a + c_b * weight_b, [a - e, b + e, -a, -b]

    def corner_areas(self, x: np.ndarray, edges: np.ndarray) -> np.ndarray:
        """Return the tributary area (k, 2) [m^2] of each end of rings' edges (k, 2).

        It is int N_a sector r ds.
        """
        diameters = np.linalg.norm(x[edges] - x[self.opposite[edges]], axis=2)
        return self.sector / 6.0 * edge_lengths(x, edges)[:, None] * weighted_ends(diameters)

    def elements(self, nodes: Nodes, region: Region, bulk_viscosity: float) -> OnePointElements:
        goes_around = self.is_ring.any()
        across = RingAcross(nodes, region, self.hoop) if goes_around else Across()
        return section_elements(nodes, region, bulk_viscosity, across)


class RingAcross(Across):
    """Out-of-plane kinematics of ring cells and single cells."""

    def __init__(self, nodes: Nodes, region: Region, hoop: PairedHoop) -> None:
        super().__init__()
        cells, is_ring = region.cells, hoop.is_ring
        self.corners = cells.shape[1]
        # Both nodes of a diameter have its number: each is named after its smaller node.
        name = np.minimum(cells, hoop.opposite[cells])[is_ring]
        first, number = np.unique(name, return_inverse=True)
        number = number.reshape(name.shape)
        ends = region.first_node + np.stack([first, hoop.opposite[first]], axis=1)
        blocks = backend.lane_blocks(len(cells))
        lanes = blocks * backend.lanes()
        self.diameters = Diameters(nodes, ends, number, np.flatnonzero(is_ring), lanes)
        place = np.full(cells.shape, self.diameters.pad_slot)
        place[is_ring] = self.diameters.places[number]
        self.place = index_field(by_lane(padded(place)))
        self.hoop = lane_field((nodes.scenarios, blocks))
        # 1 / D of ring cells, and F_zz of the others.
        at_rest = hoop.diameters(region.points, cells).sum(axis=1)
        slope = np.divide(1.0, at_rest, out=np.zeros(len(cells)), where=is_ring)
        self.hoop_slope = lane_data(padded(slope))
        self.single = lane_data(padded(np.where(is_ring, 0.0, 1.0)))

    def passes(self) -> dict[Stage, list[Pass]]:
        """Return the passes that measure diameters before the elements and load them afterwards."""
        diameters = self.diameters
        blocks = int(diameters.blocks)
        return {
            Stage.MEASURE: [Pass("elements", blocks, (diameters.measure,))],
            Stage.PULL: [Pass("elements", blocks, (diameters.pull,))],
        }

    @ti.func
    def measure(self, s, b, x: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Compute F_zz from the diameters at the nodes."""
        diameters = self.lane(0.0)
        for lane in ti.static(range(backend.lanes())):
            for c in ti.static(range(self.corners)):
                diameters[lane] += self.diameters.length[s, self.place[b, c, lane]]
        self.hoop[s, b] = self.single[b] + diameters * self.hoop_slope[b]

    @ti.func
    def stretch(self, s, b):
        return self.hoop[s, b]

    @ti.func
    def tension(self, s, b, S):
        """Store the tension of the diameters, V F_zz S_zz / D, and return zero for the nodes."""
        tension = self.hoop[s, b] * S.zz * self.hoop_slope[b]
        for lane in ti.static(range(backend.lanes())):
            self.diameters.tension[s, b * ti.static(backend.lanes()) + lane] = tension[lane]
        return self.lane(0.0)
