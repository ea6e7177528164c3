"""Meshes from files: gmsh .msh, VTK .vtu, ABAQUS .inp. The only user of meshio."""

import io
import logging
from collections import defaultdict
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.mesh import SURFACE, Mesh, boundary_facets, signed_volumes
from softsim.mesh.quality import check

if TYPE_CHECKING:
    import meshio

log = logging.getLogger(__name__)

_DIMENSION = {"vertex": 0, "line": 1, "triangle": 2, "tetra": 3}

_Group = dict[str, np.ndarray]
"""Cell type -> numbers of the group's cells among all cells of that type."""


def read_mesh(path: Path, length_unit: float = 1e-3) -> Mesh:
    """The body in a mesh file: its tetrahedra if it has any, otherwise its triangles.

    length_unit: metres in one unit of the file, 1e-3 for a mesh drawn in millimetres. Triangles
    must lie in a plane z = constant; z is dropped. Inverted cells are turned and nodes without a
    cell dropped; how many is logged.

    A named group (gmsh physical group, ABAQUS set) of cells gives a cell set, a group of lines (in
    3D: of triangles) on the boundary a facet set, oriented with the material to its left; either
    gives the node set of the same name too, unless the file has its own.

    Raises MeshError, naming the file, if it cannot be read, has cells of another kind (second
    order, quadrilaterals ...) or does not pass `softsim.mesh.quality.check`.
    """
    content = _content(Path(path))
    blocks = _blocks_by_type(content, path)
    dimension = 3 if "tetra" in blocks else 2
    cell_type, facet_type = ("tetra", "triangle") if dimension == 3 else ("triangle", "line")
    points = length_unit * _coordinates(content.points, dimension, path)
    cells = _turned_upright(points, blocks[cell_type], path)
    number = _new_numbers(len(points), cells, path)
    cells = number[cells]

    facet_sets: dict[str, np.ndarray] = {}
    cell_sets: dict[str, np.ndarray] = {}
    grouped_nodes: dict[str, list[np.ndarray]] = defaultdict(list)
    for name, group in _groups(content).items():
        for kind, members in group.items():
            nodes = number[blocks[kind][members]]
            grouped_nodes[name].append(nodes[nodes >= 0])
            if kind == cell_type:
                cell_sets[name] = members
            elif kind == facet_type:
                facets = _on_boundary(nodes, cells)
                if len(facets) == len(nodes):
                    facet_sets[name] = facets
                else:
                    log.warning("%s: '%s' is not on the boundary: a node set only", path, name)
    node_sets = {name: np.unique(np.concatenate(parts)) for name, parts in grouped_nodes.items()}
    for name, nodes in content.point_sets.items():
        renamed = number[np.asarray(nodes, dtype=np.int64)]
        node_sets[name] = renamed[renamed >= 0]
    if SURFACE in node_sets:
        raise MeshError(
            f"{path}: the name '{SURFACE}' is kept for the whole boundary",
            hint="rename this set in the file",
        )
    mesh = Mesh(points[number >= 0], cells, node_sets, facet_sets, cell_sets)
    try:
        check(mesh)
    except MeshError as fault:
        raise MeshError(f"{path}: {fault.message}", hint=fault.hint) from fault
    return mesh


def _content(path: Path) -> "meshio.Mesh":
    import meshio  # takes longer to import than the rest of this package

    if not path.is_file():
        raise MeshError(f"{path}: no such mesh file", hint="check the path and its spelling")
    said = io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(io.StringIO()):
            return meshio.read(path)
    # meshio passes on whatever its parsers stumble over; when no parser is left it prints the
    # cause and exits.
    except (Exception, SystemExit) as fault:
        cause = said.getvalue().strip() or f"{type(fault).__name__}: {fault}"
        raise MeshError(
            f"{path}: cannot be read as a mesh ({cause})",
            hint="formats: .msh, .vtu, and .inp with elements CPS3 or C3D4 (CPE3 is unknown to the "
            "reader: rename it); otherwise the file is damaged",
        ) from fault


