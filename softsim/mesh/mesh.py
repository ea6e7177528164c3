"""Nodes, cells and named sets of a body.

Cells are triangles or quadrilaterals in the plane, tetrahedra or hexahedra in space; their kind
follows from the number of their corners and the number of coordinates. Corners are in the order of
VTK and ABAQUS. A mesh of several kinds has cells of the larger one: the others are written with
corners repeated, a triangle a b c as the quadrilateral a b c c (see `with_corners`). A side that
has collapsed to a point or a line is left out; one that has collapsed to a triangle is also a b c
c.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from softsim.errors import MeshError

# -------------------------------------------------------------------------------------------------
# Batches of cells, which limit memory: intermediate results take a kilobyte or more per cell.

BATCH = 16_384


def batches(count: int) -> list[slice]:
    """Return slices of at most BATCH of `count` cells.

    Without cells there is one empty batch, so that results have their shape.
    """
    return [slice(k, k + BATCH) for k in range(0, max(1, count), BATCH)]


def in_batches(of_cells: Callable[[np.ndarray], np.ndarray], cells: np.ndarray) -> np.ndarray:
    """Apply a function of cells (k, corners) to batches; return all results (m, ...)."""
    return np.concatenate([of_cells(cells[batch]) for batch in batches(len(cells))])


SURFACE = "surface"
CORNER_COUNTS = {2: (3, 4), 3: (4, 8)}
"""Numbers of corners that cells can have, by number of dimensions."""

# Facets of a positive cell, by number of dimensions and of corners: material to the left of an
# edge, outward normal of a face by the right-hand rule.
_LOCAL_FACETS = {
    (2, 3): np.array([[0, 1], [1, 2], [2, 0]]),
    (2, 4): np.array([[0, 1], [1, 2], [2, 3], [3, 0]]),
    (3, 4): np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
    (3, 8): np.array(
        [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    ),
}

# Corners of the cell that a smaller one becomes, by number of dimensions and of its corners: of a
# triangle, a tetrahedron, a pyramid, a wedge.
_COLLAPSED = {
    (2, 3): [0, 1, 2, 2],
    (3, 4): [0, 1, 2, 2, 3, 3, 3, 3],
    (3, 5): [0, 1, 2, 3, 4, 4, 4, 4],
    (3, 6): [0, 1, 2, 2, 3, 4, 5, 5],
}

# Order of corners that turns a cell inside out, collapsed ones and facets too.
_TURNED = {
    (1, 2): [1, 0],
    (2, 3): [2, 1, 0],
    (2, 4): [1, 0, 3, 2],
    (3, 4): [1, 0, 2, 3],
    (3, 8): [1, 0, 3, 2, 5, 4, 7, 6],
}


@dataclass(frozen=True)
class Mesh:
    """A body of cells with straight edges.

    points: (n, 2) or (n, 3) positions [m].
    cells: node numbers; in the plane (m, 3) triangles or (m, 4) quadrilaterals, counter-clockwise;
        in space (m, 4) tetrahedra or (m, 8) hexahedra, corners 4 to 7 above 0 to 3, which are
        counter-clockwise seen from above.
    node_sets: name -> (k,) node numbers.
    facet_sets: name -> node numbers of boundary facets as cells list them: (k, 2) edges, (k, 3)
        triangles of tetrahedra, (k, 4) quadrilaterals of hexahedra. The material lies to the left
        of an edge a -> b, so that (dy, -dx) points out of the body.
    cell_sets: name -> (k,) cell numbers.

    Every mesh has the node set and the facet set "surface": its whole boundary.

    Raises MeshError if the arrays do not have these shapes.
    """

    points: np.ndarray
    cells: np.ndarray
    node_sets: dict[str, np.ndarray] = field(default_factory=dict)
    facet_sets: dict[str, np.ndarray] = field(default_factory=dict)
    cell_sets: dict[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        points = np.ascontiguousarray(self.points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] not in (2, 3):
            raise MeshError(f"points have the shape {points.shape}; (n, 2) or (n, 3) is needed")
        dimension = points.shape[1]
        cells = _node_rows("cells", self.cells, CORNER_COUNTS[dimension])
        surface = boundary_facets(cells, dimension)
        node_sets = {**self.node_sets, SURFACE: np.unique(surface)}
        facet_sets = {**self.facet_sets, SURFACE: surface}
        typed = {
            "points": points,
            "cells": cells,
            "node_sets": {name: _numbers(nodes) for name, nodes in node_sets.items()},
            "facet_sets": {
                name: _node_rows(f"facet set '{name}'", facets, surface.shape[1:])
                for name, facets in facet_sets.items()
            },
            "cell_sets": {name: _numbers(members) for name, members in self.cell_sets.items()},
        }
        for attribute, value in typed.items():
            object.__setattr__(self, attribute, value)

    @property
    def dimension(self) -> int:
        """Number of coordinates of a node: 2 or 3."""
        return self.points.shape[1]


def _numbers(members: np.ndarray) -> np.ndarray:
    return np.asarray(members, dtype=np.int64)


def _node_rows(what: str, rows: np.ndarray, widths: tuple[int, ...]) -> np.ndarray:
    """Return `rows` as an integer array (k, width), of one of these widths."""
    array = np.ascontiguousarray(rows, dtype=np.int64)
    if array.size == 0:
        return array.reshape(0, widths[0])
    if array.ndim != 2 or array.shape[1] not in widths:
        needed = " or ".join(f"(k, {width})" for width in widths)
        raise MeshError(
            f"{what}: the shape is {array.shape}; {needed} is needed",
            hint="2D points require triangles, quadrilaterals and edges; 3D points require "
            "tetrahedra and triangles, or hexahedra and quadrilaterals",
        )
    return array


def with_corners(cells: np.ndarray, dimension: int, corners: int) -> np.ndarray:
    """Return the cells written with `corners` corners, some of them repeated where necessary.

    cells: (m, 3) triangles, (m, 4) tetrahedra, (m, 5) pyramids, base first, or (m, 6) wedges; in
    the order of ABAQUS.
    """
    if cells.shape[1] == corners:
        return cells
    return cells[:, _COLLAPSED[dimension, cells.shape[1]]]


def of_one_kind(groups: Sequence[np.ndarray], dimension: int) -> np.ndarray:
    """Return all cells of the groups (m, corners), written with the largest number of corners.

    Pyramids and wedges are written as hexahedra. Facets of bodies in space are cells of two
    dimensions.
    """
    most = max(cells.shape[1] for cells in groups)
    corners = {5: 8, 6: 8}.get(most, most)
    return np.concatenate([with_corners(cells, dimension, corners) for cells in groups])


def of_corners(mesh: Mesh, corners: int) -> Mesh:
    """Return the mesh with its cells written with `corners` corners, and facets to match."""
    cells = with_corners(mesh.cells, mesh.dimension, corners)
    width = _LOCAL_FACETS[mesh.dimension, corners].shape[1]
    facets = {name: with_corners(f, 2, width) for name, f in mesh.facet_sets.items()}
    return replace(mesh, cells=cells, facet_sets=facets)


def turned(cells: np.ndarray, dimension: int) -> np.ndarray:
    """Return the cells in the order of corners that changes the sign of their volume."""
    return cells[:, _TURNED[dimension, cells.shape[1]]]


def boundary_facets(cells: np.ndarray, dimension: int) -> np.ndarray:
    """Return the facets (k, corners) of one cell only, oriented outward, in order of the cells."""
    facets, _ = cell_facets(cells, dimension)
    number = _row_numbers(facet_keys(facets))
    return facets[np.bincount(number)[number] == 1]


def facets_on(boundary: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Return the facets (k, corners) of the boundary whose nodes are all among `nodes`."""
    return boundary[np.isin(boundary, nodes).all(axis=1)]


