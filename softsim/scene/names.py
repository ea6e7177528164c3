"""Lookup of names in a scene: node sets, facet sets, rigid bodies; vectors of its space."""

import difflib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from graphlib import CycleError, TopologicalSorter
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from softsim.mesh.mesh import SURFACE, Mesh, facet_keys, facet_owners, find_rows
from softsim.mesh.surface import side_lengths
from softsim.scene.bodies import BoxSet, PlaneSet, SetDefinition
from softsim.scene.loading import LoadedScene
from softsim.scene.quantities import Spec
from softsim.scene.schema import Scene
from softsim.scene.steps import Beginning
from softsim.scene.text import Keys, first_key

if TYPE_CHECKING:
    from softsim.elements.geometry import Geometry

S = TypeVar("S", bound=Spec)


@dataclass(frozen=True)
class MeshedRegion:
    """Cells of a body's mesh by number, with their cell set and their kinematics.

    cell_set: None for the cells that are in no region of the scene.
    """

    cell_set: str | None
    numbers: np.ndarray
    geometry: "Geometry"


@dataclass(frozen=True)
class MeshedBody:
    """Placed mesh of a body, with its numbering and kinematics.

    first_node: number of its first node in the model. geometry: kinematics without regions.
    remarks: on its mesh file; not_read: what else the file contains.
    """

    mesh: Mesh
    first_node: int
    geometry: "Geometry"
    regions: tuple[MeshedRegion, ...]
    remarks: tuple[str, ...]
    not_read: tuple[str, ...]

    def has_nodes(self, nodes: np.ndarray) -> np.ndarray:
        """Return True for the nodes that belong to the body, in an array of their shape."""
        return (nodes >= self.first_node) & (nodes < self.first_node + len(self.mesh.points))


@dataclass(frozen=True)
class PlacedCable:
    """Nodes (k, d) [m] of a cable along its line, and the number of the first in the model."""

    points: np.ndarray
    first_node: int

    @property
    def nodes(self) -> np.ndarray:
        """Numbers of the nodes in the model (k,)."""
        return self.first_node + np.arange(len(self.points))

    @property
    def lengths(self) -> np.ndarray:
        """Lengths of the segments at rest (k - 1,) [m]."""
        return np.linalg.norm(np.diff(self.points, axis=0), axis=1)

    @property
    def node_sets(self) -> dict[str, np.ndarray]:
        """Node sets of the cable, numbered within it."""
        numbers = np.arange(len(self.points))
        return {
            "start": numbers[:1], "end": numbers[-1:], "start_segment": numbers[:2],
            "end_segment": numbers[-2:], "all": numbers,
        }  # fmt: skip


@dataclass(frozen=True)
class PlacedSurface:
    """Closed surface of a rigid body at rest.

    points (k, d) [m]: its vertices; first_node: number of the first in the model. facets (f, d):
    edges or triangles, numbered within the model, with outward normals. faces (m, d): the same
    before subdivision, for drawing.
    """

    points: np.ndarray
    first_node: int
    facets: np.ndarray
    faces: np.ndarray


