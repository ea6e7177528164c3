"""Material at the integration point of each element: law, its softening and Maxwell branches.

Each Maxwell branch (Linder, Tkachuk, Miehe 2011, J. Mech. Phys. Solids 59:2134-2156) has a viscous
metric A, at rest the inverse of C_bar:
    energy   mu/2 (A : C_bar - 3 - ln det A),    dA/dt = (C_bar^-1 - A) / tau,
    dissipation  mu/(2 tau) (A : C_bar + A^-1 : C_bar^-1 - 6) >= 0.
After a sudden stretch the branch stress decays as exp(-t / tau). A slow branch relaxes in some
increments only (see below); the sum of mu A is stored in between.

Energy balance: the force on a metric is -d(energy)/dA = mu/2 (A^-1 - C_bar), so a branch has
dissipated
    mu/2 (ln det A - integral of C_bar : dA).
ln det A is that of the present, the integral is summed by the trapezoidal rule in every increment
in which A changes, as the work of central differences is: for small strains the books then close
to round-off, whatever the relaxation time is.

Throughout: C = F^T F, r2 = J^(-2/3), C_bar = r2 C. Tensors are in the basis of each element's edges
(elements/kinematics.py), in which the identity, A at rest, is a field of its own.
"""

from typing import Any

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import index_field, lane_data, lane_field, real_field
from softsim.compute.term import Pass
from softsim.elements.kinematics import LaneFunctions, isochoric
from softsim.materials.material import Material, Mullins

# -------------------------------------------------------------------------------------------------
# Relaxation of Maxwell branches; those that are slow against the time step relax less often.
#
# A branch may be held for n increments of dt, in which its viscous strain stays and its stress is
# that of a spring, and then relax by all of them at once, h = n dt, towards the strain at a time
# before the present one:
#     A <- e A + (1 - e) C_bar^-1(t - phi dt),    e = exp(-h / tau).
# Of a slow motion the A that forces meet lags behind C_bar^-1 by h e / (1 - e) for the relaxing,
# (h - dt) / 2 for the holding and phi dt. phi is such that all this is tau, as it should be: about
# 1/2, and next to nothing where tau is much shorter than the step. What is left is of second order,
# below 1 % of the complex modulus at 10 kHz with steps of 8 us and the branches of Dragon Skin; of
# the loss modulus alone 0.5 % are lacking at 5 kHz and 2 % at 10 kHz, with phi = 0 and n = 1 17 %.
#
# A branch is held for MOST_HELD increments at most, which is short against every motion that a mesh
# resolves, and for TAU_SHARE of its relaxation time. Nothing is dissipated while it is held. If the
# time step changes while it is held, it then relaxes by n of the new steps.

MOST_HELD = 8  # increments
TAU_SHARE = 1 / 8


class MaxwellSchedule:
    """Schedule of the branches with these relaxation times [s], in each scenario.

    due [s, k]: 1 if branch k relaxes in the current increment. share [s, k]: fraction 1 - e by
    which it relaxes. behind [s, k]: phi, the steps before now of the strain towards which it
    relaxes.
    """

    def __init__(self, times: np.ndarray, scenarios: int) -> None:
        self.times = times
        shape = (scenarios, len(times))
        self.holds = index_field(np.ones(shape, dtype=int))  # increments
        self.held, self.due = (index_field(np.zeros(shape, dtype=int)) for _ in range(2))
        self.share, self.behind = (real_field(np.zeros(shape)) for _ in range(2))

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return {"branch_held": self.held, "branch_due": self.due}

    def set_time_increment(self, scenario: int, dt: float) -> None:
        """Set the time step [s] of a scenario; infinite: all branches relax at once."""
        steps = self.times / dt  # in a relaxation time
        n = np.clip(TAU_SHARE * steps, 1, MOST_HELD).astype(int)
        with np.errstate(divide="ignore"):
            x = n / steps
        behind = steps - n / np.expm1(x) - 0.5 * (n - 1)
        for field, values in (
            (self.holds, n), (self.share, -np.expm1(-x)), (self.behind, behind),
        ):  # fmt: skip
            fields.write_row(field, scenario, values)

    @ti.func
    def tick(self, s, i, t, dt):
        """Find the branches that are due in the increment that begins."""
        for k in range(ti.static(len(self.times))):
            held = self.held[s, k] * (1 - self.due[s, k]) + 1
            self.held[s, k] = held
            self.due[s, k] = ti.cast(held >= self.holds[s, k], ti.i32)


