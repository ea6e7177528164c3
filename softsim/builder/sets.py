"""Sets that a scene defines on a body: what lies in a box or on one side of a plane, and what is in
any, in all, or in one but not the other, of further sets. Each may have nodes, facets and cells.
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
"""How far off a plane or the side of a box a node counts as on it: this share of the body's extent,
far below the size of an element, and above the round-off of the seven digits of a mesh file.
"""

ALL = "all"
"""Name of the node set and the cell set that hold a whole body."""

OPERATIONS: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "union": np.logical_or,
    "intersection": np.logical_and,
    "difference": lambda one, other: one & ~other,
}


@dataclass(frozen=True)
class Members:
    """Whether each node (n,), each facet of the surface (k,), and each cell (m,), is in a set; None
    where a set of the mesh has no such members.
    """

    nodes: np.ndarray | None
    facets: np.ndarray | None
    cells: np.ndarray | None

    def describe(self) -> str:
        """How many there are, for people."""
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
    """The mesh's own sets, by name."""
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
    """Which of `count` members have these numbers."""
    chosen = np.zeros(count, dtype=bool)
    chosen[numbers] = True
    return chosen


def refuse_taken_names(loaded: LoadedScene, body: str, of_mesh: Mapping[str, Members]) -> None:
    """A defined set has a name of its own."""
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
    """Names of the defined sets, each after those that it is made of."""
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
    """Names of the sets that a set is made of; none of a geometric one."""
    kind = first_key(type(data))
    return getattr(data, kind) if kind in OPERATIONS else ()


def members(
    loaded: LoadedScene,
    mesh: Mesh,
    data: SetDefinition,
    known: Mapping[str, Members],
    keys: Keys,
) -> Members:
    """Who is in a set; `known`: at least the sets that it is made of."""
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
    """A set of nodes, a mask (n,), and the facets of the surface and the cells with all corners
    among them.
    """
    facets, cells = (nodes[rows].all(axis=1) for rows in (mesh.facet_sets[SURFACE], mesh.cells))
    return Members(nodes, facets, cells)


def combined(
    operation: Callable[[np.ndarray, np.ndarray], np.ndarray], masks: list[np.ndarray | None]
) -> np.ndarray | None:
    """Masks joined by an operation, from left to right; None where one is not there."""
    given = [mask for mask in masks if mask is not None]
    return reduce(operation, given) if len(given) == len(masks) else None


def in_box(loaded: LoadedScene, mesh: Mesh, data: BoxSet, keys: Keys) -> np.ndarray:
    """Which nodes (n,) lie in a box."""
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
    """Which nodes (n,) lie on the side of a plane that its normal points to."""
    plane, keys = data.plane, (*keys, "plane")
    point = model_vector(loaded, mesh.dimension, plane.point, (*keys, "point"))
    normal = model_vector(loaded, mesh.dimension, plane.normal, (*keys, "normal"))
    height = (mesh.points - point) @ (normal / np.linalg.norm(normal))
    return height >= -ON_IT * extent(mesh)


def extent(mesh: Mesh) -> float:
    """Largest size [m] of a mesh along an axis."""
    return float(np.ptp(mesh.points, axis=0).max())


def why_empty(mesh: Mesh, data: SetDefinition, known: Mapping[str, Members]) -> str:
    """A hint: where the body is, or what the set is made of."""
    if parts(data):
        return "; ".join(f"{part}: {known[part].describe()}" for part in parts(data))
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    return f"the body extends from {in_mm(low)} to {in_mm(high)}"
