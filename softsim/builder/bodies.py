"""Deformable bodies: meshes, kinematics, masses, held components, velocities, probes."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from softsim.applications import entry
from softsim.builder.chambers import lids, refuse_open_chamber
from softsim.compute.mass_scaling import MassScaling, edges_of, grouped
from softsim.elements.geometry import Geometry, Region, nodal_sums
from softsim.elements.hoop import Axisymmetric, RingSection
from softsim.elements.plane_elements import PlaneStrain
from softsim.elements.solid import Solid
from softsim.errors import MeshError
from softsim.loads.load import joined_facets
from softsim.materials.library import built_material, named_materials, viscoelastic_material
from softsim.materials.material import Material
from softsim.mesh.abaqus import family, plane_stress_advice
from softsim.mesh.cad import stored_mesh
from softsim.mesh.mesh import SURFACE, Mesh, mirrored, of_corners, transformed
from softsim.mesh.quality import check
from softsim.mesh.reading import GEOMETRY, MeshFile, read_mesh
from softsim.model import Body, Model, Probe
from softsim.scene import bodies as scene_bodies
from softsim.scene import outputs
from softsim.scene.bodies import Fixed, InitialVelocity, PointMass, Symmetry
from softsim.scene.loading import LoadedScene
from softsim.scene.meshes import FileMesh, GeneratedMesh
from softsim.scene.names import (
    MeshedBody,
    MeshedRegion,
    Names,
    close_names,
    in_mm,
    with_defined_sets,
)
from softsim.scene.text import Keys
from softsim.structures.structure import Structure
from softsim.structures.ties import Ties

# -------------------------------------------------------------------------------------------------
# Regions of a body: cell sets with a material or a thickness of their own.


def meshed_regions(
    loaded: LoadedScene, body: str, mesh: Mesh, geometry: Geometry
) -> tuple[MeshedRegion, ...]:
    """Return the regions of a body.

    The first one holds the cells that are in none of the scene's regions, if there are any. Raises
    SceneError for a set that does not exist, a cell in two regions, or a thickness that has no
    meaning.
    """
    given = loaded.scene.bodies[body].regions
    region_of_cell = np.full(len(mesh.cells), -1)
    for k, name in enumerate(given):
        keys = ("bodies", body, "regions", name)
        if name not in mesh.cell_sets:
            raise loaded.error(
                keys,
                f"there is no cell set '{name}' in '{body}'",
                close_names(name, list(mesh.cell_sets), "cell sets"),
            )
        cells = mesh.cell_sets[name]
        taken = cells[region_of_cell[cells] >= 0]
        if len(taken):
            other = list(given)[region_of_cell[taken[0]]]
            place = in_mm(mesh.points[mesh.cells[taken[0]]].mean(axis=0))
            raise loaded.error(
                keys,
                f"the cell at {place} is in '{name}' and in '{other}' ({len(taken)} such cells): "
                "it can be in one region only",
                f"define a set without them (bodies.{body}.sets: difference: [{name}, {other}])",
            )
        refuse_meaningless_thickness(loaded, body, name, geometry, cells)
        region_of_cell[cells] = k
    regions = []
    rest = np.flatnonzero(region_of_cell < 0)
    if len(rest):
        regions.append(MeshedRegion(None, rest, geometry.of_cells(rest, None)))
    for k, (name, data) in enumerate(given.items()):
        numbers = np.flatnonzero(region_of_cell == k)
        geometry_of_region = geometry.of_cells(numbers, data.thickness)
        regions.append(MeshedRegion(name, numbers, geometry_of_region))
    return tuple(regions)


def refuse_meaningless_thickness(
    loaded: LoadedScene, body: str, region: str, geometry: Geometry, cells: np.ndarray
) -> None:
    """Raise SceneError for a thickness of a region in which it has no meaning.

    Plates have a thickness, and cells of a ring section that are not rings.
    """
    data = loaded.scene.bodies[body]
    if data.regions[region].thickness is None:
        return
    keys = ("bodies", body, "regions", region, "thickness")
    if data.thickness is None:
        raise loaded.error(
            keys, f"has no meaning in a body that is {data.formulation}", "leave it out"
        )
    if isinstance(geometry, RingSection) and geometry.is_ring[cells].all():
        raise loaded.error(
            keys,
            f"all cells of '{region}' are rings around the axis: the sector defines their depth",
            "leave it out, or name cells that are not rings",
        )


def built_region(names: Names, body: str, region: MeshedRegion) -> Region:
    """Return a region with its material."""
    part = names.bodies[body]
    keys = material_keys(names, body, region.cell_set)
    return Region(
        body=body,
        cell_set=region.cell_set,
        first_node=part.first_node,
        points=part.mesh.points,
        cells=part.mesh.cells[region.numbers],
        numbers=region.numbers,
        geometry=region.geometry,
        material=built_material(names.loaded, keys),
    )


def material_keys(names: Names, body: str, cell_set: str | None) -> Keys:
    """Return the keys at which the scene names the material of a region."""
    keys: Keys = ("bodies", body)
    if cell_set is not None and names.scene.bodies[body].regions[cell_set].material is not None:
        keys = (*keys, "regions", cell_set)
    return (*keys, "material")


# Cells along the longest side of a generated body, at most.
MOST_ALONG = 1e4
# Families of ABAQUS's element types -> the formulation that they mean.
FORMULATIONS = {
    "CPE": ("plane_strain", "ring_section"),
    "CAX": ("axisymmetric",),
    "C3D": ("solid",),
}


def meshed_bodies(loaded: LoadedScene) -> dict[str, MeshedBody]:
    """Return the meshes of all bodies, in the scene's order, numbered one after the other."""
    placed = {}
    for name, data in loaded.scene.bodies.items():
        refuse_other_formulation(loaded, name)
        placed[name] = placed_mesh(loaded, name, data)
    # The stable step and the files take the elements of all bodies together.
    corners = max(found.mesh.cells.shape[1] for found in placed.values())
    result: dict[str, MeshedBody] = {}
    first_node = 0
    for name, found in placed.items():
        mesh = of_corners(found.mesh, corners)
        geometry = kinematics(loaded, name, loaded.scene.bodies[name], mesh)
        mesh = with_defined_sets(loaded, name, mesh)
        regions = meshed_regions(loaded, name, mesh, geometry)
        result[name] = MeshedBody(
            mesh, first_node, geometry, regions, found.changes, found.not_read
        )
        first_node += len(mesh.points)
    return result


