"""Branching pipes as one wall; the free space is the union of their bores.

In the wall the gap is the largest of the signed depths in the bores, because the nearest of their
walls is that of the nearest bore; each depth is exact (contact/pipe_path.py). Where two bores meet,
the edge between them is rounded (contact/junction.py). Open ends continue straight, except that of
a path alone (a network of one), which ends in a flat face.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute.fields import index_field, padded, real_field, vector_field
from softsim.compute.term import PerScenario
from softsim.compute.vectors import KERNEL
from softsim.contact.junction import Junction, RoundedEdges
from softsim.contact.pipe_path import PipePath, Segment, SegmentArrays, bore_gap, piece_distance
from softsim.contact.wall import Obstacle, Wall

# -------------------------------------------------------------------------------------------------
# Branching pipes in kernels: the gap, tracked node by node.
#
# Each node stores the segment of each bore that it is beside, and moves to a neighbour when it has
# passed the plane at an end of it: two scalar products find the segment, wherever the path leads.
# As the gap is never more than the distance, a free node cannot touch before it has moved by that
# distance: until then the gap is not computed. At the joints of cylinders and tori of one radius
# gap and normal are continuous.


class NetworkObstacle(Obstacle):
    """Wall of branching pipes, one of `walls` per scenario.

    places: positions of the contact nodes at the start (k, d) [m].

    Segments of all bores are numbered consecutively; the first and last of each bore are the free
    or solid spaces before its start and beyond its end. Joint j lies between segments j and j + 1
    of a bore.

    Fields, (scenarios, ...): bores, their number; of each bore first_segment; of each segment:
    origin (a point of its centre line, of a bend the centre), direction (along it, of a bend the
    axis, which is zero in the plane), bend_radius (0 unless a bend), radius at its start, slope;
    middle, half_way: the plane across its middle; joint_point, joint_tangent of the joint after it;
    first_piece. Of each piece: its joint, ends (a, rho, a, rho), normal. Of each node, (scenarios,
    k): near, (.., bores), the segment that it is beside; seen, its position when its gap was last
    computed [m]; clearance, that gap, or zero [m].
    """

    count = 1

    def __init__(self, walls: Sequence["PipeNetwork"], places: np.ndarray) -> None:
        self.bore_gap, self.piece_distance = ti.func(bore_gap), ti.func(piece_distance)
        tables = [[branch.bore.tables for branch in wall.branches] for wall in walls]
        self.origin = vector_field(padded([joined(ts, "origin") for ts in tables]))
        self.direction = vector_field(padded([joined(ts, "direction") for ts in tables]))
        self.bend_radius = real_field(padded([joined(ts, "bend_radius") for ts in tables]))
        self.radius = real_field(padded([joined(ts, "radius") for ts in tables]))
        self.slope = real_field(padded([joined(ts, "slope") for ts in tables]))
        self.middle = vector_field(padded([joined(ts, "middle") for ts in tables]))
        self.half_way = vector_field(padded([joined(ts, "half_way") for ts in tables]))
        self.joint_point = vector_field(padded([joined(ts, "joint_point") for ts in tables]))
        self.joint_tangent = vector_field(padded([joined(ts, "joint_tangent") for ts in tables]))
        firsts = [np.cumsum([0, *(len(t.radius) for t in ts)]) for ts in tables]
        self.segments = int(max(np.diff(first).max() for first in firsts))
        self.bores = index_field(np.array([len(ts) for ts in tables]))
        self.first_segment = index_field(padded(firsts))
        pieces = [[(p, at) for t, at in zip(ts, first[:-1], strict=True)
                   for beside in t.pieces for p in beside]
                  for ts, first in zip(tables, firsts, strict=True)]  # fmt: skip
        counts = [[len(beside) for t in ts for beside in t.pieces] for ts in tables]
        self.first_piece = index_field(padded([np.cumsum([0, *c]) for c in counts]))
        self.piece_joint = index_field(
            padded([np.array([p.joint + at for p, at in ps], dtype=int) for ps in pieces])
        )
        self.piece_ends = vector_field(
            padded([np.array([p.ends.ravel() for p, _ in ps]).reshape(-1, 4) for ps in pieces])
        )
        self.piece_normal = vector_field(
            padded([np.array([p.normal for p, _ in ps]).reshape(-1, 2) for ps in pieces])
        )
        self.edges = RoundedEdges([wall.junctions for wall in walls], places.shape[1])
        near = padded(
            [
                np.array([t.beside(places) + at for t, at in zip(ts, first[:-1], strict=True)])
                for ts, first in zip(tables, firsts, strict=True)
            ]
        ).transpose(0, 2, 1)
        self.near = index_field(near)
        self.seen = vector_field(np.zeros((len(walls), *places.shape)))
        self.clearance = real_field(np.zeros((len(walls), len(places))))

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return {"near": self.near, "seen": self.seen, "clearance": self.clearance}

    @ti.func
    def may_touch(self, s, i, x, reach: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return 0 while the gap of contact node i at x exceeds `reach`, else 1.

        It does as long as the node has moved less than the excess since the gap was last computed,
        and where it is found free again.
        """
        answer = 1
        clearance = self.clearance[s, i] - reach
        if clearance > 0.0 and (x - self.seen[s, i]).norm_sqr() < clearance * clearance:
            answer = 0
        else:
            self.follow(s, i, x)
            gap, _ = self.gap_and_normal(s, i, 0, x)
            self.seen[s, i] = x
            self.clearance[s, i] = ti.max(gap, 0.0)
            # Without clearance it touched, which has to end.
            if gap > reach and clearance > 0.0:
                answer = 0
        return answer

    @ti.func
    def follow(self, s, i, x):
        """Update the segment that contact node i is beside in each bore."""
        for b in range(self.bores[s]):
            k = self.near[s, i, b]
            for _ in range(self.segments):
                onwards = 0
                # Planes at both ends of a long bend cut each other: each counts on its own half.
                if (x - self.middle[s, k]).dot(self.half_way[s, k]) > 0.0:
                    if (x - self.joint_point[s, k]).dot(self.joint_tangent[s, k]) > 0.0:
                        onwards = 1
                elif (x - self.joint_point[s, k - 1]).dot(self.joint_tangent[s, k - 1]) < 0.0:
                    onwards = -1
                if onwards == 0:
                    break
                k += onwards
            self.near[s, i, b] = k

    @ti.func
    def gap_and_normal(self, s, i, w, x):
        """Return the signed gap [m] of contact node i at x, and the normal of the nearest wall.

        The gap is negative in the wall. After `may_touch` returned 0 it may be that of a segment
        that the node has left; it is not needed then, as no contact exists.
        """
        gap, normal = self.depth_and_normal(s, self.near[s, i, 0], x)
        for b in range(1, self.bores[s]):
            depth, n = self.depth_and_normal(s, self.near[s, i, b], x)
            if depth > gap:
                gap, normal = depth, n
        for j in range(self.edges.count[s]):
            at = self.edges.coordinates(s, j, x)
            if self.edges.holds(s, j, at):
                gap, normal = self.edges.gap_and_normal(s, j, x, at)
        return gap, normal

    @ti.func
    def depth_and_normal(self, s, k, x):
        """Return the signed depth [m] of x in a bore, and the unit normal of its nearest wall.

        x is beside segment k of the bore; the depth is negative outside the bore.
        """
        gap, normal = self.bore_gap(
            x, self.origin[s, k], self.direction[s, k], self.bend_radius[s, k], self.radius[s, k],
            self.slope[s, k], KERNEL,
        )  # fmt: skip
        side = ti.math.sign(gap)
        for p in range(self.first_piece[s, k], self.first_piece[s, k + 1]):
            j = self.piece_joint[s, p]
            other, n = self.piece_distance(
                x, self.joint_point[s, j], self.joint_tangent[s, j], self.piece_ends[s, p],
                self.piece_normal[s, p], side, KERNEL,
            )  # fmt: skip
            if other < side * gap:
                gap, normal = side * other, n
        return gap, normal


