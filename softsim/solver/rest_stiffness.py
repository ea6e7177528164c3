"""Stiffness matrix of a region at rest, from differences of the forces of an increment.

K = -df/dx by central differences, where f are the forces of the elements alone. Two nodes are
coupled if they move elements with a common pressure (elements/one_point.py). Nodes are moved
at once, as nodes of one colour, if no force depends on two of them (Curtis, Powell, Reid 1974,
J. Inst. Math. Appl. 13:117-119), so that the number of differences does not grow with the mesh.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import norm

from softsim.compute import fields
from softsim.elements.geometry import Region
from softsim.errors import ModesError
from softsim.model import Body, Model
from softsim.solver.explicit import ExplicitSolver
from softsim.structures.ties import Ties

STEP = 1e-5
"""Displacement of a node over its shortest edge.

Larger ones make squares of the strains count, smaller ones round-off.
"""

ALLOWED_ERROR = 1e-5
"""Largest allowed error of a stiffness matrix, see RestStiffness."""

MOST_ENTRIES = 20_000_000
"""Largest number of matrix entries: for a body in space the factors then take some 4 GB."""


@dataclass(frozen=True, eq=False)
class RestStiffness:
    """Stiffness matrix of a region at rest.

    matrix: K (n d, n d) [N/m] of a body's nodes, symmetric, zero where a component is not free.
    error: relative norm of its antisymmetric part, or relative error of its forces under an
    arbitrary displacement, whichever is larger [-].
    """

    matrix: sp.csr_matrix
    error: float


def rest_stiffness(model: Model, body: Body, region: Region) -> RestStiffness:
    """Return the stiffness of a region of a body with relaxed Maxwell branches.

    Raises ModesError if the matrix would have too many entries, or its error is too large.
    """
    is_free = model.is_free[body.nodes]
    ties = model.ties.within(body.nodes)
    pairs = coupled_pairs(region, ties, np.any(is_free, axis=1))
    refuse_too_large(body, pairs.nnz * model.dimension**2)
    if pairs.nnz == 0:  # the body moves, but nothing of this region
        return RestStiffness(sp.csr_matrix((is_free.size, is_free.size)), 0.0)
    forces = ElasticForces(model, body, region)
    step = STEP * shortest_edges(region.points, region.cells)
    free = sp.diags(is_free.ravel().astype(float))
    found = free @ differences(forces, pairs, step) @ free
    matrix = (0.5 * (found + found.T)).tocsr()
    asymmetry = norm(found - found.T) / norm(found)
    arbitrary = is_free * step[:, None] * np.random.default_rng(0).uniform(-1.0, 1.0, is_free.shape)
    resisted = free @ forces.resisting(arbitrary).ravel()
    missed = np.linalg.norm(resisted - matrix @ arbitrary.ravel()) / np.linalg.norm(resisted)
    error = float(max(asymmetry, missed))
    if not error <= ALLOWED_ERROR:
        raise ModesError(
            f"the stiffness matrix of body '{body.name}' at rest is not symmetric, or couples "
            f"nodes that are not neighbours: error {error:.2g}, allowed {ALLOWED_ERROR:g}",
            hint="its natural frequencies cannot be computed",
        )
    return RestStiffness(matrix, error)


def refuse_too_large(body: Body, entries: int) -> None:
    """Raise ModesError if the matrix of a body would have too many entries."""
    if entries > MOST_ENTRIES:
        raise ModesError(
            f"body '{body.name}' is too large for natural frequencies: its stiffness matrix would "
            f"have {entries:,} entries; the limit is {MOST_ENTRIES:,}",
            hint="use a coarser mesh, or a part of the body that is held at the cut",
        )


class ElasticForces:
    """Forces on a body's nodes by one of its regions alone, relaxed and not softened."""

    def __init__(self, model: Model, body: Body, region: Region) -> None:
        relaxed = replace(region, material=replace(region.material, branches=(), mullins=None))
        alone = replace(
            model, bodies=(replace(body, regions=(relaxed,)),), rigid_bodies=(), outlines=(),
            walls=(), self_contact=None, structures=(), loads=(),
            bulk_viscosity=0.0, relaxation=None, settling=None, passage=None,
        )  # fmt: skip
        self.solver, self.nodes, self.rest = ExplicitSolver([alone]), body.nodes, model.points

    def at(self, displacement: np.ndarray) -> np.ndarray:
        """Return the forces (n, d) [N] on the body's nodes displaced by (n, d) [m]."""
        x, nodes = self.rest.copy(), self.solver.terms.nodes
        x[self.nodes] += displacement
        fields.write(nodes.position, x[None])
        self.solver.find_forces(dt=1.0)  # elements without branches and viscosity know no time
        return fields.read(nodes.force)[0, self.nodes]

    def resisting(self, displacement: np.ndarray) -> np.ndarray:
        """Return K u (n, d) [N] for a small displacement u (n, d) [m], by a central difference."""
        return 0.5 * (self.at(-displacement) - self.at(displacement))


def coupled_pairs(region: Region, ties: Ties, moving: np.ndarray) -> sp.coo_matrix:
    """Return the pairs of moving nodes of a body that elements or ties may couple.

    moving (n,): True for nodes with a free component.
    """
    hoop, cells = region.geometry.hoop, region.cells
    movers = cells if hoop is None else hoop.stencil(cells)
    count = len(moving)
    moves = incidence(movers, count) @ ties.matrix(count) @ sp.diags(moving.astype(float))
    around_pressure = incidence(region.pressure_points, region.pressure_count).T @ moves
    pairs = (around_pressure.T @ around_pressure).tocsr()
    pairs.eliminate_zeros()
    return pairs.tocoo()


