"""Contact of the surfaces of deformable bodies with each other: points against facets.

The laws are those of the walls (contact/forces.py), between a point of a surface, vertex or
centroid of a facet, and the closest facet that faces it (contact/deformable_surface.py); one at a
time. The points of each surface are tested against the facets of the others. The force on a point
is distributed to the corners of its own facet, by their weights, and its reaction to the corners of
the facet that it touches, so momentum and angular momentum are conserved. The spring of the
friction is a vector in space that moves with the facet: it grows with the velocity of the point
relative to the location on the facet, and rotates with the tangent plane.

The stiffness of a point is determined when it meets a facet and stays constant until it leaves
(`DeformableSurface.facing_fraction`), so its springs have a potential. So has the attraction of
surfaces that adhere: a point meets a facet when it comes within its reach, and the area with which
it adheres stays constant as long as it is near facets of the same group. Beyond an end of the
surface both fade out alike.
"""

from collections.abc import Sequence

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import Number, index_field, real_field, vector_field
from softsim.compute.nodes import PARTS
from softsim.compute.term import Pass, Stage
from softsim.contact.adhesion import PairAdhesion, PairLaws
from softsim.contact.deformable_surface import (
    DEPTH,
    EXTENSION,
    DeformableSurface,
    corner,
    corner_forces,
    foot_weights,
    is_farther,
    velocity_beside,
)
from softsim.contact.forces import (
    BEFORE_START,
    Dissipation,
    Penalty,
    PenaltyFields,
    normal_force,
    shear_force,
    slip,
)
from softsim.contact.neighbour_lists import NeighbourLists, part_of

TURNING = 0.2
"""Smallest path over facet size by which the nodes of a facet move when it turns to face a point.

It turns from a normal perpendicular to that of the point to one within FACING of its opposite (asin
0.3 is 17 degrees).
"""


