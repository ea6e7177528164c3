"""Upper bound of the contact stiffness, as if every node that may touch were in contact.

A node against one surface has the stiffness k_n n (x) n + k_t (I - n (x) n), against several their
sum. A dashpot c, whose velocity lags half a step behind, acts on the stable step as a spring
2 c / dt (solver/stable_step.py). If a node and a rigid body press each other, each has the spring
as if the other were fixed; the bound combines both.

A corner of a wall that presses a facet adds k w w^T, with the weights w_c of the facet's nodes: at
most k w_c at each of them, as (sum_c w_c u_c)^2 <= sum_c w_c u_c^2.

Between bodies a point against a facet adds k b b^T along one direction. b are the weights of the
nodes of its own facet and, negative, those of the other; each set adds up to 1. As
(sum_j b_j u_j)^2 <= (sum_j |b_j|) (sum_j |b_j| u_j^2), that is at most 2 k |b_j| at each of them.
(Two nodes that press each other from both sides attain it.) Two terms are left out: the rotation of
the facet by friction, of the order of the gap over its length, and the end of a surface, where
contact fades: 3 k (z / l)^2, a hundredth of k at the default penetration z.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from softsim.contact.surface_contact import ContactData
from softsim.contact.wall import Wall
from softsim.loads.load import RigidSpring
from softsim.loads.tether import EndDrag
from softsim.mesh.surface import area_vectors, weights_in_line
from softsim.model import Model, OutlineData, SelfContactData
from softsim.rigid import RigidBodyData, in_space, point_inertia

# -------------------------------------------------------------------------------------------------
# Rigid bodies in the bound of the stable step: their inertia, and the springs on them.
#
# For the stable step the tie of nodes to a body is cut, so that nodes and body move independently.
# This is safe, as a constraint only removes motions. The body's inertia may be assigned to either.
# A mass eps at each of the k tied nodes, at r from the centre, has at most the kinetic energy 2 eps
# (k |v|^2 + sum r^2 |omega|^2) / 2, which the fraction s of the body's inertia covers if eps = s/2
# min(M / k, I / sum r^2).
#
# A spring k along a line through a point, and K against rotation, add at most k/M + K/I to omega^2.
#
# Let nodes alone have the largest omega^2 p, bodies alone b. The springs of the contact between
# them alone give at most d for nodes if bodies are fixed, and s for bodies if nodes are fixed. The
# block that couples both is a product of two matrices whose norms are the roots of these. So all
# together have at most the larger eigenvalue of
#     [ p          sqrt(d s) ]
#     [ sqrt(d s)  b         ].

# Of the inertia that goes to the tied nodes; a frame is much heavier than they are.
TIED_SHARE = 0.25


def tied_mass(body: RigidBodyData, points: np.ndarray, tied: np.ndarray) -> float:
    """Return the mass [kg] of the body for each of the nodes `tied`; infinite if it cannot move."""
    mass, inertia = least_inertia(body, points.shape[1])
    spread = ((points[tied] - body.centre) ** 2).sum()
    if len(tied) == 0:
        return np.inf
    turning = inertia / spread if spread > 0.0 else np.inf
    return 0.5 * TIED_SHARE * min(mass / len(tied), turning)


def least_inertia(body: RigidBodyData, dimension: int) -> tuple[float, float]:
    """Return the mass [kg] and smallest moment of inertia [kg m^2]; infinite if held."""
    mass = body.mass if any(body.free[:dimension]) else np.inf
    return mass, float(np.diag(body.inertia)[list(body.free[3:])].min(initial=np.inf))


class TiedSprings:
    """Isotropic springs at nodes (k,), of which those at nodes tied to a rigid body hold it.

    points (n, d) [m]: positions of all nodes at rest, for which the body's inertia is given.
    """

    def __init__(self, body: RigidBodyData, points: np.ndarray, nodes: np.ndarray) -> None:
        self.own = np.isin(nodes, body.tied)
        self.arms = in_space(points[nodes[self.own]] - body.centre)
        d = points.shape[1]
        moves = np.flatnonzero([*body.free[:d], *([False] * (3 - d)), *body.free[3:]])
        self.hold_nothing = len(moves) == 0 or not self.own.any()
        self.moving = np.ix_(moves, moves)
        inertia = np.zeros((6, 6))
        inertia[:3, :3], inertia[3:, 3:] = body.mass * np.eye(3), body.inertia
        self.inertia = inertia[self.moving]

    def largest_frequency(self, stiffness: np.ndarray) -> float:
        """Return the largest omega^2 [1/s^2] of the body alone on these springs.

        stiffness (k,) [N/m]: of the springs. The result is 0 if the body is fixed or has no spring.
        """
        if self.hold_nothing:
            return 0.0
        k = stiffness[self.own]
        x, y, z = k @ self.arms
        springs = np.zeros((6, 6))
        springs[:3, :3] = k.sum() * np.eye(3)
        springs[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]  # k omega x r
        springs[3:, :3] = springs[:3, 3:].T
        springs[3:, 3:] = point_inertia(k, self.arms)
        return float(eigh(springs[self.moving], self.inertia, eigvals_only=True)[-1])


def with_bodies(nodes: float, bodies: float, pressed: float, pressing: float) -> float:
    """Return a bound of omega^2 [1/s^2] of nodes and rigid bodies together.

    nodes, bodies: omega^2 of each alone, with all its springs. pressed, pressing: omega^2 of nodes
    and of bodies with the springs between them alone.
    """
    mean, half = 0.5 * (nodes + bodies), 0.5 * (nodes - bodies)
    return float(mean + np.sqrt(half**2 + pressed * pressing))


def load_springs(model: Model) -> list[RigidSpring]:
    """Return the springs of all loads on rigid bodies."""
    centres = np.array(
        [body.with_tied_mass(model.points, model.mass)[1] for body in model.rigid_bodies]
    )
    gravity = float(np.linalg.norm(model.gravity))
    return [spring for load in model.loads for spring in load.springs(centres, gravity)]


def spring_frequencies(model: Model, springs: list[RigidSpring]) -> dict[str, float]:
    """Return the largest k/M + K/I [1/s^2] of the rigid bodies for springs of each kind, by kind.

    The inertia of a body is reduced by the part assigned to its tied nodes.
    """
    stiffness: dict[str, np.ndarray] = {}
    for spring in springs:
        of_kind = stiffness.setdefault(spring.kind, np.zeros((len(model.rigid_bodies), 2)))
        of_kind[spring.body] += spring.stiffness, spring.turning
    inertias = np.array([least_inertia(body, model.dimension) for body in model.rigid_bodies])
    return {
        kind: float((of_kind / inertias).sum(axis=1).max()) / (1.0 - TIED_SHARE)
        for kind, of_kind in stiffness.items()
    }


# Of the contact points of facets: the centroid's area, 2/3 of an edge and 3/4 of half a square, and
# the distance of vertices and centroids, over the edge or over the side of the square.
LARGEST_POINT = {2: 2.0 / 3.0, 3: 3.0 / 8.0}
POINT_SEPARATION = {2: 1.0 / 2.0, 3: np.sqrt(2.0) / 3.0}

# A wall is within reach of a node at this fraction of the model's size: half of it is left for the
# motion until the next inspection.
REACH = 0.1


@dataclass(frozen=True)
class ContactBound:
    """Upper bounds of the contact stiffness in one configuration and at one step.

    nodes (n,) [N/m]: of each node, with walls, outlines and other surfaces; drag at the ends of
    cables is added. A tied node loads its rigid body instead. A node on an outline or on another
    surface touches a wall at the same time only if a wall is within reach.
    hits (n,) [N/m]: the largest of a node with walls, with outlines or with surfaces.
    pressed (n,) [N/m]: of each node with outlines, and surfaces, some of which may be tied to
    rigid bodies.
    bodies_at_walls, pressed_bodies [1/s^2]: the largest omega^2 of a rigid body on its contact
    springs with walls, and on those with nodes.
    """

    nodes: np.ndarray
    hits: np.ndarray
    pressed: np.ndarray
    bodies_at_walls: float
    pressed_bodies: float

    @property
    def bodies(self) -> float:
        """Upper bound of omega^2 [1/s^2] of a rigid body on all contact springs."""
        return self.bodies_at_walls + self.pressed_bodies


@dataclass(frozen=True)
class ContactPlaces:
    """Places of nodes on which the contact bound of one configuration depends.

    far (k,): nodes on outlines or surfaces that had no wall within reach. arms [m]: distances of
    nodes on each outline from the centre of its body.
    """

    stiffness: "ContactStiffness"
    far: np.ndarray
    arms: list[np.ndarray]

    def hold(self, x: np.ndarray) -> bool:
        """Return True if the bound still holds with all nodes at x (n, d) [m], and for half the
        reach of further motion.
        """
        half = 0.5 * self.stiffness.reach
        if not (gaps(self.stiffness.model.walls, x[self.far]) > half).all():
            return False
        now = self.stiffness.arms(x)
        return all((a <= then + half).all() for a, then in zip(now, self.arms, strict=True))


def gaps(walls: Sequence[Wall], x: np.ndarray) -> np.ndarray:
    """Return a lower bound (n,) [m] of the gaps of points x (n, d) to the nearest wall."""
    return np.min([np.full(len(x), np.inf), *(wall.least_gap(x) for wall in walls)], axis=0)


class ContactStiffness:
    """Upper bounds of the stiffness that contact adds to nodes and to rigid bodies."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.tied = np.zeros(len(model.points), dtype=bool)
        for body in model.rigid_bodies:
            self.tied[body.tied] = True
        self.reach = REACH * np.ptp(model.points, axis=0).max()
        self.supports = [(o, o.support) for o in model.outlines if o.support is not None]
        self.touched_at_once = touched_at_once(model.walls)
        self.on_walls = self._tied_springs(model.contact.nodes)
        if model.self_contact is not None:
            self.surfaces = SurfaceStiffness(model.self_contact, model.points)
            self.on_surfaces = self._tied_springs(model.self_contact.nodes)
        others = self._of_supports(np.inf) + self._of_surfaces(model.points, np.inf)[1]
        self.touching_both = np.flatnonzero((self._of_walls(np.inf) > 0.0) & (others > 0.0))

    def _tied_springs(self, nodes: np.ndarray) -> list[TiedSprings]:
        """Return the contact springs at nodes (k,) on each rigid body."""
        bodies, points = self.model.rigid_bodies, self.model.points
        return [TiedSprings(body, points, nodes) for body in bodies]

    def at(self, x: np.ndarray, dt: float) -> ContactBound:
        """Return the bounds with all nodes at x (n, d) [m] and the step dt [s]."""
        at_walls, at_supports = self._of_walls(dt), self._of_supports(dt)
        pressed, at_surfaces = self._of_surfaces(x, dt)
        others = at_supports + at_surfaces
        walls, held = self._of_bodies(x, dt, pressed)
        return ContactBound(
            self._together(at_walls, others, x),
            np.max([at_walls, at_supports, at_surfaces], axis=0),
            others,
            walls,
            held,
        )

    def _together(self, at_walls: np.ndarray, others: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return the stiffness (n,) [N/m] of nodes that touch walls and others, with end drag."""
        walls, others = at_walls.copy(), others.copy()
        far = self._far_from_walls(x)
        walls[far], others[far] = np.maximum(walls[far], others[far]), 0.0
        for drag in self.model.of_kind(EndDrag):
            others[drag.end] += drag.stiffness
        return walls + others

    def _far_from_walls(self, x: np.ndarray) -> np.ndarray:
        """Return the nodes (k,) on outlines or surfaces that no wall is within reach of."""
        both = self.touching_both
        return both[gaps(self.model.walls, x[both]) > self.reach]

    def places(self, x: np.ndarray) -> ContactPlaces:
        """Return the places of nodes on which the bounds with all nodes at x (n, d) [m] depend."""
        return ContactPlaces(self, self._far_from_walls(x), self.arms(x))

    def _of_walls(self, dt: float) -> np.ndarray:
        """Return the stiffness (n,) [N/m] of nodes with all walls together, 0 for tied nodes."""
        stiffness = np.zeros(len(self.model.points))
        if self.model.walls:
            for contact in self.model.wall_contacts:
                stiffness[contact.nodes] = wall_stiffness(contact, self.touched_at_once, dt)
            stiffness += self._of_corners(dt)
        return np.where(self.tied, 0.0, stiffness)

    def _of_corners(self, dt: float) -> np.ndarray:
        """Return the stiffness (n,) [N/m] of nodes of facets that corners of walls may press.

        As many corners as can be close together press each facet.
        """
        stiffness, data = np.zeros(len(self.model.points)), self.model.corners
        if data is not None:
            of_corner = data.penalty.largest_stiffness(dt).max()
            stiffness[data.facets] = data.together * of_corner
        return stiffness

    def _of_supports(self, dt: float) -> np.ndarray:
        """Return the stiffness (n,) [N/m] of nodes with the outlines of rigid bodies."""
        stiffness = np.zeros(len(self.model.points))
        for _, contact in self.supports:
            stiffness[contact.nodes] += contact.penalty.largest_stiffness(dt)
        return stiffness

    def _of_surfaces(self, x: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the stiffness [N/m] in contact of bodies: (k,) of the nodes of their surfaces, and
        (n,) of all nodes, 0 for tied ones.
        """
        data, stiffness = self.model.self_contact, np.zeros(len(x))
        if data is None:
            return np.zeros(0), stiffness
        pressed = self.surfaces.of_nodes(x, dt)
        stiffness[data.nodes] = pressed
        return pressed, np.where(self.tied, 0.0, stiffness)

    def _of_bodies(self, x: np.ndarray, dt: float, surfaces: np.ndarray) -> tuple[float, float]:
        """Return the largest omega^2 [1/s^2] of a rigid body with walls, and with nodes.

        The first is that of a body on the contact springs of its tied nodes and corners with walls.
        The second is that on the contact springs with nodes, of its tied surfaces and of its
        outline. Springs k_a at distances r_a on an outline give at most
        sum k_a / M + sum k_a r_a^2 / I. surfaces (k,) [N/m]: stiffness of the nodes of surfaces.
        """
        model, contact = self.model, self.model.contact
        at_walls, pressed = np.zeros((2, len(model.rigid_bodies)))
        if model.walls:
            k = wall_stiffness(contact, self.touched_at_once, dt)
            k += self._of_corners(dt)[contact.nodes]
            at_walls[:] = [springs.largest_frequency(k) for springs in self.on_walls]
        if model.self_contact is not None:
            pressed[:] = [springs.largest_frequency(surfaces) for springs in self.on_surfaces]
        for outline, supported in self.supports:
            k = supported.penalty.largest_stiffness(dt)
            mass, inertia = least_inertia(model.rigid_bodies[outline.body], model.dimension)
            moment = (k * self._arms(outline, supported.nodes, x) ** 2).sum()
            pressed[outline.body] += k.sum() / mass + moment / inertia
        left = 1.0 - TIED_SHARE
        return float(at_walls.max(initial=0.0)) / left, float(pressed.max(initial=0.0)) / left

    def arms(self, x: np.ndarray) -> list[np.ndarray]:
        """Return the distances [m] of `_arms` of the nodes of each outline."""
        return [self._arms(outline, contact.nodes, x) for outline, contact in self.supports]

    def _arms(self, outline: OutlineData, nodes: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return the distance (k,) [m] of nodes from a body's centre if they touch its outline."""
        model, body = self.model, self.model.rigid_bodies[outline.body]
        corners = body.tied[model.mass[body.tied] == 0.0]
        centre = x[corners].mean(axis=0)
        farthest = np.linalg.norm(model.points[corners] - body.centre, axis=1).max()
        off_centre = float(np.linalg.norm(outline.shape.centre - body.centre))
        return np.minimum(np.linalg.norm(x[nodes] - centre, axis=1) + off_centre, farthest)


def touched_at_once(walls: Sequence[Wall]) -> tuple[float, float]:
    """Return the number w of surfaces that a node can touch at once, and an eigenvalue bound.

    The bound is for the largest eigenvalue of sum n (x) n over the normals n of the w surfaces: the
    largest eigenvalue of a sum is at most the sum of the largest eigenvalues of the walls.
    """
    surfaces, alike = np.sum([(0.0, 0.0), *(wall.touched_at_once() for wall in walls)], axis=0)
    return float(surfaces), float(alike)


def wall_stiffness(
    contact: ContactData, touched_at_once: tuple[float, float], dt: float
) -> np.ndarray:
    """Return the largest stiffness (k,) [N/m] of each node with all walls that it can touch.

    It is the largest eigenvalue of k_t w I + (k_n - k_t) sum n (x) n.
    """
    surfaces, alike = touched_at_once
    k_n, k_t = contact.penalty.stiffness_with_dashpots(dt)
    return surfaces * k_t + alike * np.maximum(k_n - k_t, 0.0)


class SurfaceStiffness:
    """Upper bound of the stiffness of contact between bodies at the nodes of their surfaces.

    A node bears its own points and, by their weights w, those of others on the facets around it.
    One surface presses it at a time, from one side: then it has the areas of its facets projected
    onto that surface. Its own points have k_n = (stiffness per area) (area) / 2, the others at most
    half of the node's stiffness per area, or of theirs, and an area sum A_i w_i: of points that lie
    s apart and have the area s^(d - 1) each, no more than (s weights_in_line(h / s))^(d - 1) for a
    reach h of the facets; and of the points of Simpson's rule, which lie POINT_SEPARATION s apart
    and have LARGEST_POINT s^(d - 1) at most, where s^(d - 1) is the area of a quadrilateral or an
    edge. The bound is taken over facets of about one size at a time.
    """

    def __init__(self, data: SelfContactData, rest: np.ndarray) -> None:
        """Prepare the facets around each node; rest: positions of all nodes (n, d) [m]."""
        self.data, d = data, rest.shape[1]
        count = len(data.nodes)
        number = np.searchsorted(data.nodes, data.facets)
        # Pairs of facets around each node: the second is projected along the normal of the first.
        node, facet = number.ravel(), np.repeat(np.arange(len(number)), d)
        order = np.argsort(node, kind="stable")
        node, facet = node[order], facet[order]
        around = np.bincount(node, minlength=count)
        begin = np.concatenate([[0], np.cumsum(around)])[node]
        self.first = np.repeat(np.arange(len(node)), around[node])
        along = np.arange(len(self.first)) - np.repeat(
            np.cumsum(around[node]) - around[node], around[node]
        )
        self.second = begin[self.first] + along
        self.node, self.facet, self.number = node, facet, number
        self.rest_areas = np.linalg.norm(area_vectors(rest, data.facets), axis=1)
        depth = data.summed_at_nodes(data.point_areas) / np.bincount(
            node, self.rest_areas[facet] / d, count
        )
        self.depth = self._largest_around(depth[number].max(axis=1))
        self.per_area = self._largest_around(data.facet_stiffness)

    def _largest_around(self, of_facets: np.ndarray) -> np.ndarray:
        """Return the largest value (k,) of the facets (f,) around each node."""
        largest = np.zeros(len(self.data.nodes))
        np.maximum.at(largest, self.number, of_facets[:, None])
        return largest

    def _stiffening(self, dt: float) -> np.ndarray:
        """Return the largest stiffness with dashpots over k_n (f,) of the points of each facet."""
        penalty = self.data.penalty
        factor = np.ones(len(penalty.k_n))  # a point on the axis has no area, so no spring
        np.divide(penalty.largest_stiffness(dt), penalty.k_n, out=factor, where=penalty.k_n > 0.0)
        vertices, centroids = np.split(factor, [len(self.data.nodes)])
        return np.maximum(vertices[self.number].max(axis=1), centroids)

    def _projected(self, x: np.ndarray, of_facets: np.ndarray) -> np.ndarray:
        """Return the sum (k,) over the facets around each node of values (f,), projected along the
        normal of that facet, or of their mean, which makes it largest, all nodes at x.
        """
        count, vectors = len(self.data.nodes), area_vectors(x, self.data.facets)
        normals = (vectors / np.linalg.norm(vectors, axis=1)[:, None])[self.facet]
        values = of_facets[self.facet]
        cosine = np.einsum("pi,pi->p", normals[self.first], normals[self.second])
        sums = np.bincount(self.first, np.maximum(cosine, 0.0) * values[self.second])
        largest = np.zeros(count)
        np.maximum.at(largest, self.node, sums)
        mean = [np.bincount(self.node, values * component, count) for component in normals.T]
        return np.maximum(largest, np.linalg.norm(mean, axis=0))

    def of_nodes(self, x: np.ndarray, dt: float) -> np.ndarray:
        """Return the stiffness (k,) [N/m] of each surface node at the step dt [s], all nodes at x
        (n, d) [m].
        """
        data, d = self.data, x.shape[1]
        own = self._projected(x, self.rest_areas / d * data.facet_stiffness)
        stiffening = self._stiffening(dt)
        own *= self._largest_around(stiffening)
        areas = np.linalg.norm(area_vectors(x, data.facets), axis=1)
        extent = self._projected(x, areas / d) ** (1.0 / (d - 1))
        # Facets of about one size at a time press a node: large ones have much area, small ones a
        # high stiffness per area.
        lengths = ((d - 1) * areas) ** (1.0 / (d - 1))
        squeezed = self.rest_areas / areas
        sizes = np.floor(2.0 * np.log2(lengths)).astype(int)
        separation, largest = POINT_SEPARATION[d], LARGEST_POINT[d] ** (1.0 / (d - 1))
        others = np.zeros(len(data.nodes))
        for part, size in np.unique(np.stack([data.facet_part, sizes]), axis=1).T:
            of_size = (data.facet_part == part) & (sizes == size)
            apart = lengths[of_size].max()
            line = np.minimum(
                apart * weights_in_line(extent / apart),
                largest * apart * weights_in_line(extent / (separation * apart)),
            )
            area = squeezed[of_size].max() * line ** (d - 1)
            per_area = np.minimum(self.per_area, data.facet_stiffness[of_size].max())
            others = np.maximum(others, per_area * area * stiffening[of_size].max())
        # Half the stiffness in each half pass, twice the stiffness of a pair in the bound.
        return self.depth * (own + others)
