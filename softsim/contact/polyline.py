"""Polylines in the plane, free on one side: exact signed distances, and checks of a polyline.

The free side is on the left in the direction of the points. A polyline that is not closed continues
straight beyond its ends, to infinity.

The sign of the distance is that of the vector from the nearest point, projected on the normal
there: an edge's own inside it, at a corner the sum of both (Baerentzen and Aanaes, IEEE Trans. Vis.
Comput. Graph. 11 (2005) 243, in the plane). It is right whichever of two edges that meet is taken.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from softsim.errors import MeshError
from softsim.sharing import Own

PAIRS = 2**18
"""Number of pairs of a point and an edge that are computed together: some 50 MB."""


@dataclass(frozen=True, eq=False)
class Polyline:
    """Polyline through points (n, 2) [m], of which no two neighbours are the same.

    closed: True if the last point is joined to the first. The first and the last point of an open
    one only give its direction there, see `prolonged`.
    """

    points: Own[np.ndarray]
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