# -------------------------------------------------------------------------------------------------
# Softening by the largest energy density so far.

PEAK_ENERGY = "peak_energy"
"""State field of materials that soften."""


class Softening:
    """Kernel class of the Mullins effect, with the largest W of each element.

    peak (scenarios, blocks) [J/m^3]: W_m of materials/material.py.
    """

    def __init__(self, mullins: Mullins, scenarios: int, blocks: int) -> None:
        self.constants = real_field(np.array(mullins.constants))
        self.peak = lane_field((scenarios, blocks))
        self.functions = LaneFunctions()
        self.law_factor, self.law_stored = ti.func(mullins.factor), ti.func(mullins.stored)
        self.law_dissipated = ti.func(mullins.dissipated)

    @ti.func
    def c(self):
        """Return the constants."""
        return ti.Vector([self.constants[i] for i in range(3)])

    @ti.func
    def factor(self, s, b, W):
        """Return eta at an energy density W [J/m^3], which is remembered if it is the largest."""
        peak = ti.max(self.peak[s, b], W)
        self.peak[s, b] = peak
        return self.law_factor(ti.max(W, 0.0), peak, self.c(), self.functions)

    @ti.func
    def stored(self, s, b, W):
        """Return the stored energy density U [J/m^3]."""
        return self.law_stored(ti.max(W, 0.0), self.peak[s, b], self.c(), self.functions)

    @ti.func
    def dissipated(self, s, b):
        """Return the dissipated energy density D [J/m^3]."""
        return self.law_dissipated(self.peak[s, b], self.c(), self.functions)


class MaterialPoints:
    """Material points of the elements of a region.

    rest_edges (m, edges, d): edges at rest, m whole lane vectors.

    metric: PlaneMetric or SpaceMetric.
    """

    def __init__(
        self, material: Material, metric: Any, rest_edges: np.ndarray, scenarios: int
    ) -> None:
        # Not the material itself: kernels serve all of its values (compute/term.py).
        self.metric, self.law = metric, type(material.law).__name__
        self.branch_sum = np.array(sum(b.shear_modulus for b in material.branches))
        self.shear_modulus = np.array(material.law.initial_shear_modulus)
        blocks = backend.lane_blocks(len(rest_edges))
        identity = metric.identity(rest_edges)
        self.elastic = isochoric(material.law, metric)
        self.softens = material.mullins is not None
        if material.mullins is not None:
            self.softening = Softening(material.mullins, scenarios, blocks)
        self.branch_count = len(material.branches)
        self.branch_modulus = real_field(np.array([b.shear_modulus for b in material.branches]))
        self.identity = [lane_data(component[None]) for component in identity.T]
        if self.branch_count:
            times = np.array([b.relaxation_time for b in material.branches])
            self.relaxation = MaxwellSchedule(times, scenarios)
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
        kept: dict[str, ti.Field] = {}
        if self.softens:
            kept[PEAK_ENERGY] = self.softening.peak
        if not self.branch_count:
            return kept
        kept["metric_work"] = self.metric_work
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
        """Return M = 2 eta dW/dC_bar + sum mu A [Pa] after relaxing the branches that are due."""
        M = self.elastic.stress(C, r2, self._identity(b))
        if ti.static(self.softens):
            W = self.elastic.energy_density(C, r2, self._identity(b))
            M = self.metric.scaled(self.softening.factor(s, b, W), M)
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
        if ti.static(self.softens):
            w = self.softening.stored(s, b, w)
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
    def damage(self, s, b):
        """Return the energy density that softening has dissipated so far [J/m^3]."""
        w = self.metric.lane(0.0)
        if ti.static(self.softens):
            w += self.softening.dissipated(s, b)
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
