"""Whether a mesh can be computed with, and how well it is shaped."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from softsim.errors import MeshError
from softsim.mesh.mesh import Mesh, boundary_facets, signed_volumes

FLAT_CELL = 1e-9
"""A cell is flat when its volume is below this fraction of its longest edge cubed (2D: squared)."""

SAME_PLACE = 1e-9
"""Two nodes are one when they lie closer than this fraction of the bounding box's diagonal."""


@dataclass(frozen=True)
class MeshQuality:
    """Size and shape of a mesh.

    smallest_altitude [m] sets the stable time increment; it belongs to smallest_altitude_cell.
    smallest_angle, largest_angle [rad]: between the edges of a triangle, between the faces of a
        tetrahedron.
    worst_aspect_ratio: longest edge over smallest altitude, 1 for an equilateral cell.
    volume [m^3], in 2D the area [m^2].
    """

    node_count: int
    cell_count: int
    smallest_altitude: float
    smallest_altitude_cell: int
    smallest_angle: float
    largest_angle: float
    worst_aspect_ratio: float
    volume: float


def check(mesh: Mesh) -> None:
    """Raise MeshError, naming the cell, node or set and its place, if the mesh cannot be used.

    It cannot with: no cells, a coordinate that is not finite, a node or cell number out of range,
    an empty set, a node that belongs to no cell, two nodes in one place, a flat cell or an inverted
    one, a facet that is not on the boundary or is listed the wrong way round.
    """
    if len(mesh.cells) == 0:
        raise MeshError("the mesh has no cells")
    _check_coordinates(mesh)
    _check_numbers(mesh)
    _check_nodes(mesh)
    _check_volumes(mesh)
    _check_facets(mesh)


def quality(mesh: Mesh) -> MeshQuality:
    """Measure a mesh that has passed `check`."""
    volumes = signed_volumes(mesh.points, mesh.cells)
    normals = _facet_normals(mesh)
    sizes = np.linalg.norm(normals, axis=2)
    # Volume = base * altitude / dimension; the smallest altitude stands on the largest facet.
    altitudes = mesh.dimension * volumes / sizes.max(axis=1)
    angles = _angles(normals / sizes[:, :, None])
    equilateral = np.sqrt(3 / 4) if mesh.dimension == 2 else np.sqrt(2 / 3)
    lowest = int(np.argmin(altitudes))
    return MeshQuality(
        node_count=len(mesh.points),
        cell_count=len(mesh.cells),
        smallest_altitude=float(altitudes[lowest]),
        smallest_altitude_cell=lowest,
        smallest_angle=float(angles.min()),
        largest_angle=float(angles.max()),
        worst_aspect_ratio=float(equilateral * np.max(_longest_edges(mesh) / altitudes)),
        volume=float(volumes.sum()),
    )


def _check_coordinates(mesh: Mesh) -> None:
    bad = np.flatnonzero(~np.isfinite(mesh.points).all(axis=1))
    if len(bad):
        raise MeshError(
            f"node {bad[0]} has the coordinates {mesh.points[bad[0]].tolist()}; "
            f"finite numbers are needed ({len(bad)} such nodes)"
        )


def _check_numbers(mesh: Mesh) -> None:
    node_count, cell_count = len(mesh.points), len(mesh.cells)
    _check_range("the cells", mesh.cells, "node", node_count)
    for kind, sets, what, count in (
        ("node set", mesh.node_sets, "node", node_count),
        ("facet set", mesh.facet_sets, "node", node_count),
        ("cell set", mesh.cell_sets, "cell", cell_count),
    ):
        for name, members in sets.items():
            if members.size == 0:
                raise MeshError(f"{kind} '{name}' is empty; give it members or leave it out")
            _check_range(f"{kind} '{name}'", members, what, count)


def _check_range(owner: str, numbers: np.ndarray, what: str, count: int) -> None:
    outside = numbers[(numbers < 0) | (numbers >= count)]
    if outside.size:
        raise MeshError(
            f"{owner}: {what} number {outside.flat[0]} is out of range; "
            f"the mesh has {what}s 0 to {count - 1}"
        )


