"""Tangent stiffness K = -dR/dq of a model at any state, assembled from differences of its forces.

The pattern of K has the pairs of nodes that elements, structures, ties and contact between
surfaces couple; columns are evaluated by colours (solver/natural_modes.py). Rigid motions and
pressures have columns of their own; their rows follow from the forces on tied nodes and from the
gradients of the volumes. A pulled cable couples all nodes of its eyelets by its elongation e: it
adds a matrix k (de/dL) g (x) g of rank one, where g = dL/dx. It is kept apart, and the factors are
corrected by the formula of Woodbury.

Newton's method uses K to precondition the exact product with a direction (`StaticForces`), so that
what the pattern lacks costs iterations, not accuracy. `SmallVibrations.error` (modes.py) measures
what it lacks.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
import taichi as ti
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from softsim.compute import fields
from softsim.model import Model
from softsim.solver.natural_modes import (
    STEP,
    colours,
    coupled_pairs,
    incidence,
    shortest_edges,
)
from softsim.solver.stiffness_bound import volume_gradient
from softsim.statics.forces import Configuration, StaticForces
from softsim.structures.cable import PulledCable

SHIFT = 1e-9
"""Stiffness that factors add to each coordinate of a loose piece, over the mean of the diagonal."""

ROUND_OFF = 1e-8
"""Entry of the stiffness over the mean of the diagonal, below which it couples nothing."""

RIGID = 1e-7
"""Stiffness of a rigid motion over the mean of the diagonal, below which it is round-off."""


class Tangent:
    """Assembles the tangent stiffness of a model at trial states.

    The pattern and its colours are kept until the pairs in contact change.
    """

    def __init__(self, forces: StaticForces) -> None:
        self.forces, self.model = forces, forces.model
        scenario = forces.solver.scenario(0)
        self.cables = [(c, scenario.term_of(c).elongation) for c in self.model.of_kind(PulledCable)]
        edges = np.full(len(self.model.points), np.inf)
        for body in self.model.bodies:
            edges[body.nodes] = shortest_edges(body.points, body.cells)
        self.steps = STEP * np.where(np.isfinite(edges), edges, edges.min())
        self.fixed_pairs = fixed_pairs(self.model)
        self._touching = np.zeros((0, 2), dtype=int)
        self._colour(self.fixed_pairs)

    def _colour(self, pairs: sp.csr_matrix) -> None:
        self.pairs = pairs.tocoo()
        self.colour = colours(self.pairs)
        order = np.argsort(self.colour[self.pairs.col], kind="stable")
        self.rows, self.columns = self.pairs.row[order], self.pairs.col[order]
        last = self.colour.max(initial=-1)
        self.starts = np.searchsorted(self.colour[self.columns], np.arange(last + 2))

    @property
    def column_count(self) -> int:
        """Number of differences of forces that an assembly takes."""
        return (len(self.starts) - 1) * self.model.dimension

    def at(self, where: Configuration) -> "Stiffness":
        """Return the tangent stiffness at a configuration."""
        forces = self.forces
        forces.residual(where)
        self._follow_contact()
        n, d = where.x.shape
        values = np.empty((len(self.rows), d, d))
        for number, (start, end) in enumerate(pairwise(self.starts)):
            is_moved, inside = self.colour == number, slice(start, end)
            for axis in range(d):
                resisted = self._resisted(where, is_moved, axis)
                step = self.steps[self.columns[inside], None]
                values[inside, :, axis] = resisted[self.rows[inside]] / step
        of_rows, of_columns = np.broadcast_arrays(
            (self.rows[:, None] * d + np.arange(d))[:, :, None],
            (self.columns[:, None] * d + np.arange(d))[:, None, :],
        )
        entries = (values.ravel(), (of_rows.ravel(), of_columns.ravel()))
        of_nodes = sp.csr_matrix(entries, shape=(n * d, n * d))
        matrix = self._with_others(where, of_nodes)
        vectors = [self._free(where, cable.length_gradient(where.x)) for cable, _ in self.cables]
        stiffnesses = [
            cable.stiffness * self._stretching(where, elongation, vector)
            for (cable, elongation), vector in zip(self.cables, vectors, strict=True)
        ]
        stiffness = Stiffness(
            matrix, np.array(vectors).reshape(-1, forces.size), np.array(stiffnesses),
            np.zeros((0, forces.size)), 0.0, forces.counts[3],
        )  # fmt: skip
        loose = loose_motions(forces, where, stiffness)
        return replace(stiffness, loose=loose, hold=float(abs(matrix.diagonal()).mean()))

    def _resisted(self, where: Configuration, moved: np.ndarray, axis: int) -> np.ndarray:
        """Return the forces (n, d) [N] that resist a step of the nodes of a colour along an axis.

        The elongation of a cable acts as if it did not change.
        """
        ends = []
        for sign in (-1.0, 1.0):
            x = where.x.copy()
            x[moved, axis] += sign * self.steps[moved]
            self.forces.residual(replace(where, x=x))
            ends.append((self.forces.nodal_forces(), [fields.read(e)[0] for _, e in self.cables]))
        (before, longer_before), (after, longer_after) = ends
        resisted: np.ndarray = 0.5 * (before - after)
        for (cable, _), e_0, e_1 in zip(self.cables, longer_before, longer_after, strict=True):
            gradient = cable.stiffness * cable.length_gradient(where.x)
            resisted -= 0.5 * (e_1 - e_0) * self.model.ties.handed_over(gradient)
        return resisted

    def _follow_contact(self) -> None:
        """Renew the pattern if the pairs of points and facets in contact have changed."""
        contacts, data = self.forces.solver.terms.self_contacts, self.model.self_contact
        if data is None:
            return
        facet = fields.read(contacts[0].facet)[0]
        points = np.flatnonzero(facet >= 0)
        touching = np.column_stack([points, facet[points]])
        if np.array_equal(touching, self._touching):
            return
        self._touching = touching
        d = data.facets.shape[1]
        vertices = np.repeat(data.nodes[:, None], d, axis=1)  # a vertex stands for all its corners
        own = np.concatenate([vertices, data.facets])[touching[:, 0]]
        groups = np.concatenate([own, data.facets[touching[:, 1]]], axis=1)
        self._colour(self.fixed_pairs + pairs_of(self.model, groups))

    def _free(self, where: Configuration, of_nodes: np.ndarray) -> np.ndarray:
        """Return the force (size,) on the free coordinates from forces (n, d) on all nodes."""
        on_nodes = self._gathering(where) @ self.model.ties.handed_over(of_nodes).ravel()
        return np.concatenate([on_nodes, np.zeros(self.forces.counts[3])])

    def _gathering(self, where: Configuration) -> sp.csr_matrix:
        """Return the matrix that sums forces (n d,) on nodes to those on free coordinates."""
        forces, (n, d) = self.forces, where.x.shape
        free = np.flatnonzero(forces.is_free)
        rows = [sp.identity(n * d, format="csr")[free]]
        if forces.bodies.count:
            moves, turns = [], []
            for body, tied in enumerate(forces.tied):
                arms = np.zeros((len(tied), 3))
                arms[:, :d] = where.x[tied] - where.centres[body]
                for axis in range(d):
                    if forces.free_moves[body, axis]:
                        moves.append(_row(tied, axis, np.ones(len(tied)), n, d))
                for axis in range(3):
                    if forces.free_turns[body, axis]:
                        along = np.cross(np.eye(3)[axis], arms)[:, :d] / forces.gyration[body]
                        turns.append(sum(_row(tied, k, along[:, k], n, d) for k in range(d)))
            rows += [*moves, *turns]
        return sp.vstack(rows).tocsr()

    def _with_others(self, where: Configuration, of_nodes: sp.csr_matrix) -> sp.csr_matrix:
        """Return K (size, size) without cables: with rigid motions and pressures as coordinates."""
        forces = self.forces
        free = np.flatnonzero(forces.is_free)
        gathered = (self._gathering(where) @ of_nodes)[:, free]
        volumes = sp.csr_matrix(self._volume_rows(where)[:, : forces.counts[0]])
        step, columns = float(self.steps.min()), []
        for coordinate in range(forces.counts[0], forces.size):
            along = np.zeros(forces.size)
            along[coordinate] = step
            columns.append(sp.csc_matrix(forces.resisting(where, along)[:, None] / step))
        return sp.hstack([sp.vstack([gathered, volumes]), *columns]).tocsr()

    def _volume_rows(self, where: Configuration) -> np.ndarray:
        """Return the rows (c, size) of the pressures: P dV/dq, c over its value at the start."""
        forces, rows = self.forces, np.zeros((self.forces.counts[3], self.forces.size))
        for row, load in enumerate(forces.chambers):
            surface = np.concatenate([load.facets, load.lids])
            gradient = self._free(where, volume_gradient(load.geometry, surface, where.x))
            stiffer = load.source.stiffness(load.volume(where.x)) / load.source.stiffness(
                load.volume(forces.start.x)
            )
            rows[row] = forces.pressure_scale * stiffer * gradient
        return rows

    def _stretching(self, where: Configuration, elongation: ti.Field, vector: np.ndarray) -> float:
        """Return de/dL of a cable, by a difference along its vector: 1 if it is taut, else 0."""
        length = float(self.steps.min()) * vector / np.abs(vector).max()
        ends = []
        for sign in (-1.0, 1.0):
            self.forces.residual(self.forces.moved(where, sign * length))
            ends.append(float(fields.read(elongation)[0]))
        return (ends[1] - ends[0]) / (2.0 * float(vector @ length))


def _row(nodes: np.ndarray, axis: int, values: np.ndarray, n: int, d: int) -> sp.csr_matrix:
    return sp.csr_matrix((values, (np.zeros(len(nodes), int), nodes * d + axis)), (1, n * d))


@dataclass(frozen=True, eq=False)
class Stiffness:
    """Tangent stiffness K + sum_k c_k g_k (x) g_k (size, size) [N/m] of the free coordinates.

    vectors (k, size), stiffnesses (k,): g and c of the pulled cables. loose (r, size): orthonormal
    rigid motions without stiffness; factors resist them by `hold` [N/m], which changes nothing if
    no load acts along them. pressure_count: pressures among the coordinates, the last ones.
    """

    matrix: sp.csr_matrix
    vectors: np.ndarray
    stiffnesses: np.ndarray
    loose: np.ndarray
    hold: float
    pressure_count: int

    def times(self, v: np.ndarray) -> np.ndarray:
        """Return the product (size,) [N] with a displacement (size,) [m]."""
        product: np.ndarray = self.matrix @ v + self.vectors.T @ (
            self.stiffnesses * (self.vectors @ v)
        )
        return product

    def holding(self, v: np.ndarray) -> np.ndarray:
        """Return the forces (size,) [N] that resist the loose part of a displacement (size,)."""
        product: np.ndarray = self.hold * (self.loose.T @ (self.loose @ v))
        return product


class Factors:
    """LU factors of a tangent stiffness, with its parts of rank one by Woodbury's formula."""

    def __init__(self, stiffness: Stiffness) -> None:
        self.stiffness = stiffness
        # A piece that nothing holds is singular: the correction below needs a little stiffness.
        is_loose = np.any(stiffness.loose != 0.0, axis=0)
        shift = sp.diags(np.where(is_loose, SHIFT * stiffness.hold, 0.0))
        self.lu = splu(
            (stiffness.matrix + shift).tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01,
            options={"SymmetricMode": True},
        )  # fmt: skip
        self.vectors = G = np.concatenate([stiffness.vectors, stiffness.loose])
        held = np.full(len(stiffness.loose), stiffness.hold)
        self.stiffnesses = c = np.concatenate([stiffness.stiffnesses, held])
        self.solved = np.array([self.lu.solve(g) for g in G]).reshape(G.shape)
        self.small = np.eye(len(c)) + c[:, None] * (G @ self.solved.T)

    def solve(self, force: np.ndarray) -> np.ndarray:
        """Return the displacement (size,) [m] for a force (size,) [N]."""
        u: np.ndarray = self.lu.solve(force)
        if len(self.small):
            c, G = self.stiffnesses, self.vectors
            u = u - self.solved.T @ np.linalg.solve(self.small, c * (G @ u))
        return u

    @property
    def negative_pivots(self) -> int:
        """Number of negative eigenvalues of a nearly symmetric K without its pressures.

        It is counted by the signs of the pivots. With the sign of their rows changed, pressures
        make K symmetric; each then adds a negative eigenvalue (Haynsworth's inertia formula).
        """
        pivots = self.lu.U.diagonal()[self.lu.perm_c]
        others, pressures = np.split(pivots, [len(pivots) - self.stiffness.pressure_count])
        return int((others < 0.0).sum()) - int((pressures < 0.0).sum())


