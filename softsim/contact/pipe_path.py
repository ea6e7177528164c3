"""Pipe along a path: straight, bent and tapered segments, and steps between them, in numpy.

A point is beside a segment if it lies between the planes perpendicular to the path at its ends. The
point is free if its distance d from the centre line is below the pipe's radius r, and r - d is its
gap to the wall of a straight segment (a cylinder) or a bend (a torus). All other walls, cones,
steps and the ends of the pipe, are surfaces of revolution about the tangent of a joint: with the
distance a [m] from the plane of the joint and rho [m] from its tangent they are straight lines in
the half plane of a and rho. The gap is the distance to the nearest of all these, and exact.

Of a bend's wall no point outside its two planes is nearer to the inside than to its rim, so a wall
across a joint matters only where it is a cone, a step or an end of the pipe.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np

from softsim.compute.vectors import NUMPY

# -------------------------------------------------------------------------------------------------
# Segment of a pipe along a path: its centre line and its radius.

STRAIGHT, BEND, TAPER = "straight", "bend", "taper"

# How far the flat face reaches in which an open end lies [m]: it has no rim.
FACE = 100.0


@dataclass(frozen=True, eq=False)
class Segment:
    """Segment of a path.

    kind: straight, bend or taper. item: its number in the list that it is from. start: arc length
    at its start [m]; length [m]. point (d,) [m], tangent and side (d,): start, direction there, and
    direction towards which it bends (unit vector normal to the tangent; any such vector if
    straight). bend_radius: of the centre line, infinite unless a bend. radii: of the pipe at both
    ends [m], different only for a taper.
    """

    kind: str
    item: int
    start: float
    length: float
    point: np.ndarray
    tangent: np.ndarray
    side: np.ndarray
    bend_radius: float
    radii: tuple[float, float]

    @property
    def end(self) -> float:
        """Arc length at its end [m]."""
        return self.start + self.length

    @property
    def centre(self) -> np.ndarray:
        """Centre (d,) of a bend [m]."""
        return self.point + self.bend_radius * self.side

    def axis_place(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return points (n, d) [m] and tangents (n, d), s (n,) [m] after `start`.

        Beyond its ends it continues straight.
        """
        if self.kind != BEND:
            return self.point + np.outer(s, self.tangent), np.tile(self.tangent, (len(s), 1))
        within = np.clip(s, 0.0, self.length)
        angle = within / self.bend_radius
        cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
        place = self.centre + self.bend_radius * (sin * self.tangent - cos * self.side)
        tangent = cos * self.tangent + sin * self.side
        return place + (s - within)[:, None] * tangent, tangent

    def along(self, x: np.ndarray) -> np.ndarray:
        """Return the arc length (n,) [m] after `start` of the nearest point of the centre line.

        The line or circle of the segment is extended; on a circle the result is between half a turn
        before and after the middle of the segment.
        """
        if self.kind != BEND:
            return (x - self.point) @ self.tangent
        arm = x - self.centre
        middle = 0.5 * self.length / self.bend_radius
        angle = np.arctan2(arm @ self.tangent, -(arm @ self.side)) - middle
        return self.bend_radius * (np.mod(angle + np.pi, 2.0 * np.pi) - np.pi + middle)

    def radius(self, s: np.ndarray) -> np.ndarray:
        """Return the radius of the pipe (n,) [m], s (n,) [m] after `start`."""
        return self.radii[0] + self.slope * s

    @property
    def slope(self) -> float:
        """Change of the radius with the arc length [-]."""
        return (self.radii[1] - self.radii[0]) / self.length


