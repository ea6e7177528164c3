"""Base class of elements with one integration point.

An increment has three passes at least: `deform`, `press`, `stress_corners`.
Tensors are written in the basis of each element's edges, see elements/kinematics.py.
"""

from typing import Any

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import Number, index_field, lane_data, lane_field, real_field
from softsim.compute.nodes import NodeLists, Nodes, by_lane
from softsim.compute.term import Pass, Stage, Term
from softsim.elements.geometry import Region
from softsim.elements.kinematics import inverse_cube_root
from softsim.elements.material_points import MaterialPoints
from softsim.materials.material import Material

# -------------------------------------------------------------------------------------------------
# Pressures averaged at nodes, so that triangles and tetrahedra do not lock, or one per element.
#
# Bonet and Burton 1998, Commun. Numer. Meth. Engng 14:437-449:
#     J_a = current over reference nodal volume,  p_a = kappa (J_a - 1),  element pressure = mean
#     p_a;
# a node's volume is an equal share of each of its elements'. It is the gradient of
# sum_a V_a (kappa/2) (J_a - 1)^2, so energy is conserved. A quadrilateral or hexahedron does not
# lock with a pressure of its own, J_a being its own J (Nagtegaal, Parks, Rice 1974, Comput. Meth.
# Appl. Mech. Engng 4:153-177); averaging would make it too soft in bending. Bulk viscosity (the
# linear term of ABAQUS/Explicit): p_a also gets b1 rho c_d h_a dJ_a/dt.


