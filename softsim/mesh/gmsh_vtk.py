"""Bodies from gmsh .msh and VTK .vtu files."""

from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.content import Content
from softsim.mesh.file_reading import meshio_mesh
from softsim.mesh.mesh import of_one_kind

if TYPE_CHECKING:
    import meshio

_DIMENSION = {
    "vertex": 0,
    "line": 1,
    "triangle": 2,
    "quad": 2,
    "tetra": 3,
    "pyramid": 3,
    "wedge": 3,
    "hexahedron": 3,
}

_LINEAR = {
    "line3": ("line", 2),
    "triangle6": ("triangle", 3),
    "triangle7": ("triangle", 3),
    "quad8": ("quad", 4),
    "quad9": ("quad", 4),
    "tetra10": ("tetra", 4),
    "pyramid13": ("pyramid", 5),
    "pyramid14": ("pyramid", 5),
    "wedge15": ("wedge", 6),
    "wedge18": ("wedge", 6),
    "hexahedron20": ("hexahedron", 8),
    "hexahedron27": ("hexahedron", 8),
}
"""Second-order cell type -> linear type of its corners, which come first, and their number."""

_Group = dict[str, np.ndarray]
"""Cell type -> numbers of the group's cells among all cells of that type."""


def read_gmsh_vtk(path: Path, *, reduce_order: bool = False) -> Content:
    """Return the body in a mesh file: its cells in space if it has any, otherwise its plane cells.

    Cells of each type are together. reduce_order: read second-order cells as linear ones, without
    their mid-side nodes.

    Sets are gmsh's physical groups, and in a .vtu file the integer arrays that mark members: an
    array "tip" of zeros and ones, or what meshio makes of its sets, an array "tip-root" of 0 (tip),
    1 (root) and -1 (neither).

    Raises MeshError if the file cannot be read, has cells that are not linear, plane cells or lines
    apart from the body, or a set without members.
    """
    mesh = meshio_mesh(path, "formats: gmsh .msh, VTK .vtu, ABAQUS .inp")
    midside = _drop_midside_nodes(mesh) if reduce_order else np.zeros(0, dtype=np.int64)
    blocks = _blocks_by_type(mesh, path)
    dimension = max(_DIMENSION[kind] for kind in blocks)
    body = [kind for kind in blocks if _DIMENSION[kind] == dimension]
    cells = of_one_kind([blocks[kind] for kind in body], dimension)
    first = dict(zip(body, np.cumsum([0, *(len(blocks[kind]) for kind in body)]), strict=False))
    for kind in blocks:
        if 0 < _DIMENSION[kind] < dimension:
            _refuse_apart(mesh, kind, blocks, body, path)
    content = Content(mesh.points, cells, dimension, midside_nodes=midside)
    for name, group in _groups(mesh, path).items():
        members = {kind: blocks[kind][chosen] for kind, chosen in group.items()}
        of_body = [first[kind] + chosen for kind, chosen in group.items() if kind in body]
        facets = [m for kind, m in members.items() if _DIMENSION[kind] == dimension - 1]
        others = [m.ravel() for kind, m in members.items() if _DIMENSION[kind] < dimension - 1]
        if of_body:
            content.cell_sets[name] = np.sort(np.concatenate(of_body))
        if facets:
            content.facet_sets[name] = of_one_kind(facets, 2)
        if others:
            content.node_sets[name] = np.unique(np.concatenate(others))
    for name, values in mesh.point_data.items():
        for member_name, nodes in _members(name, values, path).items():
            content.node_sets[member_name] = nodes
    for name, nodes in mesh.point_sets.items():
        content.node_sets[name] = np.asarray(nodes, dtype=np.int64)
    return content


def _drop_midside_nodes(mesh: "meshio.Mesh") -> np.ndarray:
    """Make second-order cells of a mesh linear and return the numbers of their mid-side nodes."""
    left_out = [np.zeros(0, dtype=np.int64)]
    for block in mesh.cells:
        if block.type in _LINEAR:
            block.type, corners = _LINEAR[block.type]
            left_out.append(np.unique(block.data[:, corners:]).astype(np.int64))
            block.data = block.data[:, :corners]
    return np.unique(np.concatenate(left_out))


