"""Tensors in the basis of an element's own edges, whose components are lane vectors.

The edges from corner 0 are D_i at rest and d_i = F D_i now (convected coordinates; Green and Zerna
1968, Theoretical Elasticity, ch. 2). In this basis a linear element needs no shape gradients:
    C_ij = d_i . d_j,    I^ij = inverse of D_i . D_j,    J = det(d) / det(D),
and the second Piola-Kirchhoff stress S^ij puts on corner i the force -V S^ij d_j. C has lower
indices; its inverse, the identity I, viscous metrics and S have upper ones; only tensors of
opposite kind are contracted. A section adds the out-of-plane direction, zz, which is orthonormal.

Two classes have the same operations, so that an equation is written once for both: `PlaneMetric`
for sections (edges a and b) and `SpaceMetric` (edges a, b and c).
"""

from typing import Any

import numpy as np
import taichi as ti
from numpy.polynomial import Chebyshev, Polynomial
from scipy.special import erfcx

from softsim.compute import backend
from softsim.compute.fields import real_field
from softsim.materials.laws import Functions, Law


class PlaneMetric:
    """Operations on `Symmetric` tensors with the components aa, bb, ab in the plane and zz."""

    components = ("aa", "bb", "ab", "zz")

    def __init__(self) -> None:
        lane = backend.lane_vector()
        self.lane = lane
        self.Symmetric = ti.types.struct(aa=lane, bb=lane, ab=lane, zz=lane)

    def identity(self, edges: np.ndarray) -> np.ndarray:
        """Return I^ij (m, components) of elements with the edges D (m, edges, d) at rest."""
        return self._components(np.linalg.inv(edges @ edges.transpose(0, 2, 1)))

    def stretch_at_rest(self, edges: np.ndarray) -> np.ndarray:
        """Return C_ij = D_i . D_j (m, components) of the same elements."""
        return self._components(edges @ edges.transpose(0, 2, 1))

    def _components(self, matrix: np.ndarray) -> np.ndarray:
        one = np.ones(len(matrix))
        return np.stack([matrix[:, 0, 0], matrix[:, 1, 1], matrix[:, 0, 1], one], axis=1)

    @ti.func
    def mixed(self, a, A, b, B):
        """Return a A + b B."""
        return self.Symmetric(
            aa=a * A.aa + b * B.aa,
            bb=a * A.bb + b * B.bb,
            ab=a * A.ab + b * B.ab,
            zz=a * A.zz + b * B.zz,
        )

    @ti.func
    def sum(self, A, B):
        """Return A + B."""
        return self.Symmetric(aa=A.aa + B.aa, bb=A.bb + B.bb, ab=A.ab + B.ab, zz=A.zz + B.zz)

    @ti.func
    def scaled(self, a, A):
        """Return a A."""
        return self.Symmetric(aa=a * A.aa, bb=a * A.bb, ab=a * A.ab, zz=a * A.zz)

    @ti.func
    def contraction(self, A, B):
        """Return A : B, one with lower and one with upper indices."""
        return A.aa * B.aa + A.bb * B.bb + 2.0 * A.ab * B.ab + A.zz * B.zz

    @ti.func
    def raised(self, A, B):
        """Return B A B: A with both of its lower indices raised by B."""
        return self.Symmetric(
            aa=B.aa * B.aa * A.aa + 2.0 * B.aa * B.ab * A.ab + B.ab * B.ab * A.bb,
            bb=B.ab * B.ab * A.aa + 2.0 * B.ab * B.bb * A.ab + B.bb * B.bb * A.bb,
            ab=B.aa * B.ab * A.aa + (B.aa * B.bb + B.ab * B.ab) * A.ab + B.ab * B.bb * A.bb,
            zz=B.zz * B.zz * A.zz,
        )

    @ti.func
    def adjugate(self, A):
        """Return the components' determinant times the inverse of A."""
        return self.Symmetric(
            aa=A.bb * A.zz, bb=A.aa * A.zz, ab=-A.ab * A.zz, zz=A.aa * A.bb - A.ab * A.ab
        )

    @ti.func
    def determinant(self, A):
        """Return the determinant of the components."""
        return A.zz * (A.aa * A.bb - A.ab * A.ab)

    @ti.func
    def stored(self, fields: ti.template(), s, b):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return the tensor in the fields (one per component) at [s, b]."""
        return self.Symmetric(
            aa=fields[0][s, b], bb=fields[1][s, b], ab=fields[2][s, b], zz=fields[3][s, b]
        )

    @ti.func
    def store(self, fields: ti.template(), s, b, A):  # type: ignore[valid-type]  # Taichi wants an instance
        """Write a tensor to the fields at [s, b]."""
        fields[0][s, b] = A.aa
        fields[1][s, b] = A.bb
        fields[2][s, b] = A.ab
        fields[3][s, b] = A.zz


class SpaceMetric:
    """Operations on `Symmetric` tensors with the components aa, bb, cc, ab, bc, ca."""

    components = ("aa", "bb", "cc", "ab", "bc", "ca")

    def __init__(self) -> None:
        lane = backend.lane_vector()
        self.lane = lane
        self.Symmetric = ti.types.struct(aa=lane, bb=lane, cc=lane, ab=lane, bc=lane, ca=lane)

    def identity(self, edges: np.ndarray) -> np.ndarray:
        """Return I^ij (m, components) of elements with the edges D (m, edges, d) at rest."""
        return self._components(np.linalg.inv(edges @ edges.transpose(0, 2, 1)))

    def stretch_at_rest(self, edges: np.ndarray) -> np.ndarray:
        """Return C_ij = D_i . D_j (m, components) of the same elements."""
        return self._components(edges @ edges.transpose(0, 2, 1))

    def _components(self, matrix: np.ndarray) -> np.ndarray:
        pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
        return np.stack([matrix[:, i, j] for i, j in pairs], axis=1)

    @ti.func
    def mixed(self, a, A, b, B):
        """Return a A + b B."""
        return self.Symmetric(
            aa=a * A.aa + b * B.aa,
            bb=a * A.bb + b * B.bb,
            cc=a * A.cc + b * B.cc,
            ab=a * A.ab + b * B.ab,
            bc=a * A.bc + b * B.bc,
            ca=a * A.ca + b * B.ca,
        )

    @ti.func
    def sum(self, A, B):
        """Return A + B."""
        return self.Symmetric(
            aa=A.aa + B.aa,
            bb=A.bb + B.bb,
            cc=A.cc + B.cc,
            ab=A.ab + B.ab,
            bc=A.bc + B.bc,
            ca=A.ca + B.ca,
        )

    @ti.func
    def scaled(self, a, A):
        """Return a A."""
        return self.Symmetric(
            aa=a * A.aa, bb=a * A.bb, cc=a * A.cc, ab=a * A.ab, bc=a * A.bc, ca=a * A.ca
        )

    @ti.func
    def contraction(self, A, B):
        """Return A : B, one with lower and one with upper indices."""
        return (
            A.aa * B.aa
            + A.bb * B.bb
            + A.cc * B.cc
            + 2.0 * (A.ab * B.ab + A.bc * B.bc + A.ca * B.ca)
        )

    @ti.func
    def raised(self, A, B):
        """Return B A B: A with both of its lower indices raised by B."""
        # Rows of A B.
        a_a = A.aa * B.aa + A.ab * B.ab + A.ca * B.ca
        a_b = A.aa * B.ab + A.ab * B.bb + A.ca * B.bc
        a_c = A.aa * B.ca + A.ab * B.bc + A.ca * B.cc
        b_a = A.ab * B.aa + A.bb * B.ab + A.bc * B.ca
        b_b = A.ab * B.ab + A.bb * B.bb + A.bc * B.bc
        b_c = A.ab * B.ca + A.bb * B.bc + A.bc * B.cc
        c_a = A.ca * B.aa + A.bc * B.ab + A.cc * B.ca
        c_b = A.ca * B.ab + A.bc * B.bb + A.cc * B.bc
        c_c = A.ca * B.ca + A.bc * B.bc + A.cc * B.cc
        return self.Symmetric(
            aa=B.aa * a_a + B.ab * b_a + B.ca * c_a,
            bb=B.ab * a_b + B.bb * b_b + B.bc * c_b,
            cc=B.ca * a_c + B.bc * b_c + B.cc * c_c,
            ab=B.aa * a_b + B.ab * b_b + B.ca * c_b,
            bc=B.ab * a_c + B.bb * b_c + B.bc * c_c,
            ca=B.ca * a_a + B.bc * b_a + B.cc * c_a,
        )

    @ti.func
    def adjugate(self, A):
        """Return the components' determinant times the inverse of A."""
        return self.Symmetric(
            aa=A.bb * A.cc - A.bc * A.bc,
            bb=A.cc * A.aa - A.ca * A.ca,
            cc=A.aa * A.bb - A.ab * A.ab,
            ab=A.bc * A.ca - A.ab * A.cc,
            bc=A.ca * A.ab - A.bc * A.aa,
            ca=A.ab * A.bc - A.ca * A.bb,
        )

    @ti.func
    def determinant(self, A):
        """Return the determinant of the components."""
        return (
            A.aa * (A.bb * A.cc - A.bc * A.bc)
            + A.ab * (A.bc * A.ca - A.ab * A.cc)
            + A.ca * (A.ab * A.bc - A.ca * A.bb)
        )

    @ti.func
    def stored(self, fields: ti.template(), s, b):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return the tensor in the fields (one per component) at [s, b]."""
        return self.Symmetric(
            aa=fields[0][s, b],
            bb=fields[1][s, b],
            cc=fields[2][s, b],
            ab=fields[3][s, b],
            bc=fields[4][s, b],
            ca=fields[5][s, b],
        )

    @ti.func
    def store(self, fields: ti.template(), s, b, A):  # type: ignore[valid-type]  # Taichi wants an instance
        """Write a tensor to the fields at [s, b]."""
        fields[0][s, b] = A.aa
        fields[1][s, b] = A.bb
        fields[2][s, b] = A.cc
        fields[3][s, b] = A.ab
        fields[4][s, b] = A.bc
        fields[5][s, b] = A.ca


@ti.func
def inverse_cube_root(J):
    """Return J^(-1/3), by two Halley iterations from a quadratic seed.

    With e = 1 - J y^3 the exact value is y (1 - e)^(-1/3) = y (1 + e/3 + 2 e^2/9 + 14 e^3/81 ...).

    Relative error below 1e-11 for 0.6 < J < 1.5 and below 1e-5 for 0.3 < J < 2; outside the latter
    the guards stop the run. `pow` would cost a quarter of the increment.
    """
    d = J - 1.0
    y = 1.0 + d * (d * (2.0 / 9.0) - 1.0 / 3.0)
    for _ in ti.static(range(2)):
        e = 1.0 - J * (y * y * y)
        y = y + y * (e * (e * (2.0 / 9.0) + 1.0 / 3.0))
    return y


# -------------------------------------------------------------------------------------------------
# Energy and stress of a law in kernels, for a whole lane vector at a time.
#
# With W1, W2 the slopes of W(I1_bar, I2_bar) and C_bar = r2 C the fictitious second Piola-Kirchhoff
# stress is (Holzapfel 2000, Nonlinear Solid Mechanics, section 6.5)
#     2 dW/dC_bar = 2 (W1 + I1_bar W2) I - 2 W2 I C_bar I,    I2_bar = (I1_bar^2 - tr C_bar^2) / 2,
# without its multiple of C_bar^-1: that part is volumetric and drops out of the stress deviator.


def _erfc_terms(degree: int) -> list[float]:
    """Return p_k, the highest first, of exp(x^2) erfc(x) = t (p_n t^n + ... + p_0) at x >= 0.

    t = 2 / (2 + x). It is the polynomial through Chebyshev points (Schonfelder 1978, Math. Comput.
    32:1232-1240).
    """
    in_u = Chebyshev.interpolate(
        lambda u: erfcx(4.0 / (1.0 + u) - 2.0) * 2.0 / (1.0 + u),
        degree,  # t = (1 + u) / 2
    )
    in_t: Polynomial = in_u(Polynomial([-1.0, 2.0]))
    return [float(p) for p in in_t.coef[::-1]]


ERFC_TERMS = _erfc_terms(22)
"""Errors of `erf` are below 1e-13."""


@ti.func
def lane_erf(x):
    """Return erf x of a lane vector x >= 0."""
    t = 2.0 / (2.0 + x)
    series = 0.0 * x
    for p in ti.static(ERFC_TERMS):
        series = series * t + p
    return 1.0 - ti.exp(-x * x) * t * series


@ti.data_oriented  # an argument of functions in kernels
class LaneFunctions(Functions):
    """Elementary functions of lane vectors, for the laws."""

    exp, log, sqrt = staticmethod(ti.exp), staticmethod(ti.log), staticmethod(ti.sqrt)
    cos, acos = staticmethod(ti.cos), staticmethod(ti.acos)
    minimum, maximum = staticmethod(ti.min), staticmethod(ti.max)
    where, erf = staticmethod(ti.select), staticmethod(lane_erf)

    erf_integral = ti.func(Functions.erf_integral)
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
