"""Meshes from files: gmsh .msh, VTK .vtu, ABAQUS .inp."""

import logging
import re
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.abaqus import read_abaqus
from softsim.mesh.content import Content, meshio_mesh
from softsim.mesh.mesh import (
    SURFACE,
    Mesh,
    boundary_facets,
    facet_keys,
    find_rows,
    of_one_kind,
    signed_volumes,
    turned,
)
from softsim.mesh.quality import (
    Labels,
    cell_name,
    check,
    check_range,
    node_label,
    piece_count,
)

if TYPE_CHECKING:
    import meshio


# -------------------------------------------------------------------------------------------------
# Bodies from gmsh .msh and VTK .vtu files.

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


log = logging.getLogger(__name__)

FORMATS = (".msh", ".vtu", ".inp")
"""File name extensions of the formats that are read: gmsh, VTK and ABAQUS."""
CAD = (".step", ".stp", ".iges", ".igs", ".brep")
GEOMETRY = (*CAD, ".stl", ".geo")
"""File name extensions of geometry that `softsim.mesh.cad` meshes."""
SURFACES = (".stl", ".obj", ".ply", ".off")
MILLIMETRE = 1e-3
"""Default unit of length of a mesh file [m]."""

_Sets = dict[str, np.ndarray]


@dataclass(frozen=True)
class MeshFile:
    """Body in a mesh file, and what was changed to make it valid.

    element_type: CPE3, CAX4R and the like, ABAQUS's type of the first element (a hybrid one without
        its H), "" if the file names no formulation (.msh, .vtu).
    turned_cells: number of inverted cells that have been turned.
    dropped_nodes: number of reference points of an assembly that have been left out.
    midside_nodes: number of mid-side nodes of second-order cells that have been left out.
    not_read: what the file contains besides the body, see `Content`.
    """

    mesh: Mesh
    element_type: str = ""
    turned_cells: int = 0
    dropped_nodes: int = 0
    midside_nodes: int = 0
    not_read: tuple[str, ...] = ()

    @property
    def changes(self) -> tuple[str, ...]:
        """Messages about what reading the file changed."""
        counted = {
            "inverted cells turned": self.turned_cells,
            "reference points ignored": self.dropped_nodes,
            "mid-side nodes dropped": self.midside_nodes,
        }
        return tuple(f"{count} {what}" for what, count in counted.items() if count)


def read_mesh(
    path: Path,
    length_unit: float = MILLIMETRE,
    instance: str | None = None,
    *,
    reduce_order: bool = False,
) -> MeshFile:
    """Return the body in a mesh file: its cells in space if it has any, otherwise its plane cells.

    Cells in space are tetrahedra, pyramids, wedges and hexahedra, plane cells triangles and
    quadrilaterals.

    length_unit: metres in one unit of the file, 1e-3 for a mesh drawn in millimetres. instance:
    instance of an ABAQUS file, see `read_abaqus`. reduce_order: read second-order cells as linear
    ones, without their mid-side nodes. Triangles and quadrilaterals must lie in a plane z =
    constant; z is dropped. Inverted cells are turned and reference points dropped; a warning is
    logged about either, and about a body in several pieces.

    A set of cells (gmsh physical group, ABAQUS element set) gives a cell set; a group of lines (in
    3D: of triangles and quadrilaterals) or an ABAQUS surface gives a facet set, oriented with the
    material to its left, if all of it lies on the boundary. Either gives the node set of the same
    name too (the surface's nodes where there are both), unless the file has its own. In names,
    everything but letters, digits, - and _ becomes _.

    Raises MeshError, naming the file, if it cannot be read, has cells of another kind, mixes
    dimensions or formulations, has an empty set or a node without a cell, or does not pass
    `softsim.mesh.quality.check`.
    """
    path = Path(path)
    if not path.is_file():
        raise MeshError(f"{path}: file not found", hint="check the path and its spelling")
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise _no_mesh(path, suffix)
    if suffix == ".inp":
        content = read_abaqus(path, instance, reduce_order=reduce_order)
    elif instance is not None:
        raise MeshError(
            f"{path}: has no instances",
            hint="the key `instance` applies to ABAQUS files (.inp) only",
        )
    else:
        content = read_gmsh_vtk(path, reduce_order=reduce_order)
    try:
        return _made_fit(content, length_unit, path)
    except MeshError as fault:
        raise MeshError(f"{path}: {fault.message}", hint=fault.hint) from fault


