"""Walls on grids of distances in kernels: gap and normal by interpolation between the nodes."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import taichi as ti

from softsim import backend
from softsim.contact.wall import Obstacle
from softsim.fields import index_field, real_field, vector_field

if TYPE_CHECKING:  # a wall imports its obstacle
    from softsim.contact.distance_grid import DistanceGrid


class GriddedObstacle(Obstacle):
    """Wall on a grid (contact/distance_grid.py), one entry of `walls` per scenario.

    Scenarios with the same grid share it.
    """

    count = 1

    def __init__(self, walls: Sequence["DistanceGrid"]) -> None:
        self.dimension = walls[0].values.ndim
        self.value, first = joined([w.values for w in walls])
        self.first = index_field(first)
        self.nodes = vector_field(np.array([w.values.shape for w in walls], dtype=float))
        self.origin = vector_field(np.stack([w.origin for w in walls]))
        self.spacing = real_field(np.array([w.spacing for w in walls]))

    @ti.func
    def gap_and_normal(self, s, i, w, x):
        """Return the signed gap [m] of contact node i at x, and the unit normal.

        The gap is negative in the wall. The normal has the direction of the gradient of the gap.
        """
        h = self.spacing[s]
        u = (x - self.origin[s]) / h
        rim = ti.min(ti.max(u, 0.0), self.nodes[s] - 1.0)
        gap, n = self.interpolated(s, rim)
        if (u - rim).norm_sqr() > 0.0:
            beyond = h * (u - rim).norm()
            gap += ti.select(gap < 0.0, -beyond, beyond)
        return gap, n

    @ti.func
    def interpolated(self, s, u):
        """Return the gap [m] at u, and its gradient as a unit vector.

        u is in spacings from the origin and within the grid. g = sum of w_c g_c over the corners c
        of the cell; w_c is the product, over the axes, of the fraction of the path across the cell,
        or its complement. The derivative of w_c along an axis is the product over the other axes,
        with the sign of the corner's side.
        """
        d = ti.static(self.dimension)
        cell = ti.min(ti.floor(u), self.nodes[s] - 2.0)
        share = u - cell
        gap = ti.cast(0.0, backend.real)
        slope = ti.Vector.zero(backend.real, d)
        for corner in ti.static(range(2**d)):
            number = 0
            for a in ti.static(range(d)):
                number = number * ti.cast(self.nodes[s][a], ti.i32) + (
                    ti.cast(cell[a], ti.i32) + (corner >> a) % 2
                )
            value = self.value[self.first[s] + number]
            weight = ti.cast(1.0, backend.real)
            for a in ti.static(range(d)):
                weight *= share[a] if ti.static((corner >> a) % 2) else 1.0 - share[a]
            gap += weight * value
            for a in ti.static(range(d)):
                of_slope = value if ti.static((corner >> a) % 2) else -value
                for b in ti.static(range(d)):
                    if ti.static(b != a):
                        of_slope *= share[b] if ti.static((corner >> b) % 2) else 1.0 - share[b]
                slope[a] += of_slope
        return gap, slope / ti.max(slope.norm(), 1e-12)


def joined(tables: Sequence[np.ndarray]) -> tuple[ti.ScalarField, np.ndarray]:
    """Return one field of the numbers of all different tables, and the start of each table."""
    kept: list[np.ndarray] = []
    begins: list[int] = []
    for table in tables:
        alike = [k for k, one in enumerate(kept) if np.array_equal(one, table)]
        if not alike:
            kept.append(table)
        number = alike[0] if alike else len(kept) - 1
        begins.append(sum(one.size for one in kept[:number]))
    return real_field(np.concatenate([one.ravel() for one in kept])), np.array(begins)
