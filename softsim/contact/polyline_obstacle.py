"""Obstacle of a polyline: gap and normal from the nearest of the edges in a cell."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import taichi as ti

from softsim import backend
from softsim.contact.polyline import Polyline
from softsim.contact.wall import Obstacle
from softsim.fields import index_field, real_field, vector_field

if TYPE_CHECKING:  # a wall imports its obstacle
    from softsim.contact.polyline_wall import PolylineWall

ENDLESS = 1e30
"""Length that stands for infinity [m]."""


class PolylineObstacle(Obstacle):
    """Wall along a polyline in kernels; one entry of `walls` per scenario.

    Equal polylines are stored once.
    """

    count = 1

    def __init__(self, walls: Sequence["PolylineWall"], nodes: int) -> None:
        """Build the fields of the obstacle; `nodes`: number of contact nodes."""
        self.dimension = walls[0].dimension
        kept, number = different([w.polyline for w in walls])
        lines = [walls[number.index(k)] for k in range(len(kept))]
        cells = [wall.cells for wall in lines]
        self.line = index_field(np.array(number))
        self.origin = vector_field(np.stack([c.origin for c in cells]))
        self.size = real_field(np.array([c.size for c in cells]))
        self.shape = vector_field(np.stack([c.shape for c in cells]).astype(float))
        # Of each line the first of its cells, of its lists of edges, and of its edges.
        first_cell, first_entry, first_edge = (
            np.concatenate([[0], np.cumsum(counts)[:-1]])
            for counts in (
                [len(c.begin) for c in cells],
                [len(c.edge) for c in cells],
                [len(line.starts) for line in kept],
            )
        )
        self.first_cell = index_field(first_cell)
        begins = [c.begin + f for c, f in zip(cells, first_entry, strict=True)]
        edges = [c.edge + f for c, f in zip(cells, first_edge, strict=True)]
        self.begin = index_field(np.concatenate(begins))
        self.edge = index_field(np.concatenate(edges))
        # One more a line, as `begin` has.
        self.clearance = real_field(np.concatenate([np.append(c.clearance, 0.0) for c in cells]))
        self.was_near = index_field(np.ones((len(walls), nodes)))

        self.start = vector_field(np.concatenate([line.starts for line in kept]))
        self.direction = vector_field(np.concatenate([line.directions for line in kept]))
        self.normal = vector_field(np.concatenate([line.normals for line in kept]))
        spans = np.concatenate([line.spans for line in kept]).clip(-ENDLESS, ENDLESS)
        self.begins_at, self.ends_at = map(real_field, spans.T)
        corner_normals = np.concatenate([line.corner_normals for line in kept])
        self.first_normal = vector_field(corner_normals[:, 0])
        self.last_normal = vector_field(corner_normals[:, 1])
        # Lines on which an open one goes on, none of a closed one.
        ends = [line.ends for line in kept]
        self.ends = len(ends[0][0])
        self.end_point, self.end_direction, self.end_normal = (
            vector_field(np.stack(parts)) for parts in zip(*ends, strict=True)
        )

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return {"was_near_wall": self.was_near}

    @ti.func
    def may_touch(self, s, i, x):
        """Return 1 if contact node i at x may be in contact now, or could be at the last call.

        Records the answer for the next call.
        """
        number, _, beyond = self._cell(s, x)
        near = ti.cast(self.clearance[number] <= self.standoff, ti.i32)
        if beyond > 0.0:
            for e in range(self.ends):
                arm = ti.Vector([x[0], x[1]]) - self.end_point[self.line[s], e]
                ahead = arm.dot(self.end_direction[self.line[s], e])
                if ahead > 0.0 and arm.dot(self.end_normal[self.line[s], e]) <= self.standoff:
                    near = 1
        result = ti.max(near, self.was_near[s, i])
        self.was_near[s, i] = near
        return result

    @ti.func
    def _cell(self, s, x):
        """Return the cell nearest to x, the nearest point of the cells, and the distance [m] to it.

        The cell by its number, the point in sides of a cell from their origin.
        """
        line = self.line[s]
        u = (ti.Vector([x[0], x[1]]) - self.origin[line]) / self.size[line]
        rim = ti.min(ti.max(u, 0.0), self.shape[line])
        cell = ti.cast(ti.min(ti.floor(rim), self.shape[line] - 1.0), ti.i32)
        number = self.first_cell[line] + cell[0] * ti.cast(self.shape[line][1], ti.i32) + cell[1]
        return number, rim, self.size[line] * (u - rim).norm()

    @ti.func
    def gap_and_normal(self, s, i, w, x):
        """Return the signed gap [m] of contact node i at x, and the unit normal.

        The gap is negative in the wall; the normal is its gradient. Beyond the cells the gap is
        that of the nearest point of their boundary, enlarged in magnitude by the distance to it, or
        that to an end line of the polyline where that is nearer.
        """
        line = self.line[s]
        q = ti.Vector([x[0], x[1]])
        number, rim, beyond = self._cell(s, x)
        place = q
        if beyond > 0.0:
            place = self.origin[line] + self.size[line] * rim
        gap, n = self._nearest(self.begin[number], self.begin[number + 1], place)
        if beyond > 0.0:
            gap += ti.select(gap < 0.0, -beyond, beyond)
            for e in range(self.ends):
                arm = q - self.end_point[line, e]
                height = arm.dot(self.end_normal[line, e])
                if arm.dot(self.end_direction[line, e]) > 0.0 and ti.abs(height) < ti.abs(gap):
                    gap, n = height, self.end_normal[line, e]
        normal = ti.Vector.zero(backend.real, self.dimension)
        normal[0], normal[1] = n[0], n[1]
        return gap, normal

    @ti.func
    def _nearest(self, first, end, q):
        """Return the gap [m] to the nearest edge in these list entries, and its gradient."""
        e, along = self.edge[first], ti.cast(0.0, backend.real)
        least = ti.cast(ENDLESS, backend.real)
        for k in range(first, end):
            one = self.edge[k]
            arm = q - self.start[one]
            t = ti.min(ti.max(arm.dot(self.direction[one]), self.begins_at[one]), self.ends_at[one])
            square = (arm - t * self.direction[one]).norm_sqr()
            if square < least:
                e, along, least = one, t, square
        arm = q - self.start[e]
        n = self.normal[e]
        gap = arm.dot(n)
        if along == self.begins_at[e] or along == self.ends_at[e]:
            side = self.last_normal[e]
            if along == self.begins_at[e]:
                side = self.first_normal[e]
            arm -= along * self.direction[e]
            gap = ti.select(arm.dot(side) < 0.0, -arm.norm(), arm.norm())
            n = side.normalized()
            if gap != 0.0:
                n = arm / gap
        return gap, n


def different(lines: Sequence[Polyline]) -> tuple[list[Polyline], list[int]]:
    """Return the polylines without duplicates, and for each input the number of its polyline."""
    kept: list[Polyline] = []
    number = []
    for line in lines:
        alike = [k for k, one in enumerate(kept) if np.array_equal(one.points, line.points)]
        if not alike:
            kept.append(line)
        number.append(alike[0] if alike else len(kept) - 1)
    return kept, number