def _no_mesh(path: Path, suffix: str) -> MeshError:
    """Return the error for a file without a mesh of a body, or with one that cannot be read."""
    if suffix in CAD:
        what = "is CAD geometry, not a mesh"
    elif suffix == ".geo":
        what = "is a script for gmsh, not a mesh"
    elif suffix in SURFACES:
        what = "is a closed surface of triangles, not a volume mesh"
    else:
        return MeshError(
            f"{path}: this mesh format is not supported", hint="formats: " + ", ".join(FORMATS)
        )
    if suffix not in GEOMETRY:
        return MeshError(f"{path}: {what}", hint="convert it to STL and mesh it: `softsim mesh`")
    hint = f"make a volume mesh first: `softsim mesh {path.name} --size 1mm`"
    if suffix != ".geo":
        hint += f"; or give the size in the scene: {{file: {path.name}, size: 1 mm}}"
    return MeshError(f"{path}: {what}", hint=hint)


def _made_fit(content: Content, length_unit: float, path: Path) -> MeshFile:
    check_range("the cells", content.cells, "node", len(content.points))
    used = np.unique(content.cells)
    number = np.full(len(content.points), -1)
    number[used] = np.arange(len(used))
    points = length_unit * _coordinates(content.points[used], content.dimension)
    labels = content.labels and Labels(content.labels.nodes[used], content.labels.cells)
    cells = number[content.cells]
    inverted = np.flatnonzero(signed_volumes(points, cells) < 0)
    cells[inverted] = turned(cells[inverted], content.dimension)
    dropped = np.flatnonzero(number < 0)
    midside = np.intersect1d(dropped, content.midside_nodes)
    dropped = np.setdiff1d(dropped, midside)
    refuse_loose_nodes(np.setdiff1d(dropped, content.reference_nodes), content)

    cell_sets = _plain_names(content.cell_sets)
    facet_sets = {}
    implied = {name: np.unique(cells[members]) for name, members in cell_sets.items()}
    boundary = boundary_facets(cells, content.dimension)
    for name, members in _plain_names(content.facet_sets).items():
        facets = number[members]
        implied[name] = np.unique(facets)
        rows = facet_keys(of_one_kind([boundary, facets], 2))
        found = find_rows(rows[len(boundary) :], rows[: len(boundary)])
        if (found >= 0).all():
            facet_sets[name] = boundary[np.unique(found)]
        else:
            log.warning("%s: '%s' is not on the boundary: it is a node set only", path, name)
    node_sets = {**implied, **_node_sets(_plain_names(content.node_sets), number, path)}
    if SURFACE in node_sets:
        raise MeshError(
            f"the name '{SURFACE}' is reserved for the whole boundary",
            hint="rename this set in the file",
        )
    mesh = Mesh(points, cells, node_sets, facet_sets, cell_sets)
    check(mesh, labels)

    if len(inverted):
        log.warning(
            "%s: turned %d inverted cells of %d, the first one is %s",
            *(path, len(inverted), len(cells), cell_name(int(inverted[0]), labels)),
        )
    if len(dropped):
        log.warning(
            "%s: dropped %d reference points, the first one is node %d",
            *(path, len(dropped), node_label(int(dropped[0]), content.labels)),
        )
    pieces = piece_count(mesh)
    if pieces > 1:
        log.warning("%s: the body consists of %d pieces that share no node", path, pieces)
    return MeshFile(
        mesh, content.element_type, len(inverted), len(dropped), len(midside), content.not_read
    )