def refuse_other_formulation(loaded: LoadedScene, name: str) -> None:
    """Raise SceneError if the body has another formulation than the first body of the scene."""
    first_name, first = next(iter(loaded.scene.bodies.items()))
    if loaded.scene.bodies[name].formulation != first.formulation:
        raise loaded.error(
            ("bodies", name, "formulation"),
            f"'{name}' is {loaded.scene.bodies[name].formulation}, '{first_name}' is "
            f"{first.formulation}: all bodies of a scene must have the same formulation",
            "put them into separate scenes",
        )


def kinematics(loaded: LoadedScene, name: str, data: scene_bodies.BodySpec, mesh: Mesh) -> Geometry:
    """Return the geometry of a body's elements."""
    made: dict[str, Callable[[], Geometry]] = {
        "plane_strain": lambda: PlaneStrain(data.thickness or 0.0),
        "axisymmetric": Axisymmetric,
        "ring_section": lambda: ring_section(loaded, name, data, mesh),
        "solid": Solid,
    }
    return made[data.formulation]()


def ring_section(
    loaded: LoadedScene, name: str, data: scene_bodies.BodySpec, mesh: Mesh
) -> RingSection:
    """Return the geometry of a ring section.

    It holds which cells are rings, and the node opposite each node. Raises SceneError if the mesh
    is rotated, not symmetric about its axis, or lacks the set of rings.
    """
    keys = ("bodies", name)
    assert data.thickness is not None and data.sector is not None and data.rings is not None
    if data.rotation != 0.0:
        raise loaded.error(
            (*keys, "rotation"),
            "the mesh of a ring_section cannot be turned: at rest its axis is parallel to x",
            "incline the environment instead (environment.inclination), or turn the mesh itself",
        )
    if data.rings not in mesh.cell_sets:
        raise loaded.error(
            (*keys, "rings"),
            f"there is no cell set '{data.rings}' in the mesh of '{name}'",
            close_names(data.rings, list(mesh.cell_sets), "cell sets"),
        )
    mirrored = mesh.points * np.array([1.0, -1.0]) + np.array([0.0, 2.0 * data.position[1]])
    distance, opposite = cKDTree(mesh.points).query(mirrored)
    worst = int(np.argmax(distance))
    if distance[worst] > 1e-6 * np.ptp(mesh.points, axis=0).max():
        raise loaded.error(
            (*keys, "mesh"),
            f"the node at {in_mm(mesh.points[worst])} has no node opposite it: a ring_section "
            f"must be symmetric about its axis, y = {data.position[1] * 1e3:g}",
            "mesh both strips identically, above and below the axis",
        )
    is_ring = np.zeros(len(mesh.cells), dtype=bool)
    is_ring[mesh.cell_sets[data.rings]] = True
    refuse_half_rings(loaded, name, mesh, opposite, is_ring)
    return RingSection(data.thickness, data.sector, opposite, is_ring)


