"""Contact of the surface of deformable bodies with itself: nodes against facets.

The laws are those of the walls (contact/laws.py), between a node and the
closest point of the facets that it may touch; of one facet, the closest, at a time. Each side's
nodes are held against the other's facets. What pushes a node pushes back on the corners of its
facet, so momentum and angular momentum are kept. The spring of the friction is a vector in space
that goes with the facet: it grows with the velocity of the node relative to the place beside the
facet where it is, and turns with the tangent plane.
"""

import numpy as np
import taichi as ti

from softsim import backend
from softsim.contact.deformable_surface import DEPTH, DeformableSurface
from softsim.contact.dissipation import Dissipation
from softsim.contact.facet_shapes import (
    corner,
    corner_forces,
    foot_weights,
    is_farther,
    velocity_beside,
)
from softsim.contact.laws import normal_force, shear_force, slip
from softsim.contact.neighbour_lists import NeighbourLists, part_of
from softsim.fields import index_field, real_field, vector_field
from softsim.nodes import PARTS
from softsim.term import Pass, Stage


class SelfContact(Dissipation):
    """Contact of the nodes of a surface with its facets, each with the closest one.

    Parameters
    ----------
    surface: nodes (k) and facets (f). lists: which of them may touch.
    members: numbers of the nodes that get forces.
    penalty_stiffness: k_n (k,) [N/m]. tangential_stiffness: k_t (k,) [N/m].
    damping: c_n (k,) [N s/m]. tangential_damping: c_t (k,) [N s/m].
    friction_coefficient: mu (scenarios,) [-].

    Fields, (scenarios, k): facet that a node touches, or -1; gap [m], zero unless it touches;
    stretch (d) of the friction's spring [m], friction (d) [N]; pressing, the normal force [N];
    friction_dissipation and damping_dissipation [J].
    """

    def __init__(
        self,
        surface: DeformableSurface,
        lists: NeighbourLists,
        members: np.ndarray,
        penalty_stiffness: np.ndarray,
        tangential_stiffness: np.ndarray,
        damping: np.ndarray,
        tangential_damping: np.ndarray,
        friction_coefficient: np.ndarray,
    ) -> None:
        nodes = surface.nodes
        scenarios, d = nodes.scenarios, nodes.dimension
        Dissipation.__init__(self, scenarios, int(surface.member_count))
        self.surface, self.lists, self.nodes = surface, lists, nodes
        self.penalty_stiffness = real_field(penalty_stiffness)
        self.tangential_stiffness = real_field(tangential_stiffness)
        self.damping = real_field(damping)
        self.tangential_damping = real_field(tangential_damping)
        self.friction_coefficient = real_field(friction_coefficient)
        self.first_slot = nodes.corner_forces.reserve(members)

        shape = (scenarios, int(surface.member_count))
        self.facet = index_field(np.full(shape, -1))
        self.gap, self.dashpot, self.pressing = (real_field(np.zeros(shape)) for _ in range(3))
        self.stretch, self.friction = (vector_field(np.zeros((*shape, d))) for _ in range(2))
        self.on_corner = vector_field(np.zeros((*shape, d, d)))  # forces on the facet's corners
        self.on_member = vector_field(np.zeros((*shape, d)))  # on the node itself
        # Whether nodes of a part may touch facets, facets around them be touched; whether it is so.
        self.may_touch, self.may_react = (index_field(np.zeros((scenarios, PARTS))) for _ in "ab")
        self.loaded = index_field(np.zeros((scenarios, len(members))))

    def passes(self) -> dict[Stage, list[Pass]]:
        """Of an increment; the lists are watched and made anew in between."""
        lists = self.lists
        return {
            Stage.MOVE: [Pass("contact", PARTS, (lists.watch,))],
            Stage.PRESS: [Pass("contact", 1, (lists.sort,))],
            Stage.STRESS: [Pass("contact", PARTS, (lists.find_facets, self.push))],
            Stage.LIST: [Pass("contact", 1, (lists.find_nodes,))],
            Stage.GATHER: [Pass("contact", PARTS, (self.gather_facet_reactions,))],
        }

    def state_fields(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps; lists are made anew."""
        return {
            "facet": self.facet,
            "gap": self.gap,
            "dashpot": self.dashpot,
            "normal_force": self.pressing,
            "stretch": self.stretch,
            "friction": self.friction,
            "loaded": self.loaded,
            "friction_dissipation": self.friction_dissipation,
            "damping_dissipation": self.damping_dissipation,
        }

    @ti.func
    def push(self, s, p, t, dt):
        """Contact forces of the nodes of part p, and what their facets' corners get."""
        first, end = part_of(self.count.read(), p)
        if self.lists.renewed[s] == 1:
            self.may_touch[s, p] = 0
            for i in range(first, end):
                if self.lists.near_facet_count[s, i] > 0 or self.facet[s, i] >= 0:
                    self.may_touch[s, p] = 1
        if self.may_touch[s, p] == 1:
            for i in range(first, end):
                if self.lists.near_facet_count[s, i] > 0 or self.facet[s, i] >= 0:
                    self._push_node(s, i, t, dt)

    @ti.func
    def _push_node(self, s, i, t, dt):
        """Contact force of node i with the closest facet."""
        x = self.surface.place(s, i)
        f, w = self._closest_facet(s, i, x)
        gap = ti.cast(0.0, backend.real)
        n = ti.Vector.zero(backend.real, self.nodes.dimension)
        rate = ti.cast(0.0, backend.real)  # dg/dt = n . (v - sum_c w_c v_c)
        if f >= 0:
            X, V = self.surface.corners(s, f), self.surface.corner_velocities(s, f)
            v = self.surface.velocity(s, i)
            gap, n = self.surface.gap_and_normal(s, i, X, f, w, x)
            rate = n.dot(v - V.transpose() @ w)
            if gap < 0.0:
                self._touch(s, i, f, X, V, w, x, v, gap, n, rate, t, dt)
        if gap >= 0.0 and self.facet[s, i] >= 0:
            self._let_go(s, i, rate, dt)

    @ti.func
    def _closest_facet(self, s, i, x):
        """Closest facet among those near, with the weights of its closest point; -1 where it is
        farther than nodes get deep in it.
        """
        closest = -1
        w = ti.Vector.zero(backend.real, self.nodes.dimension)
        nearest = self.lists.deepest[0] ** 2
        for k in range(self.lists.near_facet_count[s, i]):
            f = self.lists.near_facet[s, i, k]
            X = self.surface.corners(s, f)
            if not is_farther(X, x, nearest):
                weights = self.surface.shape.closest_weights(X, x)
                square = (x - X.transpose() @ weights).norm_sqr()
                if square < nearest:
                    closest, nearest, w = f, square, weights
        if closest >= 0 and nearest >= (DEPTH * self.surface.length(i, closest)) ** 2:
            closest = -1
        return closest, w

    @ti.func
    def _touch(self, s, i, f, X, V, w, x, v, gap, n, rate, t, dt):
        """Node i at x, with the velocity v, touches facet f, its corners at X with velocities V."""
        N = normal_force(gap, rate, self.penalty_stiffness[i], self.damping[i])
        # Where the node is beside the facet, and how fast it slides over it.
        facet_normal = self.surface.shape.normal(X)
        gradients = self.surface.shape.weight_gradients(X)
        W = foot_weights(X, gradients, x)
        z = (x - X.transpose() @ W).dot(facet_normal)
        sliding = v - velocity_beside(V, gradients, facet_normal, W, z)
        sliding -= sliding.dot(n) * n
        inside = dt
        if self.facet[s, i] < 0 and rate * dt < gap:
            inside = gap / rate  # it crossed the surface within this increment
        k_t, damping_rate = self.tangential_stiffness[i], self.tangential_damping[i] / dt
        across = self.stretch[s, i].dot(n)  # by which the tangent plane has turned away
        before = self.stretch[s, i] - across * n
        stretch = before + inside * sliding
        limit = self._friction_limit(s, i, N, sliding.norm(), t, dt)
        slipped = slip(stretch, before, k_t, damping_rate, limit)
        stretch -= slipped
        friction = shear_force(stretch, before, k_t, damping_rate)
        damping_force = N + self.penalty_stiffness[i] * gap
        self.book_normal(s, i, self.dashpot[s, i], damping_force, dt * rate)
        self.book_tangential(
            s, i, self.friction[s, i], friction, before, stretch, k_t,
            slipped + (dt - inside) * sliding,
        )  # fmt: skip
        self.friction_dissipation[s, i] = self.friction_dissipation[s, i] + (
            0.5 * k_t * across * across
        )
        self.on_member[s, i] = N * n - friction
        rubbed = corner_forces(gradients, facet_normal, W, z, -friction)
        for c in ti.static(range(self.nodes.dimension)):
            self.on_corner[s, i, c] = -w[c] * N * n - corner(rubbed, c)
        self.facet[s, i], self.gap[s, i], self.pressing[s, i] = f, gap, N
        self.dashpot[s, i] = damping_force
        self.stretch[s, i], self.friction[s, i] = stretch, friction

    @ti.func
    def _friction_limit(self, s, i, N, speed, t, dt):
        """Of friction [N] on node i, which is pressed with N and slides at `speed` [m/s]."""
        return self.friction_coefficient[s] * N

    @ti.func
    def _let_go(self, s, i, rate, dt):
        """Node i, which touched, does not any more; `rate` of its gap [m/s]."""
        nothing = ti.Vector.zero(backend.real, self.nodes.dimension)
        # How it slid in this last increment is not known: what the spring held is rubbed off.
        before, friction = self.stretch[s, i], self.friction[s, i]
        self.book_normal(s, i, self.dashpot[s, i], 0.0, dt * rate)
        self.book_tangential(
            s, i, friction, nothing, before, nothing, self.tangential_stiffness[i], before
        )
        self.on_member[s, i], self.stretch[s, i], self.friction[s, i] = nothing, nothing, nothing
        self.facet[s, i], self.gap[s, i], self.pressing[s, i] = -1, 0.0, 0.0
        self.dashpot[s, i] = 0.0

    @ti.func
    def gather_facet_reactions(self, s, p, t, dt):
        """All contact forces on the nodes of part p, into their slots."""
        first, end = part_of(self.count.read(), p)
        if self.lists.renewed[s] == 1:
            self.may_react[s, p] = self.may_touch[s, p]
            for i in range(first, end):
                if self._nodes_around(s, i) > 0 or self.loaded[s, i] == 1:
                    self.may_react[s, p] = 1
        if self.may_react[s, p] == 1:
            for i in range(first, end):
                self._gather_node(s, i)

    @ti.func
    def _nodes_around(self, s, i):
        """How many nodes may touch the facets around node i."""
        a = self.surface.member[i]
        count = 0
        for e in range(self.surface.first_around[a], self.surface.first_around[a + 1]):
            count += self.lists.near_node_count[s, self.surface.facet_around[e]]
        return count

    @ti.func
    def _gather_node(self, s, i):
        """What node i gets from its own facet and from the nodes on the facets around it."""
        a = self.surface.member[i]
        total = self.on_member[s, i]
        loaded = ti.cast(self.facet[s, i] >= 0, ti.i32)
        for e in range(self.surface.first_around[a], self.surface.first_around[a + 1]):
            f, c = self.surface.facet_around[e], self.surface.corner_around[e]
            for k in range(self.lists.near_node_count[s, f]):
                j = self.lists.near_node[s, f, k]
                if self.facet[s, j] == f:
                    loaded = 1
                    total += self.on_corner[s, j, c]
        if loaded == 1 or self.loaded[s, i] == 1:
            self.nodes.corner_forces.write(s, self.first_slot + i, total)
            self.loaded[s, i] = loaded

    @ti.func
    def stored_energy(self, s, part):
        """Energy in the penalty springs, normal and tangential [J]."""
        total = ti.cast(0.0, backend.real)
        for i in range(self.count.first(part), self.count.first(part + 1)):
            total += 0.5 * self.penalty_stiffness[i] * self.gap[s, i] * self.gap[s, i]
            total += 0.5 * self.tangential_stiffness[i] * self.stretch[s, i].norm_sqr()
        return total
