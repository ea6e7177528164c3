"""Checks of a mesh, and measures of its quality."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from softsim.errors import MeshError
from softsim.mesh.mesh import SURFACE, Mesh, cell_facets, facet_owners, find_rows, signed_volumes

FLAT_CELL = 1e-9
"""Volume over longest edge cubed (2D: squared) below which a cell is flat.

It is also applied to the volume of the simplex of a corner and its neighbours.
"""

SAME_PLACE = 1e-9
"""Distance over the bounding box's diagonal below which two nodes are the same."""


@dataclass(frozen=True)
class MeshQuality:
    """Size and shape of a mesh.

    smallest_altitude [m] sets the stable time increment; it belongs to smallest_altitude_cell. It
        is that of the parallelogram, in space the parallelepiped, of the edges at a corner: of a
        simplex its own.
    smallest_angle, largest_angle [rad]: between the edges of a cell in the plane, between the faces
        of one in space, at its corners.
    worst_aspect_ratio: longest edge over smallest altitude, 1 for an equilateral simplex, a square
        and a cube.
    cell_kinds: how many cells there are of each kind that there is, "triangles" -> 12.
    volume [m^3], in 2D the area [m^2].
    piece_count: parts of the mesh that share no node; 1 for a body in one piece.
    """

    node_count: int
    cell_count: int
    cell_kinds: dict[str, int]
    smallest_altitude: float
    smallest_altitude_cell: int
    smallest_angle: float
    largest_angle: float
    worst_aspect_ratio: float
    volume: float
    piece_count: int

    def describe(self) -> str:
        """Return numbers of nodes and cells, smallest altitude, angles and connection as text."""
        cells = ", ".join(f"{count} {kind}" for kind, count in self.cell_kinds.items())
        smallest, largest = math.degrees(self.smallest_angle), math.degrees(self.largest_angle)
        return (
            f"{self.node_count} nodes, {cells}, smallest altitude "
            f"{self.smallest_altitude * 1e3:.3g} mm, angles {smallest:.0f} deg to {largest:.0f} deg"
            + (f", {self.piece_count} unconnected pieces" if self.piece_count > 1 else "")
        )


@dataclass(frozen=True)
class Labels:
    """Labels of the nodes (n,) and the cells (m,) in the file of a mesh."""

    nodes: np.ndarray
    cells: np.ndarray


def node_label(number: int, labels: Labels | None) -> int:
    """Return the label of a node in the file, or its number where there are no labels."""
    return number if labels is None else int(labels.nodes[number])


def cell_name(number: int, labels: Labels | None) -> str:
    """Return the name of a cell for messages: its label in the file, or else its number."""
    return f"cell {number}" if labels is None else f"element {labels.cells[number]}"


def check(mesh: Mesh, labels: Labels | None = None) -> None:
    """Raise MeshError, naming the cell, node or set and its place, if the mesh cannot be used.

    It cannot with: no cells, a coordinate that is not finite, a node or cell number out of range,
    an empty set, a node that belongs to no cell, two nodes in one place, a flat cell or an inverted
    one, as a whole or at a corner, cells that overlap at a common facet (a cell listed twice), a
    quadrilateral of one cell that meets triangles of others, a facet that is not on the boundary or
    is listed the wrong way round.

    labels: how messages call nodes and cells; without, by their numbers from 0 on.
    """
    if len(mesh.cells) == 0:
        raise MeshError("the mesh has no cells")
    _check_coordinates(mesh, labels)
    _check_numbers(mesh)
    _check_nodes(mesh, labels)
    _check_volumes(mesh, labels)
    _check_overlaps(mesh, labels)
    _check_joints(mesh, labels)
    _check_facets(mesh)


def check_range(owner: str, numbers: np.ndarray, what: str, count: int) -> None:
    """Raise MeshError, naming the owner of the numbers, if one is not in 0 ... count - 1."""
    outside = numbers[(numbers < 0) | (numbers >= count)]
    if outside.size:
        raise MeshError(
            f"{owner}: {what} number {outside.flat[0]} is out of range; "
            f"the mesh has {what}s 0 to {count - 1}"
        )


