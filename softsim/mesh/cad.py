"""Meshes of solids from geometry: STEP, IGES, BREP, STL and gmsh scripts, meshed by gmsh.

Two surfaces are named in a mesh. A planar end is what lies in the lowest or highest plane of an
axis: x_min, x_max, ... A chamber is a part of the boundary that encloses space outside the
material: a closed cavity, or a pocket whose only opening lies in a planar end.
"""

import hashlib
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.sparse.csgraph import connected_components

from softsim.errors import MeshError
from softsim.mesh.mesh import (
    SURFACE,
    Mesh,
    facet_keys,
    facet_owners,
    facets_on,
    find_rows,
    incidence,
    open_rim,
    simplex_facets,
)
from softsim.mesh.reading import CAD, GEOMETRY, MILLIMETRE, read_mesh
from softsim.mesh.surface import CellKind, read_surface, signed_volume

log = logging.getLogger(__name__)

VERSION = 1
"""Version of the meshes that this module makes; a new one invalidates stored meshes."""

MOST_CELLS = 5e6
"""Estimated number of tetrahedra above which a size is refused."""

IN_PLANE = 1e-5
"""Distance of a node from a planar end over the bounding box's diagonal; STL has single precision.
"""

SAME_SHAPE = 1e-6
"""Relative difference of the volumes of a solid and of its swept end face."""

SMALLEST_IN_MM = 2.0
"""Longest side [mm] of a part below which a file without a unit is taken to be in metres."""

SHARP = np.radians(40.0)
"""Angle between triangles of an STL file above which their common side is an edge of the part."""

# -------------------------------------------------------------------------------------------------
# Chambers and planar ends of a mesh.

END_NAMES = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")


@dataclass(frozen=True)
class Chamber:
    """Chamber of a mesh.

    name: of its facet set. volume [m^3]: enclosed, by a plane over its opening if it has one.
    opening: name of the planar end in which it is open, "" for a closed cavity.
    thin: fraction of its facets where the wall is a single tetrahedron thick, 0 for hexahedra.
    """

    name: str
    volume: float
    opening: str
    thin: float


def chambers(mesh: Mesh) -> list[Chamber]:
    """Return the chambers of a mesh whose sets have been named, in the order of their names."""
    found = []
    ends = [name for name in END_NAMES if name in mesh.node_sets]
    for name, facets in mesh.facet_sets.items():
        rim = np.unique(open_rim(facets))
        opening = next((e for e in ends if np.isin(rim, mesh.node_sets[e]).all()), None)
        if name.startswith("chamber") and (len(rim) == 0 or opening):
            thin = 0.0
            if mesh.cells.shape[1] == 4:
                others = np.setdiff1d(mesh.node_sets[SURFACE], facets)
                owners = mesh.cells[facet_owners(facets, mesh.cells)]
                thin = float(np.isin(owners, others).any(axis=1).mean())
            volume = -_volume(mesh.points, facets, rim)
            found.append(Chamber(name, volume, (opening or "") if len(rim) else "", thin))
    return sorted(found, key=lambda chamber: (len(chamber.name), chamber.name))


def with_named_surfaces(mesh: Mesh) -> Mesh:
    """Return the mesh of a solid with facet sets and node sets of its planar ends and chambers.

    Chambers are numbered along the longest side of the bounding box: chamber1, chamber2, ... Sets
    of the same names that the mesh has already are kept.

    Raises MeshError for a plane mesh.
    """
    if mesh.dimension != 3:
        raise MeshError(
            "the mesh is plane: ends and chambers are named in solids only",
            hint="name curves of a plane mesh in the program that made it, or sets in the scene",
        )
    boundary = mesh.facet_sets[SURFACE]
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    tolerance = IN_PLANE * float(np.linalg.norm(high - low))
    ends = {}
    for axis, letter in enumerate("xyz"):
        for name, place in (("min", low[axis]), ("max", high[axis])):
            nodes = np.flatnonzero(np.abs(mesh.points[:, axis] - place) < tolerance)
            facets = facets_on(boundary, nodes)
            if len(facets):
                ends[f"{letter}_{name}"] = facets
    surfaces = _cavities_and_pockets(mesh.points, boundary, ends)
    axis = int(np.argmax(high - low))
    surfaces.sort(key=lambda facets: float(mesh.points[np.unique(facets), axis].mean()))
    named = ends | {f"chamber{k}": facets for k, facets in enumerate(surfaces, start=1)}
    return replace(
        mesh,
        facet_sets=named | mesh.facet_sets,
        node_sets={name: np.unique(facets) for name, facets in named.items()} | mesh.node_sets,
    )


