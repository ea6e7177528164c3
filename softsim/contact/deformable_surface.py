"""The surface of deformable bodies: signed gap of a node to a facet, and what counts as apart.

The gap is the distance to the closest point y of the surface, negative inside: then its gradient
is the normal n = (x - y) / gap for the node and -w_c n for the corners of the facet, whatever
feature y lies on, and a force k gap n is that of a potential. It is the same from both facets where
y passes from one to the next. Whether a node is inside tells the normal of the face, edge or corner
on which y lies, for a corner the sum of its facets' normals weighted by their angles (Baerentzen
and Aanaes 2005, IEEE Trans. Vis. Comput. Graph. 11:243-253).

A node lies next to the facets around it, and behind a thin fin's or skin's other side. So those
that are as close at rest as NEIGHBOURHOOD facets are long touch each other never, and a node deeper
than DEPTH of a facet's length is inside of something else: a part must be squeezed to a quarter of
NEIGHBOURHOOD facets before its two sides are mistaken for two parts.
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

SHAPES: dict[int, Any] = {2: Edge, 3: Triangle}


class DeformableSurface:
    """Facets that touch, and the nodes that do.

    Parameters
    ----------
    nodes: the shared nodes. members: numbers of those that touch (k,). facets: corners (f, d),
        numbered as nodes.
    member_size, facet_size: longest side at rest (k,), (f,) [m].
    member_part, facet_part: which connected part of the bodies each belongs to (k,), (f,).
    """

    def __init__(
        self,
        nodes: Nodes,
        members: np.ndarray,
        facets: np.ndarray,
        member_size: np.ndarray,
        facet_size: np.ndarray,
        member_part: np.ndarray,
        facet_part: np.ndarray,
    ) -> None:
        d = nodes.dimension
        self.nodes, self.shape = nodes, SHAPES[d]()
        self.member_count, self.facet_count = Number(len(members)), Number(len(facets))
        self.watched_count = self.member_count
        self.member_size, self.facet_size = real_field(member_size), real_field(facet_size)
        self.member_part, self.facet_part = index_field(member_part), index_field(facet_part)
        self.member, self.corner = index_field(members), index_field(facets)
        # Facets around each node, in their order, and which of their corners it is.
        order = np.argsort(facets.ravel(), kind="stable")
        first = np.searchsorted(facets.ravel()[order], np.arange(int(nodes.count) + 1))
        self.first_around = index_field(first)
        self.facet_around, self.corner_around = index_field(order // d), index_field(order % d)
        is_rim = np.zeros(nodes.count, dtype=bool)
        is_rim[open_rim(facets).ravel()] = True
        self.is_rim = index_field(is_rim)

    @ti.func
    def place(self, s, i):
        """Where node i is now."""
        return self.nodes.position[s, self.member[i]]

    @ti.func
    def velocity(self, s, i):
        """Of node i [m/s]."""
        return self.nodes.velocity[s, self.member[i]]

    @ti.func
    def watched_place(self, s, k):
        """Where the k-th is of those whose motion relative to each other tells that others get
        near: all nodes.
        """
        return self.place(s, k)

    @ti.func
    def corners(self, s, f):
        """X of facet f now."""
        X = ti.Matrix.zero(backend.real, self.nodes.dimension, self.nodes.dimension)
        for c, k in ti.static(ti.ndrange(self.nodes.dimension, self.nodes.dimension)):
            X[c, k] = self.nodes.position[s, self.corner[f, c]][k]
        return X

    @ti.func
    def corners_at_rest(self, f):
        """X of facet f at rest."""
        X = ti.Matrix.zero(backend.real, self.nodes.dimension, self.nodes.dimension)
        for c, k in ti.static(ti.ndrange(self.nodes.dimension, self.nodes.dimension)):
            X[c, k] = self.nodes.rest[self.corner[f, c]][k]
        return X

    @ti.func
    def corner_velocities(self, s, f):
        """Velocities of the corners of facet f, a row each [m/s]."""
        V = ti.Matrix.zero(backend.real, self.nodes.dimension, self.nodes.dimension)
        for c, k in ti.static(ti.ndrange(self.nodes.dimension, self.nodes.dimension)):
            V[c, k] = self.nodes.velocity[s, self.corner[f, c]][k]
        return V

    @ti.func
    def length(self, i, f):
        """The longer of the sides of a node's facets and of facet f, at rest [m]."""
        return ti.max(self.member_size[i], self.facet_size[f])

    @ti.func
    def are_neighbours(self, i, f):
        """Whether node i and facet f are too close at rest to touch each other."""
        result = 0
        if self.member_part[i] == self.facet_part[f]:
            X, x = self.corners_at_rest(f), self.nodes.rest[self.member[i]]
            w = self.shape.closest_weights(X, x)
            nearest = NEIGHBOURHOOD * self.length(i, f)
            if (x - X.transpose() @ w).norm_sqr() < nearest * nearest:
                result = 1
        return result

    @ti.func
    def gap_and_normal(self, s, i, X, f, w, x):
        """Signed gap [m] of node i at x to facet f, whose corners are at X and whose closest point
        has the weights w, and the unit normal n.

        Outside, as if it did not touch, where the surface ends at that point, or goes on with
        facets that node i cannot touch: the closest point of all may lie there.
        """
        apart = x - X.transpose() @ w
        n = self.shape.normal(X)
        gap = apart.dot(n)
        if w.min() == 0.0:  # on an edge of the facet or on a corner
            gap = apart.norm()
            if apart.dot(self._outward(s, i, f, w)) < 0.0:
                gap = -gap
            if gap != 0.0:
                n = apart / gap
        return gap, n

    @ti.func
    def _outward(self, s, i, f, w):
        """A normal of the edge or corner of facet f where w lies; none (zero) where the surface
        ends or goes on with neighbours of node i.
        """
        heaviest = 0
        for c in ti.static(range(1, self.nodes.dimension)):
            if w[c] > w[heaviest]:
                heaviest = c
        on_corner = w[heaviest] == 1.0
        a = self.corner[f, heaviest]
        normal = ti.Vector.zero(backend.real, self.nodes.dimension)
        meeting, whole = 0, 1
        for e in range(self.first_around[a], self.first_around[a + 1]):
            g = self.facet_around[e]
            if on_corner or self._shares(f, g, w):
                X = self.corners(s, g)
                weight = ti.cast(1.0, backend.real)  # of the two sides of an edge
                if on_corner:
                    weight = self.shape.angle(X, self.corner_around[e])
                normal += weight * self.shape.normal(X)
                meeting += 1
                if self.are_neighbours(i, g) == 1:
                    whole = 0
        if (on_corner and self.is_rim[a] == 1) or (not on_corner and meeting != 2):
            whole = 0
        return normal * whole

    @ti.func
    def _shares(self, f, g, w):
        """Whether facet g has all corners of facet f with some weight."""
        missing = 0
        for c in ti.static(range(self.nodes.dimension)):
            if w[c] > 0.0:
                found = 0
                for k in ti.static(range(self.nodes.dimension)):
                    if self.corner[g, k] == self.corner[f, c]:
                        found = 1
                missing += 1 - found
        return missing == 0
