"""Contact of the convex corners of a wall with the surface of bodies.

Contact of nodes alone would miss a corner between two nodes: it would penetrate by up to half their
distance times the tangent of half its turn. Each corner is therefore tested against the closest
facet, as a node is in self-contact (contact/self_contact.py), with the gap g of the corner to the
surface and the potential k g^2 / 2. The nodes of the facet share the force by their weights w_c,
which conserves force and moment. Friction is that of walls, with its memory. Nodes also touch the
edges of the wall.
"""

from collections.abc import Sequence

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import Number, index_field, real_field, vector_field
from softsim.compute.nodes import Nodes
from softsim.contact.deformable_surface import DeformableSurface, SurfaceData
from softsim.contact.forces import (
    BEFORE_START,
    FrictionMemory,
    NodalForces,
    Penalty,
    WallFriction,
)
from softsim.contact.neighbour_lists import NeighbourLists, part_of
from softsim.contact.self_contact import SelfContact
from softsim.contact.wall import FixedFrame

# -------------------------------------------------------------------------------------------------
# Surface of bodies in contact with the convex corners of a wall, in the wall's axes, in the plane.
#
# In these axes the corners are at rest and the facets move. The contact points are the corners;
# none is a neighbour of a facet.

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
        size = np.concatenate([np.zeros(len(of_facets)), facet_size])
        of_points, of_each = np.zeros(len(size)), np.zeros(len(facets))  # not used by corners
        data = SurfaceData(
            of_facets, facets, size, point_part=of_points, point_areas=of_points,
            facet_areas=of_each, facet_stiffness=of_each, point_group=of_points,
            may_touch=np.ones((1, 1)),
        )  # fmt: skip
        super().__init__(nodes, data)
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


AT_LIMIT = 1.0 - 1e-6
"""Fraction of the friction limit above which a corner counts as slipping."""


class CornerContact(NodalForces, SelfContact):
    """Contact of a wall's corners with facets, each with the closest one.

    Parameters
    ----------
    surface: corners (c) and facets (f). lists: which of them may touch.
    contact_nodes: numbers of all nodes that touch walls (k,), those of the facets among them.
    penalty: springs and dashpots of a corner (1,). friction: of each scenario.

    Fields: of the corners those of SelfContact, (scenarios, c); of the nodes those of
    contact/forces.py, (scenarios, k).
    """

    surface: CornerSurface

    def __init__(
        self,
        surface: CornerSurface,
        lists: NeighbourLists,
        contact_nodes: np.ndarray,
        penalty: Penalty,
        friction: WallFriction,
    ) -> None:
        scenarios, corners = surface.nodes.scenarios, int(surface.point_count)
        of_corners = penalty.repeated(corners)
        SelfContact.__init__(self, surface, lists, contact_nodes, of_corners, friction.coefficient)
        NodalForces.__init__(self, scenarios, len(contact_nodes), surface.nodes.dimension)
        self.node = index_field(contact_nodes)
        self.memory = FrictionMemory(friction)
        nothing = np.zeros((scenarios, corners))
        # Of friction: its limit, the time in contact that it remembers; when it last touched [s].
        self.limit, self.age = real_field(nothing), real_field(nothing)
        self.touched_at = real_field(np.full(nothing.shape, BEFORE_START))
        surface.frame.carry(self)

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return {
            **{f"corner_{name}": field for name, field in SelfContact.state_fields(self).items()},
            **self.nodal_fields(),
            "friction_limit": self.limit,
            "age": self.age,
            "touched_at": self.touched_at,
        }

    @property
    def pressing_force(self) -> ti.Field:
        """Normal forces (scenarios, c) [N] of the corners, which press between nodes."""
        return self.pressing

    def forget_dissipation(self, scenario: int) -> None:
        """Set the dissipated energies and the statistics of the whole run to zero in a scenario."""
        super().forget_dissipation(scenario)
        self.forget_times(scenario)
        fields.write_row(self.touched_at, scenario, BEFORE_START)

    @ti.func
    def _friction_limit(self, s, i, f, N, speed, t, dt):
        """Return the friction limit [N] of corner i, with the memory of surface_contact.py."""
        if t - self.touched_at[s, i] > dt + self.memory.time[s]:
            self.age[s, i] = 0.0
        age, instant = self.age[s, i] + dt, self.friction_coefficient[s] * N
        limit = self.memory.limit(s, self.limit[s, i], instant, age, speed, t, dt)
        self.limit[s, i], self.age[s, i], self.touched_at[s, i] = limit, age, t
        return limit

    @ti.func
    def gather_facet_reactions(self, s, p, t, dt):
        """Write the forces on the nodes of part p into their slots."""
        first, end = part_of(self.touched_count.read(), p)
        if self.lists.renewed[s] == 1:
            self.may_react[s, p] = 0
            for i in range(first, end):
                if self._near_corners(s, i) > 0 or self.loaded[s, i] == 1:
                    self.may_react[s, p] = 1
        if self.may_react[s, p] == 1:
            for i in range(first, end):
                self._gather(s, i, dt)

    @ti.func
    def _near_corners(self, s, i):
        """Return the number of corners that may touch the facets around node i."""
        a = self.node[i]
        count = 0
        for e in range(self.surface.first_around[a], self.surface.first_around[a + 1]):
            count += self.lists.near_node_count[s, self.surface.facet_around[e]]
        return count

    @ti.func
    def _gather(self, s, i, dt):
        """Write and record the sum of the forces on node i from the corners around it."""
        a = self.node[i]
        total = ti.Vector.zero(backend.real, self.nodes.dimension)
        pressing, slipping, depth = ti.Vector([0.0, 0.0, 0.0])
        loaded = 0
        for e in range(self.surface.first_around[a], self.surface.first_around[a + 1]):
            f, c = self.surface.facet_around[e], self.surface.corner_around[e]
            for k in range(self.lists.near_node_count[s, f]):
                j = self.lists.near_node[s, f, k]
                if self.facet[s, j] == f:
                    loaded = 1
                    total += self.on_corner[s, j, c]
                    X = self.surface.corners(s, f)
                    w = self.surface.shape.closest_weights(X, self.surface.place(s, j))
                    N = w[c] * self.pressing[s, j]
                    pressing += N
                    depth = ti.max(depth, -self.gap[s, j])
                    if self.friction[s, j].norm() > AT_LIMIT * self.limit[s, j]:
                        slipping += N
        if loaded == 1 or self.loaded[s, i] == 1:
            force = self.surface.frame.global_vector(s, total)
            self.nodes.corner_forces.write(s, self.first_slot + i, force)
            self.note(s, i, force, pressing, slipping, depth, dt)
            self.loaded[s, i] = loaded
