"""Layout of a pipe: conversion of a user's list of segments into a path in space."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from softsim.contact.junction import RIGHT_ANGLE, Junction
from softsim.contact.pipe_network import Branch, PipeNetwork
from softsim.contact.pipe_path import BEND, STRAIGHT, TAPER, PipePath, Segment


@dataclass(frozen=True)
class Straight:
    """Straight segment of `length` [m]."""

    length: float


@dataclass(frozen=True)
class Bend:
    """Arc of `angle` [rad] > 0 with the centre line's `radius` [m].

    turned: direction of the bend [rad], about the direction of travel, from the left (+y of a path
    that begins along +x).
    """

    angle: float
    radius: float
    turned: float


@dataclass(frozen=True)
class Taper:
    """Cone of `length` [m] that ends with the diameter `to` [m]."""

    length: float
    to: float


@dataclass(frozen=True)
class DiameterStep:
    """Change of the diameter to `to` [m] from here on: a flat ring perpendicular to the axis."""

    to: float


@dataclass(frozen=True)
class Fork:
    """Fitting of `length` [m] with pipes of the diameter `to` [m] that leave at a right angle.

    They leave in its middle. sides: angle [rad] of each by name, about the direction of travel,
    from the left. goes_on: True if the pipe also continues straight ahead; otherwise it ends
    between two that leave in opposite directions. fillet [m]: radius of the edges between the
    walls.
    """

    length: float
    sides: Mapping[str, float]
    to: float
    goes_on: bool
    fillet: float


Item = Straight | Bend | Taper | DiameterStep | Fork


@dataclass(frozen=True)
class PathPose:
    """Position and orientation reached along a pipe.

    place (d,) [m]; frame (3, 3): the directions forward, left and up; radius [m]; arc: arc length
    [m].
    """

    place: np.ndarray
    frame: np.ndarray
    radius: float
    arc: float

    def side(self, angle: float) -> np.ndarray:
        """Return the transverse direction (3,) at an angle [rad] from the left."""
        return np.asarray(np.cos(angle) * self.frame[1] + np.sin(angle) * self.frame[2])

    def turned_to(self, side: np.ndarray, angle: float) -> np.ndarray:
        """Return the frame (3, 3) turned by an angle [rad] towards a side (3,)."""
        axis = np.cross(self.frame[0], side)
        return np.stack([turned(v, axis, angle) for v in self.frame])


def path_of_items(
    name: str,
    items: Sequence[Item],
    diameter: float,
    start: np.ndarray,
    closed: tuple[bool, bool],
) -> PipePath:
    """Return the path of `items` from `start` (d,) [m] along +x.

    At least one item is not a step, and none is a fork. diameter [m]: that at the start.

    Direction and left turn with each bend about its own axis, so that the frame of a path is never
    twisted; in the plane only turned = 0 and pi stay in it.
    """
    laid, _ = segments_of(items, beginning(diameter, start), 0)
    return PipePath(name, laid, closed)


def beginning(diameter: float, start: np.ndarray) -> PathPose:
    """Return the pose at the start of a pipe."""
    return PathPose(np.array(start, dtype=float), np.eye(3), 0.5 * diameter, 0.0)


def segments_of(
    items: Sequence[Item], pose: PathPose, first: int
) -> tuple[tuple[Segment, ...], list[tuple[Fork, PathPose, int]]]:
    """Return the segments of items from a pose on, and the forks.

    Items are numbered from `first` on. Each fork comes with the pose in its middle and its number.
    """
    segments, forks = [], []
    for number, item in enumerate(items, first):
        if isinstance(item, DiameterStep):
            pose = replace(pose, radius=0.5 * item.to)
            continue
        if isinstance(item, Fork):
            _, middle = advanced(pose, Straight(0.5 * item.length), number)
            forks.append((item, middle, number))
            item = Straight(item.length if item.goes_on else 0.5 * item.length)
        segment, pose = advanced(pose, item, number)
        segments.append(segment)
    return tuple(segments), forks


def advanced(
    pose: PathPose, item: Straight | Bend | Taper, number: int
) -> tuple[Segment, PathPose]:
    """Return the segment of an item from a pose on, and the pose at its end."""
    d = len(pose.place)
    side, bend_radius, kind, end_radius = pose.frame[1], np.inf, STRAIGHT, pose.radius
    if isinstance(item, Bend):
        kind, bend_radius, length = BEND, item.radius, item.radius * item.angle
        side = pose.side(item.turned)
    elif isinstance(item, Taper):
        kind, length, end_radius = TAPER, item.length, 0.5 * item.to
    else:
        length = item.length
    segment = Segment(
        kind=kind, item=number, start=pose.arc, length=length, point=pose.place,
        tangent=pose.frame[0][:d], side=side[:d], bend_radius=bend_radius,
        radii=(pose.radius, end_radius),
    )  # fmt: skip
    frame = pose.turned_to(side, item.angle) if isinstance(item, Bend) else pose.frame
    place = segment.axis_place(np.array([length]))[0][0]
    return segment, PathPose(place, frame, end_radius, pose.arc + length)


def network_of_items(
    name: str,
    items: Sequence[Item],
    branches: Mapping[str, Sequence[Item]],
    diameter: float,
    start: np.ndarray,
    closed: Collection[str],
) -> PipeNetwork:
    """Return the network of a pipe of `items` from `start` on and of the branches of its forks.

    `branches`: items by name of the branch, which belongs to one fork of the pipe or of another
    branch. closed: names of the closed ends, which are start, end and the names of branches. Items
    are numbered from those of the pipe on to those of the branches. See `path_of_items` for the
    others.
    """
    if not branches:
        is_closed = ("start" in closed, "end" in closed)
        return PipeNetwork.of_one(path_of_items(name, items, diameter, start, is_closed))
    firsts = np.cumsum([len(items), *map(len, branches.values())])
    first_item = dict(zip(branches, firsts.tolist(), strict=False))
    pose = beginning(diameter, start)
    segments, forks = segments_of(items, pose, 0)
    ends_in_fork = bool(forks) and not forks[-1][0].goes_on
    is_closed = ("start" in closed, ends_in_fork or "end" in closed)
    path = PipePath(name, segments, is_closed, goes_on=True)
    span = (-np.inf, path.length if ends_in_fork else np.inf)
    found = [Branch(path, path, None, span, None if is_closed[1] else "end")]
    junctions, to_do = [], [(0, fork) for fork in forks]
    while to_do:
        parent, (fork, middle, number) = to_do.pop(0)
        junctions += junctions_of(fork, middle)
        for exit_name, angle in fork.sides.items():
            frame = middle.turned_to(middle.side(angle), RIGHT_ANGLE)
            pose = PathPose(middle.place, frame, 0.5 * fork.to, middle.arc)
            stub, pose = advanced(pose, Straight(0.5 * fork.length), number)
            own, forks = segments_of(branches[exit_name], pose, first_item[exit_name])
            ends_in_fork = bool(forks) and not forks[-1][0].goes_on
            ends_closed = ends_in_fork or exit_name in closed
            path = PipePath(exit_name, (stub, *own), (True, ends_closed), goes_on=True)
            bore = path if fork.goes_on else reaching_back(path, 0.5 * fork.length)
            span = (middle.arc, path.length if ends_in_fork else np.inf)
            to_do += [(len(found), each) for each in forks]
            found.append(Branch(path, bore, parent, span, None if ends_closed else exit_name))
    return PipeNetwork(name, tuple(found), tuple(junctions))


def junctions_of(fork: Fork, middle: PathPose) -> list[Junction]:
    """Return the junctions of a fork.

    If the pipe continues, each pipe that leaves it makes one; otherwise the pipe itself is the
    branch of the run that both others make up.
    """
    d, forward = len(middle.place), middle.frame[0]
    sides = [middle.side(angle) for angle in fork.sides.values()]
    own, leaving = middle.radius, 0.5 * fork.to
    if not fork.goes_on:
        return [
            Junction(
                middle.place, sides[0][:d], -forward[:d], (leaving, own), fork.fillet,
                faces_wall=True,
            )
        ]  # fmt: skip
    return [
        Junction(
            middle.place, forward[:d], side[:d], (own, leaving), fork.fillet,
            faces_wall=len(sides) == 1,
        )
        for side in sides
    ]  # fmt: skip


def junctions_by_item(network: PipeNetwork) -> dict[int, Junction]:
    """Return one of the junctions of each fork, which are alike, by the fork's number."""
    found = {}
    for branch in network.branches[1:]:
        start = branch.path.segments[0]
        near = [np.abs(j.centre - start.point).max() for j in network.junctions]
        found[start.item] = network.junctions[int(np.argmin(near))]
    return found


