"""Sets that a scene defines on a body.

A set is a box, one side of a plane, or the union, intersection or difference of further sets. It
may have nodes, facets and cells.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import reduce
from graphlib import CycleError, TopologicalSorter

import numpy as np

from softsim.builder.names import close_names, in_mm, model_vector
from softsim.mesh.mesh import SURFACE, Mesh, facet_keys, find_rows
from softsim.scene.loading import LoadedScene
from softsim.scene.sets import BoxSet, PlaneSet, SetDefinition
from softsim.scene.structure import first_key
from softsim.scene.tree import Keys

ON_IT = 1e-6
"""Distance from a plane or the side of a box up to which a node counts as on it.

It is relative to the body's extent: far below the size of an element, and above the round-off of
the seven digits of a mesh file.
"""

ALL = "all"
"""Name of the node set and the cell set that contain a whole body."""

OPERATIONS: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "union": np.logical_or,
    "intersection": np.logical_and,
    "difference": lambda one, other: one & ~other,
}


@dataclass(frozen=True)
class Members:
    """Masks of the nodes (n,), facets of the surface (k,) and cells (m,) that are in a set.

    A mask is None if a set of the mesh has no such members.
    """

    nodes: np.ndarray | None
    facets: np.ndarray | None
    cells: np.ndarray | None

    def describe(self) -> str:
        """Return the numbers of members as text."""
        counted = {"nodes": self.nodes, "facets": self.facets, "cells": self.cells}
        return " and ".join(f"{m.sum()} {kind}" for kind, m in counted.items() if m is not None)


def with_defined_sets(loaded: LoadedScene, body: str, mesh: Mesh) -> Mesh:
    """Return a body's mesh, placed, with the sets that the scene defines on it beside its own, and
    with its nodes and cells as the set `all`.
    """
    mesh = with_all(loaded, body, mesh)
    defined = loaded.scene.bodies[body].sets
    if not defined:
        return mesh
    keys = ("bodies", body, "sets")
    known = sets_of(mesh)
    refuse_taken_names(loaded, body, known)
    for name in order_of_definition(loaded, body, known):
        known[name] = members(loaded, mesh, defined[name], known, (*keys, name))
    nodes, facets, cells = mesh.node_sets.copy(), mesh.facet_sets.copy(), mesh.cell_sets.copy()
    for name in defined:
        found = known[name]
        if found.nodes is not None and found.nodes.any():
            nodes[name] = np.flatnonzero(found.nodes)
        if found.facets is not None and found.facets.any():
            facets[name] = mesh.facet_sets[SURFACE][found.facets]
        if found.cells is not None and found.cells.any():
            cells[name] = np.flatnonzero(found.cells)
        if not {name} & {*nodes, *facets, *cells}:
            hint = why_empty(mesh, defined[name], known)
            raise loaded.error((*keys, name), f"the set '{body}.{name}' is empty", hint)
    return replace(mesh, node_sets=nodes, facet_sets=facets, cell_sets=cells)


def with_all(loaded: LoadedScene, body: str, mesh: Mesh) -> Mesh:
    """Return a mesh with the sets `all`. SceneError where its file means something else by that."""
    nodes, cells = np.arange(len(mesh.points)), np.arange(len(mesh.cells))
    of_file = mesh.node_sets.get(ALL, nodes), mesh.cell_sets.get(ALL, cells)
    if (len(of_file[0]), len(of_file[1])) != (len(nodes), len(cells)) or ALL in mesh.facet_sets:
        raise loaded.error(
            ("bodies", body, "mesh"),
            f"the mesh has a set '{ALL}' that is not the whole body",
            f"rename it in the file: '{body}.{ALL}' means all nodes and cells of '{body}'",
        )
    return replace(
        mesh, node_sets={**mesh.node_sets, ALL: nodes}, cell_sets={**mesh.cell_sets, ALL: cells}
    )


def sets_of(mesh: Mesh) -> dict[str, Members]:
    """Return the mesh's own sets, by name."""
    surface = facet_keys(mesh.facet_sets[SURFACE])
    nodes = {name: mask(numbers, len(mesh.points)) for name, numbers in mesh.node_sets.items()}
    cells = {name: mask(numbers, len(mesh.cells)) for name, numbers in mesh.cell_sets.items()}
    facets = {}
    for name, rows in mesh.facet_sets.items():
        facets[name] = mask(find_rows(facet_keys(rows), surface), len(surface))
    return {
        name: Members(nodes.get(name), facets.get(name), cells.get(name))
        for name in {**nodes, **facets, **cells}
    }


def mask(numbers: np.ndarray, count: int) -> np.ndarray:
    """Return True for those of `count` members that have these numbers."""
    chosen = np.zeros(count, dtype=bool)
    chosen[numbers] = True
    return chosen