def _cavities_and_pockets(
    points: np.ndarray, boundary: np.ndarray, ends: dict[str, np.ndarray]
) -> list[np.ndarray]:
    """Return the facets of each closed cavity, and of each pocket that is open in a planar end.

    Without the facets of the end, the outer surface falls apart into what is left of it and the
    pockets.
    """
    found = []
    for shell in _connected(boundary, len(points)):
        if _volume(points, shell, shell[:0]) < 0.0:
            found.append(shell)
            continue
        for end in ends.values():
            rest = shell[find_rows(facet_keys(shell), facet_keys(end)) < 0]
            parts = _connected(rest, len(points))
            parts.sort(key=lambda part: float(np.ptp(points[np.unique(part)], axis=0).sum()))
            found += [p for p in parts[:-1] if _volume(points, p, np.unique(open_rim(p))) < 0.0]
    return found


def _connected(facets: np.ndarray, node_count: int) -> list[np.ndarray]:
    """Return the parts of a surface that share no node."""
    if not len(facets):
        return []
    nodes = incidence(facets, node_count)
    count, labels = connected_components(nodes @ nodes.T, directed=False)
    return [facets[labels == part] for part in range(count)]


def _volume(points: np.ndarray, facets: np.ndarray, rim: np.ndarray) -> float:
    """Return the volume [m^3] inside facets with outward normals; negative around a chamber.

    rim: nodes of a plane opening, empty for a closed surface. Seen from a point in its plane, a lid
    over the opening adds nothing.
    """
    triangles, _ = simplex_facets(facets)
    origin = points[rim[0]] if len(rim) else points[facets[0, 0]]
    return float(np.linalg.det(points[triangles] - origin).sum() / 6.0)


# -------------------------------------------------------------------------------------------------
# Meshing by gmsh.


def mesh_solid(
    source: Path,
    target: Path,
    size: float,
    length_unit: float | None = None,
    cells: CellKind = "simplex",
) -> Mesh:
    """Mesh the solid in a geometry file, name its surfaces, write the mesh in mm and return it.

    target: .msh file to write. size [m]: longest edge of the cells, approximately. length_unit:
    metres in one unit of the file; None takes millimetres, or metres for a very small part, with a
    warning. STEP and IGES files state their unit. cells: "quad" makes hexahedra of a solid that is
    swept along x, y or z.

    Several solids in a STEP, IGES or BREP file are joined where they touch and become the cell sets
    solid1, solid2, ...

    Raises MeshError if gmsh is not installed, the file has no solid, or it cannot be meshed.
    """
    source = Path(source)
    if not source.is_file():
        raise MeshError(f"{source}: file not found", hint="check the path and its spelling")
    if length_unit is not None and has_unit(source):
        raise MeshError(
            f"{source}: the file states its unit of length itself", hint="leave out the unit"
        )
    with TemporaryDirectory() as folder, _session(source) as gmsh:
        _load(gmsh, source)
        unit = _unit(gmsh, source, length_unit)
        if not gmsh.model.getEntities(3):
            raise MeshError(
                f"{source}: contains no solid",
                hint="export a solid, not surfaces or curves; in a gmsh script make a Volume",
            )
        _refuse_too_many(gmsh, source, size / unit)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size / unit)
        if cells == "quad":
            _sweep(gmsh, source, size / unit)
        gmsh.model.mesh.generate(3)
        made = Path(folder) / f"{source.stem}.msh"
        gmsh.write(str(made))
        mesh = with_named_surfaces(read_mesh(made, unit).mesh)
    write_gmsh(mesh, target)
    return mesh


def stored_mesh(source: Path, size: float, length_unit: float, cells: CellKind) -> Path:
    """Return the mesh file of a geometry file, which is made unless it is stored already.

    Meshes are stored in the folder `meshes` of $SOFTSIM_CACHE, else of the user's cache folder, by
    the content of the geometry file, the options and the version of gmsh. See `mesh_solid`. A gmsh
    script is refused: it can read other files.
    """
    if source.suffix.lower() == ".geo":
        raise MeshError(
            f"{source}: a gmsh script is not meshed with the scene",
            hint=f"run `softsim mesh {source.name}` and name the .msh file that it writes",
        )
    unit = None if has_unit(source) and length_unit == MILLIMETRE else length_unit
    options = (VERSION, _gmsh().__version__, source.suffix.lower(), size, unit, cells)
    key = hashlib.sha256(repr(options).encode() + source.read_bytes()).hexdigest()
    path = _folder() / f"{source.stem}_{key[:24]}.msh"
    if not path.is_file():
        path.parent.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=path.parent) as partial:
            mesh_solid(source, Path(partial) / path.name, size, unit, cells)
            os.replace(Path(partial) / path.name, path)
    return path


def has_unit(source: Path) -> bool:
    """Return True for the formats that state their unit of length."""
    return source.suffix.lower() in CAD and source.suffix.lower() != ".brep"


