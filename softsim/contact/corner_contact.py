"""Contact of the convex corners of a wall with the surface of bodies.

Contact of nodes alone would miss a corner between two nodes: it would penetrate by up to half their
distance times the tangent of half its turn. Each corner is therefore tested against the closest
facet, as a node is in self-contact (contact/self_contact.py), with the gap g of the corner to the
surface and the potential k g^2 / 2. The nodes of the facet share the force by their weights w_c,
which conserves force and moment. Friction is that of walls, with its memory. Nodes also touch the
edges of the wall.
"""

import numpy as np
import taichi as ti

from softsim import backend, fields
from softsim.contact.corner_surface import CornerSurface
from softsim.contact.laws import BEFORE_START, limit_with_memory
from softsim.contact.neighbour_lists import NeighbourLists, part_of
from softsim.contact.nodal_forces import NodalForces
from softsim.contact.self_contact import SelfContact
from softsim.fields import index_field, real_field

AT_LIMIT = 1.0 - 1e-6
"""Fraction of the friction limit above which a corner counts as slipping."""


class CornerContact(NodalForces, SelfContact):
    """Contact of a wall's corners with facets, each with the closest one.

    Parameters
    ----------
    surface: corners (c) and facets (f). lists: which of them may touch.
    contact_nodes: numbers of all nodes that touch walls (k,), those of the facets among them.
    constants: k_n, k_t [N/m], c_n, c_t [N s/m] of a corner.
    friction_coefficient: mu (scenarios,) [-]. friction_memory: t* of its limit (scenarios,) [s].
    slip_length: d of its limit (scenarios,) [m].

    Fields: of the corners those of SelfContact, (scenarios, c); of the nodes those of
    contact/nodal_forces.py, (scenarios, k).
    """

    surface: CornerSurface

    def __init__(
        self,
        surface: CornerSurface,
        lists: NeighbourLists,
        contact_nodes: np.ndarray,
        constants: tuple[float, float, float, float],
        friction_coefficient: np.ndarray,
        friction_memory: np.ndarray,
        slip_length: np.ndarray,
    ) -> None:
        scenarios, corners = surface.nodes.scenarios, int(surface.point_count)
        k_n, k_t, c_n, c_t = (np.full(corners, constant) for constant in constants)
        SelfContact.__init__(
            self, surface, lists, contact_nodes, k_n, k_t, c_n, c_t, friction_coefficient
        )
        NodalForces.__init__(self, scenarios, len(contact_nodes), surface.nodes.dimension)
        self.node = index_field(contact_nodes)
        self.friction_memory, self.slip_length = map(real_field, (friction_memory, slip_length))
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
        memory = self.friction_memory[s]
        if t - self.touched_at[s, i] > dt + memory:
            self.age[s, i] = 0.0
        age = self.age[s, i] + dt
        if t < 0.0:  # bodies settle, as if they lay there for long: the limit has followed
            memory = 0.0
        limit = limit_with_memory(
            self.limit[s, i], self.friction_coefficient[s] * N, age, memory, self.slip_length[s],
            speed, dt,
        )  # fmt: skip
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
