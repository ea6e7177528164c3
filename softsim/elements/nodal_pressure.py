"""Averaged nodal pressure, which keeps linear elements from locking.

Bonet and Burton 1998, Commun. Numer. Meth. Engng 14:437-449:
    J_a = current over reference nodal volume,  p_a = kappa (J_a - 1),  element pressure = mean p_a;
a node's volume is an equal share of each of its elements'. It is the gradient of
sum_a V_a (kappa/2) (J_a - 1)^2, so it keeps energy.
Bulk viscosity (the linear term of ABAQUS/Explicit): p_a also gets b1 rho c_d h_a dJ_a/dt.
"""

import numpy as np
import taichi as ti

from softsim import backend
from softsim.elements.material import Material
from softsim.fields import index_field, real_field


@ti.data_oriented
class NodalPressure:
    """Pressure of the nodes of one body.

    cells: (m, corners), numbered within the body. volume: (m,) [m^3]. size: (n,) length of a
    node's surroundings [m]. bulk_viscosity: b1 [-].
    """

    def __init__(
        self,
        cells: np.ndarray,
        volume: np.ndarray,
        size: np.ndarray,
        material: Material,
        bulk_viscosity: float,
        scenarios: int,
    ) -> None:
        self.count, self.corners = len(size), cells.shape[1]
        cell_of_corner = np.repeat(np.arange(len(cells)), self.corners)
        order = np.argsort(cells.ravel(), kind="stable")
        start = np.searchsorted(cells.ravel()[order], np.arange(self.count + 1))
        self.cell_start, self.cell_of_node = index_field(start), index_field(cell_of_corner[order])
        self.lane_bits = backend.lanes().bit_length() - 1
        self.lane_mask = backend.lanes() - 1
        corner_volume = np.repeat(volume / self.corners, self.corners)
        self.volume = real_field(np.bincount(cells.ravel(), corner_volume, minlength=self.count))
        wave_speed = np.sqrt(
            (material.bulk_modulus + 4.0 / 3.0 * material.instantaneous_shear_modulus)
            / material.density
        )
        self.bulk_viscosity = real_field(bulk_viscosity * material.density * wave_speed * size)
        self.bulk_modulus = real_field(np.array([material.bulk_modulus]))
        self.J = real_field(np.ones((scenarios, self.count)))
        self.pressure = real_field(np.zeros((scenarios, self.count)))
        self.dissipation = real_field(np.zeros((scenarios, self.count)))

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        return {"nodal_J": self.J, "bulk_dissipation": self.dissipation}

    @ti.func
    def press(self, s, a, dt, element_volume: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """p_a = kappa (J_a - 1) + viscosity dJ_a/dt from the elements' present volumes."""
        volume = ti.cast(0.0, backend.real)
        for k in range(self.cell_start[a], self.cell_start[a + 1]):
            cell = self.cell_of_node[k]
            volume += element_volume[s, cell >> ti.static(self.lane_bits)][
                cell & ti.static(self.lane_mask)
            ]
        J = volume / (self.corners * self.volume[a])
        dJ = J - self.J[s, a]
        viscous = self.bulk_viscosity[a] * dJ / dt
        self.J[s, a] = J
        self.pressure[s, a] = self.bulk_modulus[0] * (J - 1.0) + viscous
        self.dissipation[s, a] = self.dissipation[s, a] + viscous * dJ * self.volume[a]

    @ti.func
    def stored_energy(self, s):
        """Energy of compression [J]."""
        energy = ti.cast(0.0, backend.real)
        for a in range(self.count):
            dilation = self.J[s, a] - 1.0
            energy += 0.5 * self.bulk_modulus[0] * dilation * dilation * self.volume[a]
        return energy

    @ti.func
    def dissipated_energy(self, s):
        """Dissipated by bulk viscosity so far [J]."""
        energy = ti.cast(0.0, backend.real)
        for a in range(self.count):
            energy += self.dissipation[s, a]
        return energy