def refuse_taken_names(loaded: LoadedScene, body: str, of_mesh: Mapping[str, Members]) -> None:
    """Raise SceneError if a defined set has the name of a set of the mesh."""
    for name in loaded.scene.bodies[body].sets:
        if name in of_mesh:
            raise loaded.error(
                ("bodies", body, "sets", name),
                f"the mesh of '{body}' has a set '{name}' already",
                f"choose another name than {', '.join(of_mesh)}",
            )


def order_of_definition(
    loaded: LoadedScene, body: str, of_mesh: Mapping[str, Members]
) -> list[str]:
    """Return the names of the defined sets, each after those of which it consists."""
    defined, keys = loaded.scene.bodies[body].sets, ("bodies", body, "sets")
    for name, data in defined.items():
        for k, part in enumerate(parts(data)):
            if part not in defined and part not in of_mesh:
                raise loaded.error(
                    (*keys, name, first_key(type(data)), k),
                    f"there is no set '{part}' of '{body}'",
                    close_names(part, [*of_mesh, *defined], "sets"),
                )
    graph = {name: parts(data) for name, data in defined.items()}
    try:
        return [name for name in TopologicalSorter(graph).static_order() if name in defined]
    except CycleError as error:
        circle = error.args[1][::-1]
        raise loaded.error(
            (*keys, circle[0]),
            f"sets of '{body}' are defined by each other in a circle",
            " -> ".join(circle),
        ) from None


def parts(data: SetDefinition) -> tuple[str, ...]:
    """Return the names of the sets of which a set consists; none for a geometric one."""
    kind = first_key(type(data))
    return getattr(data, kind) if kind in OPERATIONS else ()


def members(
    loaded: LoadedScene,
    mesh: Mesh,
    data: SetDefinition,
    known: Mapping[str, Members],
    keys: Keys,
) -> Members:
    """Return the members of a set; `known`: at least the sets of which it consists."""
    if isinstance(data, BoxSet):
        return there(mesh, in_box(loaded, mesh, data, keys))
    if isinstance(data, PlaneSet):
        return there(mesh, beside_plane(loaded, mesh, data, keys))
    operation, operands = OPERATIONS[first_key(type(data))], [known[p] for p in parts(data)]
    return Members(
        combined(operation, [one.nodes for one in operands]),
        combined(operation, [one.facets for one in operands]),
        combined(operation, [one.cells for one in operands]),
    )


def there(mesh: Mesh, nodes: np.ndarray) -> Members:
    """Return the set of some nodes, a mask (n,).

    It has the facets of the surface and the cells whose corners are all among these nodes.
    """
    facets, cells = (nodes[rows].all(axis=1) for rows in (mesh.facet_sets[SURFACE], mesh.cells))
    return Members(nodes, facets, cells)


def combined(
    operation: Callable[[np.ndarray, np.ndarray], np.ndarray], masks: list[np.ndarray | None]
) -> np.ndarray | None:
    """Return masks combined by an operation, from left to right; None if one of them is None."""
    given = [mask for mask in masks if mask is not None]
    return reduce(operation, given) if len(given) == len(masks) else None


def in_box(loaded: LoadedScene, mesh: Mesh, data: BoxSet, keys: Keys) -> np.ndarray:
    """Return True for the nodes (n,) that lie in a box."""
    for k, corner in enumerate(data.box):
        # A z left out is not taken for zero: such a box would be flat.
        if len(corner) != mesh.dimension:
            raise loaded.error(
                (*keys, "box", k),
                f"has {len(corner)} coordinates; this model has {mesh.dimension}",
                "give all coordinates of both corners of the box",
            )
    off = ON_IT * extent(mesh)
    low, high = np.min(data.box, axis=0) - off, np.max(data.box, axis=0) + off
    return ((mesh.points >= low) & (mesh.points <= high)).all(axis=1)


def beside_plane(loaded: LoadedScene, mesh: Mesh, data: PlaneSet, keys: Keys) -> np.ndarray:
    """Return True for the nodes (n,) on the side of a plane to which its normal points."""
    plane, keys = data.plane, (*keys, "plane")
    point = model_vector(loaded, mesh.dimension, plane.point, (*keys, "point"))
    normal = model_vector(loaded, mesh.dimension, plane.normal, (*keys, "normal"))
    height = (mesh.points - point) @ (normal / np.linalg.norm(normal))
    return height >= -ON_IT * extent(mesh)


def extent(mesh: Mesh) -> float:
    """Return the largest size [m] of a mesh along an axis."""
    return float(np.ptp(mesh.points, axis=0).max())


def why_empty(mesh: Mesh, data: SetDefinition, known: Mapping[str, Members]) -> str:
    """Return a hint on an empty set: the extent of the body, or the sizes of the sets used."""
    if parts(data):
        return "; ".join(f"{part}: {known[part].describe()}" for part in parts(data))
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    return f"the body extends from {in_mm(low)} to {in_mm(high)}"
