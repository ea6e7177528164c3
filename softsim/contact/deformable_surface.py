"""Surface of deformable bodies: the points that touch, the facets they touch, the signed gap.

Contact is integrated over each facet by Simpson's rule of a simplex, which is exact for quadratics:
its points are the d vertices, with 1 / (d (d + 1)) of the area each, and the centroid, with d / (d
+ 1). A vertex is shared by the facets around it, so it is one point. The points of each surface are
tested against the facets of the others, and vice versa (two half passes).

A point touches the closest of the facets that face it: those whose normal is within FACING of the
opposite of the point's own. At a flush edge a point therefore finds the face that it presses, not
the side of the other body that happens to be closer. The gap g is the distance to the closest point
y of the facing surface, negative inside: its gradient is the normal n = (x - y) / g for the point
and -w_c n for the vertices of the facet, whatever feature y lies on. The side on which x lies
follows from the normal of the face, edge or vertex on which y lies, at a vertex the sum of its
facets' normals weighted by their angles (Baerentzen and Aanaes 2005, IEEE Trans. Vis. Comput.
Graph. 11:243-253).

The facing surface ends at a rim, and at edges whose other facet does not face the point or is its
neighbour. A point at the distance s beyond such an end keeps the gap z to the facet's plane and
loses its stiffness over the length l = EXTENSION times the facet's size,

    E = k phi(s / l) z^2 / 2,    phi(u) = (1 - u)^3 (1 + 3 u + 6 u^2),

so a body that slides off an edge loses contact without a jump, and energy is conserved. At a flush
edge, s = 0, phi'' is zero: a corner there is not pushed outwards.

A point lies next to the facets around it, and behind the other side of a thin fin or skin. Pairs
that are closer at rest than NEIGHBOURHOOD times the facet length therefore never touch, and a point
deeper than DEPTH of a facet's length is considered to be inside something else: a part must be
squeezed to a quarter of NEIGHBOURHOOD facets before its two sides are mistaken for two parts.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import Number, index_field, real_field
from softsim.compute.nodes import Nodes
from softsim.mesh.mesh import open_rim

# -------------------------------------------------------------------------------------------------
# Shape of one facet, an edge of a section or a triangle in space: closest point, normal.
#
# A facet is given by the rows of X (d, d), the positions of its corners. A point x beside it is x =
# sum_c W_c X_c + z n with the weights W of its projection onto the facet's line or plane, some of
# them negative where the projection lies outside; the closest point of the facet has weights w >=
# 0.


@ti.func
def corner(X, k):
    """Return row k of X."""
    return ti.Vector([X[k, j] for j in ti.static(range(X.m))])


@ti.func
def centroid(X):
    """Return the mean of the rows of X."""
    centre = corner(X, 0)
    for c in ti.static(range(1, X.n)):
        centre += corner(X, c)
    return centre / ti.static(float(X.n))


@ti.func
def foot_weights(X, gradients, x):
    """Return the weights W (d,): linear in x, each 1 at its own corner and 0 at the others."""
    W = gradients @ (x - corner(X, 0))
    W[0] += 1.0
    return W


@ti.func
def is_farther(X, x, square):
    """Return True only if no point of a facet is closer to x than the root of `square` [m^2].

    All its points lie within r, the distance of its farthest corner, of its centroid c, and (r +
    d)^2 <= 2 (r^2 + d^2), so |x - c|^2 > 2 (r^2 + d^2) is sufficient and needs no square root. This
    rejects most facets that are near but not the closest.
    """
    centre = centroid(X)
    farthest = ti.cast(0.0, backend.real)
    for c in ti.static(range(X.n)):
        farthest = ti.max(farthest, (corner(X, c) - centre).norm_sqr())
    return (x - centre).norm_sqr() > 2.0 * (farthest + square)


@ti.func
def velocity_beside(V, gradients, n, W, z):
    """Return the velocity [m/s] of the point W, z beside a facet, moving and turning with it.

    With the corner velocities V (rows) it is sum_c W_c v_c + z dn/dt, with dn/dt = -sum_c dW_c/dx
    (n . v_c).
    """
    return V.transpose() @ W - z * (gradients.transpose() @ (V @ n))


@ti.func
def corner_forces(gradients, n, W, z, T):
    """Return the corner forces (rows) of a facet for a force T at the point W, z beside it.

    They have the same power, so the same resultant and moment.
    """
    return W.outer_product(T) - z * (gradients @ T).outer_product(n)


@ti.func
def share_along(a, b, x):
    """Return the position of the point of the line from a to b closest to x: 0 at a, 1 at b."""
    along = b - a
    return ti.math.clamp((x - a).dot(along) / along.norm_sqr(), 0.0, 1.0)


class EdgeShape:
    """An edge of a section, with the material to its left."""

    dimension = 2

    @ti.func
    def area_vector(self, X):
        """Return the normal out of the material, with the length of the edge [m]."""
        along = corner(X, 1) - corner(X, 0)
        return ti.Vector([along[1], -along[0]])

    @ti.func
    def normal(self, X):
        """Return the unit normal out of the material."""
        return self.area_vector(X).normalized()

    @ti.func
    def weight_gradients(self, X):
        """Return dW_c/dx, one row for each corner [1/m]."""
        along = corner(X, 1) - corner(X, 0)
        g = along / along.norm_sqr()
        return ti.Matrix([[-g[0], -g[1]], [g[0], g[1]]])

    @ti.func
    def closest_weights(self, X, x):
        """Return the weights w of the point of the edge closest to x."""
        t = share_along(corner(X, 0), corner(X, 1), x)
        return ti.Vector([1.0 - t, t])

    @ti.func
    def angle(self, X, k):
        """Return 1, the weight of an edge's normal in the surface normal at a corner."""
        return ti.cast(1.0, backend.real)


