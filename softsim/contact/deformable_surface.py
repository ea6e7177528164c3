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

from typing import Any

import numpy as np
import taichi as ti

from softsim import backend
from softsim.contact.facet_shapes import Edge, Triangle
from softsim.fields import Number, index_field, real_field
from softsim.mesh.mesh import open_rim
from softsim.nodes import Nodes

NEIGHBOURHOOD = 3.0
DEPTH = 0.75
# Least cosine between a facet's normal and the opposite of that of a point that it faces.
FACING = 0.3
# Over the size of a facet: length beyond an end of the surface over which contact fades.
EXTENSION = 0.1

SHAPES: dict[int, Any] = {2: Edge, 3: Triangle}


class DeformableSurface:
    """Facets that touch, and the points that do: vertices first, then the facets' centroids.

    Parameters
    ----------
    nodes: the shared nodes. members: numbers of the vertices (k,). facets: corners (f, d),
        numbered as nodes.
    point_size, facet_size: size at rest (k + f,), (f,) [m].
    point_part, facet_part: number of the connected part of the bodies (k + f,), (f,).
    facet_areas: at rest (f,) [m^2].
    facet_stiffness: contact stiffness per area (f,) [Pa/m].
    point_group: group of each point (k + f,). may_touch (groups, groups): True for groups in
        contact with each other.
    """

    def __init__(
        self,
        nodes: Nodes,
        members: np.ndarray,
        facets: np.ndarray,
        point_size: np.ndarray,
        facet_size: np.ndarray,
        point_part: np.ndarray,
        facet_part: np.ndarray,
        facet_areas: np.ndarray,
        facet_stiffness: np.ndarray,
        point_group: np.ndarray,
        may_touch: np.ndarray,
    ) -> None:
        d = nodes.dimension
        self.nodes, self.shape = nodes, SHAPES[d]()
        self.member_count, self.facet_count = Number(len(members)), Number(len(facets))
        self.point_count = Number(len(members) + len(facets))
        self.watched_count = self.member_count
        self.point_size, self.facet_size = real_field(point_size), real_field(facet_size)
        self.point_part, self.facet_part = index_field(point_part), index_field(facet_part)
        self.facet_area, self.facet_stiffness = real_field(facet_areas), real_field(facet_stiffness)
        self.point_group, self.may_touch = index_field(point_group), index_field(may_touch)
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