@dataclass(frozen=True)
class Names:
    """Lookup of the names in a scene; raises SceneError, at the key, for unknown names."""

    loaded: LoadedScene
    bodies: Mapping[str, MeshedBody]
    cables: Mapping[str, PlacedCable]
    beginning: Beginning
    surfaces: Mapping[str, PlacedSurface] = field(default_factory=dict)

    @property
    def scene(self) -> Scene:
        """The validated scene."""
        return self.loaded.scene

    @property
    def geometry(self) -> "Geometry":
        """Kinematics of the first body; the others have the same formulation."""
        return next(iter(self.bodies.values())).geometry

    @property
    def dimension(self) -> int:
        """Coordinates of a node: 2 or 3."""
        return self.geometry.dimension

    @property
    def is_axisymmetric(self) -> bool:
        """True if x is the radius and y the axis of revolution."""
        return self.geometry.name == "axisymmetric"

    @property
    def is_ring_section(self) -> bool:
        """True if opposite sides of a section belong to the same rings."""
        return self.geometry.name == "ring_section"

    @property
    def median_side(self) -> float:
        """Median side of the facets on the surfaces of all bodies [m]."""
        sides = []
        for body in self.bodies.values():
            sides.append(side_lengths(body.mesh.points, body.mesh.facet_sets[SURFACE]).ravel())
        return float(np.median(np.concatenate(sides)))

    def vector(self, components: Sequence[float], keys: Keys) -> np.ndarray:
        """Return a vector (d,) of the model's space; a z that is left out is zero."""
        return model_vector(self.loaded, self.dimension, components, keys)

    def axis(self, letter: str, keys: Keys) -> int:
        """Return the number of the direction x, y or z."""
        number = "xyz".index(letter)
        if number >= self.dimension:
            raise self.loaded.error(
                keys,
                f"a model of {self.dimension} dimensions has no direction {letter}",
                "models with bodies of formulation solid are 3D; all others are in the x-y plane",
            )
        return number

    def body(self, reference: str, keys: Keys) -> tuple[str, str]:
        """Return the body and the set of "body.set"."""
        body, dot, name = reference.partition(".")
        if not dot or body not in self.bodies:
            raise self.loaded.error(
                keys,
                f"'{reference}' does not name a set of a body",
                f'write body.set, such as "{next(iter(self.bodies))}.surface"; '
                f"bodies: {', '.join(self.bodies)}",
            )
        return body, name

    def node_set(self, reference: str, keys: Keys) -> np.ndarray:
        """Return the nodes of "body.set" or "cable.set", numbered within the model."""
        cable, _, name = reference.partition(".")
        if cable in self.cables:
            placed = self.cables[cable]
            return placed.first_node + self._member(placed.node_sets, reference, name, keys, "node")
        body, name = self.body(reference, keys)
        part = self.bodies[body]
        return part.first_node + self._member(part.mesh.node_sets, reference, name, keys, "node")

    def facet_set(self, reference: str, keys: Keys) -> np.ndarray:
        """Return the facets of "body.set", numbered within the model."""
        body, name = self.body(reference, keys)
        part = self.bodies[body]
        return part.first_node + self._member(part.mesh.facet_sets, reference, name, keys, "facet")

    def _member(
        self, sets: Mapping[str, np.ndarray], reference: str, name: str, keys: Keys, kind: str
    ) -> np.ndarray:
        if name not in sets:
            raise self.loaded.error(
                keys,
                f"there is no {kind} set '{reference}'",
                close_names(name, list(sets), f"{kind} sets"),
            )
        return sets[name]

    def bounded(self, facets: np.ndarray) -> Iterator[tuple[MeshedBody, MeshedRegion, np.ndarray]]:
        """Yield body, region and numbers of the facets (k, corners) on elements of each region."""
        for body in self.bodies.values():
            here = np.flatnonzero(body.has_nodes(facets).all(axis=1))
            if not len(here):
                continue
            owner = facet_owners(facets[here] - body.first_node, body.mesh.cells)
            for region in body.regions:
                chosen = here[np.isin(owner, region.numbers)]
                if len(chosen):
                    yield body, region, chosen

    def common_geometry(self, facets: np.ndarray, keys: Keys) -> "Geometry":
        """Return the kinematics of the elements behind the facets of one chamber."""
        first, *others = [region.geometry for _, region, _ in self.bounded(facets)]
        if not all(first.bounds_with(other) for other in others):
            raise self.loaded.error(
                (*keys, "facets"),
                "the facets belong to bodies of different thickness or rings, or to such regions",
                "use a separate load for each",
            )
        return first

    def conditions(self, kind: type[S]) -> Iterator[tuple[Keys, S]]:
        """Yield the keys and the data of the conditions of a kind."""
        for name, condition in self.scene.conditions.items():
            if isinstance(condition, kind):
                yield ("conditions", name), condition

    def walls(self, kind: type[S]) -> dict[str, S]:
        """Return the data of the walls of a kind, by name."""
        walls = self.scene.environment.walls.items()
        return {name: wall for name, wall in walls if isinstance(wall, kind)}

    def require_wall(self, name: str, keys: Keys) -> None:
        """Raise SceneError if the scene has no wall of this name."""
        known = list(self.scene.environment.walls)
        if name not in known:
            raise self.loaded.error(
                keys, f"there is no wall '{name}'", close_names(name, known, "walls")
            )

    def rigid_number(self, name: str, keys: Keys) -> int:
        """Return the number of a rigid body."""
        names = list(self.scene.rigid_bodies)
        if name not in names:
            raise self.loaded.error(
                keys,
                f"there is no rigid body '{name}'",
                close_names(name, names, "rigid bodies"),
            )
        return names.index(name)


def model_vector(
    loaded: LoadedScene, dimension: int, components: Sequence[float], keys: Keys
) -> np.ndarray:
    """Return a vector (d,) of a model of d dimensions; a z that is left out is zero."""
    if len(components) > dimension:
        raise loaded.error(
            keys,
            f"has {len(components)} components; this model has {dimension}",
            "models with bodies of formulation solid are 3D; all others are in the x-y plane",
        )
    return np.array([*components, *[0.0] * (dimension - len(components))], dtype=float)


def close_names(name: str, known: list[str], kind: str) -> str:
    """Return a hint with the known names that `name` may mean, and all known names."""
    close = difflib.get_close_matches(name, known, n=3, cutoff=0.5)
    listed = ", ".join(known) if known else "none"
    meant = f"did you mean {' or '.join(repr(c) for c in close)}? " if close else ""
    return f"{meant}{kind}: {listed}"


def in_mm(place: np.ndarray) -> str:
    """Return a place [m] as text in mm."""
    return "(" + ", ".join(f"{c * 1e3:.2f}" for c in place) + ") mm"


# -------------------------------------------------------------------------------------------------
# Sets that a scene defines on a body.
#
# A set is a box, one side of a plane, or the union, intersection or difference of further sets. It
# may have nodes, facets and cells.

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
