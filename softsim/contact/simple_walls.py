"""Walls whose gap is one formula: half spaces, capped cylinders, straight round pipes, balls."""

from abc import abstractmethod
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute.fields import real_field, vector_field
from softsim.compute.term import PerScenario
from softsim.compute.vectors import KERNEL, NUMPY
from softsim.contact.wall import Obstacle, Wall
from softsim.scene.names import Names
from softsim.scene.walls import CylinderWall, PipeWall, PlaneWall, SphereWall


class SimpleWall(Wall):
    """Wall whose gap is a formula of numbers and vectors."""

    @property
    @abstractmethod
    def parameters(self) -> tuple[np.ndarray, ...]:
        """Parameters of the formula: numbers (w,) or vectors (w, d) of all surfaces."""

    @staticmethod
    @abstractmethod
    def gap_and_normal(x, *parameters_and_m):
        """Return the signed gap [m] of points x to a surface, and the unit normal.

        After x come the parameters of the surface and the functions `m` of compute/vectors.py.
        """

    def gaps(self, x: np.ndarray) -> dict[str, np.ndarray]:
        of_surfaces = zip(*self.parameters, strict=True)
        return {
            name: self.gap_and_normal(x.T, *(p[..., None] for p in parameters), NUMPY)[0]
            for name, parameters in zip(self.names, of_surfaces, strict=True)
        }

    def obstacle(self, scenarios: Sequence["SimpleWall"], places: np.ndarray) -> "SimpleObstacle":
        return SimpleObstacle(scenarios)


class SimpleObstacle(Obstacle):
    """Kernel class of a SimpleWall; one entry of `walls` a scenario."""

    def __init__(self, walls: Sequence[SimpleWall]) -> None:
        self.count, self.kind = len(walls[0].names), type(walls[0]).__name__
        self.formula = ti.func(walls[0].gap_and_normal)
        of_all = [np.stack(p) for p in zip(*(wall.parameters for wall in walls), strict=True)]
        self.parameters = [real_field(p) if p.ndim == 2 else vector_field(p) for p in of_all]

    @ti.func
    def gap_and_normal(self, s, i, w, x):
        """Return the signed gap [m] of contact node i at x to surface w, and the unit normal."""
        parameters = [parameter[s, w] for parameter in ti.static(self.parameters)]
        return self.formula(x, *parameters, KERNEL)


# -------------------------------------------------------------------------------------------------
# Half spaces, in a section half planes; solid behind.


@dataclass(frozen=True)
class HalfSpaces(SimpleWall):
    """Half spaces, in a section half planes.

    surfaces: names. points (w, d) [m] on the planes. normals (w, d): unit normals into the free
    side.
    """

    surfaces: tuple[str, ...]
    points: PerScenario[np.ndarray]
    normals: PerScenario[np.ndarray]

    @property
    def names(self) -> tuple[str, ...]:
        return self.surfaces

    @property
    def parameters(self) -> tuple[np.ndarray, ...]:
        return self.points, self.normals

    @staticmethod
    def gap_and_normal(x, point, normal, m):
        return m.dot(x - point, normal), normal

    def touched_at_once(self) -> tuple[float, float]:
        """Return the bounds; of walls that face each other only one side is touched at a time."""
        normals = facing_one_way(self.normals)
        return len(normals), float(np.linalg.eigvalsh(normals.T @ normals)[-1])

    def drawn(self) -> dict[str, np.ndarray]:
        """Return a point and the normal of each half space."""
        return {"walls": np.concatenate([self.points, self.normals], axis=1)}


def facing_one_way(normals: np.ndarray) -> np.ndarray:
    """Return those of the unit normals (w, d) of half spaces that one node can touch together.

    Walls that face each other are far apart, so of two opposite sides only the one with more walls
    counts.
    """
    cosines = normals @ normals.T
    alike, opposite = (cosines > 1.0 - 1e-9).sum(axis=1), (cosines < 1e-9 - 1.0).sum(axis=1)
    first = np.array([tuple(n) > tuple(-n) for n in normals], dtype=bool)
    return normals[(alike > opposite) | ((alike == opposite) & first)]


# -------------------------------------------------------------------------------------------------
# Capped cylinders, free outside; in a section rectangles.

MERIDIANS = 48
"""Number of faces around the axis in the drawing of a cylinder or a ball."""