def refuse_half_rings(
    loaded: LoadedScene, name: str, mesh: Mesh, opposite: np.ndarray, is_ring: np.ndarray
) -> None:
    """Raise SceneError unless each ring cell is off the axis and has a ring cell opposite to it."""
    keys = ("bodies", name, "rings")
    cells = mesh.cells[is_ring]
    diameters = (mesh.points - mesh.points[opposite])[cells, 1]
    least = 1e-6 * np.ptp(mesh.points, axis=0).max()
    astride = np.flatnonzero(~((diameters > least).all(axis=1) | (diameters < -least).all(axis=1)))
    if len(astride):
        raise loaded.error(
            keys,
            f"the ring cell at {in_mm(mesh.points[cells[astride[0]]].mean(axis=0))} touches the "
            "axis: a ring needs a hole",
            "name the cells of both strips, above and below the axis",
        )
    alone = np.setdiff1d(opposite[cells], cells)
    if len(alone):
        raise loaded.error(
            keys,
            f"the node at {in_mm(mesh.points[alone[0]])} belongs to no ring cell, but the node "
            "opposite it does",
            "name the cells of both strips",
        )


def placed_mesh(loaded: LoadedScene, name: str, data: scene_bodies.BodySpec) -> MeshFile:
    """Return the mesh of a body, checked and moved to its place, and how it was read."""
    keys = ("bodies", name, "mesh")
    try:
        found = read_or_generated(loaded, name, data)
        check(found.mesh)
    except MeshError as error:
        raise loaded.error(keys, error.message, error.hint) from None
    mesh = found.mesh
    dimension = 3 if data.formulation == "solid" else 2
    if mesh.dimension != dimension:
        needed = {2: "triangles or quadrilaterals", 3: "tetrahedra or hexahedra"}
        raise loaded.error(
            keys,
            f"{data.formulation} needs {needed[dimension]}; this mesh has {needed[mesh.dimension]}",
            "sections are meshed with linear triangles or quadrilaterals, solids with linear "
            "tetrahedra or hexahedra",
        )
    if len(data.position) > dimension:
        raise loaded.error(
            ("bodies", name, "position"), "a section has two coordinates", "leave z out"
        )
    if data.mirror is not None:
        axis = "xyz".index(data.mirror)
        if axis >= dimension:
            raise loaded.error(("bodies", name, "mirror"), "a section has no z", "write x or y")
        mesh = mirrored(mesh, axis)
    shift = np.zeros(dimension)
    shift[: len(data.position)] = data.position
    mesh = transformed(mesh, data.rotation, shift)
    if data.formulation == "axisymmetric":
        inside = np.flatnonzero(mesh.points[:, 0] < -1e-12)
        if len(inside):
            raise loaded.error(
                keys,
                f"node {inside[0]} is at x = {mesh.points[inside[0], 0] * 1e3:.3g} mm: x is the "
                "radius of an axisymmetric body and must not be negative",
                "the axis is y; mesh the half section at x >= 0",
            )
    return replace(found, mesh=mesh)