def _check_nodes(mesh: Mesh) -> None:
    loose = np.setdiff1d(np.arange(len(mesh.points)), mesh.cells)
    if len(loose):
        raise MeshError(
            f"node {loose[0]} at {_place(mesh.points[loose[0]])} belongs to no cell "
            f"({len(loose)} such nodes)",
            hint="remove it: it would have no mass",
        )
    tolerance = SAME_PLACE * float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    pairs = cKDTree(mesh.points).query_pairs(tolerance, output_type="ndarray")
    if len(pairs):
        first, second = min(map(tuple, np.sort(pairs, axis=1).tolist()))
        raise MeshError(
            f"nodes {first} and {second} lie in one place, {_place(mesh.points[first])} "
            f"({len(pairs)} such pairs)",
            hint="merge them, otherwise the body is cut open there",
        )


def _check_volumes(mesh: Mesh) -> None:
    volumes = signed_volumes(mesh.points, mesh.cells)
    shape = volumes / _longest_edges(mesh) ** mesh.dimension
    bad = np.flatnonzero(~(shape > FLAT_CELL))
    if len(bad):
        cell = int(bad[0])
        fault = "inverted" if shape[cell] < -FLAT_CELL else "flat"
        measure, unit = ("area", "m^2") if mesh.dimension == 2 else ("volume", "m^3")
        raise MeshError(
            f"cell {cell} at {_place(mesh.points[mesh.cells[cell]].mean(axis=0))} is {fault}: "
            f"{measure} {volumes[cell]:.3g} {unit} ({len(bad)} such cells)",
            hint="list its nodes counter-clockwise, and keep them apart",
        )


def _check_facets(mesh: Mesh) -> None:
    boundary = {_turned(facet) for facet in boundary_facets(mesh.cells).tolist()}
    for name, facets in mesh.facet_sets.items():
        for facet in facets.tolist():
            if _turned(facet) not in boundary:
                centre = mesh.points[facet].mean(axis=0)
                raise MeshError(
                    f"facet set '{name}': facet {facet} at {_place(centre)} is no boundary facet "
                    "with the material to its left",
                    hint="list the nodes of a facet in the order in which its cell lists them",
                )


def _turned(facet: list[int]) -> tuple[int, ...]:
    """The facet, its orientation kept: a triangle from its smallest node, an edge as it is."""
    start = facet.index(min(facet)) if len(facet) == 3 else 0
    return (*facet[start:], *facet[:start])


def _longest_edges(mesh: Mesh) -> np.ndarray:
    corners = mesh.points[mesh.cells]
    first, second = np.triu_indices(mesh.cells.shape[1], k=1)
    return np.linalg.norm(corners[:, first] - corners[:, second], axis=2).max(axis=1)


def _facet_normals(mesh: Mesh) -> np.ndarray:
    """Outward normals (cells, corners, d) of the facets, each as long as its facet is large."""
    corners = mesh.points[mesh.cells]
    if mesh.dimension == 2:
        edges = np.roll(corners, -1, axis=1) - corners
        return np.stack([edges[..., 1], -edges[..., 0]], axis=-1)
    a, b, c, d = corners.transpose(1, 0, 2)
    spans = ((c - b, d - b), (d - a, c - a), (b - a, d - a), (c - a, b - a))
    return 0.5 * np.stack([np.cross(u, v) for u, v in spans], axis=1)


def _angles(normals: np.ndarray) -> np.ndarray:
    """Angles [rad] between facets with the outward unit normals (cells, corners, d)."""
    first, second = np.triu_indices(normals.shape[1], k=1)
    cosines = -np.einsum("cpi,cpi->cp", normals[:, first], normals[:, second])
    return np.arccos(np.clip(cosines, -1, 1))


def _place(point: np.ndarray) -> str:
    return "(" + ", ".join(f"{1e3 * coordinate:.6g}" for coordinate in point) + ") mm"