def refuse_loose_nodes(loose: np.ndarray, content: Content) -> None:
    """Raise MeshError for a node that belongs to no cell, which would have no mass."""
    if len(loose):
        place = ", ".join(f"{c:g}" for c in content.points[loose[0]])
        raise MeshError(
            f"node {node_label(int(loose[0]), content.labels)} at ({place}) in the file's unit "
            f"belongs to no cell ({len(loose)} such nodes)",
            hint="remove it; in ABAQUS files a reference point belongs to the *ASSEMBLY, outside "
            "the part; gmsh writes such nodes only with Mesh.SaveAll",
        )


def _coordinates(points: np.ndarray, dimension: int) -> np.ndarray:
    points = np.asarray(points, dtype=np.float64)
    if dimension == 2 and points.shape[1] == 3:
        if np.ptp(points[:, 2]) > 1e-9 * np.ptp(points, axis=0).max():
            raise MeshError(
                f"plane cells with z from {points[:, 2].min():g} to {points[:, 2].max():g}; a 2D "
                "body must lie in one plane z = constant",
                hint="a 3D body needs a volume mesh of tetrahedra or hexahedra: use gmsh -3, "
                "with the volume in a physical group or without groups",
            )
        return points[:, :2]
    return points


def _node_sets(sets: _Sets, number: np.ndarray, path: Path) -> _Sets:
    """Return the sets with the nodes' new numbers (old -> new, -1 for a node that is left out)."""
    kept = {}
    for name, nodes in sets.items():
        check_range(f"node set '{name}'", nodes, "node", len(number))
        renamed = number[nodes]
        kept[name] = np.unique(renamed[renamed >= 0])
        if len(nodes) and not len(kept[name]):
            # A reference point, say: a set that ABAQUS needs and the body does not.
            log.warning("%s: node set '%s' is ignored: no cell has its nodes", path, name)
            del kept[name]
    return kept


def _plain_names(sets: _Sets) -> _Sets:
    """Return the sets under names that a scene can contain; two must not become one."""
    plain: _Sets = {}
    before: dict[str, str] = {}
    for name, members in sets.items():
        short = re.sub(r"[^A-Za-z0-9_-]", "_", name)
        if short in plain:
            raise MeshError(
                f"the sets '{before[short]}' and '{name}' would both be called '{short}'",
                hint="rename one of them in the file",
            )
        plain[short], before[short] = members, name
    return plain


# -------------------------------------------------------------------------------------------------
# Reading of points of a line in the plane from a text table.


def read_points(path: Path, length_unit: float) -> np.ndarray:
    """Return points (n, 2) [m] from a file with x and y in each line.

    They are separated by a comma, a semicolon, a tab or blanks. length_unit: metres in one unit of
    the file. Empty lines and text after a # are skipped, as is a first line without any number,
    which names the columns.

    Raises MeshError, naming file and line, if it cannot be read or a line has not two numbers.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise MeshError(
            f"{path}: cannot be read as a table of points ({error})",
            hint="use a text file with x and y of one point per line",
        ) from error
    points: list[list[float]] = []
    seen = 0
    for number, line in enumerate(lines, start=1):
        words = [word for word in re.split(r"[;,\s]+", line.partition("#")[0]) if word]
        if not words:
            continue
        seen += 1
        values = [_value(word) for word in words]
        if seen == 1 and not any(np.isfinite(values)):
            continue
        if len(values) != 2 or not np.isfinite(values).all():
            raise MeshError(
                f"{path}:{number}: '{line.strip()}' is not a point",
                hint="write two numbers, x and y, separated by a comma, a semicolon, a tab or "
                "spaces",
            )
        points.append(values)
    return length_unit * np.array(points).reshape(-1, 2)


def _value(word: str) -> float:
    """Return the number that a word represents, NaN if it is none."""
    try:
        return float(word)
    except ValueError:
        return float("nan")