class TriangleShape:
    """A triangle in space; seen from outside its corners go counter-clockwise."""

    dimension = 3

    @ti.func
    def area_vector(self, X):
        """Return the normal out of the material, with the length of twice the area [m^2]."""
        a = corner(X, 0)
        return (corner(X, 1) - a).cross(corner(X, 2) - a)

    @ti.func
    def normal(self, X):
        """Return the unit normal out of the material."""
        return self.area_vector(X).normalized()

    @ti.func
    def weight_gradients(self, X):
        """Return dW_c/dx, one row for each corner [1/m]."""
        a = corner(X, 0)
        e, f = corner(X, 1) - a, corner(X, 2) - a
        area = e.cross(f)
        g1, g2 = f.cross(area) / area.norm_sqr(), area.cross(e) / area.norm_sqr()
        g0 = -g1 - g2
        return ti.Matrix([[g0[0], g0[1], g0[2]], [g1[0], g1[1], g1[2]], [g2[0], g2[1], g2[2]]])

    @ti.func
    def closest_weights(self, X, x):
        """Return the weights w of the point of the triangle closest to x, inside or on a side."""
        w = foot_weights(X, self.weight_gradients(X), x)
        if w.min() < 0.0:
            nearest = ti.cast(1e30, backend.real)
            for k in ti.static(range(3)):
                i, j = ti.static(k, (k + 1) % 3)
                a, b = corner(X, i), corner(X, j)
                t = share_along(a, b, x)
                square = (x - a - t * (b - a)).norm_sqr()
                if square < nearest:
                    nearest = square
                    w = ti.Vector([0.0, 0.0, 0.0])
                    w[i], w[j] = 1.0 - t, t
        return w

    @ti.func
    def angle(self, X, k):
        """Return the angle [rad] at corner k, the weight of the normal in the surface normal."""
        e, f = corner(X, (k + 1) % 3) - corner(X, k), corner(X, (k + 2) % 3) - corner(X, k)
        return ti.atan2(e.cross(f).norm(), e.dot(f))


NEIGHBOURHOOD = 3.0
DEPTH = 0.75
# Least cosine between a facet's normal and the opposite of that of a point that it faces.
FACING = 0.3
# Over the size of a facet: length beyond an end of the surface over which contact fades.
EXTENSION = 0.1

SHAPES: dict[int, Any] = {2: EdgeShape, 3: TriangleShape}


