"""Surface of bodies in contact with the convex corners of a wall, in the wall's axes, in the plane.

In these axes the corners are at rest and the facets move. The contact points are the corners; none
is a neighbour of a facet.
"""

from collections.abc import Sequence

import numpy as np
import taichi as ti

from softsim import backend
from softsim.contact.deformable_surface import DeformableSurface
from softsim.contact.frame import FixedFrame
from softsim.fields import Number, vector_field
from softsim.nodes import Nodes

NOWHERE = 1e6
"""Coordinates [m] of the padding entries of scenarios with fewer corners than others."""


class CornerSurface(DeformableSurface):
    """Facets that touch corners.

    Parameters
    ----------
    nodes: the shared nodes. facets: corners of facets (f, 2), numbered as nodes.
    facet_size: their lengths at rest (f,) [m]. frame: axes of the wall.
    corners: of the wall in each scenario (c, 2) [m], in its axes.
    """

    def __init__(
        self,
        nodes: Nodes,
        facets: np.ndarray,
        facet_size: np.ndarray,
        frame: FixedFrame,
        corners: Sequence[np.ndarray],
    ) -> None:
        of_facets = np.unique(facets)
        nothing = np.zeros(len(facets))
        super().__init__(
            nodes,
            of_facets,
            facets,
            nothing,
            facet_size,
            nothing,
            nothing,
            nothing,
            nothing,
            nothing,
            np.ones((1, 1)),
        )
        self.frame = frame
        most = max(len(places) for places in corners)
        self.point_count = Number(most)
        self.watched_count = Number(len(of_facets) + 1)
        filled = [np.pad(c, ((0, most - len(c)), (0, 0)), constant_values=NOWHERE) for c in corners]
        self.place_of_corner = vector_field(np.stack(filled))

    @ti.func
    def place(self, s, i):
        """Return the position of corner i."""
        return self.place_of_corner[s, i]

    @ti.func
    def velocity(self, s, i):
        """Return the velocity of corner i [m/s], which is zero."""
        return ti.Vector.zero(backend.real, self.nodes.dimension)

    @ti.func
    def watched_place(self, s, k):
        """Return the position of the k-th node of the facets; the last is the origin, at rest."""
        result = ti.Vector.zero(backend.real, self.nodes.dimension)
        if k < self.watched_count.read() - 1:
            result = self.frame.local_position(s, self.nodes.position[s, self.member[k]])
        return result

    @ti.func
    def watched_velocity(self, s, k):
        """Return the velocity [m/s] of the k-th node relative to the wall; zero for the last."""
        result = ti.Vector.zero(backend.real, self.nodes.dimension)
        if k < self.watched_count.read() - 1:
            a = self.member[k]
            result = self.frame.relative_velocity(
                s, self.nodes.position[s, a], self.nodes.velocity[s, a]
            )
        return result

    @ti.func
    def corners(self, s, f):
        """Return the positions X of the corners of facet f, in the wall's axes."""
        X = ti.Matrix.zero(backend.real, self.nodes.dimension, self.nodes.dimension)
        for c in ti.static(range(self.nodes.dimension)):
            place = self.frame.local_position(s, self.nodes.position[s, self.corner[f, c]])
            for k in ti.static(range(self.nodes.dimension)):
                X[c, k] = place[k]
        return X

    @ti.func
    def corner_velocities(self, s, f):
        """Return the corner velocities of facet f relative to the wall, one row each [m/s]."""
        V = ti.Matrix.zero(backend.real, self.nodes.dimension, self.nodes.dimension)
        for c in ti.static(range(self.nodes.dimension)):
            a = self.corner[f, c]
            v = self.frame.relative_velocity(
                s, self.nodes.position[s, a], self.nodes.velocity[s, a]
            )
            for k in ti.static(range(self.nodes.dimension)):
                V[c, k] = v[k]
        return V

    @ti.func
    def outward(self, s, i):
        """Return zero: a corner has no normal and presses on any facet nearby."""
        return ti.Vector.zero(backend.real, self.nodes.dimension)

    @ti.func
    def faces(self, X, outward):
        """Return True: all facets face a corner."""
        return True

    @ti.func
    def facing_fraction(self, s, i, X, f):
        """Return 1: a corner acts with its full stiffness."""
        return ti.cast(1.0, backend.real)

    @ti.func
    def length(self, i, f):
        """Return the length of facet f at rest [m]."""
        return self.facet_size[f]

    @ti.func
    def never_touch(self, i, f):
        """Return 0: a corner is not part of the surface, so it may touch any facet."""
        return 0