def write_gmsh(mesh: Mesh, path: Path) -> None:
    """Write a mesh in millimetres with its sets as physical groups (gmsh format 2.2).

    Raises MeshError for cell sets that overlap, or if the file cannot be written.
    """
    import meshio

    kinds = {4: "tetra", 8: "hexahedron"}, {3: "triangle", 4: "quad"}
    blocks: list[tuple[str, np.ndarray]] = []
    tags: list[int] = []
    groups: dict[str, np.ndarray] = {}
    of_cell = np.zeros(len(mesh.cells), dtype=int)
    for name, members in mesh.cell_sets.items():
        if of_cell[members].any():
            raise MeshError(
                f"the cell set '{name}' has cells of another set",
                hint="a cell may belong to one physical volume",
            )
        of_cell[members] = len(groups) + 1
        groups[name] = np.array([len(groups) + 1, 3])
    for tag in np.unique(of_cell):
        blocks.append((kinds[0][mesh.cells.shape[1]], mesh.cells[of_cell == tag]))
        tags.append(int(tag))
    for name, facets in mesh.facet_sets.items():
        if name != SURFACE:
            groups[name] = np.array([len(groups) + 1, 2])
            blocks.append((kinds[1][facets.shape[1]], facets))
            tags.append(len(groups))
    for name, nodes in mesh.node_sets.items():
        if name not in groups and name != SURFACE:
            groups[name] = np.array([len(groups) + 1, 0])
            blocks.append(("vertex", nodes[:, None]))
            tags.append(len(groups))
    numbers = [np.full(len(b), tag) for (_, b), tag in zip(blocks, tags, strict=True)]
    written = meshio.Mesh(
        mesh.points / MILLIMETRE,
        blocks,
        cell_data={"gmsh:physical": numbers, "gmsh:geometrical": numbers},
        field_data=groups,
    )
    try:
        meshio.write(path, written, file_format="gmsh22")
    except OSError as fault:
        raise MeshError(f"{path}: cannot be written ({fault.strerror})") from fault


def _folder() -> Path:
    given = os.environ.get("SOFTSIM_CACHE")
    if given:
        return Path(given) / "meshes"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "softsim" / "meshes"


def _gmsh() -> Any:
    """Return the package gmsh, which is optional."""
    try:
        import gmsh
    except (ImportError, OSError) as fault:  # OSError: a system library is missing
        raise MeshError(
            f"geometry is meshed by the package gmsh, which cannot be imported ({fault})",
            hint="install it with `pip install gmsh`; on a computer without a screen "
            "it needs system libraries, see Install in the documentation",
        ) from fault
    return gmsh


@contextmanager
def _session(source: Path) -> Iterator[Any]:
    """Yield gmsh with an empty model; its errors become a MeshError."""
    gmsh = _gmsh()
    gmsh.initialize([], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        yield gmsh
    except MeshError:
        raise
    except Exception as fault:  # gmsh raises no other class
        raise MeshError(
            f"{source}: gmsh cannot mesh this geometry ({fault})",
            hint="check that the file opens in a CAD program; try another size; remove details "
            "smaller than the elements; repair faces that cross or do not meet",
        ) from fault
    finally:
        gmsh.finalize()


def _load(gmsh: Any, source: Path) -> None:
    """Load a geometry file into the model of gmsh."""
    suffix = source.suffix.lower()
    if suffix in CAD:
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        is_iges = suffix in (".iges", ".igs")  # surfaces that make a solid together
        for option in ("Geometry.OCCSewFaces", "Geometry.OCCMakeSolids"):
            gmsh.option.setNumber(option, int(is_iges))
        gmsh.model.occ.importShapes(str(source))
        solids = gmsh.model.occ.getEntities(3)
        if len(solids) > 1:
            gmsh.model.occ.fragment(solids[:1], solids[1:])
        gmsh.model.occ.synchronize()
        solids = gmsh.model.getEntities(3)
        for number, (_, tag) in enumerate(solids if len(solids) > 1 else [], start=1):
            gmsh.model.addPhysicalGroup(3, [tag], name=f"solid{number}")
    elif suffix == ".stl":
        read_surface(source, 1.0)  # raises an error for an open surface
        gmsh.merge(str(source))
        gmsh.model.mesh.classifySurfaces(SHARP, True, True, np.pi)
        gmsh.model.mesh.createGeometry()
        _fill(gmsh, source)
    elif suffix == ".geo":
        gmsh.open(str(source))
    else:
        raise MeshError(
            f"{source}: this geometry format is not supported", hint=f"formats: {GEOMETRY}"
        )


def _fill(gmsh: Any, source: Path) -> None:
    """Make one volume of closed surfaces, of which one contains all others."""
    shells: list[tuple[set[int], list[int]]] = []  # curves and surfaces
    for _, tag in gmsh.model.getEntities(2):
        curves = {curve for _, curve in gmsh.model.getBoundary([(2, tag)], oriented=False)}
        joined = [shell for shell in shells if shell[0] & curves]
        shells = [shell for shell in shells if shell not in joined]
        of_shell = [tag, *(surface for shell in joined for surface in shell[1])]
        shells.append((curves.union(*(shell[0] for shell in joined)), of_shell))
    boxes = np.array([_box(gmsh, [(2, tag) for tag in tags]) for _, tags in shells])
    order = np.argsort(-(boxes[:, 3:] - boxes[:, :3]).sum(axis=1))
    low, high = boxes[order[0], :3], boxes[order[0], 3:]
    if ((boxes[:, :3] < low) | (boxes[:, 3:] > high)).any():
        raise MeshError(
            f"{source}: contains {len(shells)} closed surfaces, of which none contains the others",
            hint="write one body per file, its outer surface and those of its cavities",
        )
    loops = [gmsh.model.geo.addSurfaceLoop(shells[k][1]) for k in order]
    gmsh.model.geo.addVolume(loops)
    gmsh.model.geo.synchronize()


def _box(gmsh: Any, entities: list[tuple[int, int]]) -> np.ndarray:
    """Return the bounding box (6,) of entities: lowest, then highest coordinates."""
    boxes = np.array([gmsh.model.getBoundingBox(*entity) for entity in entities])
    return np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])


