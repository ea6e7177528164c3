"""A pipe along a path: straight, bent and tapered segments, steps between them. Geometry in numpy.

A place has path coordinates: s, the arc length [m] of the nearest point of the centre line, and d,
the distance [m] from there. In the half plane of s and d the wall is a chain of straight pieces:
lines along s for straight segments and bends, a slope for a cone, a line along d for a step or a
closed end. The signed gap is the distance to the nearest of them. That is exact for cylinders, tori
and cones, because s and d are lengths there; beside the joint of a bend with something else it is
off by the share gap / bend radius, which vanishes at the wall.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

STRAIGHT, BEND, TAPER = "straight", "bend", "taper"


@dataclass(frozen=True, eq=False)
class Segment:
    """A piece of the path. kind: straight, bend, taper. item: its number in the list it is from.

    start: arc length where it begins [m]; length [m]. point (d,) [m], tangent and side (d,): where
    it begins, its direction there, and the direction towards which it bends (unit, across; any one
    of those across for what is straight). bend_radius: of the centre line, infinite unless a bend.
    radii: of the pipe at both ends [m].
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
        """Arc length where it ends [m]."""
        return self.start + self.length

    @property
    def centre(self) -> np.ndarray:
        """Centre (d,) of a bend [m]."""
        return self.point + self.bend_radius * self.side

    def axis_place(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Point of the centre line (n, d) [m] and tangent there (n, d), s (n,) [m] after `start`;
        beyond its ends it goes on as it is.
        """
        if self.kind != BEND:
            return self.point + np.outer(s, self.tangent), np.tile(self.tangent, (len(s), 1))
        angle = s / self.bend_radius
        cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
        place = self.centre + self.bend_radius * (sin * self.tangent - cos * self.side)
        return place, cos * self.tangent + sin * self.side

    def along(self, x: np.ndarray) -> np.ndarray:
        """Arc length (n,) after `start` [m] of the nearest point of the line, or the circle, that
        the segment is a part of; of a circle between half a turn before and after its middle.
        """
        if self.kind != BEND:
            return (x - self.point) @ self.tangent
        arm = x - self.centre
        middle = 0.5 * self.length / self.bend_radius
        angle = np.arctan2(arm @ self.tangent, -(arm @ self.side)) - middle
        return self.bend_radius * (np.mod(angle + np.pi, 2.0 * np.pi) - np.pi + middle)

    def radius(self, s: np.ndarray) -> np.ndarray:
        """Radius of the pipe (n,) [m], s (n,) [m] after `start`."""
        return self.radii[0] + (self.radii[1] - self.radii[0]) * s / self.length


@dataclass(frozen=True, eq=False)
class PipePath:
    """A pipe whose wall is free inside. closed: whether a flat wall closes its start, its end; an
    open end has nothing beyond it.
    """

    name: str
    segments: tuple[Segment, ...]
    closed: tuple[bool, bool]

    @property
    def length(self) -> float:
        """Of the centre line [m]."""
        return self.segments[-1].end

    @cached_property
    def pieces(self) -> tuple[np.ndarray, ...]:
        """Of each segment the pieces (k, 2, 2) of the wall that a place beside it can be nearest
        to: ends of s after the segment's start, and d. Its own piece comes first; those of a
        neighbour that goes on smoothly are left out.
        """
        return tuple(self._pieces_beside(k) for k in range(len(self.segments)))

    def _pieces_beside(self, k: int) -> np.ndarray:
        segment = self.segments[k]
        length, (first, last) = segment.length, segment.radii
        found = [[(0.0, first), (length, last)]]
        slope = (last - first) / length
        if k > 0:
            before = self.segments[k - 1]
            found += _pieces_across(0.0, first, slope, before.radii[1], -before.length, before)
        elif self.closed[0]:
            found.append([(0.0, 0.0), (0.0, first)])
        if k + 1 < len(self.segments):
            after = self.segments[k + 1]
            found += _pieces_across(length, last, slope, after.radii[0], after.length, after)
        elif self.closed[1]:
            found.append([(length, last), (length, 0.0)])
        return np.array(found)

    def coordinates(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Number of the nearest segment (n,), arc length (n,) after its start and distance from
        the centre line (n,) [m] of places x (n, d). Before the start and beyond the end of the
        path its first and last segment go on.
        """
        count = len(self.segments)
        along, distance = np.zeros((2, count, len(x)))
        for k, segment in enumerate(self.segments):
            low = -np.inf if k == 0 else 0.0
            high = np.inf if k == count - 1 else segment.length
            along[k] = np.clip(segment.along(x), low, high)
            distance[k] = np.linalg.norm(x - segment.axis_place(along[k])[0], axis=1)
        nearest = distance.argmin(axis=0)
        one = np.arange(len(x))
        return nearest, along[nearest, one], distance[nearest, one]

    def arc_length(self, x: np.ndarray) -> np.ndarray:
        """Arc length s (n,) [m] of places x (n, d); below 0 before the start."""
        nearest, along, _ = self.coordinates(x)
        return np.array([s.start for s in self.segments])[nearest] + along

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Signed gap (n,) [m] of places x (n, d), negative in the wall; infinite beyond an open
        end.
        """
        nearest, along, distance = self.coordinates(x)
        result = np.full(len(x), np.inf)
        last = len(self.segments) - 1
        for k, segment in enumerate(self.segments):
            before = (nearest == k) & (along < 0.0)
            beyond = (nearest == k) & (along > segment.length)
            outside = (before & (k == 0)) | (beyond & (k == last))
            is_open = (before & (not self.closed[0])) | (beyond & (not self.closed[1]))
            here = np.flatnonzero((nearest == k) & np.logical_not(outside & is_open))
            at = np.stack([along[here], distance[here]], axis=1)
            free = (at[:, 1] < segment.radius(at[:, 0])) & np.logical_not(outside[here])
            result[here] = np.where(free, 1.0, -1.0) * distance_to_pieces(at, self.pieces[k])
        return result

    def axis_place(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Point of the centre line (n, d) [m] and unit tangent (n, d) at arc lengths s (n,) [m]."""
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


def _pieces_across(
    joint: float, own: float, slope: float, other: float, step: float, neighbour: Segment
) -> list[list[tuple[float, float]]]:
    """Pieces of the wall across the joint at s = `joint` to a neighbour `step` long, which lies
    before it if negative; own, other: radii on both sides of the joint.
    """
    change = (neighbour.radii[1] - neighbour.radii[0]) / neighbour.length
    if own == other and slope == change:
        return []
    far = neighbour.radii[0] if step < 0.0 else neighbour.radii[1]
    found = [[(joint, other), (joint + step, far)]]
    if own != other:
        found.append([(joint, own), (joint, other)])
    return found


def distance_to_pieces(at: np.ndarray, pieces: np.ndarray) -> np.ndarray:
    """Distance (n,) [m] of places at (n, 2) to the nearest of pieces (k, 2, 2)."""
    first, way = pieces[:, 0], pieces[:, 1] - pieces[:, 0]
    arm = at[:, None] - first
    share = np.clip((arm * way).sum(axis=2) / (way**2).sum(axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(arm - share[..., None] * way, axis=2).min(axis=1))