@dataclass(frozen=True, eq=False)
class Joint:
    """Joint of two segments, or end of the path.

    It is a plane through `point` (d,) [m] perpendicular to the unit vector `tangent` (d,), the
    direction of travel.
    """

    point: np.ndarray
    tangent: np.ndarray

    def coordinates(self, x: np.ndarray) -> np.ndarray:
        """Return the distances (n, 2) [m] a and rho of points x (n, d) from plane and tangent."""
        arm = x - self.point
        a = arm @ self.tangent
        return np.stack([a, np.linalg.norm(arm - np.outer(a, self.tangent), axis=1)], axis=1)


@dataclass(frozen=True, eq=False)
class Piece:
    """Wall of revolution about the tangent of joint number `joint`.

    It is the line between `ends` (2, 2) [m], each a and rho, with the unit `normal` (2,) into the
    free side.
    """

    joint: int
    ends: np.ndarray
    normal: np.ndarray

    @classmethod
    def cone(cls, joint: int, a: float, segment: Segment) -> "Piece":
        """Return the wall of a taper that begins at `a`."""
        way = np.array([segment.length, segment.radii[1] - segment.radii[0]])
        first = np.array([a, segment.radii[0]])
        normal = np.array([way[1], -way[0]]) / np.linalg.norm(way)
        return cls(joint, np.array([first, first + way]), normal)

    @classmethod
    def ring(cls, joint: int, a: float, before: float, after: float) -> "Piece":
        """Return a flat wall at `a` where the radius changes, free on the side of the larger."""
        normal = np.array([np.sign(after - before), 0.0])
        return cls(joint, np.array([[a, before], [a, after]]), normal)


def bore_gap(x, origin, direction, bend_radius, radius, slope, m):
    """Return the signed gap [m] of x to the wall of the segment beside it, and the unit normal.

    origin: a point on the centre line, of a bend its centre. direction: along the centre line, of a
    bend its axis (zero in the plane). bend_radius: 0 unless a bend. radius: that of the pipe at the
    origin, slope: its change with the arc length. The gap to a cone is that straight across, which
    is more than that of its piece.
    """
    arm = x - origin
    a = m.dot(arm, direction)
    across = arm - a * direction
    is_bent = bend_radius > 0.0
    if m.any(is_bent):
        from_axis = arm - bend_radius / m.maximum(m.norm(across), 1e-12) * across
        across = m.where(is_bent, from_axis, across)
    distance = m.norm(across)
    return radius + slope * a - distance, -across / m.maximum(distance, 1e-12)


def piece_distance(x, point, tangent, ends, normal, side, m):
    """Return the distance [m] of x from a piece of the wall, and the unit normal.

    For x beyond an end of the piece the normal is along the line between them. point, tangent:
    those of its joint. ends (4): a, rho, a, rho [m]. side: 1 in free space, -1 in the wall.
    """
    arm = x - point
    along = m.dot(arm, tangent)
    across = arm - along * tangent
    rho = m.norm(across)
    place = m.vector([along, rho])
    first, last = m.vector([ends[0], ends[1]]), m.vector([ends[2], ends[3]])
    way = last - first
    fraction = m.dot(place - first, way) / m.dot(way, way)
    distance, n = abs(m.dot(place - first, normal)), normal
    is_beyond = (fraction < 0.0) | (fraction > 1.0)
    if m.any(is_beyond):
        from_end = place - m.where(fraction > 1.0, last, first)
        size = m.norm(from_end)
        distance = m.where(is_beyond, size, distance)
        n = m.where(is_beyond, side * from_end / m.maximum(size, 1e-12), n)
    return distance, n[0] * tangent + n[1] / m.maximum(rho, 1e-12) * across