def loose_motions(forces: StaticForces, where: Configuration, stiffness: Stiffness) -> np.ndarray:
    """Return orthonormal rigid motions (r, size) of connected pieces that nothing resists."""
    mean = float(abs(stiffness.matrix.diagonal()).mean())
    links = abs(stiffness.matrix) > ROUND_OFF * mean
    count, piece = connected_components(links, directed=False)
    tried = rigid_motions(forces, where)
    motions = [np.where(piece == p, z, 0.0) for p in range(count) for z in tried]
    motions = [z for z in motions if np.abs(z).max() > 0.0]
    _, sizes, basis = np.linalg.svd(np.array(motions).reshape(-1, forces.size), full_matrices=False)
    basis = basis[sizes > 1e-6 * sizes.max(initial=0.0)]
    resisted = np.array([stiffness.times(z) for z in basis]).reshape(-1, forces.size)
    # Not by z K z, which stiffness of the other sign elsewhere could cancel.
    left, forces_of, _ = np.linalg.svd(resisted, full_matrices=False)
    return np.asarray(left[:, forces_of < RIGID * mean].T @ basis)


def rigid_motions(forces: StaticForces, where: Configuration) -> np.ndarray:
    """Return the translations and rotations (k, size) of the whole model in free coordinates."""
    x, centres, (n, d) = where.x, where.centres, where.x.shape
    count, length = len(centres), float(np.ptp(x, axis=0).max())
    motions = [
        (np.tile(along, (n, 1)), np.tile(along, (count, 1)), np.zeros((count, 3)))
        for along in np.eye(d)
    ]
    for about in np.eye(3) if d == 3 else np.eye(3)[2:]:
        of_nodes, of_bodies = (np.cross(about, in_space(y))[:, :d] / length for y in (x, centres))
        motions.append((of_nodes, of_bodies, about * forces.gyration / length))
    free = (forces.is_free, forces.free_moves, forces.free_turns)
    nothing = np.zeros(forces.counts[3])
    return np.array(
        [
            np.concatenate([*(m[f] for m, f in zip(motion, free, strict=True)), nothing])
            for motion in motions
        ]
    )


