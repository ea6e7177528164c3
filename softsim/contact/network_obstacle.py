"""Branching pipes in kernels: the gap of contact/pipe_network.py, tracked node by node.

Each node stores the segment of each bore that it is beside, and moves to a neighbour when it has
passed the plane at an end of it: two scalar products find the segment, wherever the path leads. As
the gap is never more than the distance, a free node cannot touch before it has moved by that
distance: until then the gap is not computed. At the joints of cylinders and tori of one radius gap
and normal are continuous.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import taichi as ti

from softsim import backend
from softsim.contact.junction import RoundedEdges
from softsim.contact.pipe_segment import BEND, FACE
from softsim.contact.wall import Obstacle
from softsim.fields import index_field, padded, real_field, vector_field

if TYPE_CHECKING:  # a wall imports its obstacle
    from softsim.contact.pipe_network import PipeNetwork
    from softsim.contact.pipe_path import PipePath


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
        tables = [[Tables(branch.bore) for branch in wall.branches] for wall in walls]
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
    def may_touch(self, s, i, x):
        """Return 0 while contact node i cannot touch the wall, else 1.

        It cannot as long as it has moved less than its gap since that was last computed, and where
        it is found free again.
        """
        answer = 1
        clearance = self.clearance[s, i]
        if (x - self.seen[s, i]).norm_sqr() < clearance * clearance:
            answer = 0
        else:
            self.follow(s, i, x)
            gap, _ = self.gap_and_normal(s, i, 0, x)
            gap -= self.standoff
            self.seen[s, i] = x
            self.clearance[s, i] = ti.max(gap, 0.0)
            if gap > 0.0 and clearance > 0.0:  # without clearance it touched, which has to end
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
        arm = x - self.origin[s, k]
        direction = self.direction[s, k]
        a = arm.dot(direction)
        across = arm - a * direction
        if self.bend_radius[s, k] > 0.0:
            across = arm - self.bend_radius[s, k] / ti.max(across.norm(), 1e-12) * across
        distance = across.norm()
        # Of a cone this is its distance straight across, which is more than that of its piece.
        gap = self.radius[s, k] + self.slope[s, k] * a - distance
        normal = -across / ti.max(distance, 1e-12)
        side = ti.math.sign(gap)
        for p in range(self.first_piece[s, k], self.first_piece[s, k + 1]):
            other, n = self.distance_and_normal(s, p, x, side)
            if other < side * gap:
                gap, normal = side * other, n
        return gap, normal

    @ti.func
    def distance_and_normal(self, s, p, x, side):
        """Return the distance [m] of a point x from a piece of the wall, and the piece's normal.

        For a point beyond an end of the piece the normal is along the line between them; side: 1 in
        free space, -1 in the wall.
        """
        j, ends, n = self.piece_joint[s, p], self.piece_ends[s, p], self.piece_normal[s, p]
        arm = x - self.joint_point[s, j]
        tangent = self.joint_tangent[s, j]
        along = arm.dot(tangent)
        across = arm - along * tangent
        rho = across.norm()
        place = ti.Vector([along, rho], dt=backend.real)
        first, last = ti.Vector([ends[0], ends[1]]), ti.Vector([ends[2], ends[3]])
        way = last - first
        share = (place - first).dot(way) / way.dot(way)
        distance = ti.abs((place - first).dot(n))
        if share < 0.0 or share > 1.0:
            corner = first
            if share > 1.0:
                corner = last
            distance = (place - corner).norm()
            n = side * (place - corner) / ti.max(distance, 1e-12)
        return distance, n[0] * tangent + n[1] / ti.max(rho, 1e-12) * across


class Tables:
    """Data of each segment of a bore for the kernels, in numpy: arrays (segments + 2, ...)."""

    def __init__(self, wall: "PipePath") -> None:
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


def joined(tables: Sequence[Tables], name: str) -> np.ndarray:
    """Return an array of several bores as one."""
    return np.concatenate([getattr(table, name) for table in tables])


def across_bend(tangent: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Return the axis (d,) about which a bend turns; zero in the plane, which has none."""
    return np.cross(tangent, side) if len(tangent) == 3 else np.zeros(2)
