"""Selective mass scaling: slows the modes that limit the time step, not the motion of the body.

Nodes closer together than the length of interest form groups. In each group, motion relative to the
centre of mass has `factor` times the inertia:
    M' = M + (factor - 1) (M_g - m m^T / sum m)   in each direction, M_g = diag(m) of the group.
Mass, momentum and rigid translations of a group are unchanged; so is statics, as only M changes.
The changes are in motions within a group, whose frequencies are far above those of interest, and in
the rotational inertia, to which a group adds (factor - 1) sum m |r|^2, r from its centre. M' is
constant and symmetric: momentum and energy are conserved exactly, angular momentum is that of M'.

Olovsson, Simonsson, Unosson 2005, Int. J. Numer. Meth. Engng 63:1436-1445 scale in each
element, which couples all of them; groups do not overlap, so that the inverse is explicit:
    M'^-1 f = a - (1 - 1 / factor) (a - mean),   a = M^-1 f, the mean of a group weighted by mass;
pairs across a thin shell in Cocchetti, Pagani, Perego 2013, Comput. Struct. 127:39-52.
"""

from collections.abc import Callable
from dataclasses import dataclass
from heapq import heapify, heappop, heappush
from typing import Any

import numpy as np
import scipy.sparse as sp
import taichi as ti
from scipy.spatial.distance import cdist

from softsim.compute import backend
from softsim.compute.fields import Number, index_field, real_field, vector_field
from softsim.compute.nodes import Nodes


@dataclass(frozen=True)
class MassScaling:
    """Groups of mass scaling and their factor.

    group (n,): number of each node's group, -1 for none; count: number of groups. factor: scaled
    over unscaled inertia of motion within a group [-], more than 1.
    """

    group: np.ndarray
    count: int
    factor: float

    def of_nodes(self, nodes: slice) -> "MassScaling":
        """Return the mass scaling of some of the nodes, renumbered from 0."""
        return MassScaling(self.group[nodes], self.count, self.factor)

    @property
    def group_of_each(self) -> np.ndarray:
        """Number of each node's group (n,); a node without a group is its own group."""
        grouped = self.group >= 0
        return np.where(grouped, self.group, self.count + np.cumsum(~grouped) - 1)

    def means(self, mass: np.ndarray) -> sp.csr_matrix:
        """Return the matrix (n, n) that projects M^1/2 u on the mean motion of each group."""
        root = np.sqrt(self.shares(mass))
        spread = sp.csr_matrix((root, (np.arange(len(mass)), self.group_of_each)))
        return (spread @ spread.T).tocsr()

    def shares(self, mass: np.ndarray) -> np.ndarray:
        """Return the fraction of each node in the mass of its group (n,) [-]."""
        total = np.bincount(self.group_of_each, mass)[self.group_of_each]
        return np.divide(mass, total, out=np.ones(len(mass)), where=total > 0.0)

    def scaled(self, mass: np.ndarray, dimension: int, power: float) -> sp.csr_matrix:
        """Return (M^-1/2 M' M^-1/2)^power (n d, n d) of nodes of these masses (n,) [kg]."""
        whole, means = sp.identity(len(mass)), self.means(mass)
        of_nodes = means + self.factor**power * (whole - means)
        return sp.kron(of_nodes, sp.identity(dimension)).tocsr()

    def mobility(self, mass: np.ndarray) -> np.ndarray:
        """Return the ratio of scaled to unscaled acceleration of a node by its force (n,) [-]."""
        shared: np.ndarray = self.means(mass).diagonal()
        return shared + (1.0 - shared) / self.factor

    def added_turning(self, points: np.ndarray, mass: np.ndarray) -> float:
        """Return the relative increase [-] of rotational inertia by mass scaling.

        The inertia is sum m |r|^2 of these nodes about their centre of mass.
        """
        weighted = np.sqrt(mass)[:, None] * points
        within = ((weighted - self.means(mass) @ weighted) ** 2).sum()
        whole = (mass[:, None] * (points - mass @ points / mass.sum()) ** 2).sum()
        return float((self.factor - 1.0) * within / whole)

    def describe(self) -> str:
        """Return a text with the number and size of the groups and the factor."""
        sizes = np.bincount(self.group[self.group >= 0])
        return (
            f"{sizes.sum()} nodes in {self.count} groups of at most {sizes.max()}; inertia of "
            f"relative motion in a group times {self.factor:g}"
        )


