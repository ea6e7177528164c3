"""Polylines in the plane, free on one side, and their exact signed distances.

The free side is on the left in the direction of the points. A polyline that is not closed continues
straight beyond its ends, to infinity.

The sign of the distance is that of the vector from the nearest point, projected on the normal
there: an edge's own inside it, at a corner the sum of both (Baerentzen and Aanaes, IEEE Trans. Vis.
Comput. Graph. 11 (2005) 243, in the plane). It is right whichever of two edges that meet is taken.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import index_field, lengthened, real_field, vector_field
from softsim.compute.term import PerScenario
from softsim.compute.vectors import KERNEL, NUMPY
from softsim.contact.wall import Obstacle, Wall

PAIRS = 2**18
"""Number of pairs of a point and an edge that are computed together: some 50 MB."""


@dataclass(frozen=True, eq=False)
class Polyline:
    """Polyline through points (n, 2) [m], of which no two neighbours are the same.

    closed: True if the last point is joined to the first. The first and the last point of an open
    one only give its direction there, see `prolonged`.
    """

    points: PerScenario[np.ndarray]
    closed: bool

    @cached_property
    def starts(self) -> np.ndarray:
        """Starts of the edges (m, 2) [m]."""
        return self.points if self.closed else self.points[:-1]

    @cached_property
    def ways(self) -> np.ndarray:
        """Vectors from the start of each edge to its end (m, 2) [m]."""
        return np.roll(self.points, -1, axis=0)[: len(self.starts)] - self.starts

    @cached_property
    def directions(self) -> np.ndarray:
        """Unit vectors (m, 2) along the edges."""
        return self.ways / np.linalg.norm(self.ways, axis=1)[:, None]

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit normals (m, 2) of the edges, into the free side."""
        return self.directions @ np.array([[0.0, 1.0], [-1.0, 0.0]])

    @property
    def ends(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points, outward directions and normals (2, 2) of the two end lines of an open polyline.

        For a closed one they have the shape (0, 2).
        """
        if self.closed:
            return (np.zeros((0, 2)),) * 3
        outwards = self.directions[[0, -1]] * [[-1.0], [1.0]]
        return self.points[[0, -1]], outwards, self.normals[[0, -1]]

    def prolonged(self, length: float) -> "Polyline":
        """Return the polyline with both ends, if it is open, moved outwards by `length` [m]."""
        if self.closed:
            return self
        points, outwards, _ = self.ends
        beyond = points + length * outwards
        return Polyline(np.vstack([beyond[:1], self.points[1:-1], beyond[1:]]), False)

    def boxes(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest and highest coordinates (m, 2) [m] of each edge."""
        ends = np.stack([self.starts, self.starts + self.ways])
        return ends.min(axis=0), ends.max(axis=0)

    @cached_property
    def spans(self) -> np.ndarray:
        """Start and end of each edge along its direction, from its starting point (m, 2) [m].

        They are infinite at the ends of an open polyline.
        """
        spans = np.stack([np.zeros(len(self.ways)), np.linalg.norm(self.ways, axis=1)], axis=1)
        if not self.closed:
            spans[0, 0], spans[-1, 1] = -np.inf, np.inf
        return spans

    @cached_property
    def corner_normals(self) -> np.ndarray:
        """Sums of the normals of the edges that meet at both ends of each edge (m, 2, 2).

        At the ends of an open polyline, which are no corners, the edge's own normal.
        """
        before, after = np.roll(self.normals, 1, axis=0), np.roll(self.normals, -1, axis=0)
        if not self.closed:
            before[0] = after[-1] = 0.0
        return np.stack([self.normals + before, self.normals + after], axis=1)

    @cached_property
    def turns(self) -> np.ndarray:
        """Angle by which the polyline turns to the left at the start of each edge (m,) [rad].

        It is negative at a convex corner of the solid, zero at the end of an open polyline.
        """
        before = np.roll(self.directions, 1, axis=0)
        along = (before * self.directions).sum(axis=1)
        turns = np.arctan2(cross(before, self.directions), along)
        if not self.closed:
            turns[0] = 0.0
        return turns

    @cached_property
    def thickness(self) -> float:
        """Shortest path [m] through the solid, from the middle of an edge along its normal.

        It ends at another edge, and is infinite where no path leads out again.
        """
        shortest, part = np.inf, max(1, PAIRS // len(self.starts))
        for k in range(0, len(self.starts), part):
            own = slice(k, k + part)
            inwards = -self.normals[own, None]
            to_start = self.starts - (self.starts + 0.5 * self.ways)[own, None]
            turn = cross(inwards, self.ways)
            with np.errstate(divide="ignore", invalid="ignore"):
                way = cross(to_start, self.ways) / turn
                share = cross(to_start, inwards) / turn
            hit = (turn < 0.0) & (way > 0.0) & (share >= 0.0) & (share <= 1.0)
            shortest = min(shortest, float(way[hit].min(initial=np.inf)))
        return shortest

    def distances(self, x: np.ndarray) -> np.ndarray:
        """Return the distances (k, m) [m] of points x (k, 2) to all edges."""
        return np.asarray(NUMPY.norm(self._feet(x)[2]))

    def gaps(self, x: np.ndarray) -> np.ndarray:
        """Return the signed distances (k,) [m] of points x (k, 2), negative in the solid."""
        part = max(1, PAIRS // len(self.starts))
        parts = (self._gaps(x[k : k + part]) for k in range(0, len(x), part))
        return np.concatenate([np.zeros(0), *parts])

    def _gaps(self, x: np.ndarray) -> np.ndarray:
        """Return the result of `gaps` for points that are computed together."""
        arm, along, apart = self._feet(x)
        edge, one = NUMPY.norm(apart).argmin(axis=1), np.arange(len(x))
        begin, end = self.spans[edge].T
        first_normal, last_normal = self.corner_normals[edge].transpose(1, 2, 0)
        gap, _ = gap_and_normal(
            arm[:, one, edge], along[one, edge], apart[:, one, edge], begin, end,
            self.normals[edge].T, first_normal, last_normal, NUMPY,
        )  # fmt: skip
        return np.asarray(gap)

    def _feet(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the vectors from the start of each edge to points x (k, 2): (2, k, m) [m].

        Also return the positions (k, m) [m] along the edges of their nearest points, and the
        vectors (2, k, m) [m] from there.
        """
        (begin, end), arm = self.spans.T, x.T[:, :, None] - self.starts.T[:, None]
        return arm, *nearest_on_edge(arm, self.directions.T[:, None], begin, end, NUMPY)


def nearest_on_edge(arm, direction, begin, end, m):
    """Return the position [m] along an edge of the point nearest to x, and the vector to x.

    arm: vector to x from the point of the edge at 0. begin, end: positions of its ends [m].
    """
    along = m.minimum(m.maximum(m.dot(arm, direction), begin), end)
    return along, arm - along * direction


def gap_and_normal(arm, along, apart, begin, end, normal, first_normal, last_normal, m):
    """Return the signed gap [m] of x to its nearest edge, and the gradient.

    arm, begin, end: as above. along, apart: position of the nearest point and vector from there.
    normal: that of the edge. first_normal, last_normal: those of its corners.
    """
    gap, n = m.dot(arm, normal), normal
    at_corner = (along == begin) | (along == end)
    if m.any(at_corner):
        side = m.where(along == begin, first_normal, last_normal)
        distance = m.norm(apart)
        signed = m.where(m.dot(apart, side) < 0.0, -distance, distance)
        away = apart / m.where(distance > 0.0, signed, 1.0)
        gap = m.where(at_corner, signed, gap)
        n = m.where(at_corner, m.where(distance > 0.0, away, side / m.norm(side)), n)
    return gap, n


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the out-of-plane component of a x b, vectors (..., 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


# -------------------------------------------------------------------------------------------------
# Grid of cells that list the edges of a polyline that can be nearest to a point.
#
# The list of a cell has all edges that are nearest to some point in it, and few others: with the
# cell's centre c and its half diagonal r, an edge e that is nearest at x satisfies
#
#     |e - c| <= |e - x| + r <= |e' - x| + r <= |e' - c| + 2 r
#
# for every other edge e'. The nearest edge in a list is therefore exact.

MOST_CELLS = 2**13
HALF_DIAGONAL = np.sqrt(0.5) * (1.0 + 1e-9)
"""Half diagonal of a cell over its side."""

RIM = 2
"""Number of cells around the polyline's points, on each side."""


@dataclass(frozen=True, eq=False)
class EdgeCells:
    """Grid of square cells with the edges near each of them.

    Cells have the side `size` [m], their number along the axes is shape (2,), and the corner of the
    first one is at `origin` (2,) [m]. The edges of cell (i, j) are edge[begin[c]] .. edge[begin[c +
    1] - 1] with c = i shape[1] + j; no gap in it is below clearance[c] [m].
    """

    origin: np.ndarray
    size: float
    shape: np.ndarray
    begin: np.ndarray
    edge: np.ndarray
    clearance: np.ndarray


def cells_of(polyline: Polyline) -> EdgeCells:
    """Return the cells around a polyline, the smallest within the limit of MOST_CELLS."""
    low, high = polyline.points.min(axis=0), polyline.points.max(axis=0)
    size = float((high - low).max()) / MOST_CELLS
    while np.prod(shape_of_cells(low, high, size)) > MOST_CELLS:
        size *= 1.1
    origin, shape = low - RIM * size, shape_of_cells(low, high, size)
    counts, edges = zip(*near_edges(polyline, origin, size, shape), strict=True)
    clearance = polyline.gaps(centres(np.arange(np.prod(shape)), origin, size, shape))
    begin = np.concatenate([[0], np.cumsum(np.concatenate(counts))])
    return EdgeCells(
        origin, size, shape, begin, np.concatenate(edges), clearance - size * HALF_DIAGONAL
    )


def shape_of_cells(low: np.ndarray, high: np.ndarray, size: float) -> np.ndarray:
    """Return the number of cells (2,) along both axes of the box (2,) [m] with its rim."""
    return np.maximum(np.ceil((high - low) / size), 1.0).astype(int) + 2 * RIM


def near_edges(
    polyline: Polyline, origin: np.ndarray, size: float, shape: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield, for successive groups of cells, the number of edges listed by each, and the edges."""
    across = 2.0 * HALF_DIAGONAL * size
    part = max(1, PAIRS // len(polyline.starts))
    for first in range(0, int(np.prod(shape)), part):
        cell = np.arange(first, min(first + part, int(np.prod(shape))))
        distance = polyline.distances(centres(cell, origin, size, shape))
        near = distance <= distance.min(axis=1, keepdims=True) + across
        yield near.sum(axis=1), np.nonzero(near)[1]


def centres(cell: np.ndarray, origin: np.ndarray, size: float, shape: np.ndarray) -> np.ndarray:
    """Return the centres (k, 2) [m] of cells (k,)."""
    index = np.stack(np.unravel_index(cell, tuple(shape)), axis=1)
    return np.asarray(origin + size * (index + 0.5))


# -------------------------------------------------------------------------------------------------
# Obstacle of a polyline: gap and normal from the nearest of the edges in a cell.

ENDLESS = 1e30
"""Length that stands for infinity [m]."""


class PolylineObstacle(Obstacle):
    """Wall along a polyline in kernels; one entry of `walls` per scenario.

    Equal polylines are stored once.
    """

    count = 1

    def __init__(self, walls: Sequence["PolylineWall"], nodes: int) -> None:
        """Build the fields of the obstacle; `nodes`: number of contact nodes."""
        self.nearest_on_edge, self.gap_of_edge = map(ti.func, (nearest_on_edge, gap_and_normal))
        self.dimension = walls[0].dimension
        kept, number = different([w.polyline for w in walls])
        cells = [walls[number.index(k)].cells for k in range(len(kept))]
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
        self.begin = index_field(lengthened(np.concatenate(begins)))
        self.edge = index_field(lengthened(np.concatenate(edges)))
        # One more a line, as `begin` has.
        clearances = np.concatenate([np.append(c.clearance, 0.0) for c in cells])
        self.clearance = real_field(lengthened(clearances))
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
    def may_touch(self, s, i, x, reach: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return 1 if the gap of node i at x may be within `reach`, now or at the last call.

        Records the answer for the next call.
        """
        number, _, beyond = self._cell(s, x)
        near = ti.cast(self.clearance[number] <= reach, ti.i32)
        if beyond > 0.0:
            for e in range(self.ends):
                arm = ti.Vector([x[0], x[1]]) - self.end_point[self.line[s], e]
                ahead = arm.dot(self.end_direction[self.line[s], e])
                if ahead > 0.0 and arm.dot(self.end_normal[self.line[s], e]) <= reach:
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
        line, q = self.line[s], ti.Vector([x[0], x[1]])
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
        least, apart = ti.cast(ENDLESS, backend.real), q
        for k in range(first, end):
            one = self.edge[k]
            t, arm = self.nearest_on_edge(
                q - self.start[one], self.direction[one], self.begins_at[one], self.ends_at[one],
                KERNEL,
            )  # fmt: skip
            square = arm.norm_sqr()
            if square < least:
                e, along, apart, least = one, t, arm, square
        return self.gap_of_edge(
            q - self.start[e], along, apart, self.begins_at[e], self.ends_at[e], self.normal[e],
            self.first_normal[e], self.last_normal[e], KERNEL,
        )  # fmt: skip


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


# -------------------------------------------------------------------------------------------------
# Wall along a polyline, in the plane or extruded along z: exact, corners included.
#
# At a convex corner the normal points from the corner to the node; inside a concave one the corner
# is nearest too, and pushes a node that is depths a and b behind both edges by k (a n_a + b n_b),
# as two walls would. The penalty energy k g^2 / 2 is that of a distance: continuous everywhere. Its
# gradient jumps where two edges are equally near inside the wall, behind a convex corner: a node
# that passes the corner at the depth g meets the other edge there, which takes or gives k g^2 / 2
# over a path of g.

STRAIGHT = 1e-9
"""Turning angle [rad] below which a corner counts as straight."""


@dataclass(frozen=True, eq=False)
class PolylineWall(Wall):
    """Wall `name` along a polyline of the x-y plane.

    across: in space, where the wall is the same at every z, the interval of z [m] in which it is
    drawn; None in the plane.
    """

    name: PerScenario[str]
    polyline: Polyline
    across: PerScenario[tuple[float, float] | None]

    @property
    def names(self) -> tuple[str, ...]:
        return (self.name,)

    @property
    def dimension(self) -> int:
        """Dimension of the space of the wall, 2 or 3."""
        return 2 if self.across is None else 3

    @cached_property
    def cells(self) -> EdgeCells:
        """Grid of cells in which kernels look up edges."""
        return cells_of(self.polyline)

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        return {self.name: self.polyline.gaps(x[:, :2])}

    def thickness(self) -> float:
        """Return the shortest path [m] through the wall, normal to the middle of an edge."""
        return self.polyline.thickness

    def obstacle(self, scenarios: Sequence["PolylineWall"], places: np.ndarray) -> PolylineObstacle:
        return PolylineObstacle(scenarios, len(places))

    def touched_at_once(self) -> tuple[float, float]:
        """Return the bounds for one edge, or two where there is a concave corner.

        The two edges of a concave corner act as one spring in all directions.
        """
        return (2.0 if (self.polyline.turns > 0.0).any() else 1.0), 1.0

    def corners(self) -> np.ndarray:
        """Return the convex corners of the solid, in the plane."""
        line = self.polyline
        return line.starts[(line.turns < -STRAIGHT) & (self.dimension == 2)]

    def drawn(self) -> dict[str, np.ndarray]:
        """Return the edges, in space as strips along z.

        Those at the ends are longer by the polyline's own size.
        """
        longer = self.polyline.prolonged(float(np.ptp(self.polyline.points, axis=0).max()))
        edges = np.stack([longer.starts, longer.starts + longer.ways], axis=1)
        if self.across is None:
            return {"wall_lines": edges}
        corners = edges[:, [0, 0, 1, 1]]
        depth = np.broadcast_to(np.array(self.across)[[0, 1, 1, 0]], corners.shape[:2])
        return {"wall_faces": np.concatenate([corners, depth[..., None]], axis=2)}
