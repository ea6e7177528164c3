"""Tensors whose components are lane vectors, and the few operations the elements need.

Two kinds with the same operations: `PlaneTensors` for sections (in-plane components and zz) and
`SpaceTensors`. Whoever holds one of them writes the same equation for both.
"""

import taichi as ti

from softsim import backend


@ti.data_oriented
class PlaneTensors:
    """`General`: in-plane xx, xy, yx, yy and zz. `Symmetric`: xx, yy, xy and zz."""

    symmetric_names = ("xx", "yy", "xy", "zz")

    def __init__(self) -> None:
        lane = backend.lane_vector()
        self.lane = lane
        self.General = ti.types.struct(xx=lane, xy=lane, yx=lane, yy=lane, zz=lane)
        self.Symmetric = ti.types.struct(xx=lane, yy=lane, zz=lane, xy=lane)

    @ti.func
    def isotropic(self, value):
        """value times the identity."""
        return self.Symmetric(xx=value, yy=value, zz=value, xy=self.lane(0.0))

    @ti.func
    def mixed(self, a, A, b, B):
        """a A + b B of symmetric tensors."""
        return self.Symmetric(
            xx=a * A.xx + b * B.xx,
            yy=a * A.yy + b * B.yy,
            zz=a * A.zz + b * B.zz,
            xy=a * A.xy + b * B.xy,
        )

    @ti.func
    def contraction(self, A, B):
        """A : B of symmetric tensors."""
        return A.xx * B.xx + A.yy * B.yy + A.zz * B.zz + 2.0 * A.xy * B.xy

    @ti.func
    def cofactor(self, A):
        """det A times A^-1 of a symmetric tensor."""
        return self.Symmetric(
            xx=A.yy * A.zz, yy=A.xx * A.zz, zz=A.xx * A.yy - A.xy * A.xy, xy=-A.xy * A.zz
        )

    @ti.func
    def symmetric_determinant(self, A):
        """det A of a symmetric tensor."""
        return A.zz * (A.xx * A.yy - A.xy * A.xy)

    @ti.func
    def determinant(self, F):
        """det F."""
        return F.zz * (F.xx * F.yy - F.xy * F.yx)

    @ti.func
    def right_cauchy_green(self, F):
        """C = F^T F."""
        return self.Symmetric(
            xx=F.xx * F.xx + F.yx * F.yx,
            yy=F.xy * F.xy + F.yy * F.yy,
            zz=F.zz * F.zz,
            xy=F.xx * F.xy + F.yx * F.yy,
        )

    @ti.func
    def first_piola(self, F, r2, M, h):
        """P = r2 F M + h J F^-T."""
        return self.General(
            xx=r2 * (F.xx * M.xx + F.xy * M.xy) + h * (F.yy * F.zz),
            xy=r2 * (F.xx * M.xy + F.xy * M.yy) - h * (F.yx * F.zz),
            yx=r2 * (F.yx * M.xx + F.yy * M.xy) - h * (F.xy * F.zz),
            yy=r2 * (F.yx * M.xy + F.yy * M.yy) + h * (F.xx * F.zz),
            zz=r2 * F.zz * M.zz + h * (F.xx * F.yy - F.xy * F.yx),
        )

    @ti.func
    def stored(self, fields: ti.template(), s, b):  # type: ignore[valid-type]  # Taichi wants an instance
        """The symmetric tensor in the fields (in the order of `symmetric_names`) at [s, b]."""
        return self.Symmetric(
            xx=fields[0][s, b], yy=fields[1][s, b], xy=fields[2][s, b], zz=fields[3][s, b]
        )

    @ti.func
    def store(self, fields: ti.template(), s, b, A):  # type: ignore[valid-type]  # Taichi wants an instance
        """Put a symmetric tensor into the fields at [s, b]."""
        fields[0][s, b] = A.xx
        fields[1][s, b] = A.yy
        fields[2][s, b] = A.xy
        fields[3][s, b] = A.zz


