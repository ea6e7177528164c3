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

from softsim.compute.fields import index_field, padded, real_field, vector_field
from softsim.compute.vectors import KernelVectors, Vectors
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

    def holds(self, x: np.ndarray) -> np.ndarray:
        """Return a mask (n,) of the points x (n, d) that lie in both enlarged bores."""
        return np.asarray(self.formulas.is_between(self._coordinates(x), *self.enlarged))

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Return the signed gap (n,) [m] of points x (n, d) that lie in both enlarged bores."""
        return self._gap_and_normal(x)[0]

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """Return the gradient of that gap: unit vectors (n, d)."""
        return self._gap_and_normal(x)[1].T

    @property
    def formulas(self) -> "EdgeFormulas":
        """Formulas of its rounded edge."""
        return EdgeFormulas(len(self.centre))

    @property
    def _axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Centre, run and branch as vectors (d, 1)."""
        return self.centre[:, None], self.run[:, None], self.branch[:, None]

    def _coordinates(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(self.formulas.coordinates(x.T, *self._axes))

    def _gap_and_normal(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        gap, normal = self.formulas.gap_and_normal(
            x.T, self._coordinates(x), *self._axes, *self.enlarged, self.fillet, self.opposite
        )
        return gap, normal


class EdgeFormulas(Vectors):
    """Formulas of the rounded edge of a junction in a space of a dimension.

    A, B: enlarged radii [m]; at: coordinates |xi|, eta and |zeta| [m] of a point.
    """

    def __init__(self, dimension: int) -> None:
        self.dimension = dimension

    def coordinates(self, x, centre, run, branch):
        """Return |xi|, eta and |zeta| [m] of a point x."""
        arm = x - centre
        xi, eta = self.dot(arm, run), self.dot(arm, branch)
        return self.vector([abs(xi), eta, self.norm(arm - xi * run - eta * branch)])

    def is_between(self, at, A, B):
        """Return True if a point lies in both enlarged bores."""
        from_run = at[1] * at[1] + at[2] * at[2]
        from_branch = at[0] * at[0] + at[2] * at[2]
        return (at[1] > 0.0) & (from_run < A * A) & (from_branch < B * B)

    def gap_and_normal(self, x, at, centre, run, branch, A, B, fillet, opposite):
        """Return the signed gap [m] of a point x in both enlarged bores, and the unit normal."""
        way = at - self.nearest(at, A, B, opposite)
        distance = self.norm(way)
        way = way / distance
        arm = x - centre
        xi = self.dot(arm, run)
        rest = arm - xi * run - at[1] * branch
        normal = way[1] * branch + way[2] / self.maximum(at[2], 1e-12) * rest
        normal = normal + self.where(xi < 0.0, -way[0], way[0]) * run
        return distance - fillet, normal

    def nearest(self, at, A, B, opposite):
        """Return the point p of C nearest to a point."""
        xi, eta, zeta = at[0], at[1], at[2]
        from_run, from_branch = self.sqrt(eta * eta + zeta * zeta), self.sqrt(xi * xi + zeta * zeta)
        by_run, by_branch = A / self.maximum(from_run, 1e-12), B / self.maximum(from_branch, 1e-12)
        p = self.where(
            A - from_run >= B - from_branch,
            self.vector([xi, by_run * eta, by_run * zeta]),
            self.vector([by_branch * xi, eta, by_branch * zeta]),
        )
        in_run = p[1] * p[1] + p[2] * p[2] < A * A * (1.0 - 1e-14)
        in_branch = p[0] * p[0] + p[2] * p[2] < B * B * (1.0 - 1e-14)
        is_on_edge = in_run | in_branch
        if self.any(is_on_edge):
            p = self.where(is_on_edge, self.edge(self.edge_angle(at, A, B), A, B), p)
        is_opposite = eta - opposite < self.norm(at - p)
        return self.where(is_opposite, self.vector([xi, opposite + 0.0 * xi, zeta]), p)

    def edge(self, theta, A, B):
        """Return the point p [m] of the edge at an angle theta about the branch."""
        sine = self.sin(theta)
        return self.vector([B * self.cos(theta), self.edge_height(sine, A, B), B * sine])

    def edge_height(self, sine, A, B):
        """Return eta [m] of the edge; its square must not be negative by round-off."""
        return self.sqrt(self.maximum(A * A - B * B * sine * sine, 0.0))

    def edge_angle(self, at, A, B):
        """Return theta of the nearest point of the edge.

        Newton's method, kept in an interval that shrinks.
        """
        xi, eta, zeta = at[0], at[1], at[2]
        theta = 0.0 * xi
        if ti.static(self.dimension == 3):
            low, high = 0.0 * xi, 0.0 * xi + RIGHT_ANGLE
            theta = self.atan2(zeta, xi)
            for _ in range(MOST_STEPS):
                sine, cosine = self.sin(theta), self.cos(theta)
                height = self.maximum(self.edge_height(sine, A, B), 1e-30)
                # Both over B: half the derivative of |x - p|^2, and the derivative of that.
                lift = B * (eta * cosine / height - cosine)
                slope = xi * sine - zeta * cosine + sine * lift
                bend = xi * cosine + zeta * sine + cosine * lift
                bend = bend + B * sine * sine * (1.0 - eta * (A * A - B * B) / height**3)
                low = self.where(slope > 0.0, low, theta)
                high = self.where(slope > 0.0, theta, high)
                newton = theta - slope / self.where(bend > 0.0, bend, 1.0)
                is_good = (bend > 0.0) & (newton >= low) & (newton <= high)
                following = self.where(is_good, newton, 0.5 * (low + high))
                step = abs(following - theta)
                theta = following
                if self.all(step < LEAST_STEP):
                    break
        return theta


@ti.data_oriented  # an argument of functions in kernels
class KernelEdgeFormulas(KernelVectors):
    """Formulas of rounded edges in kernels."""

    def __init__(self, dimension: int) -> None:
        self.dimension = dimension

    coordinates = ti.func(EdgeFormulas.coordinates)
    is_between = ti.func(EdgeFormulas.is_between)
    gap_and_normal = ti.func(EdgeFormulas.gap_and_normal)
    nearest = ti.func(EdgeFormulas.nearest)
    edge = ti.func(EdgeFormulas.edge)
    edge_height = ti.func(EdgeFormulas.edge_height)
    edge_angle = ti.func(EdgeFormulas.edge_angle)


class RoundedEdges:
    """Rounded edges of junctions in kernels, those of `walls` per scenario.

    Fields, (scenarios, ...): count; of each junction centre, run, branch, enlarged radii (A, B),
    fillet, opposite.
    """

    def __init__(self, walls: Sequence[Sequence[Junction]], dimension: int) -> None:
        self.formulas = KernelEdgeFormulas(dimension)
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
        return self.formulas.coordinates(x, self.centre[s, j], self.run[s, j], self.branch[s, j])

    @ti.func
    def holds(self, s, j, at):
        """Return True if the point with the coordinates `at` lies in both enlarged bores."""
        return self.formulas.is_between(at, self.enlarged[s, j][0], self.enlarged[s, j][1])

    @ti.func
    def gap_and_normal(self, s, j, x, at):
        """Return the signed gap [m] of a point x in both enlarged bores, and the unit normal."""
        return self.formulas.gap_and_normal(
            x, at, self.centre[s, j], self.run[s, j], self.branch[s, j], self.enlarged[s, j][0],
            self.enlarged[s, j][1], self.fillet[s, j], self.opposite[s, j],
        )  # fmt: skip
