"""Regions of a body: cell sets with a material or a thickness of their own."""

from collections.abc import Iterator

import numpy as np

from softsim.builder.materials import material
from softsim.builder.names import MeshedBody, MeshedRegion, Names, close_names, in_mm
from softsim.elements.geometry import Geometry
from softsim.elements.region import Region
from softsim.elements.ring_section import RingSection
from softsim.mesh.mesh import Mesh, facet_owners
from softsim.scene.loading import LoadedScene
from softsim.scene.tree import Keys


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
        material=material(names, keys),
    )


def material_keys(names: Names, body: str, cell_set: str | None) -> Keys:
    """Return the keys at which the scene names the material of a region."""
    keys: Keys = ("bodies", body)
    if cell_set is not None and names.scene.bodies[body].regions[cell_set].material is not None:
        keys = (*keys, "regions", cell_set)
    return (*keys, "material")


def bounded(
    names: Names, facets: np.ndarray
) -> Iterator[tuple[MeshedBody, MeshedRegion, np.ndarray]]:
    """Yield bodies and regions whose elements have some of the facets (k, corners), and which."""
    for body in names.bodies.values():
        here = np.flatnonzero(body.has_nodes(facets).all(axis=1))
        if not len(here):
            continue
        owner = facet_owners(facets[here] - body.first_node, body.mesh.cells)
        for region in body.regions:
            chosen = here[np.isin(owner, region.numbers)]
            if len(chosen):
                yield body, region, chosen


def common_geometry(names: Names, facets: np.ndarray, keys: Keys) -> Geometry:
    """Return the kinematics of the elements behind the facets of one chamber."""
    first, *others = [region.geometry for _, region, _ in bounded(names, facets)]
    if not all(first.bounds_with(other) for other in others):
        raise names.loaded.error(
            (*keys, "facets"),
            "the facets belong to bodies of different thickness or rings, or to such regions",
            "use a separate load for each",
        )
    return first
