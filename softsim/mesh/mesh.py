"""Nodes, cells and named sets of a body of linear triangles (2D) or tetrahedra (3D)."""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from softsim.errors import MeshError

SURFACE = "surface"

# Facets of a positive cell, by number of dimensions: material to the left of an edge,
# outward normal of a face by the right-hand rule.
_LOCAL_FACETS = {
    2: np.array([[0, 1], [1, 2], [2, 0]]),
    3: np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
}


@dataclass(frozen=True)
class Mesh:
    """A body of linear triangles or tetrahedra.

    points: (n, 2) or (n, 3) positions [m].
    cells: (m, 3) triangles or (m, 4) tetrahedra, node numbers, positive when counter-clockwise.
    node_sets: name -> (k,) node numbers.
    facet_sets: name -> (k, 2) or (k, 3) node numbers of boundary facets. The material lies to the
        left of an edge a -> b, so that (dy, -dx) points out of the body.
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
        cells = _node_rows("cells", self.cells, dimension + 1)
        surface = boundary_facets(cells)
        node_sets = {**self.node_sets, SURFACE: np.unique(surface)}
        facet_sets = {**self.facet_sets, SURFACE: surface}
        typed = {
            "points": points,
            "cells": cells,
            "node_sets": {name: _numbers(nodes) for name, nodes in node_sets.items()},
            "facet_sets": {
                name: _node_rows(f"facet set '{name}'", facets, dimension)
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


def _node_rows(what: str, rows: np.ndarray, width: int) -> np.ndarray:
    """`rows` as an integer array (k, width)."""
    array = np.ascontiguousarray(rows, dtype=np.int64)
    if array.size == 0:
        return array.reshape(0, width)
    if array.ndim != 2 or array.shape[1] != width:
        raise MeshError(
            f"{what}: the shape is {array.shape}; (k, {width}) is needed",
            hint="2D points go with triangles and edges, 3D points with tetrahedra and triangles",
        )
    return array


def boundary_facets(cells: np.ndarray) -> np.ndarray:
    """Facets (k, 2 or 3) that belong to one cell only, oriented outward, in order of the cells.

    cells: (m, 3) triangles or (m, 4) tetrahedra.
    """
    facets = cell_facets(cells)
    number = _row_numbers(np.sort(facets, axis=1))
    return facets[np.bincount(number)[number] == 1]


def cell_facets(cells: np.ndarray) -> np.ndarray:
    """All facets (m * corners, 2 or 3) of the cells, cell by cell, each oriented outward."""
    dimension = cells.shape[1] - 1
    return cells[:, _LOCAL_FACETS[dimension]].reshape(-1, dimension)


def facet_owners(facets: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Number (k,) of the cell that has each facet (k, corners) of the boundary; -1: none has it."""
    of_cells = cell_facets(cells)
    rows, among = (np.sort(f, axis=1) for f in (facets, of_cells))
    return find_rows(rows, among) // (len(of_cells) // len(cells))


def open_rim(facets: np.ndarray) -> np.ndarray:
    """The rim of a surface: what a lid must hold on to; empty when the surface is closed.

    facets: (k, 2) edges -> (r, 1) end nodes: those of one edge only, in increasing order.
    facets: (k, 3) triangles -> (r, 2) edges: those of one triangle only, in order of the
        triangles, each in the direction opposite to its triangle's, so that a lid whose triangles
        run along them is oriented as the surface is.
    """
    if facets.shape[1] == 2:
        nodes, count = np.unique(facets, return_counts=True)
        return nodes[count == 1][:, None]
    return boundary_facets(facets)[:, ::-1]


def find_rows(rows: np.ndarray, among: np.ndarray) -> np.ndarray:
    """Position (k,) of each row (k, d) among the rows (n, d), which differ; -1 if not there."""
    number = _row_numbers(np.concatenate([among, rows]))
    position = np.full(len(number), -1)
    position[number[: len(among)]] = np.arange(len(among))
    return position[number[len(among) :]]


def _row_numbers(rows: np.ndarray) -> np.ndarray:
    """Numbers (k,) from 0 on of the rows (k, d): the same for equal rows, else different."""
    # np.unique(axis=0) compares rows as bytes: ten times slower for a million facets.
    order = np.lexsort(rows.T)
    differs = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    number = np.zeros(len(rows), dtype=np.int64)
    number[order[1:]] = np.cumsum(differs)
    return number


def signed_volumes(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Areas [m^2] of triangles or volumes [m^3] of tetrahedra, (m,); negative when inverted."""
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    factorial = 2.0 if cells.shape[1] == 3 else 6.0
    return np.linalg.det(edges) / factorial


def transformed(mesh: Mesh, rotation: float, shift: np.ndarray) -> Mesh:
    """The mesh turned by `rotation` [rad] about the origin, then moved by `shift` (2 or 3,) [m].

    The rotation is counter-clockwise in the x-y plane: about the z axis in three dimensions.
    """
    cosine, sine = np.cos(rotation), np.sin(rotation)
    turn = np.eye(mesh.dimension)
    turn[:2, :2] = [[cosine, -sine], [sine, cosine]]
    return replace(mesh, points=mesh.points @ turn.T + np.asarray(shift, dtype=np.float64))


def renumbered(mesh: Mesh) -> Mesh:
    """The same mesh with neighbours close in memory, its sets carried along.

    Nodes in reverse Cuthill-McKee order, cells by their smallest node.
    """
    node_count, corner_count = len(mesh.points), mesh.cells.shape[1]
    rows = np.repeat(mesh.cells, corner_count, axis=1).ravel()
    columns = np.tile(mesh.cells, corner_count).ravel()
    adjacency = coo_array((np.ones(len(rows)), (rows, columns)), shape=(node_count, node_count))
    old_node = reverse_cuthill_mckee(adjacency.tocsr(), symmetric_mode=True)
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


def _inverse(permutation: np.ndarray) -> np.ndarray:
    inverse = np.empty(len(permutation), dtype=np.int64)
    inverse[permutation] = np.arange(len(permutation))
    return inverse
