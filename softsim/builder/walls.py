"""Walls of a scene: construction, motion, and checks for bodies that start inside them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from softsim.builder.contact import ALLOWED_PENETRATION
from softsim.builder.gridded_walls import surface_walls
from softsim.builder.names import Names, close_names, in_mm
from softsim.builder.pipe_path import overlap, pipe_networks
from softsim.builder.polylines import polyline_walls
from softsim.builder.profiles import displacement
from softsim.builder.terrain import terrains
from softsim.contact.cylinder import Cylinder
from softsim.contact.fit import FittedWall
from softsim.contact.half_spaces import HalfSpaces
from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.round_pipes import RoundPipes
from softsim.contact.sphere import Sphere
from softsim.contact.wall import Wall
from softsim.elements.axisymmetric import Axisymmetric
from softsim.errors import SceneError
from softsim.loads.wall_motion import MovingWall
from softsim.scene.conditions import WallMotion
from softsim.scene.gridded_walls import SurfaceWall
from softsim.scene.polylines import PolylineWall
from softsim.scene.surroundings import (
    CylinderWall,
    PipePathWall,
    PipeWall,
    PlaneWall,
    SphereWall,
)
from softsim.scene.terrain import RampWall, SemicircleWall, StepFieldWall

ON_AXIS = (Sphere, Cylinder)
FITS = "for an interference fit write contact.interference_fit: [{}] and a time.settle"
APART = f"move the wall or the body so that they do not overlap; {FITS}"
# Part of the settling time in which a wall with an interference fit closes.
CLOSING = 0.5


def walls(names: Names) -> tuple[Wall, ...]:
    """Return all walls of the scene; those of a kind that kernels treat together are one."""
    motions = wall_motions(names)
    found = (
        *flat_walls(names, motions), *round_pipes(names, motions), *spheres(names),
        *cylinders(names), *pipe_networks(names), *surface_walls(names), *polyline_walls(names),
        *terrains(names),
    )  # fmt: skip
    return tuple(moving(names, wall, motions) for wall in found)


def wall_motions(names: Names) -> dict[str, str]:
    """Return the key of the condition that moves each moving wall, by the name of the wall."""
    moved: dict[str, str] = {}
    for key, condition in names.scene.conditions.items():
        if not isinstance(condition, WallMotion):
            continue
        walls, keys = list(names.scene.environment.walls), ("conditions", key, "wall")
        if condition.wall not in walls:
            hint = close_names(condition.wall, walls, "walls")
            raise names.loaded.error(keys, f"there is no wall '{condition.wall}'", hint)
        if condition.wall in moved:
            other = f"conditions.{moved[condition.wall]}"
            raise names.loaded.error(
                keys,
                f"'{condition.wall}' is already moved by {other}",
                "use only one condition for it",
            )
        moved[condition.wall] = key
    return moved


def moving(names: Names, wall: Wall, motions: Mapping[str, str]) -> Wall:
    """Return the wall, moved by its condition, if it has one."""
    name = wall_of(wall.names[0])
    if name not in motions:
        return wall
    keys = ("conditions", motions[name])
    condition = names.scene.conditions[motions[name]]
    assert isinstance(condition, WallMotion)
    axis = names.axis(condition.direction, (*keys, "direction"))
    if isinstance(names.geometry, Axisymmetric) and axis == 0 and isinstance(wall, ON_AXIS):
        raise names.loaded.error(
            (*keys, "direction"),
            f"moved in this direction, '{name}' would leave the axis",
            "move it along y",
        )
    if names.scene.layout is not None and isinstance(wall, PipeNetwork):
        raise names.loaded.error(
            (*keys, "wall"),
            f"a layout assesses the passage through '{name}', which must not move",
            "leave out the layout or the motion",
        )
    profile = displacement(names, condition, keys)
    return MovingWall(wall, axis, profile)


def wall_of(surface: str) -> str:
    """Return the name in the scene of the wall to which a surface belongs."""
    return surface.partition(".")[0]


def together(found: Sequence[str], motions: Mapping[str, str]) -> list[list[str]]:
    """Return groups of walls that kernels treat together: all fixed ones, and each moving one."""
    standing = [name for name in found if name not in motions]
    return [group for group in (standing, *([n] for n in found if n in motions)) if group]


def flat_walls(names: Names, motions: Mapping[str, str]) -> list[HalfSpaces]:
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
    if isinstance(names.geometry, Axisymmetric):
        return [("", np.array([0.5 * wall.diameter, 0.0]), np.array([-1.0, 0.0]))]
    return [
        (
            f".{side}",
            np.array([0.0, wall.axis_height + sign * 0.5 * wall.diameter]),
            np.array([0.0, -sign]),
        )
        for side, sign in (("top", 1.0), ("bottom", -1.0))
    ]


def round_pipes(names: Names, motions: Mapping[str, str]) -> list[RoundPipes]:
    """Return straight pipes in space."""
    found = {
        name: wall
        for name, wall in names.scene.environment.walls.items()
        if isinstance(wall, PipeWall) and names.dimension == 3
    }
    return [
        RoundPipes(
            tuple(group),
            np.array([[0.0, found[name].axis_height, 0.0] for name in group]),
            np.tile([1.0, 0.0, 0.0], (len(group), 1)),
            np.array([0.5 * found[name].diameter for name in group]),
        )
        for group in together(list(found), motions)
    ]


def spheres(names: Names) -> list[Sphere]:
    """Return spherical walls."""
    found = []
    for name, wall in names.scene.environment.walls.items():
        if isinstance(wall, SphereWall):
            found.append(Sphere(name, centre_of(names, name, wall), 0.5 * wall.diameter))
    return found


def cylinders(names: Names) -> list[Cylinder]:
    """Return capped cylinders."""
    found = []
    for name, wall in names.scene.environment.walls.items():
        if isinstance(wall, CylinderWall):
            keys = ("environment", "walls", name, "direction")
            axis = names.axis(wall.direction, keys)
            if isinstance(names.geometry, Axisymmetric) and axis != 1:
                raise names.loaded.error(keys, "y is the only axis of this model", "write y")
            centre = centre_of(names, name, wall)
            found.append(Cylinder(name, centre, axis, 0.5 * wall.length, 0.5 * wall.diameter))
    return found


def centre_of(names: Names, name: str, wall: SphereWall | CylinderWall) -> np.ndarray:
    """Return the centre (d,) [m] of a wall that lies on the axis of an axisymmetric model."""
    keys = ("environment", "walls", name, "center")
    centre = names.vector(wall.center, keys)
    if isinstance(names.geometry, Axisymmetric) and centre[0] != 0.0:
        raise names.loaded.error(
            keys,
            f"a {wall.kind} away from the axis would be a ring",
            "write 0 mm for x, the radial direction",
        )
    return centre


def fitted(names: Names, walls: Sequence[Wall], places: np.ndarray) -> tuple[Wall, ...]:
    """Return the walls, of which those with an interference fit recede from places (n, d) at first.

    Raises SceneError where such a wall is unknown or has corners, or where nothing settles.
    """
    wanted = names.scene.contact.interference_fit
    for k, name in enumerate(wanted):
        keys = ("contact", "interference_fit", k)
        known = list(names.scene.environment.walls)
        if name not in known:
            hint = close_names(name, known, "walls")
            raise names.loaded.error(keys, f"there is no wall '{name}'", hint)
        [wall] = [w for w in walls if name in map(wall_of, w.names)]
        if len(wall.corners()):
            raise names.loaded.error(
                keys,
                f"'{name}' has corners: facets that start around a corner cannot be moved out of "
                "it",
                "an interference fit is for walls without convex corners, such as pipes",
            )
    time = names.scene.time
    first = names.beginning.time == 0.0
    if wanted and first and (time.procedure == "static" or time.settle is None):
        raise names.loaded.error(
            ("contact", "interference_fit"),
            "an interference fit is closed during time.settle, and this scene does not settle "
            "before t = 0",
            "write time.settle: 0.2 s and time.procedure: dynamic (static steps may follow)",
        )
    # In later steps the walls have closed long since.
    settle = time.settle if time.settle is not None else 1.0
    return tuple(_fitted(wall, frozenset(wanted), places, settle) for wall in walls)


def _fitted(wall: Wall, wanted: frozenset[str], places: np.ndarray, settle: float) -> Wall:
    """Return the wall, with an interference fit of those of its surfaces that have one."""
    if not any(wall_of(name) in wanted for name in wall.names):
        return wall
    if isinstance(wall, MovingWall):
        return replace(wall, wall=_fitted(wall.wall, wanted, places, settle))
    gaps = wall.gaps(places)
    overlap = [max(0.0, -gaps[n].min()) if wall_of(n) in wanted else 0.0 for n in wall.names]
    return FittedWall(wall, np.array(overlap), -settle, CLOSING * settle)


def refuse_penetration(names: Names, walls: Sequence[Wall], places: np.ndarray) -> None:
    """Raise SceneError if a point that may touch a wall, at places (n, d), starts inside it."""
    for wall in walls:
        for surface, gap in wall.gaps(places).items():
            if gap.min() < -ALLOWED_PENETRATION:
                name = wall_of(surface)
                scene_wall = names.scene.environment.walls[name]
                raise OVERLAPS[type(scene_wall)](names, name, wall, places)


def plain_overlap(key: str, names: Names, name: str, wall: Wall, places: np.ndarray) -> SceneError:
    """Return the error, at a key of the wall `name`, for places (n, d) that start inside it."""
    problem = how_deep(name, wall, places)
    return names.loaded.error(("environment", "walls", name, key), problem, APART.format(name))


def pipe_overlap(names: Names, name: str, wall: Wall, places: np.ndarray) -> SceneError:
    """Return the error for places (n, d) that start inside the wall of the straight pipe `name`."""
    keys = ("environment", "walls", name, "diameter")
    pipe = names.scene.environment.walls[name]
    assert isinstance(pipe, PipeWall)
    # All of its gaps: the pipe may be too narrow on both sides.
    widest = pipe.diameter - 2.0 * least_gap(name, wall, places).min()
    enough = np.ceil((widest - 2.0 * ALLOWED_PENETRATION) * 1e6) / 1e3  # mm, up to a um
    hint = f"use a pipe with a diameter of at least {enough:g} mm; {FITS.format(name)}"
    return names.loaded.error(keys, how_deep(name, wall, places), hint)


def how_deep(name: str, wall: Wall, places: np.ndarray) -> str:
    """Return text on where and how far places (n, d) are inside a wall."""
    gap = least_gap(name, wall, places)
    worst = int(np.argmin(gap))
    return (
        f"wall '{name}' starts {-gap[worst] * 1e3:.3g} mm inside the body, deepest at "
        f"{in_mm(places[worst])}"
    )


def least_gap(name: str, wall: Wall, places: np.ndarray) -> np.ndarray:
    """Return the gap (n,) [m] of places (n, d) to the nearest surface of the wall `name`."""
    gaps = wall.gaps(places).items()
    return np.min([gap for surface, gap in gaps if wall_of(surface) == name], axis=0)


# What to say of bodies that start inside a wall, by the class of the wall in the scene.
OVERLAPS: dict[type, Callable[[Names, str, Any, np.ndarray], SceneError]] = {
    PlaneWall: partial(plain_overlap, "point"),
    SphereWall: partial(plain_overlap, "center"),
    CylinderWall: partial(plain_overlap, "center"),
    PipeWall: pipe_overlap,
    PipePathWall: overlap,
    PolylineWall: partial(plain_overlap, "kind"),
    SurfaceWall: partial(plain_overlap, "kind"),
    RampWall: partial(plain_overlap, "foot"),
    SemicircleWall: partial(plain_overlap, "foot"),
    StepFieldWall: partial(plain_overlap, "foot"),
}
