"""Pressures averaged at nodes, so that triangles and tetrahedra do not lock, or one per element.

Bonet and Burton 1998, Commun. Numer. Meth. Engng 14:437-449:
    J_a = current over reference nodal volume,  p_a = kappa (J_a - 1),  element pressure = mean p_a;
a node's volume is an equal share of each of its elements'. It is the gradient of
sum_a V_a (kappa/2) (J_a - 1)^2, so energy is conserved. A quadrilateral or hexahedron does not lock
with a pressure of its own, J_a being its own J (Nagtegaal, Parks, Rice 1974, Comput. Meth. Appl.
Mech. Engng 4:153-177); averaging would make it too soft in bending.
Bulk viscosity (the linear term of ABAQUS/Explicit): p_a also gets b1 rho c_d h_a dJ_a/dt.
"""

import numpy as np
import taichi as ti

from softsim import backend, fields
from softsim.fields import lane_data, lane_field, real_field
from softsim.materials.material import Material
from softsim.nodes import NodeLists


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