def generated(loaded: LoadedScene, name: str, source: GeneratedMesh) -> Mesh:
    """Return the mesh that a generator makes. Raises MeshError or SceneError."""
    sizes = source.model_dump(exclude={"generator"})
    lengths = {key: size for key, size in sizes.items() if isinstance(size, float)}
    longest = max(lengths, key=lambda key: lengths[key])
    if lengths[longest] > MOST_ALONG * lengths["element_size"]:
        raise loaded.error(
            ("bodies", name, "mesh", "element_size"),
            f"{longest} is more than {MOST_ALONG:g} times the element_size: "
            f"{lengths[longest] * 1e3:g} mm and {lengths['element_size'] * 1e3:g} mm",
            "such a mesh would have too many cells: check the units of both",
        )
    try:
        return entry(source.built_by)(**sizes)
    except MemoryError:
        raise MeshError(
            "the mesh has more cells than fit into memory", hint="increase element_size"
        ) from None


def read_or_generated(loaded: LoadedScene, name: str, data: scene_bodies.BodySpec) -> MeshFile:
    """Return the mesh from its file or its generator. Raises MeshError."""
    source = data.mesh
    if not isinstance(source, FileMesh):
        return MeshFile(generated(loaded, name, source))
    path = loaded.resolve_file(("bodies", name, "mesh", "file"))
    is_geometry = path.suffix.lower() in GEOMETRY
    if not is_geometry and (source.size is not None or source.cells != "simplex"):
        key = "cells" if source.size is None else "size"
        raise loaded.error(
            ("bodies", name, "mesh", key),
            f"{source.file} is a mesh already",
            f"{key} applies to geometry, which is meshed: STEP, IGES, BREP and STL files",
        )
    if is_geometry and source.size is not None:
        path = stored_mesh(path, source.size, source.length_unit, source.cells)
        found = read_mesh(path, instance=source.instance, reduce_order=source.reduce_order)
    else:
        found = read_mesh(
            path, source.length_unit, source.instance, reduce_order=source.reduce_order
        )
    kind = family(found.element_type)
    if kind == "CPS":
        raise MeshError(
            f"{source.file} has plane-stress elements ({found.element_type}), which are not "
            "supported",
            hint=plane_stress_advice(found.element_type, data.formulation),
        )
    meant = FORMULATIONS.get(kind, (data.formulation,))
    if data.formulation not in meant:
        raise MeshError(
            f"{source.file} has elements {found.element_type} ({meant[0]}), but the formulation "
            f"of the body is {data.formulation}",
            hint=f'write "formulation: {meant[0]}", or use other elements in the file',
        )
    return found


def built_bodies(names: Names) -> tuple[Body, ...]:
    """Return all bodies with their materials."""
    return tuple(
        Body(
            name=name,
            first_node=part.first_node,
            points=part.mesh.points,
            cells=part.mesh.cells,
            regions=tuple(built_region(names, name, region) for region in part.regions),
            remarks=part.remarks,
            not_read=part.not_read,
            node_sets={k: part.first_node + v for k, v in part.mesh.node_sets.items()},
            facet_sets={k: part.first_node + v for k, v in part.mesh.facet_sets.items()},
            cell_sets=part.mesh.cell_sets,
        )
        for name, part in names.bodies.items()
    )


def with_branches(loaded: LoadedScene, model: Model) -> Model:
    """Return the model of a static scene with the Maxwell branches of its materials."""
    named = named_materials(loaded.scene)

    def of(region: Region) -> Material:
        own: Keys = ("bodies", region.body, "regions", region.cell_set or "", "material")
        return viscoelastic_material(
            loaded, own if own in named else ("bodies", region.body, "material")
        )

    bodies = tuple(
        replace(
            body,
            regions=tuple(replace(r, material=of(r)) for r in body.regions),
        )
        for body in model.bodies
    )
    return replace(model, bodies=bodies)


# -------------------------------------------------------------------------------------------------
# Conditions on node sets: held components, masses, velocities; probes of node sets.