class PressurePoints:
    """Pressures of one region of a body.

    members: (m, k) numbers of the pressures of each element, volume: (m,) [m^3]. size (n,) [m]:
    length of the area or volume of a pressure, zero for nodes outside the region. bulk_viscosity:
    b1 [-]. element_count: number of lanes, with padding.
    """

    def __init__(
        self,
        members: np.ndarray,
        volume: np.ndarray,
        size: np.ndarray,
        material: Material,
        bulk_viscosity: float,
        scenarios: int,
        element_count: int,
    ) -> None:
        self.lane = backend.lane_vector()
        count, shares = len(size), members.shape[1]
        element = np.repeat(np.arange(len(members)), shares)
        self.elements_of = lists = NodeLists(
            members.ravel(), element, count, pad_entry=element_count
        )
        whole = np.bincount(members.ravel(), np.repeat(volume / shares, shares), minlength=count)
        share = np.divide(1.0, shares * whole, np.zeros(count), where=whole > 0.0)
        viscosity = bulk_viscosity * material.impedance * size
        self.volume = lane_data(lists.by_block(whole))
        self.share_over_volume = lane_data(lists.by_block(share))
        self.bulk_viscosity = lane_data(lists.by_block(viscosity))
        self.bulk_modulus = real_field(np.array([material.bulk_modulus]))
        blocks = int(lists.blocks)
        self.J = lane_data(np.ones((scenarios, blocks * backend.lanes())))
        self.viscous = lane_field((scenarios, blocks))  # pressure of the last increment
        self.dissipation = lane_field((scenarios, blocks))
        self.pressure = real_field(np.zeros((scenarios, count)))

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return {
            "pressure_J": self.J,
            "viscous_pressure": self.viscous,
            "bulk_dissipation": self.dissipation,
        }

    def forget_dissipation(self, scenario: int) -> None:
        """Reset the dissipated energy of a scenario."""
        fields.write_row(self.dissipation, scenario, 0.0)

    @ti.func
    def press(self, s, b, dt, element_volume: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Compute p_a = kappa (J_a - 1) + viscosity dJ_a/dt of a block of pressures.

        element_volume: current volumes of the elements.
        """
        J = self.elements_of.sum(element_volume, s, b) * self.share_over_volume[b]
        dJ = J - self.J[s, b]
        viscous = self.bulk_viscosity[b] * dJ * (1.0 / dt)
        p = self.bulk_modulus[0] * (J - 1.0) + viscous
        # Work over the way since the last increment, trapezoidal.
        work = 0.5 * (self.viscous[s, b] + viscous) * dJ * self.volume[b]
        self.dissipation[s, b] = self.dissipation[s, b] + work
        self.J[s, b], self.viscous[s, b] = J, viscous
        for lane in ti.static(range(backend.lanes())):
            a = self.elements_of.node[b, lane]
            if a >= 0:
                self.pressure[s, a] = p[lane]

    @ti.func
    def stored_energy(self, s, part):
        """Return the energy of compression [J]."""
        energy = self.lane(0.0)
        for b in range(
            self.elements_of.blocks.first(part), self.elements_of.blocks.first(part + 1)
        ):
            dilation = self.J[s, b] - 1.0
            energy += 0.5 * self.bulk_modulus[0] * dilation * dilation * self.volume[b]
        return energy.sum()

    @ti.func
    def dissipated_energy(self, s, part):
        """Return the energy dissipated by bulk viscosity so far [J]."""
        energy = self.lane(0.0)
        for b in range(
            self.elements_of.blocks.first(part), self.elements_of.blocks.first(part + 1)
        ):
            energy += self.dissipation[s, b]
        return energy.sum()


class OnePointElements(Term):
    """Force term of all elements of one region.

    nodes: the shared nodes. metric: PlaneMetric or SpaceMetric. bulk_viscosity: b1 [-].
    """

    def __init__(self, nodes: Nodes, region: Region, metric: Any, bulk_viscosity: float) -> None:
        scenarios, lanes = nodes.scenarios, backend.lanes()
        cells, first_node = region.cells, region.first_node
        self.nodes, self.metric = nodes, metric
        self.corners = cells.shape[1]
        blocks = backend.lane_blocks(len(cells))
        self.blocks = Number(blocks)

        # Padding repeats the last cell with zero volume and sends its forces nowhere.
        corners, volume = padded(cells), region.volumes
        self.corner = index_field(by_lane(corners + first_node))
        rest_edges = padded(self.rest_edges(region))
        determinant = np.linalg.det(rest_edges)
        self.inverse_determinant = lane_data(1.0 / determinant)  # of the edges at rest
        self.volume = lane_data(followed_by_zeros(volume))
        owner = np.where(np.arange(len(corners))[:, None] < len(cells), corners + first_node, -1)
        # Slots of a block: its lanes for corner 0, for corner 1, ...
        self.first_slot = nodes.corner_forces.reserve(by_lane(owner))

        self.points = MaterialPoints(region.material, metric, rest_edges, scenarios)
        self.pressed = index_field(by_lane(padded(region.pressure_points)))
        self.shares = region.pressure_points.shape[1]
        self.pressure = PressurePoints(
            region.pressure_points,
            volume,
            region.pressure_sizes,
            region.material,
            bulk_viscosity,
            scenarios,
            blocks * lanes,
        )

        d = region.geometry.dimension
        # Components of the first edge, of the second, ...
        self.edge = [lane_field((scenarios, blocks)) for _ in range(d * d)]
        # One more than there are elements: it stays zero, for the padding of the pressures' lists.
        self.current_volume = real_field(np.zeros((scenarios, blocks * lanes + 1)))

    def passes(self) -> dict[Stage, list[Pass]]:
        pressures, blocks = int(self.pressure.elements_of.blocks), int(self.blocks)
        return {
            Stage.MOVE: [Pass("elements", blocks, (self.deform,)), *self.points.passes()],
            Stage.PRESS: [Pass("elements", pressures, (self.press,))],
            Stage.STRESS: [Pass("elements", blocks, (self.stress_corners,))],
        }

    def state_fields(self) -> dict[str, ti.Field]:
        return self.points.state_fields() | self.pressure.state_fields()

    def set_time_increment(self, scenario: int, dt: float) -> None:
        self.points.set_time_increment(scenario, dt)

    def forget_dissipation(self, scenario: int) -> None:
        self.points.forget_dissipation(scenario)
        self.pressure.forget_dissipation(scenario)

    def rest_edges(self, region: Region) -> np.ndarray:
        """Return the basis D_i (m, d, d) [m] of each element at rest.

        Its rows are the edges from node 0.
        """
        corners = region.points[region.cells]
        edges: np.ndarray = corners[:, 1:] - corners[:, :1]
        return edges

    # Of the element itself: `deform(s, b, t, dt)` stores edges and the present volumes of a block,
    # `stretch(s, b)` gives C, J of them, `stress_corners(s, b, t, dt)` writes corner forces.
    deform: Any
    stretch: Any
    stress_corners: Any

    # --- one increment, pass by pass; deform comes first, stress_corners last --------------------

    @ti.func
    def corner_component(self, s, b, corner: ti.template(), k: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return coordinate k of one node of each element of a block."""
        x = self.metric.lane(0.0)
        for lane in ti.static(range(backend.lanes())):
            x[lane] = self.nodes.position[s, self.corner[b, corner, lane]][k]
        return x

    @ti.func
    def keep_volume(self, s, b, J):
        """Store the current volumes J V of block b for its pressures."""
        volume = J * self.volume[b]
        for lane in ti.static(range(backend.lanes())):
            self.current_volume[s, b * ti.static(backend.lanes()) + lane] = volume[lane]

    @ti.func
    def press(self, s, b, t, dt):
        """Compute a block of pressures."""
        self.pressure.press(s, b, dt, self.current_volume)

    @ti.func
    def average_pressure(self, s, b):
        """Return the element pressure, the mean of its pressure points (positive in tension)."""
        p = self.metric.lane(0.0)
        for lane in ti.static(range(backend.lanes())):
            for c in ti.static(range(self.shares)):
                p[lane] += self.pressure.pressure[s, self.pressed[b, c, lane]]
        return p * (1.0 / self.shares)

    @ti.func
    def stress(self, s, b):
        """Return V S, S = J^(-2/3) (M - (C : M) / 3 C^-1) + p J C^-1, M of `fictitious_stress`."""
        C, J = self.stretch(s, b)
        r = inverse_cube_root(J)
        r2 = r * r
        r3 = r2 * r
        J2_inverse_C = self.points.cofactor(b, C)  # J^2 C^-1
        M = self.points.fictitious_stress(s, b, C, r2)
        trace = self.metric.contraction(C, M) * (1.0 / 3.0)
        h = r3 * (self.average_pressure(s, b) - trace * (r3 * r2))
        volume = self.volume[b]
        return self.metric.mixed(volume * r2, M, volume * h, J2_inverse_C)

    @ti.func
    def push_corner(self, s, b, corner: ti.template(), k: ti.template(), force):  # type: ignore[valid-type]  # Taichi wants an instance
        """Write component k of the forces (a lane vector) on one node of a block to its slots."""
        first = self.first_slot + (self.corners * b + corner) * ti.static(backend.lanes())
        for lane in ti.static(range(backend.lanes())):
            self.nodes.corner_forces.component[k][s, first + lane] = force[lane]

    # --- what observers ask ----------------------------------------------------------------------

    @ti.func
    def stored_energy(self, s, part):
        """Return the energy [J] of the law, Maxwell springs, compression and hourglass modes."""
        in_elements = self.metric.lane(0.0)
        for b in range(self.blocks.first(part), self.blocks.first(part + 1)):
            C, J = self.stretch(s, b)
            r = inverse_cube_root(J)
            in_elements += self.points.stored_energy(s, b, C, r * r) * self.volume[b]
        return (
            in_elements.sum()
            + self.pressure.stored_energy(s, part)
            + self.hourglass_energy(s, part)
        )

    @ti.func
    def hourglass_energy(self, s, part):
        """Return the energy [J] in hourglass modes (ABAQUS's ALLAE), zero without such modes."""
        return ti.cast(0.0, backend.real)

    @ti.func
    def dissipated_energy(self, s, part):
        """Return the energy [J] dissipated by friction (zero) and by viscosity.

        The viscous part is that of Maxwell dashpots and bulk viscosity.
        """
        in_elements = self.metric.lane(0.0)
        for b in range(self.blocks.first(part), self.blocks.first(part + 1)):
            in_elements += self.points.dissipation(s, b) * self.volume[b]
        viscous = in_elements.sum() + self.pressure.dissipated_energy(s, part)
        return ti.Vector([0.0, viscous + self.hourglass_dissipation(s, part)])

    @ti.func
    def damage_energy(self, s, part):
        """Return the energy [J] dissipated by the softening of the material (ABAQUS's ALLDMD)."""
        in_elements = self.metric.lane(0.0)
        if ti.static(self.points.softens):
            for b in range(self.blocks.first(part), self.blocks.first(part + 1)):
                in_elements += self.points.damage(s, b) * self.volume[b]
        return in_elements.sum()

    @ti.func
    def hourglass_dissipation(self, s, part):
        """Return the energy [J] that hourglass modes have dissipated so far."""
        return ti.cast(0.0, backend.real)


def padded(values: np.ndarray) -> np.ndarray:
    """Return per-element values (m, ...), the last one repeated up to whole lane vectors."""
    padding = backend.lane_blocks(len(values)) * backend.lanes() - len(values)
    return np.concatenate([values, np.repeat(values[-1:], padding, axis=0)])


def lane_tables(values: np.ndarray) -> ti.MatrixField:
    """Return a field [block, ...] of values (m, ...) of whole lane vectors of elements.

    One field replaces many, because Taichi allows about a thousand components.
    """
    lanes = backend.lanes()
    blocks = np.moveaxis(values.reshape(-1, lanes, *values.shape[1:]), 1, -1)
    return lane_data(np.ascontiguousarray(blocks).reshape(*blocks.shape[:-2], -1))


def followed_by_zeros(values: np.ndarray) -> np.ndarray:
    """Return per-element values (m, ...), padded with zeros up to whole lane vectors."""
    result = padded(values)
    result[len(values) :] = 0.0
    return result