def _unit(gmsh: Any, source: Path, given: float | None) -> float:
    """Return the metres in one unit of the file, given or guessed from the size of the part."""
    if has_unit(source):
        return MILLIMETRE  # gmsh converts to this unit
    if given is not None:
        return given
    box = np.array(gmsh.model.getBoundingBox(-1, -1))
    sides = box[3:] - box[:3]
    unit, name = (1.0, "m") if sides.max() < SMALLEST_IN_MM else (MILLIMETRE, "mm")
    log.warning(
        "%s has no unit of length; taken as %s, the part measures %s %s",
        *(source, name, " x ".join(f"{side:.4g}" for side in sides), name),
    )
    return unit


def _refuse_too_many(gmsh: Any, source: Path, size: float) -> None:
    """Raise MeshError if the solid would need more than MOST_CELLS tetrahedra of this size."""
    if source.suffix.lower() == ".stl":
        surface = read_surface(source, 1.0)
        volume = signed_volume(surface.points, surface.triangles)
    else:
        volume = sum(gmsh.model.occ.getMass(3, tag) for _, tag in gmsh.model.occ.getEntities(3))
    count = volume / (size**3 / np.sqrt(72.0))
    if count > MOST_CELLS:
        raise MeshError(
            f"{source}: elements of this size would be about {count:.2g}, more than "
            f"{MOST_CELLS:.2g}",
            hint="give a larger size, and check its unit and that of the file",
        )


def _sweep(gmsh: Any, source: Path, size: float) -> None:
    """Replace the solid by its end face swept along an axis, which gmsh fills with hexahedra.

    Raises MeshError unless the swept face is the same solid.
    """
    occ = gmsh.model.occ
    solids = occ.getEntities(3)
    for axis in range(3) if len(solids) == 1 else ():
        box = np.array(occ.getBoundingBox(*solids[0]))
        height = box[3 + axis] - box[axis]
        faces = [
            face
            for face in occ.getEntities(2)
            if occ.getBoundingBox(*face)[3 + axis] < box[axis] + IN_PLANE * height
        ]
        if len(faces) != 1:
            continue
        layers = max(1, round(height / size))
        step = np.where(np.arange(3) == axis, height, 0.0)
        base = occ.copy(faces)
        made = occ.extrude(base, *step, numElements=[layers], recombine=True)
        swept = [entity for entity in made if entity[0] == 3]
        common, _ = occ.intersect(solids, swept, removeObject=False, removeTool=False)
        volumes = [occ.getMass(*e) for e in (*solids, *swept)]
        volumes.append(sum(occ.getMass(*e) for e in common))
        occ.remove(common, recursive=True)
        if np.ptp(volumes) < SAME_SHAPE * volumes[0]:
            occ.remove(solids, recursive=True)
            occ.synchronize()
            gmsh.model.mesh.setRecombine(*base[0])
            gmsh.option.setNumber("Mesh.Algorithm", 8)  # quadrilaterals by a frontal method
            gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 3)  # no triangles left over
            return
        occ.remove(swept, recursive=True)
    raise MeshError(
        f"{source}: hexahedra are made of one solid with a constant section along x, y or z only, "
        "from a STEP, IGES or BREP file",
        hint="use tetrahedra, or extrude with Layers and Recombine in a gmsh script",
    )