@dataclass(frozen=True)
class SurfaceData:
    """Surfaces of deformable bodies: vertices `nodes` (k,) and facets (f, d), numbered as nodes.

    Points are the vertices, then the facets' centroids (k + f,): point_size at rest [m], point_part
    the connected part of the bodies that each belongs to, point_areas the area [m^2] that it stands
    for, point_group the number of its group. facet_areas (f,) [m^2]; facet_stiffness: contact
    stiffness per area (f,) [Pa/m]. may_touch (groups, groups): True for groups in contact with each
    other.
    """

    nodes: np.ndarray
    facets: np.ndarray
    point_size: np.ndarray
    point_part: np.ndarray
    point_areas: np.ndarray
    facet_areas: np.ndarray
    facet_stiffness: np.ndarray
    point_group: np.ndarray
    may_touch: np.ndarray

    @property
    def facet_size(self) -> np.ndarray:
        """Size of each facet at rest (f,) [m]."""
        return self.point_size[len(self.nodes) :]

    @property
    def facet_part(self) -> np.ndarray:
        """Connected part of the bodies (f,) that each facet belongs to."""
        return self.point_part[len(self.nodes) :]

    def summed_at_nodes(self, of_points: np.ndarray) -> np.ndarray:
        """Return the sum (k,) of values of points over each vertex and the centroids around it.

        of_points (k + f,): values of all points; a vertex gets an equal part of each centroid's.
        """
        d = self.facets.shape[1]
        own, centroids = np.split(of_points, [len(self.nodes)])
        number = np.searchsorted(self.nodes, self.facets)
        return own + np.bincount(number.ravel(), np.repeat(centroids / d, d), len(self.nodes))