@ti.data_oriented
class SpaceTensors:
    """`General`: all nine components. `Symmetric`: xx, yy, zz, xy, yz, zx."""

    symmetric_names = ("xx", "yy", "zz", "xy", "yz", "zx")

    def __init__(self) -> None:
        lane = backend.lane_vector()
        self.lane = lane
        self.General = ti.types.struct(
            xx=lane, xy=lane, xz=lane, yx=lane, yy=lane, yz=lane, zx=lane, zy=lane, zz=lane
        )
        self.Symmetric = ti.types.struct(xx=lane, yy=lane, zz=lane, xy=lane, yz=lane, zx=lane)

    @ti.func
    def isotropic(self, value):
        """value times the identity."""
        zero = self.lane(0.0)
        return self.Symmetric(xx=value, yy=value, zz=value, xy=zero, yz=zero, zx=zero)

    @ti.func
    def mixed(self, a, A, b, B):
        """a A + b B of symmetric tensors."""
        return self.Symmetric(
            xx=a * A.xx + b * B.xx,
            yy=a * A.yy + b * B.yy,
            zz=a * A.zz + b * B.zz,
            xy=a * A.xy + b * B.xy,
            yz=a * A.yz + b * B.yz,
            zx=a * A.zx + b * B.zx,
        )

    @ti.func
    def contraction(self, A, B):
        """A : B of symmetric tensors."""
        return (
            A.xx * B.xx
            + A.yy * B.yy
            + A.zz * B.zz
            + 2.0 * (A.xy * B.xy + A.yz * B.yz + A.zx * B.zx)
        )

    @ti.func
    def cofactor(self, A):
        """det A times A^-1 of a symmetric tensor."""
        return self.Symmetric(
            xx=A.yy * A.zz - A.yz * A.yz,
            yy=A.xx * A.zz - A.zx * A.zx,
            zz=A.xx * A.yy - A.xy * A.xy,
            xy=A.yz * A.zx - A.xy * A.zz,
            yz=A.xy * A.zx - A.yz * A.xx,
            zx=A.xy * A.yz - A.zx * A.yy,
        )

    @ti.func
    def symmetric_determinant(self, A):
        """det A of a symmetric tensor."""
        return (
            A.xx * (A.yy * A.zz - A.yz * A.yz)
            + A.xy * (A.yz * A.zx - A.xy * A.zz)
            + A.zx * (A.xy * A.yz - A.zx * A.yy)
        )

    @ti.func
    def determinant(self, F):
        """det F."""
        return (
            F.xx * (F.yy * F.zz - F.yz * F.zy)
            + F.xy * (F.yz * F.zx - F.yx * F.zz)
            + F.xz * (F.yx * F.zy - F.yy * F.zx)
        )

    @ti.func
    def right_cauchy_green(self, F):
        """C = F^T F."""
        return self.Symmetric(
            xx=F.xx * F.xx + F.yx * F.yx + F.zx * F.zx,
            yy=F.xy * F.xy + F.yy * F.yy + F.zy * F.zy,
            zz=F.xz * F.xz + F.yz * F.yz + F.zz * F.zz,
            xy=F.xx * F.xy + F.yx * F.yy + F.zx * F.zy,
            yz=F.xy * F.xz + F.yy * F.yz + F.zy * F.zz,
            zx=F.xz * F.xx + F.yz * F.yx + F.zz * F.zx,
        )

    @ti.func
    def first_piola(self, F, r2, M, h):
        """P = r2 F M + h J F^-T."""
        return self.General(
            xx=r2 * (F.xx * M.xx + F.xy * M.xy + F.xz * M.zx) + h * (F.yy * F.zz - F.yz * F.zy),
            xy=r2 * (F.xx * M.xy + F.xy * M.yy + F.xz * M.yz) + h * (F.yz * F.zx - F.yx * F.zz),
            xz=r2 * (F.xx * M.zx + F.xy * M.yz + F.xz * M.zz) + h * (F.yx * F.zy - F.yy * F.zx),
            yx=r2 * (F.yx * M.xx + F.yy * M.xy + F.yz * M.zx) + h * (F.xz * F.zy - F.xy * F.zz),
            yy=r2 * (F.yx * M.xy + F.yy * M.yy + F.yz * M.yz) + h * (F.xx * F.zz - F.xz * F.zx),
            yz=r2 * (F.yx * M.zx + F.yy * M.yz + F.yz * M.zz) + h * (F.xy * F.zx - F.xx * F.zy),
            zx=r2 * (F.zx * M.xx + F.zy * M.xy + F.zz * M.zx) + h * (F.xy * F.yz - F.xz * F.yy),
            zy=r2 * (F.zx * M.xy + F.zy * M.yy + F.zz * M.yz) + h * (F.xz * F.yx - F.xx * F.yz),
            zz=r2 * (F.zx * M.zx + F.zy * M.yz + F.zz * M.zz) + h * (F.xx * F.yy - F.xy * F.yx),
        )

    @ti.func
    def stored(self, fields: ti.template(), s, b):  # type: ignore[valid-type]  # Taichi wants an instance
        """The symmetric tensor in the fields (in the order of `symmetric_names`) at [s, b]."""
        return self.Symmetric(
            xx=fields[0][s, b],
            yy=fields[1][s, b],
            zz=fields[2][s, b],
            xy=fields[3][s, b],
            yz=fields[4][s, b],
            zx=fields[5][s, b],
        )

    @ti.func
    def store(self, fields: ti.template(), s, b, A):  # type: ignore[valid-type]  # Taichi wants an instance
        """Put a symmetric tensor into the fields at [s, b]."""
        fields[0][s, b] = A.xx
        fields[1][s, b] = A.yy
        fields[2][s, b] = A.zz
        fields[3][s, b] = A.xy
        fields[4][s, b] = A.yz
        fields[5][s, b] = A.zx


@ti.func
def inverse_cube_root(J):
    """J^(-1/3) by three Newton rounds from a quadratic seed.

    Relative error below 1e-11 for 0.6 < J < 1.5 and below 1e-5 for 0.3 < J < 2; outside the latter
    the guards stop the run. `pow` would cost a quarter of the increment.
    """
    d = J - 1.0
    y = 1.0 + d * (d * (2.0 / 9.0) - 1.0 / 3.0)
    for _ in ti.static(range(3)):
        y = y * (4.0 - J * y * y * y) * (1.0 / 3.0)
    return y