def facets_touching(boundary: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Return the facets (k, corners) of the boundary with at least one node among `nodes`."""
    return boundary[np.isin(boundary, nodes).any(axis=1)]


def cell_facets(cells: np.ndarray, dimension: int) -> tuple[np.ndarray, np.ndarray]:
    """Return all facets (k, corners) of the cells, oriented outward, and the cell (k,) of each.

    They are in order of the cells. A triangle among quadrilaterals has its last corner twice.
    """
    local = _LOCAL_FACETS[dimension, cells.shape[1]]
    facets = cells[:, local].reshape(-1, local.shape[1])
    owners = np.repeat(np.arange(len(cells)), len(local))
    if cells.shape[1] > dimension + 1:  # other cells than simplexes may have collapsed
        following = np.roll(facets, -1, axis=1)
        repeated = facets == following
        whole = (np.diff(np.sort(facets, axis=1), axis=1) > 0).sum(axis=1) >= dimension - 1
        turn = np.where(repeated.any(axis=1), np.argmax(repeated, axis=1) + 2, 0)
        order = (turn[:, None] + np.arange(local.shape[1])) % local.shape[1]
        facets, owners = np.take_along_axis(facets, order, axis=1)[whole], owners[whole]
    return facets, owners


def facet_keys(facets: np.ndarray) -> np.ndarray:
    """Return the facets (k, corners) as rows that are equal for equal nodes in any order."""
    nodes = np.sort(facets, axis=1)
    if facets.shape[1] == 4:
        # Of a triangle among quadrilaterals any corner may be the one that is there twice.
        twice = nodes[:, 1:] == nodes[:, :-1]
        nodes[:, 1:][twice] = -1
        nodes.sort(axis=1)
    return nodes


def simplex_facets(facets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return facets as edges or triangles (k, d), and the number (k,) of the facet of each.

    Quadrilaterals are cut into triangles along the diagonal from their smallest node, so that two
    cells cut a common facet in the same way.
    """
    numbers = np.arange(len(facets))
    if facets.shape[1] < 4:
        return facets, numbers
    turn = (np.argmin(facets, axis=1)[:, None] + np.arange(4)) % 4
    halves = np.take_along_axis(facets, turn, axis=1)[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    whole = _are_different(halves)
    return halves[whole], np.repeat(numbers, 2)[whole]


def simplexes(cells: np.ndarray, dimension: int) -> np.ndarray:
    """Return the cells cut into triangles or tetrahedra (k, d + 1), which conform.

    Each cell is cut from its smallest node to its facets, which are cut from theirs.
    """
    if cells.shape[1] == dimension + 1:
        return cells
    facets, owners = cell_facets(cells, dimension)
    bases, numbers = simplex_facets(facets)
    found = np.column_stack([cells.min(axis=1)[owners[numbers]], bases])
    return found[_are_different(found)]


def _are_different(rows: np.ndarray) -> np.ndarray:
    """Return a mask (k,) of the rows (k, corners) whose nodes all differ."""
    nodes = np.sort(rows, axis=1)
    return (nodes[:, 1:] != nodes[:, :-1]).all(axis=1)


def facet_owners(facets: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return the cell (k,) of each facet (k, corners) of the boundary, -1 if there is none."""
    of_cells, owners = cell_facets(cells, 2 if facets.shape[1] == 2 else 3)
    rows = facet_keys(of_one_kind([of_cells, facets], 2))
    found = find_rows(rows[len(of_cells) :], rows[: len(of_cells)])
    return np.where(found < 0, -1, owners[found])


def open_rim(facets: np.ndarray) -> np.ndarray:
    """Return the rim of a surface, to which a lid must attach; empty for a closed surface.

    facets: (k, 2) edges -> (r, 1) end nodes: those of one edge only, in increasing order.
    facets: (k, 3) triangles or (k, 4) quadrilaterals -> (r, 2) edges: those of one facet only, in
        order of the facets, each in the direction opposite to its facet's, so that a lid whose
        facets run along them is oriented as the surface is.
    """
    if facets.shape[1] == 2:
        nodes, count = np.unique(facets, return_counts=True)
        return nodes[count == 1][:, None]
    return boundary_facets(facets, 2)[:, ::-1]


def find_rows(rows: np.ndarray, among: np.ndarray) -> np.ndarray:
    """Return the index (k,) of each row (k, d) among the distinct rows (n, d); -1 if missing."""
    number = _row_numbers(np.concatenate([among, rows]))
    position = np.full(len(number), -1)
    position[number[: len(among)]] = np.arange(len(among))
    return position[number[len(among) :]]


def _row_numbers(rows: np.ndarray) -> np.ndarray:
    """Return numbers (k,) of the rows (k, d), from 0 on, the same for equal rows only."""
    # np.unique(axis=0) compares rows as bytes: ten times slower for a million facets.
    order = np.lexsort(rows.T)
    differs = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    number = np.zeros(len(rows), dtype=np.int64)
    number[order[1:]] = np.cumsum(differs)
    return number


def signed_volumes(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return areas [m^2] of cells in the plane or volumes [m^3] of cells in space (m,).

    They are negative for inverted cells. A hexahedron's faces are bilinear.
    """
    of_corners = _VOLUMES[points.shape[1], cells.shape[1]]

    def of(cells: np.ndarray) -> np.ndarray:
        return of_corners(points[cells] - points[cells[:, :1]])

    return in_batches(of, cells)


def _simplex_volumes(corners: np.ndarray) -> np.ndarray:
    """Return areas or volumes of triangles or tetrahedra (m, d + 1, d) from the origin."""
    edges = corners[:, 1:]
    return np.linalg.det(edges) / math.factorial(edges.shape[1])


def _quadrilateral_areas(corners: np.ndarray) -> np.ndarray:
    """Return the areas of quadrilaterals (m, 4, 2), half the product of the diagonals."""
    diagonals = np.stack([corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]], axis=1)
    return np.linalg.det(diagonals) / 2.0


def _hexahedron_volumes(corners: np.ndarray) -> np.ndarray:
    """Return the volumes of hexahedra (m, 8, 3) by the divergence theorem over their faces.

    The volume between a bilinear face and the origin is the mean of those of the face cut into two
    triangles along the one or the other diagonal.
    """
    faces = corners[:, _LOCAL_FACETS[3, 8]]
    triangles = faces[:, :, [[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]]]
    return np.linalg.det(triangles).sum(axis=(1, 2)) / 12.0


_VOLUMES = {
    (2, 3): _simplex_volumes,
    (2, 4): _quadrilateral_areas,
    (3, 4): _simplex_volumes,
    (3, 8): _hexahedron_volumes,
}


def transformed(mesh: Mesh, rotation: float, shift: np.ndarray) -> Mesh:
    """Return the mesh rotated by `rotation` [rad] about the origin, then moved by `shift` [m].

    shift: (2 or 3,). The rotation is counter-clockwise in the x-y plane: about the z axis in three
    dimensions.
    """
    cosine, sine = np.cos(rotation), np.sin(rotation)
    turn = np.eye(mesh.dimension)
    turn[:2, :2] = [[cosine, -sine], [sine, cosine]]
    return replace(mesh, points=mesh.points @ turn.T + np.asarray(shift, dtype=np.float64))


def mirrored(mesh: Mesh, axis: int) -> Mesh:
    """Return the mirror image of the mesh across the plane through the origin normal to an axis.

    The order of the corners of cells and facets is reversed, so that they keep their orientation.
    """
    sign = np.ones(mesh.dimension)
    sign[axis] = -1.0
    return replace(
        mesh,
        points=mesh.points * sign,
        cells=turned(mesh.cells, mesh.dimension),
        facet_sets={n: turned(f, mesh.dimension - 1) for n, f in mesh.facet_sets.items()},
    )


def renumbered(mesh: Mesh) -> Mesh:
    """Return the same mesh, with its sets, renumbered so that neighbours are close in memory.

    Nodes are in reverse Cuthill-McKee order, cells ordered by their smallest node.
    """
    of_cells = incidence(mesh.cells, len(mesh.points))
    adjacency = of_cells.T.tocsr() @ of_cells
    adjacency.sort_indices()
    old_node = reverse_cuthill_mckee(adjacency, symmetric_mode=True)
    new_node = _inverse(old_node)
    cells = new_node[mesh.cells]
    old_cell = np.argsort(cells.min(axis=1), kind="stable")
    new_cell = _inverse(old_cell)
    return Mesh(
        points=mesh.points[old_node],
        cells=cells[old_cell],
        node_sets={name: new_node[nodes] for name, nodes in mesh.node_sets.items()},
        facet_sets={name: new_node[facets] for name, facets in mesh.facet_sets.items()},
        cell_sets={name: new_cell[members] for name, members in mesh.cell_sets.items()},
    )


def incidence(cells: np.ndarray, node_count: int) -> csr_matrix:
    """Return the incidence matrix (m, nodes) of cells (m, corners): True for their corners."""
    starts = np.arange(0, cells.size + 1, cells.shape[1])
    return csr_matrix(
        (np.ones(cells.size, dtype=bool), cells.ravel(), starts), (len(cells), node_count)
    )


def _inverse(permutation: np.ndarray) -> np.ndarray:
    inverse = np.empty(len(permutation), dtype=np.int64)
    inverse[permutation] = np.arange(len(permutation))
    return inverse