@dataclass(frozen=True, eq=False)
class PipePath:
    """Pipe along a path, free inside.

    closed: True for the start and for the end if a flat wall closes it. An open end lies in a flat
    face with only free space in front of it, or, with `goes_on`, the pipe continues straight beyond
    it.
    """

    name: str
    segments: tuple[Segment, ...]
    closed: tuple[bool, bool]
    goes_on: bool = False

    @property
    def length(self) -> float:
        """Length of the centre line [m]."""
        return self.segments[-1].end

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """Joints before each segment, and the end of the path."""
        last = self.segments[-1]
        point, tangent = last.axis_place(np.array([last.length]))
        return (*(Joint(s.point, s.tangent) for s in self.segments), Joint(point[0], tangent[0]))

    @property
    def end_radii(self) -> tuple[float, float]:
        """Radii of the pipe at its start and its end [m]."""
        return self.segments[0].radii[0], self.segments[-1].radii[1]

    @property
    def outer_radii(self) -> tuple[float, float]:
        """Outer radii of the flat walls at the start and the end [m]; 0 where a wall closes it.

        A face beside a bend ends where the bend would come back to it.
        """
        faces = (min(FACE, self.segments[k].bend_radius) for k in (0, -1))
        first, last = self.end_radii if self.goes_on else faces
        return (0.0 if self.closed[0] else first, 0.0 if self.closed[1] else last)

    @property
    def radii_beyond(self) -> tuple[float, float]:
        """Radii of the free space before the start and beyond the end [m]; negative where solid."""
        first, last = self.end_radii if self.goes_on else (FACE, FACE)
        return (-FACE if self.closed[0] else first, -FACE if self.closed[1] else last)

    @cached_property
    def pieces(self) -> tuple[tuple[Piece, ...], ...]:
        """Walls of revolution that a point can be nearest to.

        There is one tuple for points before the start of the path, one for those beside each
        segment, and one for those beyond its end.
        """
        count = len(self.segments)
        beside = []
        for k, segment in enumerate(self.segments):
            reach = max(segment.radii)  # no farther than that from the wall beside it
            own = [Piece.cone(k, 0.0, segment)] if segment.kind == TAPER else []
            beside.append((*own, *self._before(k, reach), *self._after(k + 1, reach)))
        first, last = self.segments[0].radii[0], self.segments[-1].radii[1]
        return (tuple(self._after(0, first)), *beside, tuple(self._before(count, last)))

    def _after(self, joint: int, reach: float) -> Iterator[Piece]:
        """Yield the walls from a joint up to the next bend, at most `reach` [m] from the joint."""
        a = 0.0
        for k in range(joint, len(self.segments) + 1):
            if a > reach:
                return
            yield from self._ring(k, joint, a)
            if k == len(self.segments) or self.segments[k].kind == BEND:
                return
            if self.segments[k].kind == TAPER:
                yield Piece.cone(joint, a, self.segments[k])
            a += self.segments[k].length

    def _before(self, joint: int, reach: float) -> Iterator[Piece]:
        """Yield the walls from a joint back to the bend before it, at most `reach` [m] away."""
        a = 0.0
        for k in range(joint, -1, -1):
            if a < -reach:
                return
            yield from self._ring(k, joint, a)
            if k == 0 or self.segments[k - 1].kind == BEND:
                return
            a -= self.segments[k - 1].length
            if self.segments[k - 1].kind == TAPER:
                yield Piece.cone(joint, a, self.segments[k - 1])

    def _ring(self, number: int, joint: int, a: float) -> Iterator[Piece]:
        """Yield the flat wall at joint `number`, if there is one, at `a` [m] from `joint`."""
        outer = self.outer_radii
        before = outer[0] if number == 0 else self.segments[number - 1].radii[1]
        after = outer[1] if number == len(self.segments) else self.segments[number].radii[0]
        if before != after:
            yield Piece.ring(joint, a, before, after)

    def coordinates(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return nearest segment, arc length and distance from the centre line of points x (n, d).

        Number of the segment (n,), arc length (n,) [m] after its start, and distance (n,) [m].
        Before the start and beyond the end of the path the centre line continues straight.
        """
        last = len(self.segments) - 1
        along, distance = np.zeros((2, last + 1, len(x)))
        for k, segment in enumerate(self.segments):
            along[k] = np.clip(segment.along(x), 0.0, segment.length)
            distance[k] = np.linalg.norm(x - segment.axis_place(along[k])[0], axis=1)
        nearest = distance.argmin(axis=0)
        one = np.arange(len(x))
        s, d = along[nearest, one], distance[nearest, one]
        at = self.joints[0].coordinates(x)
        before = (nearest == 0) & (s == 0.0) & (at[:, 0] < 0.0)
        s[before], d[before] = at[before].T
        at = self.joints[-1].coordinates(x)
        length = self.segments[last].length
        beyond = (nearest == last) & (s == length) & (at[:, 0] > 0.0)
        s[beyond], d[beyond] = length + at[beyond, 0], at[beyond, 1]
        return nearest, s, d

    def beside(self, nearest: np.ndarray, along: np.ndarray) -> np.ndarray:
        """Return the index (n,) into `pieces` of the part of the path that each point is beside.

        nearest: nearest segments (n,). along: arc lengths (n,) [m] after their starts.
        """
        last = len(self.segments) - 1
        before = (nearest == 0) & (along < 0.0)
        beyond = (nearest == last) & (along > self.segments[last].length)
        return nearest + np.where(before, 0, np.where(beyond, 2, 1))

    def arc_length(self, x: np.ndarray) -> np.ndarray:
        """Return the arc length s (n,) [m] of points x (n, d); below 0 before the start."""
        nearest, along, _ = self.coordinates(x)
        return np.array([s.start for s in self.segments])[nearest] + along

    @cached_property
    def tables(self) -> "SegmentArrays":
        """Data of each segment as arrays."""
        return SegmentArrays(self)

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Return the signed gap (n,) [m] of points x (n, d), negative in the wall."""
        t = self.tables
        k = t.beside(x)
        gap, _ = bore_gap(
            x.T, t.origin[k].T, t.direction[k].T, t.bend_radius[k], t.radius[k], t.slope[k], NUMPY
        )
        for number, pieces in enumerate(self.pieces):
            here = np.flatnonzero(k == number)
            side = np.sign(gap[here])
            for piece in pieces:
                joint = self.joints[piece.joint]
                other, _ = piece_distance(
                    x[here].T, joint.point[:, None], joint.tangent[:, None],
                    piece.ends.reshape(4, 1), piece.normal[:, None], side, NUMPY,
                )  # fmt: skip
                gap[here] = side * np.minimum(other, side * gap[here])
        return np.asarray(gap)

    def axis_place(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return points (n, d) [m] and tangents (n, d) of the centre line at arc lengths s (n,).

        Beyond the ends it continues straight.
        """
        starts = np.array([segment.start for segment in self.segments])
        number = np.clip(np.searchsorted(starts, s, side="right") - 1, 0, len(starts) - 1)
        dimension = len(self.segments[0].point)
        place, tangent = np.zeros((2, len(s), dimension))
        for k, segment in enumerate(self.segments):
            here = number == k
            place[here], tangent[here] = segment.axis_place(s[here] - segment.start)
        return place, tangent

    def segment_at(self, s: float) -> Segment:
        """Return the segment at the arc length s [m]; the first and last extend beyond the ends."""
        starts = [segment.start for segment in self.segments]
        return self.segments[max(0, int(np.searchsorted(starts, s, side="right")) - 1)]


class SegmentArrays:
    """Data of each segment of a path as arrays (segments + 2, ...).

    The first and last are those of the spaces before its start and beyond its end.
    """

    def __init__(self, wall: PipePath) -> None:
        self.bore, self.pieces = wall, wall.pieces
        first, last = wall.joints[0], wall.joints[-1]
        segments = wall.segments
        dimension = len(first.point)
        bends = [s.kind == BEND for s in segments]
        middles = [s.axis_place(np.array([0.5 * s.length])) for s in segments]
        origins = [s.centre if bent else s.point for s, bent in zip(segments, bends, strict=True)]
        directions = [
            across_bend(s.tangent, s.side) if bent else s.tangent
            for s, bent in zip(segments, bends, strict=True)
        ]
        outside = wall.radii_beyond
        self.origin = np.array([first.point, *origins, last.point])
        self.direction = np.array([first.tangent, *directions, last.tangent])
        self.bend_radius = np.array(
            [0.0, *np.where(bends, [s.bend_radius for s in segments], 0.0), 0.0]
        )
        self.radius = np.array([outside[0], *(s.radii[0] for s in segments), outside[1]])
        self.slope = np.array([0.0, *(s.slope for s in segments), 0.0])
        # The spaces before and beyond have one end only: their middle is far away.
        self.middle = np.array(
            [
                first.point - FACE * first.tangent,
                *(place[0] for place, _ in middles),
                last.point + FACE * last.tangent,
            ]
        ).reshape(-1, dimension)
        self.half_way = np.array(
            [first.tangent, *(tangent[0] for _, tangent in middles), last.tangent]
        )
        # There is no joint after the space beyond the end: nothing asks for it.
        self.joint_point = np.array([*(joint.point for joint in wall.joints), last.point])
        self.joint_tangent = np.array([*(joint.tangent for joint in wall.joints), last.tangent])

    def beside(self, places: np.ndarray) -> np.ndarray:
        """Return the segments (k,) that points (k, d) are beside."""
        return self.bore.beside(*self.bore.coordinates(places)[:2])


def across_bend(tangent: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Return the axis (d,) about which a bend turns; zero in the plane, which has none."""
    return np.cross(tangent, side) if len(tangent) == 3 else np.zeros(2)


# -------------------------------------------------------------------------------------------------
# Features of a pipe's path: joints, steps and narrow places. Geometry in numpy.


class FeaturePosition(Enum):
    """Position of a feature relative to the list item that it belongs to."""

    BEGINNING = "beginning of"
    END = "end of"
    STEP = ""


@dataclass(frozen=True)
class Feature:
    """Position `place` [m] along a path where the pipe changes.

    item: the item of the user's list that begins or ends there, or that is a step there.
    """

    place: float
    item: int
    edge: FeaturePosition


def features(path: PipePath) -> list[Feature]:
    """Return the joints at which something changes, and steps; the path's ends are not included."""
    found = []
    for before, after in zip(path.segments[:-1], path.segments[1:], strict=True):
        if before.radii[1] != after.radii[0]:
            # The step stands between them in the list; the last one decides, should there be two.
            found.append(Feature(after.start, after.item - 1, FeaturePosition.STEP))
        elif after.kind != STRAIGHT and not _goes_on(before, after):
            found.append(Feature(after.start, after.item, FeaturePosition.BEGINNING))
        elif before.kind != after.kind:
            found.append(Feature(after.start, before.item, FeaturePosition.END))
    return found


def _goes_on(before: Segment, after: Segment) -> bool:
    """Return True if the same bend continues in the next segment."""
    return (
        before.kind == after.kind == BEND
        and before.bend_radius == after.bend_radius
        and bool(np.allclose(before.centre, after.centre))
    )


def nearest_feature(path: PipePath, place: float) -> Feature | None:
    """Return the feature nearest to a position [m] along the path, or None if it has none."""
    return min(features(path), key=lambda f: abs(f.place - place), default=None)


def narrowings(path: PipePath) -> np.ndarray:
    """Return the intervals (k, 2) [m] along the path in which the pipe narrows.

    They are counted from its start to its end: tapers, and steps, which have no length.
    """
    found = [(s.start, s.end) for s in path.segments if s.radii[1] < s.radii[0]]
    found += [
        (after.start, after.start)
        for before, after in zip(path.segments[:-1], path.segments[1:], strict=True)
        if after.radii[0] < before.radii[1]
    ]
    return np.array(sorted(found)).reshape(-1, 2)
