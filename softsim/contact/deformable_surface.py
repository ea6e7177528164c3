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
from softsim.contact.facet_shapes import Edge, Triangle, corner
from softsim.fields import index_field, real_field
from softsim.mesh.mesh import find_rows, open_rim
from softsim.nodes import Nodes

NEIGHBOURHOOD = 3.0
DEPTH = 0.75

SHAPES: dict[int, Any] = {2: Edge, 3: Triangle}


@ti.data_oriented
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
        self.member_count, self.facet_count = len(members), len(facets)
        self.member_size, self.facet_size = real_field(member_size), real_field(facet_size)
        self.member_part, self.facet_part = index_field(member_part), index_field(facet_part)
        self.member, self.corner = index_field(members), index_field(facets)
        # Facets around each node, in their order, and which of their corners it is.
        order = np.argsort(facets.ravel(), kind="stable")
        first = np.searchsorted(facets.ravel()[order], np.arange(nodes.count + 1))
        self.first_around = index_field(first)
        self.facet_around, self.corner_around = index_field(order // d), index_field(order % d)
        is_rim = np.zeros(nodes.count, dtype=bool)
        is_rim[open_rim(facets).ravel()] = True
        self.is_rim = index_field(is_rim)
        self.across = index_field(facets_across(facets) if d == 3 else np.zeros((1, 1)))

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
    def gap_and_normal(self, s, i, f, w, x):
        """Signed gap [m] of node i at x to facet f, whose closest point has the weights w, and the
        unit normal n.

        Outside, as if it did not touch, where the surface ends at that point, or goes on with
        facets that node i cannot touch: the closest point of all may lie there.
        """
        X = self.corners(s, f)
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
        normal = ti.Vector.zero(backend.real, self.nodes.dimension)
        whole = 1
        for c in ti.static(range(self.nodes.dimension)):
            if w[c] == 1.0:
                a = self.corner[f, c]
                if self.is_rim[a] == 1:
                    whole = 0
                for e in range(self.first_around[a], self.first_around[a + 1]):
                    g = self.facet_around[e]
                    X = self.corners(s, g)
                    normal += self.shape.angle(X, self.corner_around[e]) * self.shape.normal(X)
                    if self.are_neighbours(i, g) == 1:
                        whole = 0
        if ti.static(self.nodes.dimension == 3):
            for c in ti.static(range(3)):
                if w[c] == 0.0 and w.max() < 1.0:
                    g = self.across[f, c]
                    if g < 0:
                        whole = 0
                    else:
                        normal = self.shape.normal(self.corners(s, f))
                        normal += self.shape.normal(self.corners(s, g))
                        if self.are_neighbours(i, g) == 1:
                            whole = 0
        return normal * whole

    @ti.func
    def velocity_beside(self, s, f, W, z):
        """Velocity [m/s] at the place W, z beside facet f that moves and turns with it:
        sum_c W_c v_c + z dn/dt, with dn/dt = -sum_c grad W_c (n . v_c).
        """
        X, V = self.corners(s, f), self.corner_velocities(s, f)
        n = self.shape.normal(X)
        return V.transpose() @ W - z * (self.shape.weight_gradients(X).transpose() @ (V @ n))

    @ti.func
    def corner_force(self, s, f, c, W, z, T):
        """What a force T at the place W, z beside facet f is on its corner c: the same power,
        resultant and moment.
        """
        X = self.corners(s, f)
        turning = corner(self.shape.weight_gradients(X), c).dot(T)
        return W[c] * T - z * turning * self.shape.normal(X)


def facets_across(facets: np.ndarray) -> np.ndarray:
    """The triangle across each side of triangles (f, 3), by the corner opposite that side (f, 3);
    -1 where there is none or more than one.
    """
    sides = np.stack([facets[:, [1, 2]], facets[:, [2, 0]], facets[:, [0, 1]]], axis=1)
    sides = sides.reshape(-1, 2)
    _, inverse, count = np.unique(
        np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    across = find_rows(sides[:, ::-1], sides)
    return np.where((count[inverse.ravel()] == 2) & (across >= 0), across // 3, -1).reshape(-1, 3)