def grouped(
    points: np.ndarray,
    edges: np.ndarray,
    crosses: np.ndarray,
    may_join: np.ndarray,
    within: float,
) -> tuple[np.ndarray, int]:
    """Return the number of each node's group (n,), -1 for none, and the number of groups.

    Groups consist of nodes connected by edges, none of them farther apart than `within` [m].
    points (n, d) [m], edges (k, 2) node numbers; crosses (k,): True for edges that lead through the
    body from surface to surface. may_join (n,): True for nodes that may be in a group. Nodes across
    a wall one element thick are joined first, then the neighbours that form the smallest group
    (complete linkage).
    """
    joins = may_join[edges].all(axis=1)
    edges, along = edges[joins], ~crosses[joins]
    lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    members = {node: [node] for node in np.unique(edges).tolist()}
    beside: dict[int, set[int]] = {node: set() for node in members}
    for first, second in edges.tolist():
        beside[first].add(second)
        beside[second].add(first)
    # The diameter of two groups together, as a share of `within`, with their numbers. Diameters
    # that differ by rounding count as equal, so that parts that are alike are grouped alike.
    joinable = [
        (later, round(length / within, 6), first, second)
        for later, length, (first, second) in zip(
            along.tolist(), lengths.tolist(), edges.tolist(), strict=True
        )
        if length <= within
    ]
    heapify(joinable)
    extent = dict.fromkeys(members, 0.0)
    joined = len(points)
    while joinable:
        _, size, first, second = heappop(joinable)
        if first not in members or second not in members:
            continue  # one of them has joined another
        members[joined] = members.pop(first) + members.pop(second)
        beside[joined] = (beside.pop(first) | beside.pop(second)) - {first, second}
        extent[joined] = size * within
        others = sorted(beside[joined])
        for other, across in zip(
            others,
            farthest(points, members[joined], [members[other] for other in others]),
            strict=True,
        ):
            beside[other] -= {first, second}
            beside[other].add(joined)
            diameter = max(extent[joined], extent[other], across)
            if diameter <= within:
                heappush(joinable, (True, round(diameter / within, 6), other, joined))
        joined += 1
    group = np.full(len(points), -1)
    groups = [nodes for nodes in members.values() if len(nodes) > 1]
    for k, nodes in enumerate(groups):
        group[nodes] = k
    return group, len(groups)


def farthest(points: np.ndarray, nodes: list[int], groups: list[list[int]]) -> list[float]:
    """Return the largest distance [m] between any of `nodes` and the nodes of each group."""
    if not groups:
        return []
    starts = np.cumsum([0, *map(len, groups[:-1])])
    distances = cdist(points[nodes], points[[node for group in groups for node in group]])
    found: list[float] = np.maximum.reduceat(distances.max(axis=0), starts).tolist()
    return found