def _blocks_by_type(mesh: "meshio.Mesh", path: Path) -> dict[str, np.ndarray]:
    """Return all cells of each type, (m, corners)."""
    unknown = sorted({block.type for block in mesh.cells} - set(_DIMENSION))
    if unknown:
        linear = "mesh with first-order triangles, quadrilaterals, tetrahedra or hexahedra"
        reducible = "write reduce_order: true next to the file name to drop their mid-side "
        raise MeshError(
            f"{path}: cells of type {', '.join(unknown)} are not supported; elements must be "
            "linear",
            hint=linear if set(unknown) - set(_LINEAR) else f"{reducible}nodes, or {linear}",
        )
    parts: dict[str, list[np.ndarray]] = defaultdict(list)
    for block in mesh.cells:
        parts[block.type].append(np.asarray(block.data, dtype=np.int64))
    if not any(_DIMENSION[kind] > 1 for kind in parts):
        raise MeshError(
            f"{path}: contains no triangles, quadrilaterals or 3D cells",
            hint="if a gmsh model has physical groups, only their members are written to the file",
        )
    return {kind: np.concatenate(blocks) for kind, blocks in parts.items()}


def _refuse_apart(
    mesh: "meshio.Mesh", kind: str, blocks: dict[str, np.ndarray], body: list[str], path: Path
) -> None:
    """Raise MeshError for lines and plane cells that lie neither on nor in the body."""
    nodes = np.concatenate([blocks[of_body].ravel() for of_body in body])
    apart = np.flatnonzero(~np.isin(blocks[kind], nodes).all(axis=1))
    if len(apart):
        where = np.asarray(mesh.points)[blocks[kind][apart[0]]].mean(axis=0).tolist()
        raise MeshError(
            f"{path}: mixed dimensions: {kind} {apart[0]} at {where} has a node that belongs to "
            f"no {' or '.join(body)} ({len(apart)} such cells)",
            hint="remove what is not part of the body, or write it to a separate file",
        )


def _groups(mesh: "meshio.Mesh", path: Path) -> dict[str, _Group]:
    """Return the named groups of cells."""
    groups: dict[str, _Group] = defaultdict(dict)
    starts = _block_starts(mesh)
    for name, members in mesh.cell_sets.items():
        if name.startswith("gmsh:"):  # meshio's own bookkeeping
            continue
        for block, start, chosen in zip(mesh.cells, starts, members, strict=True):
            _add(groups[name], block.type, start, chosen)
    tags = mesh.cell_data.get("gmsh:physical", [])
    # Field data of a .vtu file are no groups, but the time and the like.
    named_tags = mesh.field_data if tags else {}
    for name, (tag, dimension) in named_tags.items():
        if name in mesh.cell_sets:
            continue
        groups[name] = {}
        for block, start, block_tags in zip(mesh.cells, starts, tags, strict=False):
            if _DIMENSION[block.type] == dimension:
                _add(groups[name], block.type, start, np.flatnonzero(block_tags == tag))
    for name, values in mesh.cell_data.items():
        if name.startswith("gmsh:"):
            continue
        kinds = np.repeat([block.type for block in mesh.cells], [len(v) for v in values])
        numbers = np.concatenate(
            [np.arange(s, s + len(v)) for s, v in zip(starts, values, strict=True)]
        )
        for member_name, chosen in _members(name, np.concatenate(values), path).items():
            for kind in _DIMENSION:
                of_kind = chosen[kinds[chosen] == kind]
                _add(groups[member_name], kind, 0, numbers[of_kind])
    for name, group in groups.items():
        if not group:
            raise _empty(name, path)
    return dict(groups)


def _members(name: str, values: np.ndarray, path: Path) -> dict[str, np.ndarray]:
    """Return the sets in a data array, name -> positions; none if it does not mark members."""
    values = np.asarray(values)
    # VTK's own arrays, vtkGhostType and the like, are no sets.
    if name.startswith("vtk") or values.size != len(values) or values.dtype.kind not in "iub":
        return {}
    values = values.ravel().astype(np.int64)
    names = name.split("-")
    if values.min() == -1 and values.max() < len(names):
        sets = {part: np.flatnonzero(values == number) for number, part in enumerate(names)}
    elif values.min() >= 0 and values.max() <= 1:
        sets = {name: np.flatnonzero(values)}
    else:
        return {}
    for part, chosen in sets.items():
        if not len(chosen):
            raise _empty(part, path)
    return sets


def _empty(name: str, path: Path) -> MeshError:
    return MeshError(f"{path}: the set '{name}' is empty", hint="give it members or leave it out")


def _block_starts(mesh: "meshio.Mesh") -> list[int]:
    """Return the number of each block's first cell among all cells of its type."""
    counted: dict[str, int] = defaultdict(int)
    starts = []
    for block in mesh.cells:
        starts.append(counted[block.type])
        counted[block.type] += len(block.data)
    return starts


def _add(group: _Group, kind: str, start: int, chosen: np.ndarray | None) -> None:
    """Add a block's chosen cells to the group."""
    if chosen is not None and len(chosen):
        members = start + np.asarray(chosen, dtype=np.int64)
        group[kind] = np.concatenate([group.get(kind, members[:0]), members])
