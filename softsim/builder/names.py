"""Lookup of names in a scene: node sets, facet sets, rigid bodies; vectors of its space."""

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from softsim.elements.geometry import Geometry
from softsim.mesh.bearing import side_lengths
from softsim.mesh.mesh import SURFACE, Mesh
from softsim.scene.loading import LoadedScene
from softsim.scene.schema import Scene
from softsim.scene.steps import Beginning
from softsim.scene.tree import Keys


@dataclass(frozen=True)
class MeshedRegion:
    """Cells of a body's mesh by number, with their cell set and their kinematics.

    cell_set: None for the cells that are in no region of the scene.
    """

    cell_set: str | None
    numbers: np.ndarray
    geometry: Geometry


@dataclass(frozen=True)
class MeshedBody:
    """Placed mesh of a body, with its numbering and kinematics.

    first_node: number of its first node in the model. geometry: kinematics without regions.
    remarks: on its mesh file; not_read: what else the file contains.
    """

    mesh: Mesh
    first_node: int
    geometry: Geometry
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
    def geometry(self) -> Geometry:
        """Kinematics of the first body; the others have the same formulation."""
        return next(iter(self.bodies.values())).geometry

    @property
    def dimension(self) -> int:
        """Coordinates of a node: 2 or 3."""
        return self.geometry.dimension

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