def incidence(members: np.ndarray, count: int) -> sp.csr_matrix:
    """Return a matrix (m, count) that is positive at the members (m, k) of each element."""
    starts = np.arange(0, members.size + 1, members.shape[1])
    matrix = sp.csr_matrix((np.ones(members.size), members.ravel(), starts), (len(members), count))
    matrix.sum_duplicates()
    return matrix


def colours(pairs: sp.coo_matrix) -> np.ndarray:
    """Return the colour (n,) of each node from 0, different for nodes that act on the same node.

    pairs: rows of nodes on which a column acts. The colouring is greedy, in the order of the nodes;
    nodes without a pair have -1.
    """
    pattern = pairs.tocsc()
    conflicts = (pattern.T @ pattern).tocsr()
    colour = np.full(pattern.shape[1], -1)
    for node in np.flatnonzero(np.diff(pattern.indptr)):
        others = colour[conflicts.indices[conflicts.indptr[node] : conflicts.indptr[node + 1]]]
        taken = np.zeros(len(others) + 1, dtype=bool)
        taken[others[(others >= 0) & (others < len(taken))]] = True
        colour[node] = np.argmin(taken)
    return colour


def differences(forces: ElasticForces, pairs: sp.coo_matrix, step: np.ndarray) -> sp.csr_matrix:
    """Return K (n d, n d) [N/m], column by column; step (n,): displacement of each node [m]."""
    n, d = len(step), forces.rest.shape[1]
    colour = colours(pairs)
    order = np.argsort(colour[pairs.col], kind="stable")
    rows, columns = pairs.row[order], pairs.col[order]
    starts = np.searchsorted(colour[columns], np.arange(colour.max() + 2))
    values = np.empty((len(rows), d, d))
    for number, (start, end) in enumerate(pairwise(starts)):
        alike, inside = colour == number, slice(start, end)
        for axis in range(d):
            moved = np.zeros((n, d))
            moved[alike, axis] = step[alike]
            resisted = forces.resisting(moved)
            values[inside, :, axis] = resisted[rows[inside]] / step[columns[inside], None]
    of_rows, of_columns = np.broadcast_arrays(
        (rows[:, None] * d + np.arange(d))[:, :, None],
        (columns[:, None] * d + np.arange(d))[:, None, :],
    )
    entries = (values.ravel(), (of_rows.ravel(), of_columns.ravel()))
    return sp.csr_matrix(entries, shape=(n * d, n * d))


def shortest_edges(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return the shortest distance (n,) [m] of each node from the others of its elements.

    points (n, d), cells (e, k). Nodes without elements, which ties may move, get the smallest of
    all.
    """
    corners = points[cells]
    apart = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=3)
    apart[apart == 0.0] = np.inf
    shortest = np.full(len(points), np.inf)
    np.minimum.at(shortest, cells, apart.min(axis=2))
    return np.where(np.isfinite(shortest), shortest, shortest.min())


# -------------------------------------------------------------------------------------------------
# Tied bodies joined into one body, which vibrates as a whole.


def joined_bodies(model: Model) -> list[Body]:
    """Return the bodies of a model, with each group of tied bodies joined into one.

    Nodes of a body are numbered without a gap: bodies between two joined ones in the scene are
    joined to them too.
    """
    between = [(k, max(a, b)) for a, b in tied_pairs(model) for k in range(min(a, b), max(a, b))]
    group = linked_groups(np.array(between, dtype=int).reshape(-1, 2), len(model.bodies))
    groups = [np.flatnonzero(group == g) for g in dict.fromkeys(group.tolist())]
    return [joined([model.bodies[k] for k in members]) for members in groups]


def tied_pairs(model: Model) -> np.ndarray:
    """Return the numbers (k, 2) of the two bodies that each tied node joins."""
    starts = np.array([body.first_node for body in model.bodies])
    ends = np.column_stack([model.ties.nodes, model.ties.corners[:, 0]])
    return np.searchsorted(starts, ends, side="right") - 1


def linked_groups(pairs: np.ndarray, count: int) -> np.ndarray:
    """Return the number of the group (count,) of each of `count` bodies, linked by pairs (k, 2)."""
    links = csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1])


def joined(bodies: Sequence[Body]) -> Body:
    """Return bodies with consecutive nodes as one body; a single body is returned unchanged.

    The sets of the joined body are named "body.set".
    """
    first = bodies[0]
    if len(bodies) == 1:
        return first
    points = np.concatenate([body.points for body in bodies])
    shifts = [body.first_node - first.first_node for body in bodies]
    before = np.cumsum([0, *(len(body.cells) for body in bodies)])
    regions = [
        replace(
            region, first_node=first.first_node, points=points, cells=region.cells + shift,
            numbers=region.numbers + cells,
        )
        for body, shift, cells in zip(bodies, shifts, before, strict=False)
        for region in body.regions
    ]  # fmt: skip
    return Body(
        name=" + ".join(body.name for body in bodies),
        first_node=first.first_node,
        points=points,
        cells=np.concatenate([b.cells + s for b, s in zip(bodies, shifts, strict=True)]),
        regions=tuple(regions),
        node_sets={f"{b.name}.{k}": nodes for b in bodies for k, nodes in b.node_sets.items()},
        facet_sets={f"{b.name}.{k}": facets for b in bodies for k, facets in b.facet_sets.items()},
        cell_sets={
            f"{b.name}.{name}": cells + start
            for b, start in zip(bodies, before, strict=False)
            for name, cells in b.cell_sets.items()
        },
        remarks=tuple(remark for body in bodies for remark in body.remarks),
        not_read=tuple(text for body in bodies for text in body.not_read),
    )
