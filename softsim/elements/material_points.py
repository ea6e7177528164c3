"""The material at the one integration point of each element: law and Maxwell branches.

Maxwell branches (Linder, Tkachuk, Miehe 2011, J. Mech. Phys. Solids 59:2134-2156): each holds a
viscous metric A, at rest the inverse of C_bar:
    energy   mu/2 (A : C_bar - 3 - ln det A),    dA/dt = (C_bar^-1 - A) / tau,
    dissipation  mu/(2 tau) (A : C_bar + A^-1 : C_bar^-1 - 6) >= 0.
After a sudden stretch the branch stress decays as exp(-t / tau) exactly.

Throughout: C = F^T F, r2 = J^(-2/3), C_bar = r2 C.
"""

from typing import Any

import numpy as np
import taichi as ti

from softsim import backend, fields
from softsim.elements.material import Material
from softsim.fields import lane_data, lane_field, real_field


@ti.data_oriented
class MaterialPoints:
    """Points of `blocks` lane vectors of elements; `tensors`: PlaneTensors or SpaceTensors."""

    def __init__(self, material: Material, tensors: Any, scenarios: int, blocks: int) -> None:
        self.material, self.law, self.tensors = material, material.law, tensors
        self.energy_density = ti.func(material.law.energy_density)
        self.energy_slope = ti.func(material.law.energy_slope)
        self.constants = real_field(np.array(material.law.constants))
        self.branch_count = len(material.branches)
        self.branch_modulus = real_field(np.array([b.shear_modulus for b in material.branches]))
        self.relaxation_time = real_field(np.array([b.relaxation_time for b in material.branches]))
        self.decay = real_field(np.ones(self.branch_count))
        self.mean_distance = real_field(np.ones(self.branch_count))
        at_rest = [float(name[0] == name[1]) for name in tensors.symmetric_names]
        shape = (scenarios, blocks * backend.lanes())
        self.metric = [
            [lane_data(np.full(shape, value)) for value in at_rest]
            for _ in range(self.branch_count)
        ]
        self.dissipation = lane_field((scenarios, blocks))

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        fields = {"branch_dissipation": self.dissipation}
        for k, metric in enumerate(self.metric):
            for name, component in zip(self.tensors.symmetric_names, metric, strict=True):
                fields[f"metric_{k}_{name}"] = component
        return fields

    def set_increment(self, dt: float) -> None:
        """Take the time step [s]: exp(-dt / tau) of each branch."""
        if not self.material.branches:
            return
        ratio = dt / np.array([b.relaxation_time for b in self.material.branches])
        fields.write(self.decay, np.exp(-ratio))
        # Dissipation is sampled at the end of an increment; over it the square of the metric's
        # distance from rest was larger by this factor on the mean.
        fields.write(self.mean_distance, np.expm1(2.0 * ratio) / (2.0 * ratio))

    @ti.func
    def stress_metric(self, s, b, C, r2):
        """M = 2 dW/dI1_bar I + sum mu A, the branches having relaxed by one increment."""
        M = self.tensors.isotropic(2.0 * self._slope(r2 * self._trace(C)))
        inverse = self._inverse_isochoric(C, r2)
        one = self.tensors.lane(1.0)
        for k in ti.static(range(self.branch_count)):
            e = self.decay[k]
            A = self.tensors.mixed(
                e, self.tensors.stored(self.metric[k], s, b), 1.0 - e, inverse
            )  # exact for a constant C_bar
            self.tensors.store(self.metric[k], s, b, A)
            M = self.tensors.mixed(one, M, self.branch_modulus[k], A)
        return M

    @ti.func
    def stored_energy(self, s, b, C, r2):
        """Energy density of law and Maxwell springs [J/m^3]."""
        w = self.energy_density(r2 * self._trace(C), self._constants())
        for k in ti.static(range(self.branch_count)):
            A = self.tensors.stored(self.metric[k], s, b)
            stretch = r2 * self.tensors.contraction(A, C)
            det_A = self.tensors.symmetric_determinant(A)
            w += 0.5 * self.branch_modulus[k] * (stretch - 3.0 - ti.log(det_A))
        return w

    @ti.func
    def dissipate(self, s, b, C, r2, volume, dt):
        """Add what the Maxwell branches dissipate in dt, a few increments long."""
        inverse = self._inverse_isochoric(C, r2)
        power = self.tensors.lane(0.0)
        for k in ti.static(range(self.branch_count)):
            A = self.tensors.stored(self.metric[k], s, b)
            stretch = r2 * self.tensors.contraction(A, C)
            back = self.tensors.contraction(
                self.tensors.cofactor(A), inverse
            ) / self.tensors.symmetric_determinant(A)
            rate = self.branch_modulus[k] / (2.0 * self.relaxation_time[k])
            power += self.mean_distance[k] * rate * (stretch + back - 6.0)
        self.dissipation[s, b] = self.dissipation[s, b] + dt * power * volume

    @ti.func
    def _trace(self, C):
        return C.xx + C.yy + C.zz

    @ti.func
    def _inverse_isochoric(self, C, r2):
        """C_bar^-1 = J^(2/3) C^-1 = J^(-4/3) cof C."""
        factor = r2 * r2
        cofactor = self.tensors.cofactor(C)
        return self.tensors.mixed(factor, cofactor, self.tensors.lane(0.0), cofactor)

    @ti.func
    def _slope(self, I1_bar):
        return self.energy_slope(I1_bar, self._constants())

    @ti.func
    def _constants(self):
        return ti.Vector([self.constants[i] for i in range(len(self.law.constants))])
