"""Material at the integration point of each element: law and Maxwell branches.

Each Maxwell branch (Linder, Tkachuk, Miehe 2011, J. Mech. Phys. Solids 59:2134-2156) has a viscous
metric A, at rest the inverse of C_bar:
    energy   mu/2 (A : C_bar - 3 - ln det A),    dA/dt = (C_bar^-1 - A) / tau,
    dissipation  mu/(2 tau) (A : C_bar + A^-1 : C_bar^-1 - 6) >= 0.
After a sudden stretch the branch stress decays as exp(-t / tau). The increments in
which a branch relaxes follow from elements/relaxation.py; the sum of mu A is stored in between.

Energy balance: the force on a metric is -d(energy)/dA = mu/2 (A^-1 - C_bar), so a branch has
dissipated
    mu/2 (ln det A - integral of C_bar : dA).
ln det A is that of the present, the integral is summed by the trapezoidal rule in every increment
in which A changes, as the work of central differences is: for small strains the books then close
to round-off, whatever the relaxation time is.

Throughout: C = F^T F, r2 = J^(-2/3), C_bar = r2 C. Tensors are in the basis of each element's edges
(elements/metric.py), in which the identity, A at rest, is a field of its own.
"""

from typing import Any

import numpy as np
import taichi as ti

from softsim import backend, fields
from softsim.elements.isochoric import isochoric
from softsim.elements.relaxation import Relaxation
from softsim.fields import lane_data, lane_field, real_field
from softsim.materials.material import Material
from softsim.term import Pass