def reaching_back(path: PipePath, by: float) -> PipePath:
    """Return a path whose first segment, which is straight, begins `by` [m] before its start."""
    first = path.segments[0]
    longer = replace(
        first, start=first.start - by, length=first.length + by,
        point=first.point - by * first.tangent,
    )  # fmt: skip
    return replace(path, segments=(longer, *path.segments[1:]))


def turned(vector: np.ndarray, axis: np.ndarray, angle: float) -> np.ndarray:
    """Return a vector (3,) rotated about a unit axis (3,) by `angle` [rad] (Rodrigues)."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.asarray(
        cos * vector + sin * np.cross(axis, vector) + (1.0 - cos) * (axis @ vector) * axis
    )


@dataclass(frozen=True, eq=False)
class _Stretches:
    """Pairs of intervals on the centre lines of two segments, arrays (n, 2).

    owner: numbers of the segments. middle, half: arc length [m] of each interval's middle, and half
    its length.
    """

    owner: np.ndarray
    middle: np.ndarray
    half: np.ndarray

    def chosen(self, mask: np.ndarray) -> "_Stretches":
        """Return the pairs selected by a mask (n,)."""
        return _Stretches(self.owner[mask], self.middle[mask], self.half[mask])

    def halved(self) -> "_Stretches":
        """Return pairs in which the longer interval of each is cut in two."""
        rows, longer = np.arange(len(self.half)), self.half.argmax(axis=1)
        half = self.half.copy()
        half[rows, longer] *= 0.5
        shift = np.zeros_like(half)
        shift[rows, longer] = half[rows, longer]
        return _Stretches(
            np.repeat(self.owner, 2, axis=0),
            np.stack([self.middle - shift, self.middle + shift], axis=1).reshape(-1, 2),
            np.repeat(half, 2, axis=0),
        )


class _CentreLines:
    """Centre lines and radii of all segments of a network, as arrays over the segments."""

    def __init__(self, network: PipeNetwork) -> None:
        owned = [
            (segment, number)
            for number, branch in enumerate(network.branches)
            for segment in branch.path.segments
        ]
        self.segments = [segment for segment, _ in owned]
        self.branch = np.array([number for _, number in owned])
        self.common = arcs_in_common(network)
        self.start, self.length, self.bend_radius, self.radius, self.slope = np.array(
            [(s.start, s.length, s.bend_radius, s.radii[0], s.slope) for s in self.segments]
        ).T
        self.point, self.tangent, self.side = (
            np.array([getattr(s, name) for s in self.segments])
            for name in ("point", "tangent", "side")
        )

    def whole(self, first: int) -> _Stretches:
        """Return pairs of segment `first` and each later one, in their whole lengths."""
        later = np.arange(first + 1, len(self.segments))
        owner = np.stack([np.full_like(later, first), later], axis=1)
        half = 0.5 * self.length[owner]
        return _Stretches(owner, self.start[owner] + half, half)

    def places(self, owner: np.ndarray, arc: np.ndarray) -> np.ndarray:
        """Return points (n, 2, d) [m] of centre lines at arc lengths (n, 2) [m]."""
        along = arc - self.start[owner]
        bend = self.bend_radius[owner]
        bent = np.isfinite(bend)
        safe = np.where(bent, bend, 1.0)
        ahead = np.where(bent, safe * np.sin(along / safe), along)
        aside = np.where(bent, 2.0 * safe * np.sin(0.5 * along / safe) ** 2, 0.0)
        return np.asarray(
            self.point[owner]
            + ahead[..., None] * self.tangent[owner]
            + aside[..., None] * self.side[owner]
        )

    def radii(self, pairs: _Stretches) -> np.ndarray:
        """Return radii (n, 2) [m] of the pipes in the middle of each interval."""
        along = pairs.middle - self.start[pairs.owner]
        return np.asarray(self.radius[pairs.owner] + self.slope[pairs.owner] * along)

    def margins(self, pairs: _Stretches) -> tuple[np.ndarray, np.ndarray]:
        """Return two margins (n,) [m]; two pipes cross where both are positive.

        The first is the overlap of the pipes in the middles of the intervals, the second the excess
        of the path along the pipes over that between neighbours.
        """
        place = self.places(pairs.owner, pairs.middle)
        width = self.radii(pairs).sum(axis=1)
        branch = self.branch[pairs.owner]
        nearer = pairs.middle.min(axis=1)
        shared = np.minimum(self.common[branch[:, 0], branch[:, 1]], nearer)
        way = pairs.middle.sum(axis=1) - 2.0 * shared
        overlap = width - 1e-9 - np.linalg.norm(place[:, 0] - place[:, 1], axis=1)
        return overlap, way - 0.5 * np.pi * width

    def may_cross(self, pairs: _Stretches) -> np.ndarray:
        """Return a mask (n,) of the pairs that can cross anywhere in their intervals.

        Distances and paths change by no more than the arc length, and a radius by no more than its
        slope times that, so the margins in the middles bound those elsewhere.
        """
        overlap, way = self.margins(pairs)
        slope = np.abs(self.slope[pairs.owner])
        return np.asarray(
            (overlap + (pairs.half * (1.0 + slope)).sum(axis=1) > 0.0)
            & (way + (pairs.half * (1.0 + 0.5 * np.pi * slope)).sum(axis=1) > 0.0)
        )


def crossing(network: PipeNetwork) -> tuple[Segment, Segment] | None:
    """Return two segments of a network that run into each other, or None.

    Neighbours touch each other at their joint, so points count only where more than half a turn of
    the tightest bend possible, whose radius is the pipe's own, lies between them along the pipes.
    Intervals of centre lines that cannot meet are left out, the others halved, down to a quarter of
    the radius: the work grows with the logarithm of the lengths.
    """
    lines = _CentreLines(network)
    near = [lines.whole(number) for number in range(len(lines.segments))]
    near = [pairs.chosen(lines.may_cross(pairs)) for pairs in near]
    pairs = _Stretches(
        np.concatenate([p.owner for p in near]),
        np.concatenate([p.middle for p in near]),
        np.concatenate([p.half for p in near]),
    )
    first = len(lines.segments), 0
    while len(pairs.owner):
        met = (np.stack(lines.margins(pairs)) > 0.0).all(axis=0)
        first = min([first, *map(tuple, pairs.owner[met].tolist())])
        earlier = (pairs.owner[:, 0] < first[0]) | (
            (pairs.owner[:, 0] == first[0]) & (pairs.owner[:, 1] < first[1])
        )
        coarse = pairs.half.max(axis=1) > 0.125 * lines.radii(pairs).min(axis=1)
        pairs = pairs.chosen(earlier & coarse).halved()
        pairs = pairs.chosen(lines.may_cross(pairs))
    return (lines.segments[first[0]], lines.segments[first[1]]) if first[1] else None


def arcs_in_common(network: PipeNetwork) -> np.ndarray:
    """Return the arc lengths (n, n) [m] up to which the paths to two branches are the same.

    It is infinite for a branch with itself.
    """
    ways = [network.ways_to(number) for number in range(len(network.branches))]
    return np.array(
        [[max(min(one[b], other[b]) for b in one.keys() & other.keys()) for other in ways]
         for one in ways]
    )  # fmt: skip
