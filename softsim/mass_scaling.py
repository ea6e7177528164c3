"""Selective mass scaling: what limits the step is made slow, what the body does is not.

Nodes closer together than what is of interest form groups. In each, motion relative to the group's
centre of mass has `factor` times the inertia:
    M' = M + (factor - 1) (M_g - m m^T / sum m)   in each direction, M_g = diag(m) of the group.
Mass, momentum and any motion that a group shares are as before; statics too, for only M changes.
Changed are motions within a group, whose frequencies are far above those of interest, and the
inertia against turning, to which a group adds (factor - 1) sum m |r|^2, r from its centre. M' is
constant and symmetric: momentum and energy are kept exactly, angular momentum is that of M'.

Olovsson, Simonsson, Unosson 2005, Int. J. Numer. Meth. Engng 63:1436-1445 scale so in each element,
which couples all of them; groups do not overlap, so that the inverse is at hand:
    M'^-1 f = a - (1 - 1 / factor) (a - mean),   a = M^-1 f, the mean of a group weighted by mass;
pairs across a thin shell in Cocchetti, Pagani, Perego 2013, Comput. Struct. 127:39-52.
"""

from dataclasses import dataclass
from heapq import heapify, heappop, heappush

import numpy as np
import scipy.sparse as sp
from scipy.spatial.distance import cdist


@dataclass(frozen=True)
class MassScaling:
    """group (n,): number of each node's group, of which there are `count`, -1 for none.
    factor: inertia of motion within a group over what it is [-], more than 1.
    """

    group: np.ndarray
    count: int
    factor: float

    def of_nodes(self, nodes: slice) -> "MassScaling":
        """That of some nodes, numbered anew."""
        return MassScaling(self.group[nodes], self.count, self.factor)

    @property
    def group_of_each(self) -> np.ndarray:
        """Number of each node's group (n,), a node of none being a group of its own."""
        grouped = self.group >= 0
        return np.where(grouped, self.group, self.count + np.cumsum(~grouped) - 1)

    def means(self, mass: np.ndarray) -> sp.csr_matrix:
        """The matrix (n, n) that projects M^1/2 u on motions that each group shares."""
        root = np.sqrt(self.shares(mass))
        spread = sp.csr_matrix((root, (np.arange(len(mass)), self.group_of_each)))
        return (spread @ spread.T).tocsr()

    def shares(self, mass: np.ndarray) -> np.ndarray:
        """Of each node in the mass of its group (n,) [-]."""
        total = np.bincount(self.group_of_each, mass)[self.group_of_each]
        return np.divide(mass, total, out=np.ones(len(mass)), where=total > 0.0)

    def scaled(self, mass: np.ndarray, dimension: int, power: float) -> sp.csr_matrix:
        """(M^-1/2 M' M^-1/2)^power (n d, n d) of nodes of these masses (n,) [kg]."""
        whole, means = sp.identity(len(mass)), self.means(mass)
        of_nodes = means + self.factor**power * (whole - means)
        return sp.kron(of_nodes, sp.identity(dimension)).tocsr()

    def mobility(self, mass: np.ndarray) -> np.ndarray:
        """How fast a force on one node alone sets it in motion, over what it was (n,) [-]."""
        shared: np.ndarray = self.means(mass).diagonal()
        return shared + (1.0 - shared) / self.factor

    def added_turning(self, points: np.ndarray, mass: np.ndarray) -> float:
        """What is added to the inertia sum m |r|^2 of these nodes about their centre of mass, as a
        share of it [-].
        """
        weighted = np.sqrt(mass)[:, None] * points
        within = ((weighted - self.means(mass) @ weighted) ** 2).sum()
        whole = (mass[:, None] * (points - mass @ points / mass.sum()) ** 2).sum()
        return float((self.factor - 1.0) * within / whole)

    def describe(self) -> str:
        """Groups, and what is changed in them."""
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
    """Groups of nodes that edges connect and of which no two are farther apart than `within` [m]:
    the number of each node's group (n,), -1 for none, and how many groups there are.

    points (n, d) [m], edges (k, 2) node numbers; crosses (k,): which edges lead through the body
    from surface to surface. may_join (n,): which nodes may be in a group. First join those across a
    wall one element thick, then of all neighbours those that make the smallest group (complete
    linkage).
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
    """The largest distance [m] of a node from those of each group."""
    if not groups:
        return []
    starts = np.cumsum([0, *map(len, groups[:-1])])
    distances = cdist(points[nodes], points[[node for group in groups for node in group]])
    found: list[float] = np.maximum.reduceat(distances.max(axis=0), starts).tolist()
    return found


def edges_of(cells: np.ndarray, facets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (k, 2) of nodes that share a cell (m, corners), each once, and which of them (k,) lead
    through the body from surface to surface, of which these are the facets (f, corners).
    """
    edges, on_surface = pairs_of(cells), pairs_of(facets)
    count = cells.max() + 1
    along = np.isin(edges @ [count, 1], on_surface @ [count, 1])
    return edges, np.isin(edges, facets).all(axis=1) & ~along


def pairs_of(lists: np.ndarray) -> np.ndarray:
    """Pairs (k, 2) of nodes that are listed (m, corners) together, each once, smaller one first."""
    first, second = np.triu_indices(lists.shape[1], 1)
    pairs = np.sort(np.stack([lists[:, first].ravel(), lists[:, second].ravel()], axis=1), axis=1)
    return np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)