def joined(tables: Sequence[SegmentArrays], name: str) -> np.ndarray:
    """Return an array of several bores as one."""
    return np.concatenate([getattr(table, name) for table in tables])


@dataclass(frozen=True, eq=False)
class Branch:
    """Pipe of a network and its bore, which reaches back through the junction where it begins.

    Arc lengths continue those of the pipe `parent` (None for the first pipe) from the point where
    it leaves it [m]. span: interval of arc lengths [m] in which its path belongs to it, infinite
    beyond a free end. exit: name of its end; None where that is closed or another pipe. A path
    alone always has one.
    """

    path: PipePath
    bore: PipePath
    parent: int | None
    span: tuple[float, float]
    exit: str | None


@dataclass(frozen=True, eq=False)
class PipeNetwork(Wall):
    """Wall `name` of branching pipes.

    branches: pipes, the first of which is that of the start. junctions: their junctions.
    """

    name: PerScenario[str]
    branches: PerScenario[tuple[Branch, ...]]
    junctions: PerScenario[tuple[Junction, ...]]

    @classmethod
    def of_one(cls, path: PipePath) -> "PipeNetwork":
        """Return the network of a pipe without branches."""
        return cls(path.name, (Branch(path, path, None, (-np.inf, np.inf), "end"),), ())

    @property
    def names(self) -> tuple[str, ...]:
        return (self.name,)

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Return the signed gap (n,) [m] of points x (n, d), negative in the wall.

        In free space near a junction, outside the space between run and branch, it may be less than
        the distance.
        """
        gap = np.max([branch.bore.gap(x) for branch in self.branches], axis=0)
        for junction in self.junctions:
            held = junction.holds(x)
            gap[held] = junction.gap(x[held])
        return np.asarray(gap)

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        return {self.name: self.gap(x)}

    def obstacle(self, scenarios: Sequence["PipeNetwork"], places: np.ndarray) -> NetworkObstacle:
        return NetworkObstacle(scenarios, places)

    def touched_at_once(self) -> tuple[float, float]:
        """Return 1 for both bounds: in a corner only the nearest piece pushes."""
        return 1, 1.0

    def drawn(self) -> dict[str, np.ndarray]:
        """Return the wall, in the plane as lines and in space as faces, and the centre lines."""
        return drawn_network(self)

    def locate(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the branch (n,) nearest to points x (n, d), and the arc length (n,) [m].

        The nearest is that of the centre line; arc lengths are below 0 before the start.
        """
        along = np.array([np.clip(b.path.arc_length(x), *b.span) for b in self.branches])
        feet = [b.path.axis_place(s)[0] for b, s in zip(self.branches, along, strict=True)]
        nearest = np.array([np.linalg.norm(x - foot, axis=1) for foot in feet]).argmin(axis=0)
        return nearest, along[nearest, np.arange(len(x))]

    def tangents(self, branch: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return unit tangents (n, d) of branches `branch` (n,) at arc lengths s (n,) [m]."""
        found = np.zeros((len(s), len(self.branches[0].path.segments[0].point)))
        for number, one in enumerate(self.branches):
            here = branch == number
            found[here] = one.path.axis_place(s[here])[1]
        return found

    def ways_to(self, branch: int) -> dict[int, float]:
        """Return the branches on the path to a branch -> arc length [m] where the path leaves them.

        The branch itself is included, with infinity.
        """
        found = {branch: np.inf}
        parent = self.branches[branch].parent
        while parent is not None:
            found[parent] = self.branches[branch].span[0]
            branch, parent = parent, self.branches[parent].parent
        return found

    @property
    def exits(self) -> dict[str, int]:
        """Open ends except the start -> number of the branch."""
        return {b.exit: number for number, b in enumerate(self.branches) if b.exit is not None}


# -------------------------------------------------------------------------------------------------
# Drawing of pipes along paths: walls as lines or faces, centre lines as polylines.

# Chord of an arc: at most this angle [rad].
CHORD = np.radians(3.0)
FACES_AROUND = 48
# What is shown of the flat face around an open end: up to this share of the pipe's radius.
FACE_SHARE = 1.25
# Length [m] of the pieces that walls with openings are made of, by the dimension.
BETWEEN_STATIONS = {2: 0.5e-3, 3: 2e-3}
# How far off the rounded edge of two walls at a right angle the sharp one is, in radii.
OFF_THE_EDGE = np.sqrt(2.0) - 1.0
# Round-off of a place [m].
ON_THE_WALL = 1e-9


def drawn_network(network: "PipeNetwork") -> dict[str, np.ndarray]:
    """Return arrays for the figures, by their names in the results (FieldWriter.describe)."""
    if not network.junctions:
        return drawn(network.branches[0].path, np.inf)
    spacing = BETWEEN_STATIONS[len(network.junctions[0].centre)]
    parts = [drawn(branch.path, spacing) for branch in network.branches]
    found = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return {
        name: pieces if name == "centre_lines" else opened(network, pieces, spacing)
        for name, pieces in found.items()
    }


def opened(network: "PipeNetwork", pieces: np.ndarray, spacing: float) -> np.ndarray:
    """Return the pieces of the walls of a network's pipes, open where a pipe leaves another.

    pieces: lines or faces (k, corners, d) [m], `spacing` long. Those in an opening are left out,
    and those beside its edge are moved onto the rounded edge.
    """
    x, middle = pieces.reshape(-1, pieces.shape[2]).copy(), pieces.mean(axis=1)
    opens = np.zeros(len(pieces), dtype=bool)
    for junction in network.junctions:
        held = junction.holds(middle)
        opens[held] = junction.gap(middle[held]) > OFF_THE_EDGE * junction.fillet + 0.5 * spacing
        held = junction.holds(x)
        x[held] -= junction.gap(x[held])[:, None] * junction.gradient(x[held])
    is_wall = (np.abs(network.gap(x)) < ON_THE_WALL).reshape(pieces.shape[:2]).all(axis=1)
    return np.asarray(x.reshape(pieces.shape)[is_wall & ~opens])


def drawn(path: "PipePath", spacing: float) -> dict[str, np.ndarray]:
    """Return the wall of a pipe, in pieces of at most `spacing` [m], and its centre line."""
    _, places, tangents, radii = stations(path.segments, spacing)
    places, tangents = (np.concatenate([a[:1], a, a[-1:]]) for a in (places, tangents))
    share = 1.0 if path.goes_on else FACE_SHARE
    ends = [0.0 if is_closed else share for is_closed in path.closed]
    radii = np.concatenate([[ends[0] * radii[0]], radii, [ends[1] * radii[-1]]])
    keep = np.ones(len(radii), dtype=bool)  # a smooth joint once
    keep[1:] = (np.linalg.norm(np.diff(places, axis=0), axis=1) > 1e-9) | (np.diff(radii) != 0.0)
    places, tangents, radii = places[keep], tangents[keep], radii[keep]
    centre_line = {"centre_lines": np.stack([places[:-1], places[1:]], axis=1)}
    if places.shape[1] == 2:
        return {"wall_lines": wall_lines(places, tangents, radii), **centre_line}
    return {"wall_faces": wall_faces(places, tangents, radii), **centre_line}


def stations(segments: Sequence[Segment], spacing: float = np.inf) -> tuple[np.ndarray, ...]:
    """Return stations along the centre line, no more than `spacing` [m] and a chord apart.

    Arc lengths (n,) [m], positions (n, d) [m], tangents (n, d) and the pipe's radii (n,) [m] there;
    joints appear twice.
    """
    arcs, places, tangents, radii = [], [], [], []
    for segment in segments:
        chord = min(spacing, CHORD * segment.bend_radius)
        s = np.linspace(0.0, segment.length, 2 + int(segment.length / chord))
        place, tangent = segment.axis_place(s)
        arcs.append(segment.start + s)
        places.append(place)
        tangents.append(tangent)
        radii.append(segment.radius(s))
    return tuple(np.concatenate(parts) for parts in (arcs, places, tangents, radii))


def wall_lines(places: np.ndarray, tangents: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return both sides of a pipe in the plane as lines (k, 2, 2) [m], free side on their left."""
    left = np.stack([-tangents[:, 1], tangents[:, 0]], axis=1)
    right_side, left_side = (places + sign * radii[:, None] * left for sign in (-1.0, 1.0))
    along_right = np.stack([right_side[:-1], right_side[1:]], axis=1)
    along_left = np.stack([left_side[1:], left_side[:-1]], axis=1)[::-1]
    return np.concatenate([along_right, along_left])


def wall_faces(places: np.ndarray, tangents: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return a pipe in space as faces (k, 4, 3) [m], right-hand normals into the free side."""
    one = np.cross(np.eye(3)[np.argmin(np.abs(tangents[0]))], tangents[0])
    across = [one / np.linalg.norm(one)]
    for tangent in tangents[1:]:  # carried along without twist
        carried = across[-1] - (across[-1] @ tangent) * tangent
        across.append(carried / np.linalg.norm(carried))
    first = np.array(across)[:, None]
    second = np.cross(tangents[:, None], first)
    angles = np.linspace(0.0, 2.0 * np.pi, FACES_AROUND + 1)[:, None]
    circles = np.cos(angles) * first + np.sin(angles) * second
    rings = places[:, None] + radii[:, None, None] * circles
    sides = [rings[:-1, :-1], rings[1:, :-1], rings[1:, 1:], rings[:-1, 1:]]
    return np.stack(sides, axis=2).reshape(-1, 4, 3)
