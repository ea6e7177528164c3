"""Stiffness matrices of bodies at rest, and the natural modes that follow from them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from scipy.optimize import brentq
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import LinearOperator, eigsh, norm, splu

from softsim.compute import fields
from softsim.elements.geometry import Region
from softsim.errors import ModesError
from softsim.materials.material import Material
from softsim.model import Body, Model
from softsim.solver.explicit import ExplicitSolver
from softsim.structures.ties import Ties

# -------------------------------------------------------------------------------------------------
# Stiffness matrix of a region at rest, from differences of the forces of an increment.
#
# K = -df/dx by central differences, where f are the forces of the elements alone. Two nodes are
# coupled if they move elements with a common pressure (elements/one_point.py). Nodes are moved
# at once, as nodes of one colour, if no force depends on two of them (Curtis, Powell, Reid 1974,
# J. Inst. Math. Appl. 13:117-119), so that the number of differences does not grow with the mesh.


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


# -------------------------------------------------------------------------------------------------
# Natural frequencies and mode shapes of bodies at rest, each held where its nodes are not free.
#
# K phi = omega^2 M phi with the stiffness of the forces of a run and the masses of the nodes,
# scaled where the run scales them (compute/mass_scaling.py). Rigid motions of a body, or of a piece
# of it that nothing holds, have no frequency and are left out. Tied bodies vibrate as one; the
# independent components q are then those that are not tied (structures/ties.py).
#
# Maxwell branches stiffen a vibration. The frequency of a mode with the fractions e_r of its
# elastic energy in the regions r, whose materials have the storage moduli mu_r', solves
#     f^2 = f_0^2 sum_r e_r mu_r'(f) / mu_r'(0)
# with f_0 that of the law alone. The mode shape is kept, although regions that stiffen differently
# change it: the frequency is then too high, by the square of that change (Rayleigh). All energy is
# taken as energy of shear: the part in compression, mu / (3 kappa) in bending, does not grow.


SHIFT = 1e-3
"""Shift of the spectrum below zero for the inverse iteration, over (c / L)^2 of `wave_frequency`.

