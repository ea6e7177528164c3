"""Plane tensors whose components are lane vectors, and the few operations the elements need."""

from types import SimpleNamespace

import taichi as ti

from softsim import backend


def tensor_types() -> SimpleNamespace:
    """The struct types for this device's lanes.

    `Plane`: a general 2 x 2 tensor xx, xy, yx, yy. `Symmetric`: in-plane xx, yy, xy and zz.
    """
    lane = backend.lane_vector()
    return SimpleNamespace(
        lane=lane,
        Plane=ti.types.struct(xx=lane, xy=lane, yx=lane, yy=lane),
        Symmetric=ti.types.struct(xx=lane, yy=lane, zz=lane, xy=lane),
    )


@ti.func
def determinant(F):
    """det F of the in-plane part; equal to J in plane strain."""
    return F.xx * F.yy - F.xy * F.yx


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
