"""Polylines in the plane, free on one side: exact signed distances, and checks of a polyline.

The free side is on the left in the direction of the points. A polyline that is not closed continues
straight beyond its ends, to infinity.

The sign of the distance is that of the vector from the nearest point, projected on the normal
there: an edge's own inside it, at a corner the sum of both (Baerentzen and Aanaes, IEEE Trans. Vis.
Comput. Graph. 11 (2005) 243, in the plane). It is right whichever of two edges that meet is taken.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import index_field, lengthened, real_field, vector_field
from softsim.compute.term import PerScenario
from softsim.contact.wall import Obstacle, Wall
from softsim.errors import MeshError
from softsim.mesh.reading import read_points
from softsim.scene.names import Names
from softsim.scene.quantities import Point
from softsim.scene.text import Keys
from softsim.scene.walls import PolylineWallSpec

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
        turns = np.arctan2(_cross(before, self.directions), along)
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
            turn = _cross(inwards, self.ways)
            with np.errstate(divide="ignore", invalid="ignore"):
                way = _cross(to_start, self.ways) / turn
                share = _cross(to_start, inwards) / turn
            hit = (turn < 0.0) & (way > 0.0) & (share >= 0.0) & (share <= 1.0)
            shortest = min(shortest, float(way[hit].min(initial=np.inf)))
        return shortest

    def distances(self, x: np.ndarray) -> np.ndarray:
        """Return the distances (k, m) [m] of points x (k, 2) to all edges."""
        return np.linalg.norm(self._arms(x)[0], axis=2)

    def gaps(self, x: np.ndarray) -> np.ndarray:
        """Return the signed distances (k,) [m] of points x (k, 2), negative in the solid."""
        part = max(1, PAIRS // len(self.starts))
        parts = [self._gaps(x[k : k + part]) for k in range(0, len(x), part)]
        return np.concatenate([np.zeros(0), *parts])

    def _gaps(self, x: np.ndarray) -> np.ndarray:
        """Return the result of `gaps` for points that are computed together."""
        arms, along = self._arms(x)
        edge, one = np.linalg.norm(arms, axis=2).argmin(axis=1), np.arange(len(x))
        arm, along, spans = arms[one, edge], along[one, edge], self.spans[edge]
        at_corner = along[:, None] == spans
        side = np.where(at_corner[:, :1], self.corner_normals[edge, 0], self.normals[edge])
        side = np.where(at_corner[:, 1:], self.corner_normals[edge, 1], side)
        distance = np.linalg.norm(arm, axis=1)
        found = np.where((arm * side).sum(axis=1) < 0.0, -distance, distance)
        height = ((x - self.starts[edge]) * self.normals[edge]).sum(axis=1)
        return np.where(at_corner.any(axis=1), found, height)

    def _arms(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the vectors from the nearest point of each edge to points x (k, 2): (k, m, 2) [m].

        Also return the positions of these points along the edges (k, m) [m].
        """
        from_start = x[:, None] - self.starts
        along = np.clip((from_start * self.directions).sum(axis=2), *self.spans.T)
        return from_start - along[..., None] * self.directions, along


def checked_polyline(points: np.ndarray, closed: bool) -> Polyline:
    """Return the polyline along points (n, 2) [m] after checks.

    The last point of a closed one may repeat the first. Raises MeshError if there are too few
    points, two neighbours are the same, an edge folds back on the one before it, or edges cross or
    touch, including the straight continuations of an open one.
    """
    if closed and len(points) > 1 and np.array_equal(points[0], points[-1]):
        points = points[:-1]
    least = 3 if closed else 2
    if len(points) < least:
        raise MeshError(
            f"a polyline of {len(points)} different points: at least {least} are needed",
            hint="list its points in order, with the free side on the left",
        )
    polyline = Polyline(points, closed)
    alike = np.flatnonzero((polyline.ways == 0.0).all(axis=1))
    if len(alike):
        raise MeshError(
            f"points {alike[0]} and {(alike[0] + 1) % len(points)} (counted from 0) are the same",
            hint="leave one of them out",
        )
    size = np.ptp(points, axis=0).max()
    crossing = first_crossing(polyline.prolonged(1e3 * size))
    if crossing is not None:
        one, other, place = crossing
        where = " (extended straight beyond the ends)" if not closed else ""
        raise MeshError(
            f"the polyline crosses itself: edges {one} and {other}{where}, counted from 0, at "
            f"({place[0] * 1e3:.6g}, {place[1] * 1e3:.6g}) mm",
            hint="a wall has a free and a solid side: it must not cross, touch or fold back on "
            "itself",
        )
    return polyline