The shifted matrix is positive definite even if nothing holds the body."""

RIGID = 1e-7
"""Stiffness of a rigid motion over the mean nodal stiffness, below which it is round-off."""


@dataclass(frozen=True, eq=False)
class NaturalMode:
    """Natural mode of a body.

    frequency: of the law alone, dynamic_frequency: with Maxwell branches [Hz].
    shape (n, d): displacements of the body's nodes, of which the largest is 1. mass_shares (d,):
    effective mass in each direction over the body's mass [-].
    """

    frequency: float
    dynamic_frequency: float
    shape: np.ndarray
    mass_shares: np.ndarray

    @property
    def stiffening(self) -> float:
        """Stiffness at its frequency over that of the law alone [-]."""
        return (self.dynamic_frequency / self.frequency) ** 2

    @property
    def most_moved(self) -> int:
        """Number within the body of the node that moves most."""
        return int(np.argmax(np.linalg.norm(self.shape, axis=1)))


@dataclass(frozen=True, eq=False)
class NaturalModes:
    """Natural modes of a body by rising frequency of the law alone.

    held_count: nodes that are not free in every direction. rigid_motions: number of rigid motions,
    which are left out. stiffness_error: see RestStiffness [-].
    """

    body: Body
    modes: list[NaturalMode]
    held_count: int
    rigid_motions: int
    stiffness_error: float


def movable_bodies(model: Model) -> list[Body]:
    """Return the bodies with free nodes, with each group of tied bodies joined into one.

    Raises ModesError if there is none.
    """
    movable = [body for body in joined_bodies(model) if model.is_free[body.nodes].any()]
    if not movable:
        raise ModesError(
            "every node of every body is fixed, prescribed or tied: there are no natural modes",
            hint="hold fewer nodes",
        )
    return movable


def natural_modes(model: Model, body: Body, count: int) -> NaturalModes:
    """Return the first `count` modes of a movable body of the model.

    Raises ModesError if the body is tied to another body, has too few degrees of freedom, or is too
    large.
    """
    refuse_other_half(model, body)
    is_free, mass = model.is_free[body.nodes], model.mass[body.nodes]
    free = is_free.ravel()
    free_mass = np.repeat(mass, model.dimension)[free]
    root, inverse_root = inertia_root(model, body)
    stiffness = [rest_stiffness(model, body, region) for region in body.regions]
    parts = [(inverse_root.T @ k.matrix[free][:, free] @ inverse_root).tocsc() for k in stiffness]
    reinforcement = structure_stiffness(model, body)[free][:, free]
    whole = sum(parts, (inverse_root.T @ reinforcement @ inverse_root).tocsc())
    follows = np.zeros(len(is_free), dtype=bool)
    follows[model.ties.within(body.nodes).nodes] = True
    rigid = rigid_motions(body, is_free, follows, whole, root)
    refuse_too_many(body, count, len(free_mass) - rigid.shape[1])
    shift = SHIFT * wave_frequency(body) ** 2
    modes = []
    for square, vector in lowest(whole, rigid, count, shift):
        frequency = float(np.sqrt(square) / (2.0 * np.pi))
        energy_shares = np.array([vector @ (part @ vector) for part in parts]) / square
        shape, momentum = np.zeros((2, *is_free.shape))
        shape[is_free] = inverse_root @ vector
        momentum[is_free] = free_mass * shape[is_free]
        shape = model.ties.within(body.nodes).followed(shape)
        modes.append(
            NaturalMode(
                frequency,
                dynamic_frequency(frequency, energy_shares, [r.material for r in body.regions]),
                shape / np.linalg.norm(shape, axis=1).max(),
                momentum.sum(axis=0) ** 2 / mass.sum(),
            )
        )
    held_count = int((~is_free.all(axis=1)).sum())
    return NaturalModes(body, modes, held_count, rigid.shape[1], max(k.error for k in stiffness))


def structure_stiffness(model: Model, body: Body) -> sp.csr_matrix:
    """Return K (n d, n d) [N/m] at rest of the structures on a body and in it.

    Forces on tied nodes are transferred to the nodes that they are tied to, T^T K T.
    """
    (n, d), ties = body.points.shape, model.ties.within(body.nodes)
    T = sp.kron(ties.matrix(n), sp.identity(d))
    own = slice(d * body.nodes.start, d * body.nodes.stop)
    result = sp.csr_matrix((n * d, n * d))
    for structure in model.structures:
        result += T.T @ structure.rest_stiffness(model.points)[own, own] @ T
    return result


def inertia_root(model: Model, body: Body) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Return L (k, k) with L^T L = M of the free components of a body, and its inverse.

    M includes mass scaling.
    """
    mass, free = model.mass[body.nodes], model.is_free[body.nodes].ravel()
    root_mass = np.sqrt(np.repeat(mass, model.dimension)[free])
    root, inverse_root = sp.diags(root_mass), sp.diags(1.0 / root_mass)
    scaling = model.mass_scaling
    if scaling is None:
        return root.tocsr(), inverse_root.tocsr()
    slower, faster = (
        scaling.of_nodes(body.nodes).scaled(mass, model.dimension, power)[free][:, free]
        for power in (0.5, -0.5)
    )
    return (slower @ root).tocsr(), (inverse_root @ faster).tocsr()


def refuse_other_half(model: Model, body: Body) -> None:
    """Raise ModesError if the body is tied to another one, as it does not vibrate alone then."""
    inside = np.zeros(len(model.points), dtype=bool)
    inside[body.nodes] = True
    if (inside[model.ties.nodes] != inside[model.ties.corners[:, 0]]).any():
        raise ModesError(
            f"body '{body.name}' is tied to another body and does not vibrate alone",
            hint="request the modes of all joined bodies together (movable_bodies)",
        )


def refuse_too_many(body: Body, count: int, ways: int) -> None:
    """Raise ModesError if a body has at most `count` ways to be strained."""
    if count >= ways:
        raise ModesError(
            f"{count} modes of body '{body.name}' cannot be computed: its free nodes have only "
            f"{ways} degrees of freedom",
            hint="hold fewer nodes, or request fewer modes",
        )


