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
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
import taichi as ti
from scipy.spatial import cKDTree

from softsim.compute import backend
from softsim.compute.fields import Number, index_field, real_field
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, Stage, Term
from softsim.mesh.surface import side_lengths
from softsim.rigid import RigidBodies
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
