"""A pipe along a path: straight, bent and tapered segments, steps between them. Geometry in numpy.

A place lies beside a segment: between the planes across the path at both of its ends. There its
distance d from the centre line, against the pipe's radius, tells whether it is free, and r - d is
its gap to the wall of a straight segment (a cylinder) or a bend (a torus). All other walls, cones,
steps and the ends of the pipe, are bodies of revolution about the tangent of a joint: with the
distance a [m] from the plane of the joint and rho [m] from its tangent they are straight lines in
the half plane of a and rho. The gap is the distance to the nearest of all these, and exact.

Of a bend's wall no place outside its two planes is nearer to the inside of it than to its rim, so a
wall across a joint matters only where it is a cone, a step or an end of the pipe.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from softsim.contact.pipe_segment import BEND, FACE, TAPER, Segment


@dataclass(frozen=True, eq=False)
class Joint:
    """Where segments meet or the path ends: a plane through `point` (d,) [m] across the unit vector
    `tangent` (d,), the direction of travel.
    """

    point: np.ndarray
    tangent: np.ndarray

    def coordinates(self, x: np.ndarray) -> np.ndarray:
        """Distances (n, 2) [m] of places x (n, d): a from the plane, rho from the tangent."""
        arm = x - self.point
        a = arm @ self.tangent
        return np.stack([a, np.linalg.norm(arm - np.outer(a, self.tangent), axis=1)], axis=1)


@dataclass(frozen=True, eq=False)
class Piece:
    """A wall of revolution about the tangent of joint number `joint`: the line between `ends`
    (2, 2) [m], each a and rho, with the unit `normal` (2,) into the free side.
    """

    joint: int
    ends: np.ndarray
    normal: np.ndarray

    @classmethod
    def cone(cls, joint: int, a: float, segment: Segment) -> "Piece":
        """The wall of a taper that begins at `a`."""
        way = np.array([segment.length, segment.radii[1] - segment.radii[0]])
        first = np.array([a, segment.radii[0]])
        normal = np.array([way[1], -way[0]]) / np.linalg.norm(way)
        return cls(joint, np.array([first, first + way]), normal)

    @classmethod
    def ring(cls, joint: int, a: float, before: float, after: float) -> "Piece":
        """A flat wall at `a` where the radius changes: free on the side of the larger one."""
        normal = np.array([np.sign(after - before), 0.0])
        return cls(joint, np.array([[a, before], [a, after]]), normal)

    def distance(self, at: np.ndarray) -> np.ndarray:
        """Distance (n,) [m] of places at (n, 2)."""
        way = self.ends[1] - self.ends[0]
        arm = at - self.ends[0]
        share = np.clip(arm @ way / (way @ way), 0.0, 1.0)
        return np.asarray(np.linalg.norm(arm - share[:, None] * way, axis=1))


@dataclass(frozen=True, eq=False)
class PipePath:
    """A pipe whose wall is free inside. closed: whether a flat wall closes its start, its end. An
    open end lies in a flat face and has nothing but free space before it, or the pipe `goes_on`
    straight beyond it.
    """

    name: str
    segments: tuple[Segment, ...]
    closed: tuple[bool, bool]
    goes_on: bool = False

    @property
    def length(self) -> float:
        """Of the centre line [m]."""
        return self.segments[-1].end

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """Before each segment, and the end of the path."""
        last = self.segments[-1]
        point, tangent = last.axis_place(np.array([last.length]))
        return (*(Joint(s.point, s.tangent) for s in self.segments), Joint(point[0], tangent[0]))

    @property
    def end_radii(self) -> tuple[float, float]:
        """Of the pipe at its start and its end [m]."""
        return self.segments[0].radii[0], self.segments[-1].radii[1]

    @property
    def outer_radii(self) -> tuple[float, float]:
        """Of the flat walls at the start and the end [m]: none where a wall closes it. A face
        beside a bend ends where the bend would come back to it.
        """
        faces = (min(FACE, self.segments[k].bend_radius) for k in (0, -1))
        first, last = self.end_radii if self.goes_on else faces
        return (0.0 if self.closed[0] else first, 0.0 if self.closed[1] else last)

    @property
    def radii_beyond(self) -> tuple[float, float]:
        """Of the free space before the start and beyond the end [m]; negative: all is solid."""
        first, last = self.end_radii if self.goes_on else (FACE, FACE)
        return (-FACE if self.closed[0] else first, -FACE if self.closed[1] else last)

    @cached_property
    def pieces(self) -> tuple[tuple[Piece, ...], ...]:
        """The walls of revolution that a place can be nearest to: before the start of the path,
        beside each of its segments, and beyond its end.
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
        """From a joint on up to the next bend, no farther than `reach` [m]."""
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
        """From a joint back to the bend before it, no farther than `reach` [m]."""
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
        """The flat wall at joint `number`, if there is one, at `a` [m] from `joint`."""
        outer = self.outer_radii
        before = outer[0] if number == 0 else self.segments[number - 1].radii[1]
        after = outer[1] if number == len(self.segments) else self.segments[number].radii[0]
        if before != after:
            yield Piece.ring(joint, a, before, after)

    def coordinates(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Number of the nearest segment (n,), arc length (n,) after its start and distance from
        the centre line (n,) [m] of places x (n, d). Before the start and beyond the end of the
        path the centre line goes straight on.
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
        """Where places are (n,), numbered as `pieces` are, by their nearest segments (n,) and the
        arc lengths (n,) [m] after the starts of these.
        """
        last = len(self.segments) - 1
        before = (nearest == 0) & (along < 0.0)
        beyond = (nearest == last) & (along > self.segments[last].length)
        return nearest + np.where(before, 0, np.where(beyond, 2, 1))

    def arc_length(self, x: np.ndarray) -> np.ndarray:
        """Arc length s (n,) [m] of places x (n, d); below 0 before the start."""
        nearest, along, _ = self.coordinates(x)
        return np.array([s.start for s in self.segments])[nearest] + along

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Signed gap (n,) [m] of places x (n, d), negative in the wall."""
        nearest, along, distance = self.coordinates(x)
        beside = self.beside(nearest, along)
        result = np.zeros(len(x))
        for number, pieces in enumerate(self.pieces):
            here = np.flatnonzero(beside == number)
            radius, to_wall = self._own_wall(number, along[here], distance[here])
            for piece in pieces:
                at = self.joints[piece.joint].coordinates(x[here])
                to_wall = np.minimum(to_wall, piece.distance(at))
            result[here] = np.where(distance[here] < radius, to_wall, -to_wall)
        return result

    def _own_wall(
        self, number: int, along: np.ndarray, distance: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Radius of the free space (n,) [m] where places are, negative where there is none, and
        their distance (n,) [m] from the wall around it, infinite where that is one of the pieces.
        """
        count, nowhere = len(self.segments), np.full(len(along), np.inf)
        if number in (0, count + 1):
            radius = np.full(len(along), self.radii_beyond[number > 0])
            return radius, np.abs(radius - distance) if self.goes_on else nowhere
        segment = self.segments[number - 1]
        radius = segment.radius(along)
        return radius, nowhere if segment.kind == TAPER else np.abs(radius - distance)

    def axis_place(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Point of the centre line (n, d) [m] and unit tangent (n, d) at arc lengths s (n,) [m];
        beyond the ends it goes straight on.
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
        """The segment that has the arc length s [m]; the first and last go on beyond the ends."""
        starts = [segment.start for segment in self.segments]
        return self.segments[max(0, int(np.searchsorted(starts, s, side="right")) - 1)]