def piece_count(mesh: Mesh) -> int:
    """Return the number of parts of a mesh that share no node."""
    first, others = mesh.cells[:, :1], mesh.cells[:, 1:]
    rows, columns = np.broadcast_to(first, others.shape).ravel(), others.ravel()
    shape = (len(mesh.points), len(mesh.points))
    links = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=shape)
    return int(connected_components(links.tocsr(), directed=False, return_labels=False))


def quality(mesh: Mesh) -> MeshQuality:
    """Measure a mesh that has passed `check`."""
    edges, inner = corner_edges(mesh)
    normals = _normals_between(edges)
    sizes = np.linalg.norm(normals, axis=3)
    with np.errstate(divide="ignore", invalid="ignore"):
        at_corners = np.linalg.det(edges) / sizes.max(axis=2)
        directions = normals / sizes[..., None]
    altitudes = np.where(inner, at_corners, np.inf).min(axis=1)
    angles = _angles(directions)[inner]
    lowest = int(np.argmin(altitudes))
    return MeshQuality(
        node_count=len(mesh.points),
        cell_count=len(mesh.cells),
        cell_kinds=_cell_kinds(mesh),
        smallest_altitude=float(altitudes[lowest]),
        smallest_altitude_cell=lowest,
        smallest_angle=float(angles.min()),
        largest_angle=float(angles.max()),
        worst_aspect_ratio=float(_best_altitude(mesh) * np.max(_longest(edges) / altitudes)),
        volume=float(signed_volumes(mesh.points, mesh.cells).sum()),
        piece_count=piece_count(mesh),
    )


# Names of cells by number of dimensions and of different corners.
_KINDS = {
    2: {3: "triangles", 4: "quadrilaterals"},
    3: {4: "tetrahedra", 5: "pyramids", 6: "wedges", 7: "hexahedra", 8: "hexahedra"},
}


def _cell_kinds(mesh: Mesh) -> dict[str, int]:
    nodes = np.sort(mesh.cells, axis=1)
    corners = 1 + (nodes[:, 1:] != nodes[:, :-1]).sum(axis=1)
    counts: dict[str, int] = {}
    for different, name in _KINDS[mesh.dimension].items():
        count = int((corners == different).sum())
        if count:
            counts[name] = counts.get(name, 0) + count
    return counts


def _check_coordinates(mesh: Mesh, labels: Labels | None) -> None:
    bad = np.flatnonzero(~np.isfinite(mesh.points).all(axis=1))
    if len(bad):
        raise MeshError(
            f"node {node_label(bad[0], labels)} has the coordinates "
            f"{mesh.points[bad[0]].tolist()}; finite numbers are needed ({len(bad)} such nodes)"
        )


def _check_numbers(mesh: Mesh) -> None:
    node_count, cell_count = len(mesh.points), len(mesh.cells)
    check_range("the cells", mesh.cells, "node", node_count)
    for kind, sets, what, count in (
        ("node set", mesh.node_sets, "node", node_count),
        ("facet set", mesh.facet_sets, "node", node_count),
        ("cell set", mesh.cell_sets, "cell", cell_count),
    ):
        for name, members in sets.items():
            if members.size == 0:
                raise MeshError(f"{kind} '{name}' is empty; add members or remove it")
            check_range(f"{kind} '{name}'", members, what, count)


def _check_nodes(mesh: Mesh, labels: Labels | None) -> None:
    loose = np.flatnonzero(np.bincount(mesh.cells.ravel(), minlength=len(mesh.points)) == 0)
    if len(loose):
        raise MeshError(
            f"node {node_label(loose[0], labels)} at {_place(mesh.points[loose[0]])} belongs to no "
            f"cell ({len(loose)} such nodes)",
            hint="remove it: it would have no mass",
        )
    tolerance = SAME_PLACE * float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    pairs = cKDTree(mesh.points).query_pairs(tolerance, output_type="ndarray")
    if len(pairs):
        first, second = min(map(tuple, np.sort(pairs, axis=1).tolist()))
        raise MeshError(
            f"nodes {node_label(first, labels)} and {node_label(second, labels)} are at the same "
            f"place, {_place(mesh.points[first])} ({len(pairs)} such pairs)",
            hint="merge them, otherwise the body is not connected there",
        )


