"""The material at the one integration point of each element: law and Maxwell branches.

Maxwell branches (Linder, Tkachuk, Miehe 2011, J. Mech. Phys. Solids 59:2134-2156): each holds a
viscous metric A, at rest the inverse of C_bar:
    energy   mu/2 (A : C_bar - 3 - ln det A),    dA/dt = (C_bar^-1 - A) / tau,
    dissipation  mu/(2 tau) (A : C_bar + A^-1 : C_bar^-1 - 6) >= 0.
After a sudden stretch the branch stress decays as exp(-t / tau) exactly.

Throughout: C = F^T F, r2 = J^(-2/3), C_bar = r2 C. Tensors are in the basis of each element's edges
(elements/metric.py), in which the identity, A at rest, is a field of its own.
"""

from typing import Any

import numpy as np
import taichi as ti

from softsim import backend, fields
from softsim.elements.material import Material
from softsim.fields import lane_data, lane_field, real_field


@ti.data_oriented
class MaterialPoints:
    """Points of elements whose identity is `identity` (m, components), m whole lane vectors.

    metric: PlaneMetric or SpaceMetric.
    """

    def __init__(
        self, material: Material, metric: Any, identity: np.ndarray, scenarios: int
    ) -> None:
        self.material, self.law, self.metric = material, material.law, metric
        blocks = backend.lane_blocks(len(identity))
        self.energy_density = ti.func(material.law.energy_density)
        self.energy_slope = ti.func(material.law.energy_slope)
        self.constants = real_field(np.array(material.law.constants))
        self.branch_count = len(material.branches)
        self.branch_modulus = real_field(np.array([b.shear_modulus for b in material.branches]))
        self.relaxation_time = real_field(np.array([b.relaxation_time for b in material.branches]))
        self.decay = real_field(np.ones((scenarios, self.branch_count)))
        self.mean_distance = real_field(np.ones((scenarios, self.branch_count)))
        self.identity = [lane_data(component[None]) for component in identity.T]
        at_rest = np.repeat(identity.T[:, None], scenarios, axis=1)
        self.viscous_metric = [
            [lane_data(component) for component in at_rest] for _ in range(self.branch_count)
        ]
        self.dissipation = lane_field((scenarios, blocks))

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        kept = {"branch_dissipation": self.dissipation}
        for k, metric in enumerate(self.viscous_metric):
            for name, component in zip(self.metric.components, metric, strict=True):
                kept[f"metric_{k}_{name}"] = component
        return kept

    def set_increment(self, scenario: int, dt: float) -> None:
        """Take the time step [s] of a scenario: exp(-dt / tau) of each branch."""
        if not self.material.branches:
            return
        ratio = dt / np.array([b.relaxation_time for b in self.material.branches])
        fields.write_row(self.decay, scenario, np.exp(-ratio))
        # Dissipation is sampled at the end of an increment; over it the square of the metric's
        # distance from rest was larger by this factor on the mean.
        fields.write_row(self.mean_distance, scenario, np.expm1(2.0 * ratio) / (2.0 * ratio))

    @ti.func
    def cofactor(self, b, C):
        """J^2 C^-1: the components' determinant is J^2 / det I."""
        adjugate = self.metric.adjugate(C)
        return self.metric.scaled(self._identity_determinant(b), adjugate)

    @ti.func
    def stress_metric(self, s, b, C, J2_inverse_C, r2):
        """M = 2 dW/dI1_bar I + sum mu A, the branches having relaxed by one increment."""
        identity = self._identity(b)
        slope = self._slope(r2 * self.metric.contraction(C, identity))
        M = self.metric.scaled(2.0 * slope, identity)
        one = self.metric.lane(1.0)
        for k in ti.static(range(self.branch_count)):
            e = self.decay[s, k]
            # Exact for a constant C_bar, whose inverse is r2^2 J^2 C^-1.
            A = self.metric.mixed(
                e, self.metric.stored(self.viscous_metric[k], s, b),
                (1.0 - e) * (r2 * r2), J2_inverse_C,
            )  # fmt: skip
            self.metric.store(self.viscous_metric[k], s, b, A)
            M = self.metric.mixed(one, M, self.branch_modulus[k], A)
        return M

    @ti.func
    def stored_energy(self, s, b, C, r2):
        """Energy density of law and Maxwell springs [J/m^3]."""
        I1_bar = r2 * self.metric.contraction(C, self._identity(b))
        w = self.energy_density(I1_bar, self._constants())
        for k in ti.static(range(self.branch_count)):
            A = self.metric.stored(self.viscous_metric[k], s, b)
            stretch = r2 * self.metric.contraction(C, A)
            det_A = self.metric.determinant(A) / self._identity_determinant(b)
            w += 0.5 * self.branch_modulus[k] * (stretch - 3.0 - ti.log(det_A))
        return w

    @ti.func
    def dissipate(self, s, b, C, r2, volume, dt):
        """Add what the Maxwell branches dissipate in dt, a few increments long."""
        inverse = self.metric.scaled(r2 * r2, self.cofactor(b, C))  # of C_bar
        power = self.metric.lane(0.0)
        for k in ti.static(range(self.branch_count)):
            A = self.metric.stored(self.viscous_metric[k], s, b)
            stretch = r2 * self.metric.contraction(C, A)
            back = self.metric.contraction(
                self.metric.adjugate(A), inverse
            ) / self.metric.determinant(A)
            rate = self.branch_modulus[k] / (2.0 * self.relaxation_time[k])
            power += self.mean_distance[s, k] * rate * (stretch + back - 6.0)
        self.dissipation[s, b] = self.dissipation[s, b] + dt * power * volume

    @ti.func
    def _identity(self, b):
        return self.metric.stored(self.identity, 0, b)

    @ti.func
    def _identity_determinant(self, b):
        return self.metric.determinant(self._identity(b))

    @ti.func
    def _slope(self, I1_bar):
        return self.energy_slope(I1_bar, self._constants())

    @ti.func
    def _constants(self):
        return ti.Vector([self.constants[i] for i in range(len(self.law.constants))])
