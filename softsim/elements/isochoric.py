"""Energy and stress of a law in kernels, for a whole lane vector at a time.

With W1, W2 the slopes of W(I1_bar, I2_bar) and C_bar = r2 C the fictitious second Piola-Kirchhoff
stress is (Holzapfel 2000, Nonlinear Solid Mechanics, section 6.5)
    2 dW/dC_bar = 2 (W1 + I1_bar W2) I - 2 W2 I C_bar I,    I2_bar = (I1_bar^2 - tr C_bar^2) / 2,
less a multiple of C_bar^-1, which the deviator of the stress has none of.
"""

from typing import Any

import numpy as np
import taichi as ti

from softsim.fields import real_field
from softsim.materials.functions import Functions
from softsim.materials.law import Law


@ti.data_oriented  # an argument of functions in kernels
class LaneFunctions(Functions):
    """Elementary functions of lane vectors, for the laws."""

    exp, log, sqrt = staticmethod(ti.exp), staticmethod(ti.log), staticmethod(ti.sqrt)
    cos, acos = staticmethod(ti.cos), staticmethod(ti.acos)
    minimum, maximum = staticmethod(ti.min), staticmethod(ti.max)
    where = staticmethod(ti.select)

    principal_logarithms = ti.func(Functions.principal_logarithms)
    power_curvature = ti.func(Functions.power_curvature)
    power_slope = ti.func(Functions.power_slope)
    sinh_ratio = ti.func(Functions.sinh_ratio)


class Isochoric:
    """Kernel class of a law, with its constants in a field, so that all values share kernels."""

    def __init__(self, law: Any, metric: Any) -> None:
        self.metric, self.count = metric, len(law.constants)
        self.constants = real_field(np.array(law.constants))
        self.law_energy = ti.func(law.energy_density)

    # Of a kind of law: `stress(C, r2, identity)` gives 2 dW/dC_bar [Pa], with the same arguments
    # `energy_density` W [J/m^3].
    stress: Any
    energy_density: Any

    @ti.func
    def c(self):
        """Return the constants."""
        return ti.Vector([self.constants[i] for i in range(self.count)])


class OfFirstInvariant(Isochoric):
    """Kernel class of a FirstInvariantLaw."""

    def __init__(self, law: Any, metric: Any) -> None:
        super().__init__(law, metric)
        self.law_slope = ti.func(law.energy_slope)

    @ti.func
    def stress(self, C, r2, identity):
        """Return 2 dW/dC_bar [Pa]."""
        slope = self.law_slope(r2 * self.metric.contraction(C, identity), self.c())
        return self.metric.scaled(2.0 * slope, identity)

    @ti.func
    def energy_density(self, C, r2, identity):
        """Return W [J/m^3]."""
        return self.law_energy(r2 * self.metric.contraction(C, identity), self.c())


class OfTwoInvariants(Isochoric):
    """Kernel class of a TwoInvariantLaw."""

    def __init__(self, law: Any, metric: Any) -> None:
        super().__init__(law, metric)
        self.functions = LaneFunctions()
        self.law_slopes = ti.func(law.energy_slopes)

    @ti.func
    def stress(self, C, r2, identity):
        """Return 2 dW/dC_bar [Pa] up to a multiple of C_bar^-1."""
        raised = self.metric.raised(self.metric.scaled(r2, C), identity)
        I1, I2 = self.invariants(C, r2, identity, raised)
        W1, W2 = self.law_slopes(I1, I2, self.c(), self.functions)
        return self.metric.mixed(2.0 * (W1 + I1 * W2), identity, -2.0 * W2, raised)

    @ti.func
    def energy_density(self, C, r2, identity):
        """Return W [J/m^3]."""
        raised = self.metric.raised(self.metric.scaled(r2, C), identity)
        I1, I2 = self.invariants(C, r2, identity, raised)
        return self.law_energy(I1, I2, self.c(), self.functions)

    @ti.func
    def invariants(self, C, r2, identity, raised):
        """Return I1_bar and I2_bar."""
        I1 = r2 * self.metric.contraction(C, identity)
        return I1, 0.5 * (I1 * I1 - r2 * self.metric.contraction(C, raised))


def isochoric(law: Law, metric: Any) -> Isochoric:
    """Return the kernel class of a law, for tensors of this metric."""
    kind = OfTwoInvariants if law.depends_on_I2 else OfFirstInvariant
    return kind(law, metric)