def _check_volumes(mesh: Mesh, labels: Labels | None) -> None:
    volumes = signed_volumes(mesh.points, mesh.cells)
    edges, inner = corner_edges(mesh)
    size = _longest(edges) ** mesh.dimension
    shape = volumes / size
    at_corners = np.linalg.det(edges) / math.factorial(mesh.dimension) / size[:, None]
    bad = np.flatnonzero(~(shape > FLAT_CELL))
    if len(bad):
        cell = int(bad[0])
        fault, hint = _about_volume(float(shape[cell]), at_corners[cell][inner[cell]])
        measure, unit = ("area", "m^2") if mesh.dimension == 2 else ("volume", "m^3")
        raise MeshError(
            f"{cell_name(cell, labels)} at {_centre(mesh, cell)} is {fault}: "
            f"{measure} {volumes[cell]:.3g} {unit} ({len(bad)} such cells)",
            hint=hint,
        )
    bad, corner = np.nonzero(inner & ~(at_corners > FLAT_CELL))
    if len(bad):
        cell, node = int(bad[0]), int(mesh.cells[bad[0], corner[0]])
        fault = "inside out" if at_corners[cell, corner[0]] < -FLAT_CELL else "flat"
        raise MeshError(
            f"{cell_name(cell, labels)} at {_centre(mesh, cell)} is {fault} at its node "
            f"{node_label(node, labels)} ({len(np.unique(bad))} such cells)",
            hint="use less distorted, convex cells; or list the nodes in order around the cell",
        )


def _about_volume(shape: float, at_corners: np.ndarray) -> tuple[str, str]:
    """Return a description of a degenerate cell, and of a correct one.

    shape: its volume, and at_corners (k,) those of its corners, over the cube of its longest edge;
    in the plane areas over the square.
    """
    if (at_corners > FLAT_CELL).any() and (at_corners < -FLAT_CELL).any():
        return (
            "twisted, its sides cross each other",
            "list its nodes in order around it, counter-clockwise",
        )
    if shape < -FLAT_CELL:
        return "inverted", "list its nodes in the reverse order (in 2D counter-clockwise)"
    return "flat", "its nodes lie on a line or in a plane: move them apart"


def _check_overlaps(mesh: Mesh, labels: Labels | None) -> None:
    facets, owners = cell_facets(mesh.cells, mesh.dimension)
    facets = _from_smallest_node(facets)
    # Of two cells at a facet the one lists it as a -> b, the other as b -> a.
    order = np.lexsort(facets.T)
    same = np.flatnonzero((facets[order[1:]] == facets[order[:-1]]).all(axis=1))
    if len(same):
        pairs = np.sort(owners[np.column_stack([order[same], order[same + 1]])], axis=1)
        first, second = min(map(tuple, pairs.tolist()))
        raise MeshError(
            f"{cell_name(first, labels)} and {cell_name(second, labels)}, at "
            f"{_centre(mesh, first)} and {_centre(mesh, second)}, lie on the same side of a "
            f"common facet ({len(same)} such facets)",
            hint="a cell is listed twice, or the mesh overlaps itself",
        )


def _check_joints(mesh: Mesh, labels: Labels | None) -> None:
    """Raise MeshError if a quadrilateral of one cell meets triangles of others.

    Between them the body would be open. Any three corners of a quadrilateral on the boundary are
    those of no other facet.
    """
    boundary = mesh.facet_sets[SURFACE]
    if boundary.shape[1] < 4:
        return
    is_triangle = boundary[:, 3] == boundary[:, 2]
    triangles, others = boundary[is_triangle], boundary[~is_triangle]
    threes = np.sort(others[:, [[0, 1, 2], [1, 2, 3], [2, 3, 0], [3, 0, 1]]], axis=2)
    met = find_rows(threes.reshape(-1, 3), np.sort(triangles[:, :3], axis=1)).reshape(-1, 4)
    bad, corner = np.nonzero(met >= 0)
    if len(bad):
        pair = np.stack([others[bad[0]], triangles[met[bad[0], corner[0]]]])
        first, second = facet_owners(pair, mesh.cells)
        raise MeshError(
            f"{cell_name(first, labels)} and {cell_name(second, labels)}, at "
            f"{_centre(mesh, first)} and {_centre(mesh, second)}, meet with a quadrilateral "
            f"and a triangle ({len(np.unique(bad))} such quadrilaterals)",
            hint="use pyramids or wedges between hexahedra and tetrahedra, or mesh the body with "
            "one kind of cell",
        )