def named_motion(forces: StaticForces, where: Configuration, motion: np.ndarray) -> str:
    """Return the name of the translation or rotation that a rigid motion (size,) is closest to."""
    tried = rigid_motions(forces, where)
    inside = np.where(motion != 0.0, tried, 0.0)
    sizes = np.linalg.norm(inside, axis=1)
    shares = np.abs(inside @ motion) / np.where(sizes > 0.0, sizes, np.inf)
    d, best = where.x.shape[1], int(np.argmax(shares))
    if best < d:
        return f"translation along {'xyz'[best]}"
    return f"rotation about {'xyz'[best - d] if d == 3 else 'z'}"


def in_space(x: np.ndarray) -> np.ndarray:
    """Return places (n, d) as places of space (n, 3)."""
    return np.pad(x, ((0, 0), (0, 3 - x.shape[1])))


def fixed_pairs(model: Model) -> sp.csr_matrix:
    """Return the pairs (n, n) of nodes that elements, structures and ties couple.

    Columns are those of moving nodes.
    """
    n = len(model.points)
    moving = np.any(model.is_free, axis=1)
    pairs = sp.identity(n, format="csr")
    for body in model.bodies:
        for region in body.regions:
            everything = np.ones(len(body.points), dtype=bool)
            coupled = coupled_pairs(region, model.ties.within(slice(0, 0)), everything)
            shift = body.first_node
            entries = (coupled.data, (coupled.row + shift, coupled.col + shift))
            pairs = pairs + sp.csr_matrix(entries, shape=(n, n))
    for structure in model.all_structures:
        for bound in structure.stiffness_bound(model.points):
            pairs = pairs + pairs_of(model, bound.nodes.T)
    T = model.ties.matrix(n)
    pairs = T.T @ pairs @ T + pairs
    return (abs(pairs) @ sp.diags(moving.astype(float))).tocsr()


def pairs_of(model: Model, groups: np.ndarray) -> sp.csr_matrix:
    """Return the pairs (n, n) of the nodes of groups (m, k), and of the nodes they are tied to."""
    n = len(model.points)
    if not groups.size:
        return sp.csr_matrix((n, n))
    moves = incidence(groups, n)
    moves = moves + moves @ model.ties.matrix(n)
    moving = sp.diags(np.any(model.is_free, axis=1).astype(float))
    pairs = (moves.T @ moves @ moving).tocsr()
    pairs.eliminate_zeros()
    return pairs
