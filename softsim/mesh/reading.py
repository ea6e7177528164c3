"""Meshes from files: gmsh .msh, VTK .vtu, ABAQUS .inp."""

import logging
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.abaqus import read_abaqus
from softsim.mesh.content import Content
from softsim.mesh.gmsh_vtk import read_gmsh_vtk
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

log = logging.getLogger(__name__)

FORMATS = (".msh", ".vtu", ".inp")
"""File name extensions of the formats that are read: gmsh, VTK and ABAQUS."""
CAD = (".step", ".stp", ".iges", ".igs", ".brep")
SURFACES = (".stl", ".obj", ".ply", ".off")

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
    length_unit: float = 1e-3,
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
    elif suffix in SURFACES:
        what = "is a closed surface of triangles, not a volume mesh"
    else:
        return MeshError(
            f"{path}: this mesh format is not supported", hint="formats: " + ", ".join(FORMATS)
        )
    return MeshError(f"{path}: {what}", hint=_remedy(path, suffix))


def _remedy(path: Path, suffix: str) -> str:
    """Return the commands that make a volume mesh of what a file holds."""
    made, source = path.with_suffix(".msh").name, path.name
    if suffix in CAD:
        return (
            "make a volume mesh first, for example "
            f"`gmsh -3 {source} -o {made} -clmax 2.5` (largest element size in mm)"
        )
    script = path.with_suffix(".geo").name
    return (
        f'make a volume mesh first, for example with the script {script}: `Merge "{source}"; '
        "Surface Loop(1) = {1}; Volume(1) = {1};` and `gmsh -3 "
        f"{script} -o {made}`"
    )


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