@dataclass(frozen=True)
class Cylinder(SimpleWall):
    """Cylinder `name` about `centre` (d,) [m] along coordinate number `axis`.

    `half_length` and `radius` in [m]; in a half section the axis is y.
    """

    name: PerScenario[str]
    centre: PerScenario[np.ndarray]
    axis: int
    half_length: PerScenario[float]
    radius: PerScenario[float]

    @property
    def names(self) -> tuple[str, ...]:
        return (self.name,)

    @property
    def parameters(self) -> tuple[np.ndarray, ...]:
        axis = np.eye(len(self.centre))[self.axis]
        return self.centre[None], axis[None], np.array([self.half_length]), np.array([self.radius])

    @staticmethod
    def gap_and_normal(x, centre, axis, half_length, radius, m):
        """Return the signed gap [m] of points x to the nearer of side and caps, and the normal.

        The edge between them is not treated separately: outside a cap the gap is at most the
        distance.
        """
        arm = x - centre
        along = m.dot(arm, axis)
        across = arm - along * axis
        distance = m.norm(across)
        side, cap = distance - radius, abs(along) - half_length
        of_side, of_cap = across / m.maximum(distance, 1e-12), m.sign(along) * axis
        return m.maximum(side, cap), m.where(cap > side, of_cap, of_side)

    def thickness(self) -> float:
        """Return the smaller of diameter and length [m]."""
        return 2.0 * min(self.radius, self.half_length)

    def drawn(self) -> dict[str, np.ndarray]:
        """Return a rectangle of lines in the plane, or the faces of side and caps in space."""
        if len(self.centre) == 2:  # clockwise: the free side is on the left
            half = np.full(2, self.radius)
            half[self.axis] = self.half_length
            corners = self.centre + half * np.array([[-1, -1], [-1, 1], [1, 1], [1, -1]])
            return {"wall_lines": np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)}
        angles = np.linspace(0.0, 2.0 * np.pi, MERIDIANS + 1)
        across = self.radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        along = np.repeat(self.half_length * np.array([-1.0, -1.0, 1.0, 1.0]), MERIDIANS + 1)
        places = np.zeros((4, MERIDIANS + 1, 3))
        places[1:3, :, [(self.axis + 1) % 3, (self.axis + 2) % 3]] = across
        places[..., self.axis] = along.reshape(4, -1)
        places += self.centre
        sides = [places[:-1, :-1], places[:-1, 1:], places[1:, 1:], places[1:, :-1]]
        return {"wall_faces": np.stack(sides, axis=2).reshape(-1, 4, 3)}


# -------------------------------------------------------------------------------------------------
# Straight pipes of circular section in space.


@dataclass(frozen=True)
class RoundPipes(SimpleWall):
    """Round pipes, free inside.

    surfaces: names. points (p, 3) [m]: points on the axes. axes (p, 3): unit vectors. radii (p,)
    [m].
    """

    surfaces: tuple[str, ...]
    points: PerScenario[np.ndarray]
    axes: PerScenario[np.ndarray]
    radii: PerScenario[np.ndarray]

    @property
    def names(self) -> tuple[str, ...]:
        return self.surfaces

    @property
    def parameters(self) -> tuple[np.ndarray, ...]:
        return self.points, self.axes, self.radii

    @staticmethod
    def gap_and_normal(x, point, axis, radius, m):
        arm = x - point
        across = arm - m.dot(arm, axis) * axis
        distance = m.norm(across)
        return radius - distance, -across / m.maximum(distance, 1e-12)

    def drawn(self) -> dict[str, np.ndarray]:
        """Return a point on the axis, its direction and the radius of each pipe."""
        return {"pipes": np.concatenate([self.points, self.axes, self.radii[:, None]], axis=1)}


# -------------------------------------------------------------------------------------------------
# Balls, free outside; in a section discs, in a half section balls on the axis.

PARALLELS = 24
"""Number of faces from pole to pole in the drawing of a ball."""


@dataclass(frozen=True)
class Sphere(SimpleWall):
    """Ball `name` about `centre` (d,) [m] with a radius [m]."""

    name: PerScenario[str]
    centre: PerScenario[np.ndarray]
    radius: PerScenario[float]

    @property
    def names(self) -> tuple[str, ...]:
        return (self.name,)

    @property
    def parameters(self) -> tuple[np.ndarray, ...]:
        return self.centre[None], np.array([self.radius])

    @staticmethod
    def gap_and_normal(x, centre, radius, m):
        arm = x - centre
        distance = m.norm(arm)
        return distance - radius, arm / m.maximum(distance, 1e-12)

    def thickness(self) -> float:
        """Return the diameter [m]."""
        return 2.0 * self.radius

    def drawn(self) -> dict[str, np.ndarray]:
        """Return a circle of lines in the plane, or faces in space."""
        around = np.linspace(0.0, 2.0 * np.pi, MERIDIANS + 1)
        if len(self.centre) == 2:  # clockwise: the free side is on the left
            circle = np.stack([np.cos(around), -np.sin(around)], axis=1)
            places = self.centre + self.radius * circle
            return {"wall_lines": np.stack([places[:-1], places[1:]], axis=1)}
        polar = np.linspace(0.0, np.pi, PARALLELS + 1)[:, None]
        normals = np.stack(
            np.broadcast_arrays(
                np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)
            ),
            axis=2,
        )
        p = self.centre + self.radius * normals
        sides = [p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]]
        return {"wall_faces": np.stack(sides, axis=2).reshape(-1, 4, 3)}


