"""Junction of two pipes at a right angle, with the edge between their walls rounded.

Both are cylinders: the run, of radius R about the axis xi, and the branch, of radius r <= R about
the axis eta > 0 that leaves it at the origin; zeta is perpendicular to both, zero in the plane. The
solid with its edge rounded by a radius f is the union of all balls of radius f that fit into it
(morphological opening: Serra, *Image Analysis and Mathematical Morphology*, 1982). Centres of such
balls are farther than f from both bores: outside two cylinders of the radii A = R + f and B = r +
f. With C for the set of these centres the gap is exactly

    g(x) = |x - p| - f,   p the point of C nearest to x,

a distance of slope 1, whose gradient (x - p) / |x - p| is the normal, continuous from one wall over
the fillet to the other. Where x lies in both bores, p lies on the wall of the deeper one, radially
outwards from its axis, unless that point lies in the other bore. Then p lies on the edge of both,

    p(theta) = (B cos theta, sqrt(A^2 - B^2 sin^2 theta), B sin theta),

where (x - p) . dp/dtheta = 0. By symmetry xi and zeta are positive and theta lies between 0 and a
right angle. In the plane theta = 0: the centre of an arc that touches both walls; there the
opposite wall of a run without a second branch may be nearer.

A point more than f deep in the wall is in C: there only the wall of the nearest bore counts, and
the normal jumps where two are equally near. At the sides of pipes of one radius, where their walls
are tangent to each other, edge and fillet vanish.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import index_field, padded, real_field, vector_field
from softsim.contact.pipe_path import FACE

RIGHT_ANGLE = 0.5 * np.pi

# Of the search for the nearest place of the edge: Newton's steps kept in an interval that shrinks;
# ten are the most that were seen, bisection alone would take fifty.
MOST_STEPS = 60
# [rad], below which a step changes nothing.
LEAST_STEP = 1e-14


@dataclass(frozen=True, eq=False)
class Junction:
    """Junction of a branch that leaves a run at `centre` (d,) [m].

    run, branch: unit vectors (d,) along their axes, the latter from the run into the branch. radii:
    of run and branch [m]. fillet [m]: radius of the rounded edge. faces_wall: True if the run has a
    wall opposite to the branch, and no second branch.
    """

    centre: np.ndarray
    run: np.ndarray
    branch: np.ndarray
    radii: tuple[float, float]
    fillet: float
    faces_wall: bool

    @property
    def enlarged(self) -> tuple[float, float]:
        """Enlarged radii A and B [m] of run and branch."""
        return self.radii[0] + self.fillet, self.radii[1] + self.fillet

    @property
    def reach(self) -> float:
        """Distance [m] from the centre over which run and branch must be straight for an exact gap.

        Everywhere between their walls the edge is nearer than anything beyond this distance.
        """
        return sum(self.enlarged)

    @property
    def opposite(self) -> float:
        """Coordinate eta [m] at which C begins on the side opposite to the branch.

        It is -FACE, which is never the nearest, in space and where no wall is opposite.
        """
        is_plane = len(self.centre) == 2
        return -self.enlarged[0] if is_plane and self.faces_wall else -FACE

    def coordinates(self, x: np.ndarray) -> np.ndarray:
        """Return |xi|, eta and |zeta| (n, 3) [m] of points x (n, d)."""
        arm = x - self.centre
        xi, eta = arm @ self.run, arm @ self.branch
        rest = arm - np.outer(xi, self.run) - np.outer(eta, self.branch)
        return np.stack([np.abs(xi), eta, np.linalg.norm(rest, axis=1)], axis=1)

    def holds(self, x: np.ndarray) -> np.ndarray:
        """Return a mask (n,) of the points x (n, d) that lie in both enlarged bores."""
        return self._is_between(self.coordinates(x))

    def _is_between(self, at: np.ndarray) -> np.ndarray:
        xi, eta, zeta = at.T
        A, B = self.enlarged
        return (eta > 0.0) & (np.hypot(eta, zeta) < A) & (np.hypot(xi, zeta) < B)

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Return the signed gap (n,) [m] of points x (n, d) that lie in both enlarged bores."""
        at = self.coordinates(x)
        return np.asarray(np.linalg.norm(at - self._nearest(at), axis=1) - self.fillet)

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """Return the gradient of that gap: unit vectors (n, d)."""
        arm, at = x - self.centre, self.coordinates(x)
        way = at - self._nearest(at)
        way /= np.linalg.norm(way, axis=1)[:, None]
        xi = arm @ self.run
        rest = arm - np.outer(xi, self.run) - np.outer(at[:, 1], self.branch)
        across = way[:, 2] / np.maximum(at[:, 2], 1e-12)
        along = np.where(xi < 0.0, -way[:, 0], way[:, 0])
        return np.asarray(
            np.outer(along, self.run) + np.outer(way[:, 1], self.branch) + across[:, None] * rest
        )

    def _nearest(self, at: np.ndarray) -> np.ndarray:
        """Return the nearest points p (n, 3) [m] of C for coordinates at (n, 3)."""
        A, B = self.enlarged
        xi, eta, zeta = at.T
        from_run, from_branch = np.hypot(eta, zeta), np.hypot(xi, zeta)
        outwards = A / np.maximum(from_run, 1e-12)
        of_run = np.stack([xi, outwards * eta, outwards * zeta], axis=1)
        outwards = B / np.maximum(from_branch, 1e-12)
        of_branch = np.stack([outwards * xi, eta, outwards * zeta], axis=1)
        p = np.where((A - from_run >= B - from_branch)[:, None], of_run, of_branch)
        in_run = p[:, 1] ** 2 + p[:, 2] ** 2 < A**2 * (1.0 - 1e-14)
        in_branch = p[:, 0] ** 2 + p[:, 2] ** 2 < B**2 * (1.0 - 1e-14)
        edge = self.edge(self._edge_angles(at))
        p = np.where((in_run | in_branch)[:, None], edge, p)
        opposite = np.stack([xi, np.full(len(at), self.opposite), zeta], axis=1)
        is_nearer = eta - self.opposite < np.linalg.norm(at - p, axis=1)
        return np.where(is_nearer[:, None], opposite, p)

    def edge(self, theta: np.ndarray) -> np.ndarray:
        """Return the points p (n, 3) [m] of the edge at angles theta (n,) about the branch."""
        A, B = self.enlarged
        sine = np.sin(theta)
        return np.stack([B * np.cos(theta), np.sqrt(A**2 - (B * sine) ** 2), B * sine], axis=1)

    def _edge_angles(self, at: np.ndarray) -> np.ndarray:
        """Return theta (n,) of the point of the edge nearest to coordinates at (n, 3)."""
        if len(self.centre) == 2:
            return np.zeros(len(at))
        A, B = self.enlarged
        xi, eta, zeta = at.T
        low, high = np.zeros(len(at)), np.full(len(at), RIGHT_ANGLE)
        theta = np.arctan2(zeta, xi)
        for _ in range(MOST_STEPS):
            sine, cosine = np.sin(theta), np.cos(theta)
            height = np.maximum(np.sqrt(A**2 - (B * sine) ** 2), 1e-30)
            # Both over B: half the derivative of |x - p|^2, and the derivative of that.
            lift = B * (eta * cosine / height - cosine)
            slope = xi * sine - zeta * cosine + sine * lift
            bend = (
                xi * cosine + zeta * sine + cosine * lift
                + B * sine**2 * (1.0 - eta * (A**2 - B**2) / height**3)
            )  # fmt: skip
            low, high = np.where(slope > 0.0, low, theta), np.where(slope > 0.0, theta, high)
            newton = theta - slope / np.where(bend > 0.0, bend, 1.0)
            is_good = (bend > 0.0) & (newton >= low) & (newton <= high)
            following = np.where(is_good, newton, 0.5 * (low + high))
            step = np.abs(following - theta).max(initial=0.0)
            theta = following
            if step < LEAST_STEP:
                break
        return theta