def edges_of(cells: np.ndarray, facets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs (k, 2) of nodes that share a cell (m, corners), and which lead through.

    Each pair is listed once; the second result (k,) is True for pairs that lead through the body
    from surface to surface. facets (f, corners): of the surface.
    """
    edges, on_surface = pairs_of(cells), pairs_of(facets)
    count = cells.max() + 1
    along = np.isin(edges @ [count, 1], on_surface @ [count, 1])
    return edges, np.isin(edges, facets).all(axis=1) & ~along


def pairs_of(lists: np.ndarray) -> np.ndarray:
    """Return the pairs (k, 2) of nodes in the same row of lists (m, corners), smaller one first."""
    first, second = np.triu_indices(lists.shape[1], 1)
    pairs = np.sort(np.stack([lists[:, first].ravel(), lists[:, second].ravel()], axis=1), axis=1)
    return np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)


# -------------------------------------------------------------------------------------------------
# Nodes with selective mass scaling, in kernels.
#
# A kick sums the forces on all nodes, then computes the correction of each group, then updates
# velocities.


class ScaledNodes(Nodes):
    """Nodes in groups; a node without a group is its own group. more: arguments of `Nodes`.

    Fields, (scenarios, nodes): lag [m/s^2], reduction of the acceleration by mass scaling; drag
    [m/s^2], local damping over mass.
    """

    def __init__(self, scaling: MassScaling, *more: Any) -> None:
        super().__init__(*more)
        group = scaling.group_of_each
        members = np.argsort(group, kind="stable")
        self.groups = Number(int(group.max()) + 1)
        self.factor = real_field(np.array([scaling.factor]))
        self.member = index_field(members)
        self.first_member = index_field(np.searchsorted(group[members], np.arange(group.max() + 2)))
        self.mass_share = real_field(scaling.shares(self.lumped_mass)[members])
        at_rest = np.zeros((self.scenarios, int(self.count), self.dimension))
        self.lag, self.drag = vector_field(at_rest), vector_field(at_rest)

    def state_fields(self) -> dict[str, ti.Field]:
        return super().state_fields() | {"lag": self.lag, "drag": self.drag}

    def kicks(self) -> list[tuple[int, Callable[..., None]]]:
        """Return the functions for forces, corrections of groups, and velocities."""
        back, forward = (int(self.groups), self.hold_back), (int(self.count), self.accelerate)
        return [*super().kicks(), back, forward]

    @ti.func
    def take_force(self, s, a, t, dt):
        """Do nothing: velocities change once the forces on all nodes of a group are complete."""

    @ti.func
    def hold_back(self, s, g, t, dt):
        """Compute the reduction of accelerations in group g."""
        if ti.static(self.relaxes):
            self.resist(s, g)
        mean = ti.Vector.zero(backend.real, self.dimension)
        for k in range(self.first_member[g], self.first_member[g + 1]):
            mean += self.mass_share[k] * self.driven(s, self.member[k])
        for k in range(self.first_member[g], self.first_member[g + 1]):
            a = self.member[k]
            self.lag[s, a] = (1.0 - 1.0 / self.factor[0]) * (self.driven(s, a) - mean)

    @ti.func
    def driven(self, s, a):
        """Return f / m + g of the last force, less local damping [m/s^2]."""
        result = self.nodal_acceleration(s, a)
        if ti.static(self.relaxes):
            result -= self.drag[s, a]
        return result

    @ti.func
    def resist(self, s, g):
        """Compute the local damping of a group.

        The mean motion is damped by the resultant force on the group, the motion within it by the
        remaining forces. Otherwise forces within a group, which are slow to balance, would damp the
        motion of the whole group.
        """
        force = ti.Vector.zero(backend.real, self.dimension)
        speed, mean = force, force
        for k in range(self.first_member[g], self.first_member[g + 1]):
            force += self.mass_share[k] * self.nodal_acceleration(s, self.member[k])
            speed += self.mass_share[k] * self.velocity[s, self.member[k]]
        for k in range(self.first_member[g], self.first_member[g + 1]):
            a = self.member[k]
            self.drag[s, a] = self.resistance(
                s, self.nodal_acceleration(s, a) - force, self.velocity[s, a] - speed
            )
            mean += self.mass_share[k] * self.drag[s, a]
        for k in range(self.first_member[g], self.first_member[g + 1]):
            a = self.member[k]
            self.drag[s, a] = self.drag[s, a] + self.resistance(s, force, speed) - mean

    @ti.func
    def acceleration(self, s, a):
        return self.nodal_acceleration(s, a) - self.lag[s, a]

    @ti.func
    def damping(self, s, a):
        return self.drag[s, a]

    @ti.func
    def added_kinetic_energy(self, s, dt, part):
        """Return the kinetic energy [J] that mass scaling adds, of motion within groups."""
        energy = ti.cast(0.0, backend.real)
        for g in range(self.groups.first(part), self.groups.first(part + 1)):
            mean = ti.Vector.zero(backend.real, self.dimension)
            for k in range(self.first_member[g], self.first_member[g + 1]):
                mean += self.mass_share[k] * self.present_velocity(s, self.member[k], dt)
            for k in range(self.first_member[g], self.first_member[g + 1]):
                a = self.member[k]
                apart = self.present_velocity(s, a, dt) - mean
                energy += 0.5 * (self.factor[0] - 1.0) * self.mass[a] * apart.dot(apart)
        return energy