# -------------------------------------------------------------------------------------------------
# Simple walls of a scene.


def together(found: Sequence[str], motions: Collection[str]) -> list[list[str]]:
    """Return groups of walls that kernels treat together: all fixed ones, and each moving one."""
    standing = [name for name in found if name not in motions]
    return [group for group in (standing, *([n] for n in found if n in motions)) if group]


def flat_walls(names: Names, motions: Collection[str]) -> list[HalfSpaces]:
    """Return planes and, in a section, both sides of straight pipes."""
    flat: dict[str, list[tuple[str, np.ndarray, np.ndarray]]] = {}
    for name, wall in names.scene.environment.walls.items():
        keys = ("environment", "walls", name)
        if isinstance(wall, PlaneWall):
            normal = names.vector(wall.normal, (*keys, "normal"))
            point = names.vector(wall.point, (*keys, "point"))
            flat[name] = [(name, point, normal / np.linalg.norm(normal))]
        elif isinstance(wall, PipeWall) and names.dimension == 2:
            flat[name] = [(f"{name}{side}", p, n) for side, p, n in pipe_sides(names, wall)]
    result = []
    for group in together(list(flat), motions):
        surfaces, points, normals = zip(*(s for name in group for s in flat[name]), strict=True)
        result.append(HalfSpaces(surfaces, np.array(points), np.array(normals)))
    return result


def pipe_sides(names: Names, wall: PipeWall) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Return the sides of a straight pipe in a section: suffix of the name, a point, the normal."""
    if names.is_axisymmetric:
        return [("", np.array([0.5 * wall.diameter, 0.0]), np.array([-1.0, 0.0]))]
    return [
        (
            f".{side}",
            np.array([0.0, wall.axis_height + sign * 0.5 * wall.diameter]),
            np.array([0.0, -sign]),
        )
        for side, sign in (("top", 1.0), ("bottom", -1.0))
    ]


def round_pipes(names: Names, motions: Collection[str]) -> list[RoundPipes]:
    """Return straight pipes in space."""
    found = names.walls(PipeWall) if names.dimension == 3 else {}
    return [
        RoundPipes(
            tuple(group),
            np.array([[0.0, found[name].axis_height, 0.0] for name in group]),
            np.tile([1.0, 0.0, 0.0], (len(group), 1)),
            np.array([0.5 * found[name].diameter for name in group]),
        )
        for group in together(list(found), motions)
    ]


def spheres(names: Names, motions: Collection[str]) -> list[Sphere]:
    """Return spherical walls."""
    return [
        Sphere(name, centre_of(names, name, wall), 0.5 * wall.diameter)
        for name, wall in names.walls(SphereWall).items()
    ]


def cylinders(names: Names, motions: Collection[str]) -> list[Cylinder]:
    """Return capped cylinders."""
    found = []
    for name, wall in names.walls(CylinderWall).items():
        keys = ("environment", "walls", name, "direction")
        axis = names.axis(wall.direction, keys)
        if names.is_axisymmetric and axis != 1:
            raise names.loaded.error(keys, "y is the only axis of this model", "write y")
        centre = centre_of(names, name, wall)
        found.append(Cylinder(name, centre, axis, 0.5 * wall.length, 0.5 * wall.diameter))
    return found


def centre_of(names: Names, name: str, wall: SphereWall | CylinderWall) -> np.ndarray:
    """Return the centre (d,) [m] of a wall that lies on the axis of an axisymmetric model."""
    keys = ("environment", "walls", name, "center")
    centre = names.vector(wall.center, keys)
    if names.is_axisymmetric and centre[0] != 0.0:
        raise names.loaded.error(
            keys,
            f"a {wall.kind} away from the axis would be a ring",
            "write 0 mm for x, the radial direction",
        )
    return centre