class RoundedEdges:
    """Rounded edges of junctions in kernels (contact/junction.py), those of `walls` per scenario.

    Fields, (scenarios, ...): count; of each junction centre, run, branch, enlarged radii (A, B),
    fillet, opposite.
    """

    def __init__(self, walls: Sequence[Sequence[Junction]], dimension: int) -> None:
        self.dimension = dimension
        self.count = index_field(np.array([len(js) for js in walls]))
        self.centre, self.run, self.branch = (
            vector_field(padded([np.array([getattr(j, name) for j in js]).reshape(-1, dimension)
                                 for js in walls]))
            for name in ("centre", "run", "branch")
        )  # fmt: skip
        self.enlarged = vector_field(
            padded([np.array([j.enlarged for j in js]).reshape(-1, 2) for js in walls])
        )
        self.fillet, self.opposite = (
            real_field(padded([np.array([getattr(j, name) for j in js]) for js in walls]))
            for name in ("fillet", "opposite")
        )

    @ti.func
    def coordinates(self, s, j, x):
        """Return |xi|, eta and |zeta| [m] of a point x."""
        arm = x - self.centre[s, j]
        xi, eta = arm.dot(self.run[s, j]), arm.dot(self.branch[s, j])
        rest = arm - xi * self.run[s, j] - eta * self.branch[s, j]
        return ti.Vector([ti.abs(xi), eta, rest.norm()], dt=backend.real)

    @ti.func
    def holds(self, s, j, at):
        """Return True if the point with the coordinates `at` lies in both enlarged bores."""
        A, B = self.enlarged[s, j][0], self.enlarged[s, j][1]
        from_run = at[1] * at[1] + at[2] * at[2]
        from_branch = at[0] * at[0] + at[2] * at[2]
        return at[1] > 0.0 and from_run < A * A and from_branch < B * B

    @ti.func
    def gap_and_normal(self, s, j, x, at):
        """Return the signed gap [m] of a point x in both enlarged bores, and the unit normal."""
        way = at - self.nearest(s, j, at)
        distance = way.norm()
        way /= distance
        arm = x - self.centre[s, j]
        run, branch = self.run[s, j], self.branch[s, j]
        xi = arm.dot(run)
        rest = arm - xi * run - at[1] * branch
        normal = way[1] * branch + way[2] / ti.max(at[2], 1e-12) * rest
        normal += ti.select(xi < 0.0, -way[0], way[0]) * run
        return distance - self.fillet[s, j], normal

    @ti.func
    def nearest(self, s, j, at):
        """Return the point of C nearest to the coordinates `at`."""
        A, B = self.enlarged[s, j][0], self.enlarged[s, j][1]
        from_run = ti.sqrt(at[1] * at[1] + at[2] * at[2])
        from_branch = ti.sqrt(at[0] * at[0] + at[2] * at[2])
        p = at
        if A - from_run >= B - from_branch:
            outwards = A / ti.max(from_run, 1e-12)
            p[1], p[2] = outwards * at[1], outwards * at[2]
        else:
            outwards = B / ti.max(from_branch, 1e-12)
            p[0], p[2] = outwards * at[0], outwards * at[2]
        in_run = p[1] * p[1] + p[2] * p[2] < A * A * (1.0 - 1e-14)
        in_branch = p[0] * p[0] + p[2] * p[2] < B * B * (1.0 - 1e-14)
        if in_run or in_branch:
            theta = self.edge_angle(A, B, at)
            sine = ti.sin(theta)
            p[0], p[1], p[2] = B * ti.cos(theta), self.edge_height(A, B, sine), B * sine
        if at[1] - self.opposite[s, j] < (at - p).norm():
            p[0], p[1], p[2] = at[0], self.opposite[s, j], at[2]
        return p

    @ti.func
    def edge_angle(self, A, B, at):
        """Return theta of the nearest point of the edge.

        Newton's method, kept in an interval that shrinks.
        """
        theta = ti.cast(0.0, backend.real)
        if ti.static(self.dimension == 3):
            low, high = ti.cast(0.0, backend.real), ti.cast(RIGHT_ANGLE, backend.real)
            theta = ti.atan2(at[2], at[0])
            for _ in range(MOST_STEPS):
                sine, cosine = ti.sin(theta), ti.cos(theta)
                height = ti.max(self.edge_height(A, B, sine), 1e-30)
                lift = B * (at[1] * cosine / height - cosine)
                slope = at[0] * sine - at[2] * cosine + sine * lift
                bend = at[0] * cosine + at[2] * sine + cosine * lift
                bend += B * sine * sine * (1.0 - at[1] * (A * A - B * B) / (height**3))
                if slope > 0.0:
                    high = theta
                else:
                    low = theta
                following = theta - slope / bend
                if not (bend > 0.0 and following >= low and following <= high):
                    following = 0.5 * (low + high)
                step = ti.abs(following - theta)
                theta = following
                if step < LEAST_STEP:
                    break
        return theta

    @ti.func
    def edge_height(self, A, B, sine):
        """Return eta [m] of the edge; its square must not be negative by round-off."""
        return ti.sqrt(ti.max(A * A - B * B * sine * sine, 0.0))