def _check_facets(mesh: Mesh) -> None:
    boundary = _from_smallest_node(mesh.facet_sets[SURFACE])
    for name, facets in mesh.facet_sets.items():
        bad = np.flatnonzero(find_rows(_from_smallest_node(facets), boundary) < 0)
        if len(bad):
            facet = facets[bad[0]]
            raise MeshError(
                f"facet set '{name}': facet {facet.tolist()} at "
                f"{_place(mesh.points[facet].mean(axis=0))} is not a boundary facet with the "
                "material to its left",
                hint="list the nodes of a facet in the order of its cell",
            )


def _from_smallest_node(facets: np.ndarray) -> np.ndarray:
    """Return the facets, orientation kept: those of space from their smallest node on.

    Edges are unchanged. A triangle among quadrilaterals still has its last corner twice.
    """
    corners = facets.shape[1]
    if corners == 2:
        return facets
    size = np.where(facets[:, -1:] == facets[:, -2:-1], 3, corners)
    turn = (np.argmin(facets, axis=1)[:, None] + np.arange(corners)) % size
    turn[:, 3:] = np.where(size == 3, turn[:, 2:3], turn[:, 3:])
    return np.take_along_axis(facets, turn, axis=1)


# Neighbours of each corner along its edges, in the order that makes their simplex positive, by
# number of dimensions and of corners.
_NEIGHBOURS = {
    (2, 3): np.array([[1, 2], [2, 0], [0, 1]]),
    (2, 4): np.array([[1, 3], [2, 0], [3, 1], [0, 2]]),
    (3, 4): np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]),
    (3, 8): np.array(
        [
            *([1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7]),
            *([7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]),
        ]
    ),
}
# Where the corners of a face have become one, the next corner that is not: across the face.
_ACROSS = np.array([2, 3, 0, 1, 6, 7, 4, 5])


def corner_edges(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges (m, corners, d, d) [m] from each corner of each cell, and a mask of corners.

    The mask (m, corners) is False where one of the corner's edges has collapsed to a point.
    """
    neighbours = _NEIGHBOURS[mesh.dimension, mesh.cells.shape[1]]
    own, ends = mesh.cells[:, :, None], mesh.cells[:, neighbours]
    if mesh.cells.shape[1] > mesh.dimension + 1:
        around = mesh.cells[:, _ACROSS[: len(neighbours)], None]
        ends[..., :2] = np.where(ends[..., :2] == own, around, ends[..., :2])
    edges = mesh.points[ends] - mesh.points[own]
    return edges, (ends != own).all(axis=2)


def _longest(edges: np.ndarray) -> np.ndarray:
    """Return the longest edge (m,) [m] of each cell, from its edges (m, corners, d, d)."""
    return np.linalg.norm(edges, axis=3).max(axis=(1, 2))


def _best_altitude(mesh: Mesh) -> float:
    """Return the altitude of the best cell of this kind with edges of length 1."""
    if mesh.cells.shape[1] > mesh.dimension + 1:
        return 1.0
    return float(np.sqrt(3 / 4) if mesh.dimension == 2 else np.sqrt(2 / 3))


def _normals_between(edges: np.ndarray) -> np.ndarray:
    """Return the inward normals (m, corners, d, d) of the sides at each corner.

    Their length is the area of the parallelograms of the edges, in the plane the length of the
    edge. Side i has all edges but edge i.
    """
    if edges.shape[-1] == 2:
        return np.stack([edges[..., 1, ::-1] * [1, -1], edges[..., 0, ::-1] * [-1, 1]], axis=-2)
    first, second, third = np.moveaxis(edges, 2, 0)
    return np.stack(
        [np.cross(second, third), np.cross(third, first), np.cross(first, second)], axis=-2
    )


def _angles(normals: np.ndarray) -> np.ndarray:
    """Return the angles [rad] between the sides at each corner, from unit normals."""
    first, second = np.triu_indices(normals.shape[2], k=1)
    cosines = -np.einsum("cpni,cpni->cpn", normals[:, :, first], normals[:, :, second])
    return np.arccos(np.clip(cosines, -1, 1))


def _centre(mesh: Mesh, cell: int) -> str:
    return _place(mesh.points[mesh.cells[cell]].mean(axis=0))


def _place(point: np.ndarray) -> str:
    return "(" + ", ".join(f"{1e3 * coordinate:.6g}" for coordinate in point) + ") mm"