class SelfContact(Dissipation):
    """Contact of the points of a surface with its facets, each with the closest that faces it.

    Parameters
    ----------
    surface: points (k) and facets (f). lists: which of them may touch.
    members: numbers of the nodes that get forces.
    penalty: springs and dashpots of the points (k,).
    friction_coefficient: mu (scenarios, groups, groups) [-].
    adhesions: laws of adhesion in each scenario; none where nothing adheres.

    Fields, (scenarios, k): facet that a point touches or that attracts it, or -1; gap [m], zero
    without one; fraction of its stiffness that acts on that facet, and phi, that of it which is
    left beyond an end of the surface; stretch (d) of the friction's spring [m], friction (d) [N];
    pressing, the normal force [N]; deepest, the largest penetration so far [m];
    friction_dissipation and damping_dissipation [J].
    """

    def __init__(
        self,
        surface: DeformableSurface,
        lists: NeighbourLists,
        members: np.ndarray,
        penalty: Penalty,
        friction_coefficient: np.ndarray,
        adhesions: Sequence[PairLaws] = (),
    ) -> None:
        nodes = surface.nodes
        scenarios, d = nodes.scenarios, nodes.dimension
        Dissipation.__init__(self, scenarios, int(surface.point_count))
        self.surface, self.lists, self.nodes = surface, lists, nodes
        self.penalty = PenaltyFields(penalty)
        self.friction_coefficient = real_field(friction_coefficient)
        self.first_slot = nodes.corner_forces.reserve(members)
        points = int(surface.point_count)
        self.adhesion = [PairAdhesion(adhesions, points)] if adhesions else []  # none or one
        self.farthest = max((laws.farthest for laws in adhesions), default=0.0)

        self.member_count = Number(len(members))
        shape = (scenarios, int(surface.point_count))
        self.facet = index_field(np.full(shape, -1))
        self.gap, self.dashpot, self.pressing = (real_field(np.zeros(shape)) for _ in range(3))
        self.fraction, self.phi, self.deepest = (real_field(np.zeros(shape)) for _ in range(3))
        self.stretch, self.friction = (vector_field(np.zeros((*shape, d))) for _ in range(2))
        self.on_corner = vector_field(np.zeros((*shape, d, d)))  # forces on the facet's corners
        self.on_point = vector_field(np.zeros((*shape, d)))
        # True if points of a part may touch facets; if nodes of a part may get forces, and do.
        self.may_touch, self.may_react = (index_field(np.zeros((scenarios, PARTS))) for _ in "ab")
        self.loaded = index_field(np.zeros((scenarios, len(members))))
        # Time at which a facet was touched last: nothing touches others, whatever is near.
        self.pressed_at = real_field(np.full((scenarios, int(surface.facet_count)), BEFORE_START))

    def passes(self) -> dict[Stage, list[Pass]]:
        """Return the passes of an increment; lists are checked and renewed in between."""
        lists = self.lists
        return {
            Stage.MOVE: [Pass("contact", PARTS, (lists.watch,))],
            Stage.PRESS: [Pass("contact", 1, (lists.sort,))],
            Stage.STRESS: [Pass("contact", PARTS, (lists.find_facets, self.push))],
            Stage.LIST: [Pass("contact", 1, (lists.find_nodes,))],
            Stage.GATHER: [Pass("contact", PARTS, (self.gather_facet_reactions,))],
        }

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores; neighbour lists are renewed instead."""
        return {
            "facet": self.facet,
            "gap": self.gap,
            "fraction": self.fraction,
            "phi": self.phi,
            "deepest": self.deepest,
            "dashpot": self.dashpot,
            "normal_force": self.pressing,
            "stretch": self.stretch,
            "friction": self.friction,
            "loaded": self.loaded,
            "friction_dissipation": self.friction_dissipation,
            "damping_dissipation": self.damping_dissipation,
            **{
                name: field
                for adhesion in self.adhesion
                for name, field in adhesion.state_fields().items()
            },
        }

    def forget_dissipation(self, scenario: int) -> None:
        """Set the dissipated energies and the largest penetration of a scenario to zero."""
        super().forget_dissipation(scenario)
        fields.write_row(self.deepest, scenario, 0.0)

    @ti.func
    def push(self, s, p, t, dt):
        """Compute the contact forces of the points of part p, and their reactions on facets."""
        first, end = part_of(self.count.read(), p)
        if self.lists.renewed[s] == 1:
            self.may_touch[s, p] = 0
            for i in range(first, end):
                if self._is_involved(s, i):
                    self.may_touch[s, p] = 1
        if self.may_touch[s, p] == 1:
            for i in range(first, end):
                if self.facet[s, i] >= 0 or (
                    self.lists.near_facet_count[s, i] > 0
                    and self.lists.travel[s] >= self.lists.due[s, i]
                ):
                    self._push_point(s, i, t, dt)

    @ti.func
    def _is_involved(self, s, i):
        """Return True if point i touches a facet or may do so soon."""
        return self.lists.near_facet_count[s, i] > 0 or self.facet[s, i] >= 0

    @ti.func
    def _push_point(self, s, i, t, dt):
        """Compute the contact force of point i with the closest facet that faces it."""
        x, outward = self.surface.place(s, i), self.surface.outward(s, i)
        f, w = self._closest_facet(s, i, x, outward)
        is_held = False
        rate = ti.cast(0.0, backend.real)  # dg/dt = n . (v - sum_c U_c v_c)
        if f >= 0:
            X, V = self.surface.corners(s, f), self.surface.corner_velocities(s, f)
            v = self.surface.velocity(s, i)
            gap, n, U, phi, fading = self._gap(s, i, X, f, w, x, outward)
            rate = n.dot(v - V.transpose() @ U)
            if self.facet[s, i] < 0 and gap < self.farthest:
                self.fraction[s, i] = self.surface.facing_fraction(s, i, X, f)
            if gap < self.farthest:
                self._adhere(s, i, X, f, gap)
            reach = ti.cast(0.0, backend.real)
            for adhesion in ti.static(self.adhesion):
                reach = adhesion.reach_of(s, i)
            if gap < reach:
                is_held = True
                self.phi[s, i] = phi
                self.pressed_at[s, f] = t
                self._touch(s, i, f, X, V, U, x, v, gap, n, rate, t, dt)
                if fading > 0.0:
                    self._slide_off(s, i, X, w, U, x, gap, n, fading)
        if not is_held and self.facet[s, i] >= 0:
            self._lose_contact(s, i, rate, dt)

    @ti.func
    def _adhere(self, s, i, X, f, gap):
        """Determine the adhesion of point i to facet f with its corners at X.

        Where the point slides to another group of facets, the difference of the potentials counts
        as dissipated.
        """
        other = self.surface.facet_group(f)
        for adhesion in ti.static(self.adhesion):
            is_new = self.facet[s, i] < 0 or adhesion.group[s, i] != other
            slid = self.facet[s, i] >= 0 and is_new and adhesion.group[s, i] >= 0
            before = self.phi[s, i] * adhesion.energy(s, i, 0, gap)
            portion = adhesion.portion[self.surface.point_group[i], other]
            whole = portion * self.surface.point_area[i]
            if is_new:
                adhesion.group[s, i] = other
                adhesion.area[s, i] = whole * self._facing_area(s, i, X, f)
            # Both half passes press where one of them adheres.
            k_n = 2.0 * portion * self.fraction[s, i] * self.penalty.k_n[i]
            law, adhering = ti.Vector.zero(backend.real, 4), ti.cast(0.0, backend.real)
            compliance = ti.cast(0.0, backend.real)
            if k_n > 0.0:
                compliance = adhesion.area[s, i] / k_n
            for e in range(self.surface.first_own[i], self.surface.first_own[i + 1]):
                g = self.surface.own_facet[e]
                own = self.surface.facet_group(g)
                if adhesion.adheres(s, own, other):
                    law += self.surface.facet_area[g] * adhesion.law(s, own, other, compliance)
                    adhering += self.surface.facet_area[g]
            if adhering > 0.0:
                law /= adhering
            adhesion.act(s, i, law, k_n)
            if slid:
                after = self.phi[s, i] * adhesion.energy(s, i, 0, gap)
                self.damping_dissipation[s, i] = self.damping_dissipation[s, i] + before - after

    @ti.func
    def _facing_area(self, s, i, X, f):
        """Return the fraction of the area of point i that adheres to facet f, projected onto it.

        X: corners of f.
        """
        normal, other = self.surface.shape.normal(X), self.surface.facet_group(f)
        adhering, whole = ti.Vector([0.0, 0.0])
        for adhesion in ti.static(self.adhesion):
            for e in range(self.surface.first_own[i], self.surface.first_own[i + 1]):
                g = self.surface.own_facet[e]
                whole += self.surface.facet_area[g]
                if adhesion.adheres(s, self.surface.facet_group(g), other):
                    cosine = -normal.dot(self.surface.shape.normal(self.surface.corners(s, g)))
                    adhering += self.surface.facet_area[g] * ti.max(0.0, cosine)
        return adhering / whole

    @ti.func
    def _closest_facet(self, s, i, x, outward):
        """Return the closest of the facets near point i at x that face its normal `outward`.

        Also return the weights of its closest point; the facet is -1 if it is farther than the
        largest penetration. The search begins with the facet that the point touches, from which
        most are farther.
        """
        closest, touched = -1, self.facet[s, i]
        w = ti.Vector.zero(backend.real, self.nodes.dimension)
        deepest = self.lists.deepest[0]
        # A facet that is skipped is farther than `deepest`.
        nearest, path = deepest**2, deepest * (1.0 - EXTENSION / DEPTH) - self.farthest
        for k in range(-1, self.lists.near_facet_count[s, i]):
            f = touched
            if k >= 0:
                f = self.lists.near_facet[s, i, k]
            if f >= 0 and f != closest:
                X = self.surface.corners(s, f)
                within = nearest
                if touched < 0:
                    within = deepest**2
                if not is_farther(X, x, within):
                    weights = self.surface.shape.closest_weights(X, x)
                    apart = x - X.transpose() @ weights
                    square = apart.norm_sqr()
                    path = ti.min(path, self._path_to(s, f, X, apart, outward))
                    is_closer = square < nearest or (square == nearest and f < closest)
                    if is_closer and self.surface.faces(X, outward):
                        closest, nearest, w = f, square, weights
        if touched >= 0:
            path = 0.0
        self.lists.due[s, i] = self.lists.travel[s] + ti.max(0.0, path)
        if closest >= 0 and nearest >= (DEPTH * self.surface.length(i, closest)) ** 2:
            closest = -1
        return closest, w

    @ti.func
    def _path_to(self, s, f, X, apart, outward):
        """Return a lower bound of the path [m] after which a point may touch facet f.

        apart: vector from the closest point of the facet to the point. In front of the facet the
        bound is the distance to its extension. Behind it it is zero if the facet faces the point,
        and otherwise the path that turns the facet by that much.
        """
        area = self.surface.shape.area_vector(X)
        path = apart.norm() - EXTENSION / DEPTH * self.lists.deepest[0] - self.farthest
        if apart.dot(area) < 0.0:
            path = TURNING * self.surface.facet_size[f]
            if area.dot(outward) < 0.0 or outward.norm_sqr() == 0.0:
                path = 0.0
        return path

    @ti.func
    def _gap(self, s, i, X, f, w, x, outward):
        """Return the signed gap [m] of point i at x to facet f, and its derivatives.

        outward: normal of the point. X: corners of the facet. w: weights of its closest point.

        Returns the gap g; the unit normal n; the weights U of the corners in dg/dt = n . (v - sum_c
        U_c v_c); and phi and -(dphi/ds) / s [1/m^2] of an end of the surface, elsewhere 1 and 0.
        """
        apart = x - X.transpose() @ w
        n = self.surface.shape.normal(X)
        gap = apart.dot(n)
        U, phi, fading = w, ti.cast(1.0, backend.real), ti.cast(0.0, backend.real)
        if w.min() == 0.0:  # on an edge of the facet or on a corner
            outside = self._outward(s, i, f, w, outward)
            if outside.norm_sqr() > 0.0:
                gap = apart.norm()
                if apart.dot(outside) < 0.0:
                    gap = -gap
                if gap != 0.0:
                    n = apart / gap
            else:
                U = foot_weights(X, self.surface.shape.weight_gradients(X), x)
                reach = EXTENSION * self.surface.facet_size[f]
                beyond = (apart - gap * n).norm() / reach
                if beyond < 1.0:
                    phi = (1.0 - beyond) ** 3 * (1.0 + 3.0 * beyond + 6.0 * beyond**2)
                    fading = 30.0 * beyond * (1.0 - beyond) ** 2 / reach**2
                else:
                    gap = ti.cast(self.farthest, backend.real)
        return gap, n, U, phi, fading

    @ti.func
    def _outward(self, s, i, f, w, outward):
        """Return a normal of the edge or vertex of facet f where w lies.

        It is zero where the surface ends, or continues with facets that do not face point i or are
        its neighbours.
        """
        heaviest = 0
        for c in ti.static(range(1, self.nodes.dimension)):
            if w[c] > w[heaviest]:
                heaviest = c
        on_corner = w[heaviest] == 1.0
        a = self.surface.corner[f, heaviest]
        normal = ti.Vector.zero(backend.real, self.nodes.dimension)
        meeting, whole = 0, 1
        for e in range(self.surface.first_around[a], self.surface.first_around[a + 1]):
            g = self.surface.facet_around[e]
            if on_corner or self.surface.shares(f, g, w):
                X = self.surface.corners(s, g)
                weight = ti.cast(1.0, backend.real)  # of the two sides of an edge
                if on_corner:
                    weight = self.surface.shape.angle(X, self.surface.corner_around[e])
                normal += weight * self.surface.shape.normal(X)
                meeting += 1
                if not (self.surface.faces(X, outward) and self.lists.holds(s, i, g)):
                    whole = 0
        if (on_corner and self.surface.is_rim[a] == 1) or (not on_corner and meeting != 2):
            whole = 0
        return normal * whole

    @ti.func
    def _touch(self, s, i, f, X, V, U, x, v, gap, n, rate, t, dt):
        """Compute the forces of point i at x, with velocity v, on facet f.

        X, V: positions and velocities of the corners of the facet.
        """
        k_n = self.fraction[s, i] * self.phi[s, i] * self.penalty.k_n[i]
        c_n = self.fraction[s, i] * self.phi[s, i] * self.penalty.c_n[i]
        N = normal_force(gap, rate, k_n, c_n)
        # Where the point is beside the facet, and how fast it slides over it.
        facet_normal = self.surface.shape.normal(X)
        gradients = self.surface.shape.weight_gradients(X)
        W = foot_weights(X, gradients, x)
        z = (x - X.transpose() @ W).dot(facet_normal)
        sliding = v - velocity_beside(V, gradients, facet_normal, W, z)
        sliding -= sliding.dot(n) * n
        inside = dt
        if gap < 0.0 and self.gap[s, i] >= 0.0 and rate * dt < gap:
            inside = gap / rate  # it crossed the surface within this increment
        k_t = self.fraction[s, i] * self.penalty.k_t[i]
        damping_rate = self.fraction[s, i] * self.penalty.c_t[i] / dt
        across = self.stretch[s, i].dot(n)  # by which the tangent plane has turned away
        before = self.stretch[s, i] - across * n
        stretch = before + inside * sliding
        limit = self._friction_limit(s, i, f, N, sliding.norm(), t, dt)
        attraction = ti.cast(0.0, backend.real)
        for adhesion in ti.static(self.adhesion):
            attraction = self.phi[s, i] * adhesion.force(s, i, 0, gap)
        slipped = slip(stretch, before, k_t, damping_rate, limit)
        stretch -= slipped
        friction = shear_force(stretch, before, k_t, damping_rate)
        damping_force = N + k_n * ti.min(gap, 0.0)
        self.book_normal(s, i, self.dashpot[s, i], damping_force, dt * rate)
        self.book_tangential(
            s, i, self.friction[s, i], friction, before, stretch, k_t,
            slipped + (dt - inside) * sliding,
        )  # fmt: skip
        self.friction_dissipation[s, i] = self.friction_dissipation[s, i] + (
            0.5 * k_t * across * across
        )
        normal = (N - attraction) * n
        self.on_point[s, i] = normal - friction
        rubbed = corner_forces(gradients, facet_normal, W, z, -friction)
        for c in ti.static(range(self.nodes.dimension)):
            self.on_corner[s, i, c] = -U[c] * normal - corner(rubbed, c)
        self.facet[s, i], self.gap[s, i], self.pressing[s, i] = f, gap, N
        self.dashpot[s, i] = damping_force
        self.stretch[s, i], self.friction[s, i] = stretch, friction
        self.deepest[s, i] = ti.max(self.deepest[s, i], -gap)

    @ti.func
    def _slide_off(self, s, i, X, w, U, x, gap, n, fading):
        """Add the force of the fading contact along the path s beyond an end of the surface.

        It is -dE/ds along the path s beyond the end, E = phi(s) times the energy without the end.
        """
        beyond = x - X.transpose() @ w - gap * n
        per_length = self._normal_energy(s, i, gap) * fading
        self.on_point[s, i] = self.on_point[s, i] + per_length * beyond
        for c in ti.static(range(self.nodes.dimension)):
            moment = (U[c] - w[c]) * gap * n
            self.on_corner[s, i, c] = self.on_corner[s, i, c] + per_length * (
                moment - w[c] * beyond
            )

    @ti.func
    def _friction_limit(self, s, i, f, N, speed, t, dt):
        """Return the friction limit [N] of point i, pressed with N against facet f."""
        one, other = self.surface.point_group[i], self.surface.facet_group(f)
        mu = self.friction_coefficient[s, one, other]
        limit = mu * N
        for adhesion in ti.static(self.adhesion):
            phi = self.phi[s, i]
            limit = phi * adhesion.friction_limit(s, i, 0, N / phi, mu)
            if N == 0.0:  # only attracted, or held against the attraction by its dashpot
                limit = 0.0
        return limit

    @ti.func
    def _normal_energy(self, s, i, gap):
        """Return the energy [J] of the penalty spring and of adhesion of point i, without phi."""
        depth = ti.min(gap, 0.0)
        energy = 0.5 * self.fraction[s, i] * self.penalty.k_n[i] * depth * depth
        for adhesion in ti.static(self.adhesion):
            energy += adhesion.energy(s, i, 0, gap)
        return energy

    @ti.func
    def _lose_contact(self, s, i, rate, dt):
        """End the contact of point i; `rate`: that of its gap [m/s]."""
        nothing = ti.Vector.zero(backend.real, self.nodes.dimension)
        # How it slid in this last increment is not known: what the spring held is rubbed off.
        before, friction = self.stretch[s, i], self.friction[s, i]
        self.book_normal(s, i, self.dashpot[s, i], 0.0, dt * rate)
        k_t = self.fraction[s, i] * self.penalty.k_t[i]
        self.book_tangential(s, i, friction, nothing, before, nothing, k_t, before)
        self.on_point[s, i], self.stretch[s, i], self.friction[s, i] = nothing, nothing, nothing
        self.facet[s, i], self.gap[s, i], self.pressing[s, i] = -1, 0.0, 0.0
        self.dashpot[s, i] = 0.0

    @ti.func
    def gather_facet_reactions(self, s, p, t, dt):
        """Write all contact forces on the nodes of part p into their slots."""
        first, end = part_of(self.member_count.read(), p)
        if self.lists.renewed[s] == 1:
            self.may_react[s, p] = 0
            for i in range(first, end):
                if self._may_be_loaded(s, i):
                    self.may_react[s, p] = 1
        if self.may_react[s, p] == 1:
            for i in range(first, end):
                self._gather_node(s, i, t)

    @ti.func
    def _may_be_loaded(self, s, i):
        """Return True if a point at node i or around it, or one on a facet around it, may touch."""
        a, m = self.surface.member[i], self.member_count.read()
        result = self._is_involved(s, i) or self.loaded[s, i] == 1
        for e in range(self.surface.first_around[a], self.surface.first_around[a + 1]):
            f = self.surface.facet_around[e]
            if self.lists.near_node_count[s, f] > 0 or self._is_involved(s, m + f):
                result = True
        return result

    @ti.func
    def _gather_node(self, s, i, t):
        """Write the sum of the forces on node i.

        They are those of its own point, of the centroids of the facets around it, and of the points
        that touch these facets.
        """
        a, m = self.surface.member[i], self.member_count.read()
        total, loaded = ti.Vector.zero(backend.real, self.nodes.dimension), 0
        if self.facet[s, i] >= 0:
            total, loaded = self.on_point[s, i], 1
        for e in range(self.surface.first_around[a], self.surface.first_around[a + 1]):
            f, c = self.surface.facet_around[e], self.surface.corner_around[e]
            if self.facet[s, m + f] >= 0:
                loaded = 1
                total += self.on_point[s, m + f] / ti.static(float(self.nodes.dimension))
            if self.pressed_at[s, f] == t:
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
        """Return the energy in the penalty springs, normal and tangential, and of adhesion [J]."""
        total = ti.cast(0.0, backend.real)
        for i in range(self.count.first(part), self.count.first(part + 1)):
            if self.facet[s, i] >= 0:
                k_t = self.fraction[s, i] * self.penalty.k_t[i]
                total += self.phi[s, i] * self._normal_energy(s, i, self.gap[s, i])
                total += 0.5 * k_t * self.stretch[s, i].norm_sqr()
        return total
