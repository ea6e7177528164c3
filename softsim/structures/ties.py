"""Ties: nodes that follow the facets of a surface with a non-matching mesh.

A tied node i stays where it lies on its facet: with the facet's shape functions w_ij at that place,
    x_i = sum_j w_ij x_j,   v_i = sum_j w_ij v_j   over the facet's corners j,
and its force and its mass are handed to the corners with the same weights,
    f_j += w_ij f_i,   m_j += w_ij m_i
(Hallquist, LS-DYNA Theory Manual, "Tied contact"; ABAQUS calls the tied nodes the secondary
surface, the facets the main one, and moves the nodes onto the facets as well). With u = T q, q the
corners and all nodes that are not tied, that is f_q = T^T f, and M_q = T^T M T with the rows of its
coupling w_ij m_i w_ik summed on the diagonal. There is no penalty and no unknown force.

Momentum: sum_j w_ij = 1, so that no force and no mass is lost, and as the node lies at
sum_j w_ij x_j, the forces on the corners have the torque of the one on the node,
sum_j x_j x w_ij f_i = x_i x f_i: linear and angular momentum of the masses m_j are kept to
round-off, and so are the whole mass and its centre. Summing the rows adds
sum_j w_ij m_i |x_j - x_i|^2 to the inertia against turning.

Linear fields pass a tie exactly, whatever the meshes. The forces of a uniform stress balance there
to round-off where the tied side is a refinement of the other: each of its facets lies within one
of the other side, whose shape functions are linear on it, so that sum_i w_ij f_i integrates them
exactly. Otherwise the error is that of integrating a function with kinks by that sum (measured in
tests/verification/test_ties.py): tie the finer side to the coarser one.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
import taichi as ti
from scipy.spatial import cKDTree

from softsim.compute import backend
from softsim.compute.fields import Number, index_field, real_field
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, Stage, Term
from softsim.errors import MeshError
from softsim.mesh.quality import check
from softsim.mesh.surface import at, closest_on_facets, side_lengths
from softsim.rigid import RigidBodies
from softsim.scene.names import MeshedBody, Names, in_mm
from softsim.scene.text import Keys
from softsim.structures.fibre import SURFACE_TOLERANCE
from softsim.structures.structure import Structure

FARTHEST_TIED = 1.5
"""Distance of tied nodes over the side of their facets beyond which facet nodes have no partner."""

FARTHEST_SHIFT = 0.1
"""Plausible displacement of a tied node onto its facet over the size of the elements beside it."""


@dataclass(frozen=True, eq=False)
class Ties(Structure):
    """All ties of a model: a constraint, which adds neither mass nor stiffness.

    nodes (k,): tied nodes, numbered in the model; corners (k, c): nodes of the facet that each
    follows; weights (k, c): its shape functions there, which add up to 1; shifts (k,) [m]: distance
    by which the node was moved onto the facet.
    """

    nodes: np.ndarray
    corners: np.ndarray
    weights: np.ndarray
    shifts: np.ndarray
    kind: ClassVar[str] = "ties"

    def term(
        self, scenarios: Sequence["Ties"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "TieTerm":
        return TieTerm(nodes, self)

    def description(self) -> dict[str, str]:
        """Return the numbers of tied nodes and of facets."""
        if not len(self.nodes):
            return {}
        facets = len(np.unique(np.sort(self.corners, axis=1), axis=0))
        return {self.title: f"{len(self.nodes)} nodes tied to {facets} facets"}

    def warnings(self, points: np.ndarray) -> dict[str, str]:
        """Return warnings of ties that move nodes far, and of coarse sides tied to finer ones.

        Facet nodes between the tied nodes of a coarser side have no partner.
        """
        if len(self.nodes) < 2:
            return {}
        found = {}
        places = points[self.nodes]
        apart = cKDTree(places).query(places, k=2)[0][:, 1]
        longest = side_lengths(points, self.corners).max(axis=1)
        shifts = self.shifts / np.minimum(apart, longest)
        farthest = int(np.argmax(shifts))
        if shifts[farthest] > FARTHEST_SHIFT:
            found["shifts of ties"] = (
                f"ties move nodes onto facets by up to {1e3 * self.shifts[farthest]:.3g} mm, "
                f"{100.0 * shifts[farthest]:.3g} % of the size of their elements, more than "
                f"{100.0 * FARTHEST_SHIFT:g} %, and the adjacent elements are deformed without "
                "stress: move the bodies together, or lower ties.NAME.tolerance"
            )
        coarse = int((apart > FARTHEST_TIED * longest).sum())
        if 2 * coarse > len(places):
            found["sides of ties"] = (
                f"{coarse} of {len(places)} tied nodes are more than {FARTHEST_TIED:g} facet sides "
                "apart: facet nodes between them are free, and gaps open; exchange nodes and "
                "facets of the tie, so that the finer side is tied to the coarser one"
            )
        return found

    def within(self, nodes: slice) -> "Ties":
        """Return the ties of some of the nodes, numbered from the first of these on."""
        chosen = (self.nodes >= nodes.start) & (self.nodes < nodes.stop)
        return Ties(
            self.nodes[chosen] - nodes.start, self.corners[chosen] - nodes.start,
            self.weights[chosen], self.shifts[chosen],
        )  # fmt: skip

    def followed(self, values: np.ndarray) -> np.ndarray:
        """Return values (n, ...) of all nodes, tied nodes interpolated from the nodes of facets."""
        result = values.copy()
        result[self.nodes] = np.einsum("kc,kc...->k...", self.weights, values[self.corners])
        return result

    def handed_over(self, values: np.ndarray) -> np.ndarray:
        """Return values (n, ...) of all nodes, those of tied nodes added to the nodes of facets."""
        result = values.copy()
        result[self.nodes] = 0.0
        of_corners = np.einsum("kc,k...->kc...", self.weights, values[self.nodes])
        np.add.at(result, self.corners, of_corners)
        return result

    def moved_mass(self, mass: np.ndarray) -> np.ndarray:
        """Return the effective mass (n,) [kg] of a force on each node.

        For tied nodes it is 1 / sum_j (w_ij^2 / m_j). mass (n,) [kg]: of the other nodes, infinite
        where a node is held.
        """
        result = mass.copy()
        corner_mass = np.where(self.weights > 0.0, mass[self.corners], np.inf)
        mobility = (self.weights**2 / corner_mass).sum(axis=1)
        result[self.nodes] = np.divide(
            1.0, mobility, out=np.full(len(mobility), np.inf), where=mobility > 0.0
        )
        return result

    def matrix(self, count: int) -> sp.csr_matrix:
        """Return T (n, n) of a model with `count` nodes; columns of tied nodes are zero."""
        others = np.setdiff1d(np.arange(count), self.nodes)
        rows = np.concatenate([others, np.repeat(self.nodes, self.corners.shape[1])])
        columns = np.concatenate([others, self.corners.ravel()])
        values = np.concatenate([np.ones(len(others)), self.weights.ravel()])
        return sp.csr_matrix((values, (rows, columns)), shape=(count, count))


class TieTerm(Term):
    """Term that applies the ties of a model.

    Tied nodes are placed before forces are computed, and their forces are transferred to the facets
    afterwards.
    """

    def __init__(self, nodes: Nodes, ties: Ties) -> None:
        self.nodes, self.tied_nodes = nodes, ties.nodes
        self.count, self.corner_count = Number(len(ties.nodes)), ties.corners.shape[1]
        self.tied, self.corner = index_field(ties.nodes), index_field(ties.corners)
        self.weight = real_field(ties.weights)
        self.first_slot = nodes.corner_forces.reserve(ties.corners)

    def find_slots(self) -> None:
        """Create the list of slots of each tied node, once every term has reserved its own."""
        self.block_and_lane = index_field(
            self.nodes.corner_forces.of_node.place_of(self.tied_nodes)
        )

    def passes(self) -> dict[Stage, list[Pass]]:
        return {
            Stage.FOLLOW: [Pass("ties", int(self.count), (self.follow,))],
            Stage.HAND_OVER: [Pass("ties", int(self.count), (self.hand_over,))],
        }

    @ti.func
    def follow(self, s, i, t, dt):
        """Set the position and velocity of tied node number i from its facet."""
        x = ti.Vector.zero(backend.real, self.nodes.dimension)
        v = ti.Vector.zero(backend.real, self.nodes.dimension)
        for c in ti.static(range(self.corner_count)):
            x += self.weight[i, c] * self.nodes.position[s, self.corner[i, c]]
            v += self.weight[i, c] * self.nodes.velocity[s, self.corner[i, c]]
        self.nodes.position[s, self.tied[i]] = x
        self.nodes.velocity[s, self.tied[i]] = v

    @ti.func
    def hand_over(self, s, i, t, dt):
        """Transfer the force on tied node number i to the nodes of its facet."""
        force = self.nodes.corner_forces.on_node(
            s, self.block_and_lane[i, 0], self.block_and_lane[i, 1]
        )
        for c in ti.static(range(self.corner_count)):
            slot = self.first_slot + self.corner_count * i + c
            self.nodes.corner_forces.write(s, slot, self.weight[i, c] * force)


# -------------------------------------------------------------------------------------------------
# Ties of a scene: the place of each node on its facet, and checks.


# Of the model's size: a node that is moved by less was there already.
ROUND_OFF = 1e-12
# A corner with less weight carries nothing.
NO_WEIGHT = 1e-9


def placed_ties(names: Names) -> tuple[Names, Ties]:
    """Return the scene's bodies with tied nodes moved onto their facets, and all ties.

    Raises SceneError for a node that is too far from its facets, follows two of them, follows
    itself or a tied node, or cannot be moved.
    """
    tied, corners, weights, shifts = [], [], [], []
    points = np.concatenate([body.mesh.points for body in names.bodies.values()])
    for name, data in names.scene.ties.items():
        keys = ("ties", name)
        names.body(data.nodes, (*keys, "nodes"))  # nodes of a cable cannot be tied
        nodes = np.unique(names.node_set(data.nodes, (*keys, "nodes")))
        facets = names.facet_set(data.facets, (*keys, "facets"))
        refuse_ring_section(names, keys)
        facet, shares = closest_on_facets(points[nodes], points, facets)
        followed = facets[facet]
        places = at(shares, points[followed])
        refuse_far_nodes(names, name, points, nodes, places, facets)
        refuse_common_cells(names, name, points, nodes, followed)
        tied.append(nodes)
        corners.append(followed)
        weights.append(shares)
        shifts.append(np.linalg.norm(places - points[nodes], axis=1))
    if not tied:
        none = np.zeros((0, names.dimension))
        return names, Ties(np.zeros(0, dtype=int), none.astype(int), none, np.zeros(0))
    refuse_chains(names, points, tied, corners)
    ties = Ties(*(np.concatenate(parts) for parts in (tied, corners, weights, shifts)))
    moved = ties.followed(points)
    bodies = {
        name: moved_body(names, name, body, points, moved) for name, body in names.bodies.items()
    }
    return replace(names, bodies=bodies), ties


def moved_body(
    names: Names, name: str, body: MeshedBody, points: np.ndarray, moved: np.ndarray
) -> MeshedBody:
    """Return a body whose nodes are moved from their `points` (n, d) [m] to `moved`."""
    nodes = slice(body.first_node, body.first_node + len(body.mesh.points))
    way = np.linalg.norm(moved[nodes] - points[nodes], axis=1)
    if not way.any():
        return body
    mesh = replace(body.mesh, points=moved[nodes])
    try:
        check(mesh)
    except MeshError as error:
        by = [k for k, data in names.scene.ties.items() if data.nodes.startswith(f"{name}.")]
        raise names.loaded.error(
            ("ties", by[0]),
            f"with its tied nodes on the facets, the mesh of '{name}' is not valid: "
            f"{error.message}",
            "move the nodes closer to the facets, or lower the tolerance",
        ) from None
    shifted = int((way > ROUND_OFF * np.ptp(points)).sum())
    remark = f"{shifted} tied nodes moved onto facets, by at most {way.max() * 1e3:.3g} mm"
    return replace(body, mesh=mesh, remarks=(*body.remarks, *([remark] if shifted else [])))


def refuse_ring_section(names: Names, keys: Keys) -> None:
    """Raise SceneError in a ring section, where both strips would have to be tied equally."""
    if names.is_ring_section:
        raise names.loaded.error(
            keys,
            "a ring_section cannot be tied: its two strips form one ring",
            "write formulation plane_strain, axisymmetric or solid",
        )


def refuse_far_nodes(
    names: Names,
    name: str,
    points: np.ndarray,
    nodes: np.ndarray,
    places: np.ndarray,
    facets: np.ndarray,
) -> None:
    """Raise SceneError if a node (k,) is farther than the tolerance from its place (k, d) [m]."""
    data = names.scene.ties[name]
    apart = points[nodes] - places
    distance = np.linalg.norm(apart, axis=1)
    sides = side_lengths(points, facets)
    usual = SURFACE_TOLERANCE * float(sides[sides > 0.0].mean())
    tolerance = usual if data.tolerance is None else data.tolerance
    far = np.flatnonzero(distance > tolerance)
    if not len(far):
        return
    worst = int(np.argmax(distance))
    given = data.tolerance is not None
    raise names.loaded.error(
        ("ties", name, "tolerance") if given else ("ties", name),
        f"the node of '{data.nodes}' at {in_mm(points[nodes[worst]])} is "
        f"{distance[worst] * 1e3:.4g} mm away from the facets of '{data.facets}'; {len(far)} "
        f"of {len(nodes)} nodes are more than {tolerance * 1e3:.4g} mm away"
        + ("" if given else ", 5 % of the mean side of the facets"),
        "leave nodes that are not to be tied out of the set, move the bodies closer together, or "
        f"raise the tolerance (ties.{name}.tolerance)",
    )


def refuse_common_cells(
    names: Names, name: str, points: np.ndarray, nodes: np.ndarray, corners: np.ndarray
) -> None:
    """Raise SceneError if a node (k,) shares an element with a corner (k, c) that it would follow.

    That would prevent the element from deforming.
    """
    data, count = names.scene.ties[name], len(points)
    cells = np.concatenate([b.mesh.cells + b.first_node for b in names.bodies.values()])
    of_cells = members(cells, count)
    beside = of_cells[:, nodes].T @ of_cells  # (k, n): in how many elements two nodes are
    shared = beside.multiply(members(corners, count))
    row, _ = shared.nonzero()
    if len(row):
        raise names.loaded.error(
            ("ties", name, "nodes"),
            f"the node of '{data.nodes}' at {in_mm(points[nodes[row[0]]])} belongs to an element "
            f"that shares a node with the facet of '{data.facets}' to which it would be tied",
            "tie nodes to facets of another body, or across a gap",
        )


def members(lists: np.ndarray, count: int) -> sp.csr_array:
    """Return a sparse matrix (k, n), nonzero in each row at the listed nodes (k, m).

    count: number n of nodes.
    """
    rows = np.repeat(np.arange(len(lists)), lists.shape[1])
    return sp.csr_array((np.ones(rows.size), (rows, lists.ravel())), shape=(len(lists), count))


def refuse_chains(
    names: Names, points: np.ndarray, tied: list[np.ndarray], corners: list[np.ndarray]
) -> None:
    """Raise SceneError if a node is tied twice, or follows nodes that are tied."""
    by = np.full(len(points), -1)
    keys = list(names.scene.ties)
    for number, nodes in enumerate(tied):
        again = nodes[by[nodes] >= 0]
        if len(again):
            raise names.loaded.error(
                ("ties", keys[number], "nodes"),
                f"the node at {in_mm(points[again[0]])} is already tied by '{keys[by[again[0]]]}'",
                "a node can be tied to one surface only: leave it out of one of the sets",
            )
        by[nodes] = number
    for number, followed in enumerate(corners):
        chained = followed[by[followed] >= 0]
        if len(chained):
            raise names.loaded.error(
                ("ties", keys[number], "facets"),
                f"the node of a facet at {in_mm(points[chained[0]])} is itself tied, by "
                f"'{keys[by[chained[0]]]}'",
                "tie both to one surface, or exchange nodes and facets of one tie",
            )


def refuse_held_nodes(
    names: Names, ties: Ties, points: np.ndarray, fixed: np.ndarray, held: np.ndarray
) -> None:
    """Raise SceneError if a tied node is prescribed, tied to a rigid body or fixed (n, d).

    It may be fixed only where all nodes that it follows are, as on a plane of symmetry. held (n,
    d): held in any way.
    """
    carries = (ties.weights > NO_WEIGHT)[:, :, None]
    alike = np.where(carries, fixed[ties.corners], True).all(axis=1)
    wrong = np.flatnonzero((held[ties.nodes] & ~(fixed[ties.nodes] & alike)).any(axis=1))
    if not len(wrong):
        return
    node = int(ties.nodes[wrong[0]])
    name = tie_of(names, node)
    raise names.loaded.error(
        ("ties", name, "nodes"),
        f"the node of '{names.scene.ties[name].nodes}' at {in_mm(points[node])} is fixed, "
        "prescribed or tied to a rigid body, but its facet is not",
        "hold the facet instead, or leave the node out of the set",
    )


def tie_of(names: Names, node: int) -> str:
    """Return the name of the tie of a node."""
    return next(
        name
        for name, data in names.scene.ties.items()
        if node in names.node_set(data.nodes, ("ties", name, "nodes"))
    )