def lowest(
    matrix: sp.csc_matrix, without: np.ndarray, count: int, shift: float
) -> list[tuple[float, np.ndarray]]:
    """Return the `count` smallest eigenvalues of a matrix, each with its unit vector (size,).

    The orthonormal vectors `without` (size, k) are excluded. Lanczos iteration is applied to the
    inverse of the matrix plus `shift` on its diagonal, always from the same start vector, so that
    the result is reproducible.
    """
    size = matrix.shape[0]
    factors = splu(
        (matrix + shift * sp.identity(size)).tocsc(), permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0, options={"SymmetricMode": True},
    )  # fmt: skip

    def kept(v: np.ndarray) -> np.ndarray:
        return v - without @ (without.T @ v)

    inverse = LinearOperator(matrix.shape, lambda v: kept(factors.solve(kept(v))), dtype=float)
    start = kept(np.random.default_rng(0).standard_normal(size))
    values, vectors = eigsh(matrix, count, sigma=-shift, OPinv=inverse, v0=start)
    return [(float(values[k]), vectors[:, k]) for k in np.argsort(values)]


def wave_frequency(body: Body) -> float:
    """Return c / L [1/s] with the slowest shear wave speed c and the longest side L of the body."""
    slowest = min(r.material.law.initial_shear_modulus / r.material.density for r in body.regions)
    return float(np.sqrt(slowest) / np.ptp(body.points, axis=0).max())


def rigid_motions(
    body: Body,
    is_free: np.ndarray,
    follows: np.ndarray,
    matrix: sp.csc_matrix,
    root: sp.csr_matrix,
) -> np.ndarray:
    """Return the rigid motions of the free components, times the root of their inertia.

    Orthonormal vectors (size, k). follows (n,): True for nodes that are tied to others of the body,
    and so not held. The motions are sought among the translations and rotations of each piece that
    do not move held components; some of these strain rings of axisymmetric elements.
    """
    tried = shifts_and_turns(body)
    free, held = is_free.ravel(), (~is_free & ~follows[:, None]).ravel()
    at_held, combined = np.linalg.eigh(tried[held].T @ tried[held])
    resting = tried[free] @ combined[:, at_held < 1e-9]
    basis, _ = np.linalg.qr(root @ resting)
    stiffness, turned = np.linalg.eigh(basis.T @ (matrix @ basis))
    alone = float(matrix.diagonal().mean())
    return basis @ turned[:, stiffness < RIGID * alone]


def shifts_and_turns(body: Body) -> np.ndarray:
    """Return unit vectors (n d, k) of the translations and rotations of each piece of a body.

    A piece is a set of connected elements.
    """
    (n, d), moves = body.points.shape, incidence(body.cells, len(body.points))
    pieces, piece = connected_components(moves.T @ moves, directed=False)
    motions = []
    for number in range(pieces):
        inside = (piece == number).astype(float)[:, None]
        arms = body.points - body.points[piece == number].mean(axis=0)
        for axis in range(d):
            motions.append(inside * np.eye(d)[axis])
        for first, second in [(0, 1), (1, 2), (2, 0)][: d * (d - 1) // 2]:
            turn = np.zeros((n, d))
            turn[:, first], turn[:, second] = -arms[:, second], arms[:, first]
            motions.append(inside * turn)
    columns = np.stack([motion.ravel() for motion in motions], axis=1)
    return columns / np.linalg.norm(columns, axis=0)


def dynamic_frequency(
    frequency: float, energy_shares: np.ndarray, materials: list[Material]
) -> float:
    """Return the frequency [Hz] of a mode with Maxwell branches from that without them [Hz].

    energy_shares (k,): fractions of its energy in parts of these materials [-]; layers and fibres
    store the rest.
    """

    def excess(tried: float) -> float:
        """Return the frequency with the moduli at `tried` minus `tried` [Hz]; it has one root."""
        grown = [m.storage_modulus(tried) / m.storage_modulus(0.0) for m in materials]
        return frequency * float(np.sqrt(energy_shares @ grown + unchanged)) - tried

    unchanged = max(0.0, 1.0 - float(energy_shares.sum()))

    stiffest = max(m.instantaneous_shear_modulus / m.storage_modulus(0.0) for m in materials)
    return float(brentq(excess, 0.5 * frequency, 2.0 * frequency * np.sqrt(stiffest)))