class MaterialPoints:
    """Material points of the elements of a region.

    rest_edges (m, edges, d): edges at rest, m whole lane vectors.

    metric: PlaneMetric or SpaceMetric.
    """

    def __init__(
        self, material: Material, metric: Any, rest_edges: np.ndarray, scenarios: int
    ) -> None:
        self.material, self.metric = material, metric
        blocks = backend.lane_blocks(len(rest_edges))
        identity = metric.identity(rest_edges)
        self.elastic = isochoric(material.law, metric)
        self.branch_count = len(material.branches)
        self.branch_modulus = real_field(np.array([b.shear_modulus for b in material.branches]))
        self.identity = [lane_data(component[None]) for component in identity.T]
        if self.branch_count:
            times = np.array([b.relaxation_time for b in material.branches])
            self.relaxation = Relaxation(times, scenarios)
            # Of branch k of block b at [s, branch_count b + k].
            self.viscous_metric = self._alike(
                _repeated_by_block(identity, self.branch_count), scenarios
            )
            whole = sum(b.shear_modulus for b in material.branches)
            self.branch_stress = self._alike(whole * identity, scenarios)  # sum mu A
            self.last_C_bar = self._alike(metric.stretch_at_rest(rest_edges), scenarios)
            # Integral of C_bar : dB, B = sum mu A [J/m^3].
            self.metric_work = lane_field((scenarios, blocks))

    @staticmethod
    def _alike(components: np.ndarray, scenarios: int) -> list[ti.MatrixField]:
        """Return fields of the components (m, components) of a tensor, equal in all scenarios."""
        each = np.repeat(components.T[:, None], scenarios, axis=1)
        return [lane_data(component) for component in each]

    def passes(self) -> list[Pass]:
        """Return the passes that an increment needs before the stress."""
        return [Pass("elements", 1, (self.relaxation.tick,))] if self.branch_count else []

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        if not self.branch_count:
            return {}
        kept = {"metric_work": self.metric_work}
        kept |= self.relaxation.state_fields()
        tensors = {
            "last_C_bar": self.last_C_bar,
            "metric": self.viscous_metric,
            "branch_stress": self.branch_stress,
        }
        for tensor, fields_of in tensors.items():
            for name, component in zip(self.metric.components, fields_of, strict=True):
                kept[f"{tensor}_{name}"] = component
        return kept

    def set_time_increment(self, scenario: int, dt: float) -> None:
        """Set the time step [s] of a scenario; infinite: branches relax at once."""
        if self.branch_count:
            self.relaxation.set_time_increment(scenario, dt)

    def forget_dissipation(self, scenario: int) -> None:
        """Reset the dissipation of a scenario whose branches have relaxed: ln det A = 0."""
        if self.branch_count:
            fields.write_row(self.metric_work, scenario, 0.0)

    @ti.func
    def cofactor(self, b, C):
        """Return J^2 C^-1; the components' determinant is J^2 / det I."""
        adjugate = self.metric.adjugate(C)
        return self.metric.scaled(self._identity_determinant(b), adjugate)

    @ti.func
    def fictitious_stress(self, s, b, C, r2):
        """Return M = 2 dW/dC_bar + sum mu A [Pa] after relaxing the branches that are due."""
        M = self.elastic.stress(C, r2, self._identity(b))
        if ti.static(self.branch_count > 0):
            C_bar = self.metric.scaled(r2, C)
            last = self.metric.stored(self.last_C_bar, s, b)
            for k in ti.static(range(self.branch_count)):
                if self.relaxation.due[s, k] == 1:
                    self.relax(s, b, k, C_bar, last)
            self.metric.store(self.last_C_bar, s, b, C_bar)
            M = self.metric.sum(M, self.metric.stored(self.branch_stress, s, b))
        return M

    @ti.func
    def relax(self, s, b, k: ti.template(), C_bar, last):  # type: ignore[valid-type]  # Taichi wants an instance
        """Relax branch k of a block; C_bar: current, last: of the previous increment."""
        one = self.metric.lane(1.0)
        share, behind = self.relaxation.share[s, k], self.relaxation.behind[s, k]
        at = self.branch_count * b + k
        A = self.metric.stored(self.viscous_metric, s, at)
        met = self.metric.mixed(1.0 - behind, C_bar, behind, last)
        inverse = share / self.metric.determinant(met)  # of the adjugate
        change = self.metric.mixed(inverse, self.metric.adjugate(met), -share, A)
        self.metric.store(self.viscous_metric, s, at, self.metric.sum(A, change))
        mu = self.branch_modulus[k]
        stress = self.metric.stored(self.branch_stress, s, b)
        self.metric.store(self.branch_stress, s, b, self.metric.mixed(one, stress, mu, change))
        work = 0.5 * mu * self.metric.contraction(self.metric.sum(C_bar, last), change)
        self.metric_work[s, b] = self.metric_work[s, b] + work

    @ti.func
    def stored_energy(self, s, b, C, r2):
        """Return the energy density of law and Maxwell springs [J/m^3]."""
        w = self.elastic.energy_density(C, r2, self._identity(b))
        for k in ti.static(range(self.branch_count)):
            A = self.metric.stored(self.viscous_metric, s, self.branch_count * b + k)
            stretch = r2 * self.metric.contraction(C, A)
            w += 0.5 * self.branch_modulus[k] * (stretch - 3.0 - self._log_determinant(b, A))
        return w

    @ti.func
    def dissipation(self, s, b):
        """Return the energy density that the Maxwell branches have dissipated so far [J/m^3]."""
        w = self.metric.lane(0.0)
        if ti.static(self.branch_count > 0):
            w -= 0.5 * self.metric_work[s, b]
            for k in ti.static(range(self.branch_count)):
                A = self.metric.stored(self.viscous_metric, s, self.branch_count * b + k)
                w += 0.5 * self.branch_modulus[k] * self._log_determinant(b, A)
        return w

    @ti.func
    def _log_determinant(self, b, A):
        return ti.log(self.metric.determinant(A) / self._identity_determinant(b))

    @ti.func
    def _identity(self, b):
        return self.metric.stored(self.identity, 0, b)

    @ti.func
    def _identity_determinant(self, b):
        return self.metric.determinant(self._identity(b))


def _repeated_by_block(values: np.ndarray, count: int) -> np.ndarray:
    """Return each block of lanes of the values (m, ...) `count` times, one after another."""
    blocks = values.reshape(-1, backend.lanes(), *values.shape[1:])
    return np.repeat(blocks, count, axis=0).reshape(-1, *values.shape[1:])