def first_crossing(polyline: Polyline) -> tuple[int, int, np.ndarray] | None:
    """Return two edges of a polyline with a common point, and that point (2,) [m]; or None.

    The common corner of neighbours does not count.
    """
    low, high = polyline.boxes()
    count = len(low)
    order = np.argsort(low[:, 0], kind="stable")
    # Edges whose ranges of x overlap: in order of their beginnings, those up to the own end.
    last = np.searchsorted(low[order, 0], high[order, 0], side="right")
    for k in range(count):
        one, others = order[k], order[k + 1 : last[k]]
        others = others[(low[others, 1] <= high[one, 1]) & (high[others, 1] >= low[one, 1])]
        for other in others[_meet(polyline, one, others)]:
            i, j = sorted((int(one), int(other)))
            return i, j, _meeting_place(polyline, i, j)
    return None


def _meet(polyline: Polyline, one: int, others: np.ndarray) -> np.ndarray:
    """Return a mask of the edges `others` (k,) that meet edge `one`.

    Neighbours count only where they fold back.
    """
    starts, ways, count = polyline.starts, polyline.ways, len(polyline.starts)
    a, b = starts[one], starts[one] + ways[one]
    c, d = starts[others], starts[others] + ways[others]
    across = np.sign(_cross(ways[one], c - a)) * np.sign(_cross(ways[one], d - a)) <= 0.0
    across &= np.sign(_cross(ways[others], a - c)) * np.sign(_cross(ways[others], b - c)) <= 0.0
    step = others - one
    if polyline.closed:
        neighbours = (step % count == 1) | (step % count == count - 1)
    else:
        neighbours = np.abs(step) == 1
    along = (polyline.directions[others] * polyline.directions[one]).sum(axis=1)
    folded = along < -1.0 + 1e-12
    return np.where(neighbours, folded, across)


def _meeting_place(polyline: Polyline, one: int, other: int) -> np.ndarray:
    """Return the common point (2,) [m] of two edges; of two on one line, a corner on both."""
    starts, ways = polyline.starts, polyline.ways
    a, way, c = starts[one], ways[one], starts[other]
    turn = float(_cross(way, ways[other]))
    if turn != 0.0:
        return np.asarray(a + way * _cross(c - a, ways[other]) / turn)
    for corner in (c, c + ways[other]):
        if 0.0 <= (corner - a) @ way <= way @ way:
            return corner
    return a


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
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


# -------------------------------------------------------------------------------------------------
# Polylines of a scene, in a section or the same at every z.


DRAWN_BESIDE = 0.25
"""Width of a drawn wall in space beyond each side of the bodies, relative to their width."""


def polyline_walls(names: Names, motions: Collection[str]) -> list[PolylineWall]:
    """Return the polyline walls of a scene."""
    return [polyline_wall(names, *named) for named in names.walls(PolylineWallSpec).items()]


def polyline_wall(names: Names, name: str, wall: PolylineWallSpec) -> PolylineWall:
    """Return one polyline wall, with its points from the scene or from a file."""
    keys = ("environment", "walls", name)
    source = "points" if wall.file is None else "file"
    try:
        if wall.points is not None:
            places = [in_plane(names, p, (*keys, source, k)) for k, p in enumerate(wall.points)]
            points = np.array(places).reshape(-1, 2)
        else:
            points = read_points(names.loaded.resolve_file((*keys, source)), wall.length_unit)
        return placed_wall(names, name, checked_polyline(points, wall.closed))
    except MeshError as error:
        raise names.loaded.error((*keys, source), error.message, error.hint) from None


def placed_wall(names: Names, name: str, line: Polyline) -> PolylineWall:
    """Return the wall `name` along a polyline; in space it is drawn wider than the bodies."""
    if names.dimension == 2:
        return PolylineWall(name, line, None)
    z = np.concatenate([body.mesh.points[:, 2] for body in names.bodies.values()])
    beside = DRAWN_BESIDE * float(np.ptp(z))
    return PolylineWall(name, line, (float(z.min()) - beside, float(z.max()) + beside))


def in_plane(names: Names, point: Point, keys: Keys) -> np.ndarray:
    """Return a point (2,) [m] of a polyline."""
    place = names.vector(point, keys)
    if place[2:].any():
        raise names.loaded.error(
            keys,
            "the wall is the same at every z, so its points have no z coordinate",
            "leave the third coordinate out",
        )
    return place[:2]