class DeformableSurface:
    """Kernel class of the facets that touch, and of the points that do."""

    def __init__(self, nodes: Nodes, data: SurfaceData) -> None:
        d, members, facets = nodes.dimension, data.nodes, data.facets
        self.nodes, self.shape = nodes, SHAPES[d]()
        self.member_count, self.facet_count = Number(len(members)), Number(len(facets))
        self.point_count = Number(len(members) + len(facets))
        self.watched_count = self.member_count
        self.point_size, self.facet_size = real_field(data.point_size), real_field(data.facet_size)
        self.point_part, self.facet_part = map(index_field, (data.point_part, data.facet_part))
        self.point_area, self.facet_area = map(real_field, (data.point_areas, data.facet_areas))
        self.facet_stiffness = real_field(data.facet_stiffness)
        self.point_group, self.may_touch = map(index_field, (data.point_group, data.may_touch))
        self.member, self.corner = index_field(members), index_field(facets)
        # Facets around each node, in their order, and which of their corners it is.
        order = np.argsort(facets.ravel(), kind="stable")
        first = np.searchsorted(facets.ravel()[order], np.arange(int(nodes.count) + 1))
        self.first_around = index_field(first)
        self.facet_around, self.corner_around = index_field(order // d), index_field(order % d)
        # Facets that each point stands on, and their corners whose mean it is: of a vertex itself.
        of_members, facet_count = first[members], len(facets)
        self.first_own = index_field(
            np.concatenate([of_members, len(order) + np.arange(facet_count + 1)])
        )
        self.own_facet = index_field(np.concatenate([order // d, np.arange(facet_count)]))
        self.own_corner = index_field(np.concatenate([np.repeat(members[:, None], d, 1), facets]))
        is_rim = np.zeros(nodes.count, dtype=bool)
        is_rim[open_rim(facets).ravel()] = True
        self.is_rim = index_field(is_rim)

    @ti.func
    def corner_count(self, i):
        """Return the number of nodes whose mean is point i: one for a vertex."""
        count = ti.static(self.nodes.dimension)
        return 1 + (count - 1) * ti.cast(i >= self.member_count.read(), ti.i32)

    @ti.func
    def place(self, s, i):
        """Return the position of point i."""
        x, count = ti.Vector.zero(backend.real, self.nodes.dimension), self.corner_count(i)
        for c in range(count):
            x += self.nodes.position[s, self.own_corner[i, c]]
        return x / count

    @ti.func
    def place_at_rest(self, i):
        """Return the position of point i at rest."""
        x, count = ti.Vector.zero(backend.real, self.nodes.dimension), self.corner_count(i)
        for c in range(count):
            x += self.nodes.rest[self.own_corner[i, c]]
        return x / count

    @ti.func
    def velocity(self, s, i):
        """Return the velocity of point i [m/s]."""
        v, count = ti.Vector.zero(backend.real, self.nodes.dimension), self.corner_count(i)
        for c in range(count):
            v += self.nodes.velocity[s, self.own_corner[i, c]]
        return v / count

    @ti.func
    def watched_place(self, s, k):
        """Return the position of the k-th node whose relative motion makes lists stale (all)."""
        return self.nodes.position[s, self.member[k]]

    @ti.func
    def watched_velocity(self, s, k):
        """Return the velocity [m/s] of the k-th watched node."""
        return self.nodes.velocity[s, self.member[k]]

    @ti.func
    def outward(self, s, i):
        """Return the normal of the surface at point i, of any length.

        It is the sum of the area vectors of its facets.
        """
        n = ti.Vector.zero(backend.real, self.nodes.dimension)
        for e in range(self.first_own[i], self.first_own[i + 1]):
            n += self.shape.area_vector(self.corners(s, self.own_facet[e]))
        return n

    @ti.func
    def faces(self, X, outward):
        """Return True if a facet with its corners at X faces a point whose normal is `outward`."""
        area = self.shape.area_vector(X)
        against = -area.dot(outward)
        least = FACING * FACING * area.norm_sqr() * outward.norm_sqr()
        return against > 0.0 and against * against > least

    @ti.func
    def facing_fraction(self, s, i, X, f):
        """Return the fraction of the stiffness of point i that acts on facet f at first touch.

        X: corners of f. The fraction is that of the areas projected onto f; the softer one of two
        surfaces decides.
        """
        normal = self.shape.normal(X)
        facing, whole = ti.Vector([0.0, 0.0])
        for e in range(self.first_own[i], self.first_own[i + 1]):
            g = self.own_facet[e]
            whole += self.facet_area[g] * self.facet_stiffness[g]
            if self.are_paired(self.member_count.read() + g, f):
                cosine = -normal.dot(self.shape.normal(self.corners(s, g)))
                softer = ti.min(self.facet_stiffness[g], self.facet_stiffness[f])
                facing += self.facet_area[g] * ti.max(0.0, cosine) * softer
        return facing / whole

    @ti.func
    def corners(self, s, f):
        """Return the positions X of the corners of facet f."""
        X = ti.Matrix.zero(backend.real, self.nodes.dimension, self.nodes.dimension)
        for c, k in ti.static(ti.ndrange(self.nodes.dimension, self.nodes.dimension)):
            X[c, k] = self.nodes.position[s, self.corner[f, c]][k]
        return X

    @ti.func
    def corners_at_rest(self, f):
        """Return the positions X of the corners of facet f at rest."""
        X = ti.Matrix.zero(backend.real, self.nodes.dimension, self.nodes.dimension)
        for c, k in ti.static(ti.ndrange(self.nodes.dimension, self.nodes.dimension)):
            X[c, k] = self.nodes.rest[self.corner[f, c]][k]
        return X

    @ti.func
    def corner_velocities(self, s, f):
        """Return the velocities of the corners of facet f, one row each [m/s]."""
        V = ti.Matrix.zero(backend.real, self.nodes.dimension, self.nodes.dimension)
        for c, k in ti.static(ti.ndrange(self.nodes.dimension, self.nodes.dimension)):
            V[c, k] = self.nodes.velocity[s, self.corner[f, c]][k]
        return V

    @ti.func
    def length(self, i, f):
        """Return the larger of the sizes of a point's facets and of facet f, at rest [m]."""
        return ti.max(self.point_size[i], self.facet_size[f])

    @ti.func
    def facet_group(self, f):
        """Return the group of facet f."""
        return self.point_group[self.member_count.read() + f]

    @ti.func
    def are_paired(self, i, f):
        """Return True if the groups of point i and facet f are in contact with each other."""
        return self.may_touch[self.point_group[i], self.facet_group(f)] == 1

    @ti.func
    def never_touch(self, i, f):
        """Return 1 if point i and facet f are not paired, or too close at rest to touch, else 0."""
        result = 0
        if not self.are_paired(i, f):
            result = 1
        elif self.point_part[i] == self.facet_part[f]:
            X, x = self.corners_at_rest(f), self.place_at_rest(i)
            w = self.shape.closest_weights(X, x)
            nearest = NEIGHBOURHOOD * self.length(i, f)
            if (x - X.transpose() @ w).norm_sqr() < nearest * nearest:
                result = 1
        return result

    @ti.func
    def shares(self, f, g, w):
        """Return True if facet g has all corners of facet f with a positive weight w."""
        missing = 0
        for c in ti.static(range(self.nodes.dimension)):
            if w[c] > 0.0:
                found = 0
                for k in ti.static(range(self.nodes.dimension)):
                    if self.corner[g, k] == self.corner[f, c]:
                        found = 1
                missing += 1 - found
        return missing == 0