def lumped_mass(
    names: Names, bodies: tuple[Body, ...], structures: Sequence[Structure], node_count: int
) -> np.ndarray:
    """Return the mass (n,) [kg] of each node: from its elements, structures and point masses."""
    mass = np.zeros(node_count)
    for b in bodies:
        for r in b.regions:
            shares = r.geometry.mass_shares(r.points, r.cells)
            per_corner = r.material.density * r.volumes[:, None] * shares
            mass[b.nodes] += nodal_sums(r.cells, per_corner, len(r.points))
    for keys, condition in names.conditions(PointMass):
        nodes = names.node_set(condition.nodes, (*keys, "nodes"))
        mass[nodes] += condition.mass / len(nodes)
    for structure in structures:
        mass += structure.nodal_mass(node_count)
    return mass


def mass_scaling(
    names: Names, bodies: tuple[Body, ...], points: np.ndarray, is_free: np.ndarray
) -> MassScaling | None:
    """Return groups of nodes that are free in every direction, or None if the scene wants none.

    Raises SceneError if no two nodes are near enough.
    """
    wanted = names.scene.solver.mass_scaling
    if wanted is None:
        return None
    of_bodies = [edges_of(b.cells + b.first_node, b.facet_sets[SURFACE]) for b in bodies]
    edges, crosses = map(np.concatenate, zip(*of_bodies, strict=True))
    group, count = grouped(points, edges, crosses, np.all(is_free, axis=1), wanted.within)
    if count == 0:
        shortest = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1).min()
        raise names.loaded.error(
            ("solver", "mass_scaling", "within"),
            f"no two nodes that are free in all directions are within {wanted.within * 1e3:.3g} "
            f"mm of each other; the shortest element edge is {shortest * 1e3:.3g} mm",
            "increase mass_scaling.within, or leave mass_scaling out",
        )
    return MassScaling(group, count, wanted.factor)


def held_components(names: Names, bodies: tuple[Body, ...], points: np.ndarray) -> np.ndarray:
    """Return True (n, d) for fixed components.

    They are fixed by body, by condition, or by the axis of a half section.
    """
    held = np.zeros(points.shape, dtype=bool)
    for b in bodies:
        for k, set_name in enumerate(names.scene.bodies[b.name].fixed):
            held[names.node_set(f"{b.name}.{set_name}", ("bodies", b.name, "fixed", k))] = True
        if names.is_axisymmetric:
            held[b.nodes, 0] |= b.points[:, 0] < 1e-12
    for keys, fixed in names.conditions(Fixed):
        nodes = names.node_set(fixed.nodes, (*keys, "nodes"))
        letters = fixed.directions or "xyz"[: names.dimension]
        for k, letter in enumerate(letters):
            held[nodes, names.axis(letter, (*keys, "directions", k))] = True
    for keys, plane in names.conditions(Symmetry):
        nodes = names.node_set(plane.nodes, (*keys, "nodes"))
        axis = names.axis(plane.normal, (*keys, "normal"))
        off = np.ptp(points[nodes, axis])
        if off > 1e-9 * np.ptp(points, axis=0).max():
            raise names.loaded.error(
                (*keys, "nodes"),
                f"the nodes of '{plane.nodes}' do not lie in a plane normal to {plane.normal}: "
                f"their {plane.normal} coordinates differ by {off * 1e3:.3g} mm",
                "choose a node set in the plane of symmetry, or the direction normal to it",
            )
        held[nodes, axis] = True
    return held


def initial_velocity(
    names: Names, bodies: tuple[Body, ...], points: np.ndarray, mass: np.ndarray
) -> np.ndarray:
    """Return the initial velocity of each node (n, d) [m/s].

    points (n, d) [m], mass (n,) [kg].
    """
    velocity = np.zeros_like(points)
    for b in bodies:
        given = names.scene.bodies[b.name].initial_velocity
        velocity[b.nodes] = names.vector(given, ("bodies", b.name, "initial_velocity"))
    for keys, condition in names.conditions(InitialVelocity):
        nodes = names.node_set(condition.nodes, (*keys, "nodes"))
        translation = names.vector(condition.velocity, (*keys, "velocity"))
        velocity[nodes] = translation + spin(names, condition, points[nodes], mass[nodes], keys)
    return velocity