def _blocks_by_type(content: "meshio.Mesh", path: Path) -> dict[str, np.ndarray]:
    """All cells of each type, (m, corners)."""
    unknown = sorted({block.type for block in content.cells} - set(_DIMENSION))
    if unknown:
        raise MeshError(
            f"{path}: cells of type {', '.join(unknown)}; only linear triangles and tetrahedra "
            "are computed with",
            hint="mesh with first-order triangles or tetrahedra",
        )
    parts: dict[str, list[np.ndarray]] = defaultdict(list)
    for block in content.cells:
        parts[block.type].append(np.asarray(block.data, dtype=np.int64))
    if not {"triangle", "tetra"} & set(parts):
        raise MeshError(
            f"{path}: holds no triangles and no tetrahedra",
            hint="in gmsh, a file with physical groups holds only what belongs to one",
        )
    return {kind: np.concatenate(blocks) for kind, blocks in parts.items()}


def _coordinates(points: np.ndarray, dimension: int, path: Path) -> np.ndarray:
    points = np.asarray(points, dtype=np.float64)
    if dimension == 2 and points.shape[1] == 3:
        if np.ptp(points[:, 2]) > 1e-9 * np.ptp(points, axis=0).max():
            raise MeshError(
                f"{path}: triangles at z from {points[:, 2].min():g} to {points[:, 2].max():g}; "
                "a plane body lies in one plane z = constant"
            )
        return points[:, :2]
    return points


def _turned_upright(points: np.ndarray, cells: np.ndarray, path: Path) -> np.ndarray:
    """The cells, inverted ones with two nodes exchanged."""
    inverted = signed_volumes(points, cells) < 0
    if inverted.any():
        log.warning("%s: turned %d inverted cells of %d", path, inverted.sum(), len(cells))
    cells = cells.copy()
    cells[inverted, :2] = cells[inverted, 1::-1]
    return cells


def _new_numbers(node_count: int, cells: np.ndarray, path: Path) -> np.ndarray:
    """Numbers (node_count,) that count only nodes of cells; -1 for the others."""
    used = np.unique(cells)
    if len(used) < node_count:
        log.warning("%s: dropped %d nodes that belong to no cell", path, node_count - len(used))
    number = np.full(node_count, -1)
    number[used] = np.arange(len(used))
    return number


def _groups(content: "meshio.Mesh") -> dict[str, _Group]:
    """The named groups of cells."""
    groups: dict[str, _Group] = defaultdict(dict)
    starts = _block_starts(content)
    for name, members in content.cell_sets.items():
        if name.startswith("gmsh:"):  # meshio's own bookkeeping
            continue
        for block, start, chosen in zip(content.cells, starts, members, strict=True):
            if chosen is not None and len(chosen):
                _add(groups[name], block.type, start + np.asarray(chosen, dtype=np.int64))
    tags = content.cell_data.get("gmsh:physical", [])
    for name, (tag, dimension) in content.field_data.items():
        if name in content.cell_sets:
            continue
        for block, start, block_tags in zip(content.cells, starts, tags, strict=False):
            chosen = np.flatnonzero(np.asarray(block_tags) == tag)
            if _DIMENSION[block.type] == dimension and len(chosen):
                _add(groups[name], block.type, start + chosen)
    return dict(groups)


def _block_starts(content: "meshio.Mesh") -> list[int]:
    """Number of each block's first cell among all cells of its type."""
    counted: dict[str, int] = defaultdict(int)
    starts = []
    for block in content.cells:
        starts.append(counted[block.type])
        counted[block.type] += len(block.data)
    return starts


def _add(group: _Group, kind: str, members: np.ndarray) -> None:
    group[kind] = np.concatenate([group.get(kind, members[:0]), members])


def _on_boundary(facets: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Those of the facets that lie on the boundary, with the material to their left."""
    boundary = {frozenset(facet): facet for facet in boundary_facets(cells).tolist()}
    found = [boundary.get(frozenset(facet)) for facet in facets.tolist()]
    return np.array([facet for facet in found if facet], dtype=np.int64).reshape(
        -1, facets.shape[1]
    )