def spin(
    names: Names,
    condition: InitialVelocity,
    points: np.ndarray,
    mass: np.ndarray,
    keys: Keys,
) -> np.ndarray:
    """Return omega x (x - c) (k, d) [m/s] of nodes at `points` (k, d) [m] with `mass` (k,) [kg]."""
    given = condition.angular_velocity
    if given is None:
        return np.zeros_like(points)
    if condition.about is None:
        centre = mass @ points / mass.sum()
    else:
        centre = names.vector(condition.about, (*keys, "about"))
    arms = np.zeros((len(points), 3))
    arms[:, : names.dimension] = points - centre
    omega = angular_velocity(names, given, (*keys, "angular_velocity"))
    return np.cross(omega, arms)[:, : names.dimension]


def angular_velocity(names: Names, given: float | tuple[float, ...], keys: Keys) -> np.ndarray:
    """Return an angular velocity (3,) [rad/s]; a section has its component about z alone."""
    if names.is_axisymmetric:
        raise names.loaded.error(
            keys,
            "an axisymmetric model cannot turn",
            "leave angular_velocity out, or use a 3D model (formulation solid)",
        )
    if not isinstance(given, tuple):
        return np.array([0.0, 0.0, given])
    if len(given) != 3 or names.dimension == 2:
        raise names.loaded.error(
            keys,
            f"angular_velocity has {len(given)} components, which does not fit a model of "
            f"{names.dimension} dimensions",
            "give one value, about z; in 3D give three, about x, y and z",
        )
    return np.array(given)


def probes(names: Names, points: np.ndarray, is_free: np.ndarray, ties: Ties) -> tuple[Probe, ...]:
    """Return the probes that the history records in addition to its own columns."""
    result = []
    for name, probe in names.scene.output.probes.items():
        keys = ("output", "probes", name)
        if isinstance(probe, outputs.VolumeProbe):
            facets = joined_facets(names, probe.facets, keys)
            body = names.bodies[probe.facets[0].partition(".")[0]]
            geometry = names.common_geometry(facets, keys)
            remedy = "hold the rim (bodies.NAME.fixed)"
            refuse_open_chamber(names, facets, points, ~is_free, remedy, keys)
            closed = np.concatenate([facets, lids(names, facets, points, ~is_free)])
            members = geometry.pressed(closed, body.first_node)
        else:
            members = names.node_set(probe.nodes, (*keys, "nodes"))
            geometry = names.geometry
            refuse_radius_without_axis(names, probe.kind, keys)
            refuse_rotation_of_line(names, probe.kind, points[members], keys)
            refuse_reaction_of_tied(names, probe.kind, members, points, ties, keys)
        result.append(Probe(name, probe.kind, members, geometry))
    return tuple(result)


def refuse_reaction_of_tied(
    names: Names, kind: str, members: np.ndarray, points: np.ndarray, ties: Ties, keys: Keys
) -> None:
    """Raise SceneError if a reaction probe contains tied nodes.

    The force on a tied node acts on the nodes of its facet.
    """
    tied = np.intersect1d(members, ties.nodes)
    if kind == "reaction" and len(tied):
        raise names.loaded.error(
            (*keys, "nodes"),
            f"the node at {in_mm(points[tied[0]])} is tied to a facet, so its force acts on the "
            "nodes of the facet",
            "leave tied nodes out of the set; use the nodes of the facet instead",
        )


def refuse_rotation_of_line(names: Names, kind: str, points: np.ndarray, keys: Keys) -> None:
    """Raise SceneError if nodes at these places (n, d) [m] do not determine a rotation."""
    if kind != "rotation":
        return
    sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    needed = points.shape[1] - 1
    spread = len(sizes) >= needed and sizes[needed - 1] > 1e-6 * sizes[0]
    if not spread:
        raise names.loaded.error(
            (*keys, "nodes"),
            "the nodes are at one place" if needed == 1 else "the nodes are in one line",
            "their rotation is not determined: name a set of a face",
        )


def refuse_radius_without_axis(names: Names, kind: str, keys: Keys) -> None:
    """Raise SceneError if a radius is measured in a plane section, which has no axis."""
    if kind == "radius" and isinstance(names.geometry, PlaneStrain | RingSection):
        raise names.loaded.error(
            (*keys, "kind"),
            f"a {names.geometry.name} model has no axis from which a radius could be measured",
            "record the displacement",
        )
