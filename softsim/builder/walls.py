"""Walls of a scene, and bodies that start inside them."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from softsim.builder.contact import ALLOWED_PENETRATION
from softsim.builder.gridded_walls import gridded_walls
from softsim.builder.names import Names, in_mm
from softsim.builder.pipe_path import overlap, pipe_paths
from softsim.contact.half_spaces import HalfSpaces
from softsim.contact.round_pipes import RoundPipes
from softsim.contact.sphere import Sphere
from softsim.contact.wall import Wall
from softsim.elements.axisymmetric import Axisymmetric
from softsim.errors import SceneError
from softsim.scene.gridded_walls import PolylineWall, SurfaceWall
from softsim.scene.surroundings import PipePathWall, PipeWall, PlaneWall, SphereWall

APART = "move the wall or the body so that they do not overlap"


def walls(names: Names) -> tuple[Wall, ...]:
    """All walls of the scene; those of a kind that kernels take together are one."""
    return (
        *flat_walls(names), *round_pipes(names), *spheres(names), *pipe_paths(names),
        *gridded_walls(names),
    )  # fmt: skip


def flat_walls(names: Names) -> list[HalfSpaces]:
    """Planes, and in a section both sides of straight pipes."""
    flat: list[tuple[str, np.ndarray, np.ndarray]] = []
    for name, wall in names.scene.environment.walls.items():
        keys = ("environment", "walls", name)
        if isinstance(wall, PlaneWall):
            normal = names.vector(wall.normal, (*keys, "normal"))
            point = names.vector(wall.point, (*keys, "point"))
            flat.append((name, point, normal / np.linalg.norm(normal)))
        elif isinstance(wall, PipeWall) and names.dimension == 2:
            flat += [(f"{name}{side}", p, n) for side, p, n in pipe_sides(names, wall)]
    if not flat:
        return []
    found, points, normals = zip(*flat, strict=True)
    return [HalfSpaces(found, np.array(points), np.array(normals))]


def pipe_sides(names: Names, wall: PipeWall) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Sides of a straight pipe in a section: what they add to its name, a point, the normal."""
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


def round_pipes(names: Names) -> list[RoundPipes]:
    """Straight pipes in space."""
    found = {
        name: wall
        for name, wall in names.scene.environment.walls.items()
        if isinstance(wall, PipeWall) and names.dimension == 3
    }
    if not found:
        return []
    return [
        RoundPipes(
            tuple(found),
            np.array([[0.0, wall.axis_height, 0.0] for wall in found.values()]),
            np.tile([1.0, 0.0, 0.0], (len(found), 1)),
            np.array([0.5 * wall.diameter for wall in found.values()]),
        )
    ]


def spheres(names: Names) -> list[Sphere]:
    """Balls."""
    found = []
    for name, wall in names.scene.environment.walls.items():
        if isinstance(wall, SphereWall):
            keys = ("environment", "walls", name, "center")
            centre = names.vector(wall.center, keys)
            if isinstance(names.geometry, Axisymmetric) and centre[0] != 0.0:
                raise names.loaded.error(
                    keys, "a ball beside the axis would be a ring", "write 0 mm for x, the radius"
                )
            found.append(Sphere(name, centre, 0.5 * wall.diameter))
    return found


def refuse_penetration(names: Names, walls: Sequence[Wall], places: np.ndarray) -> None:
    """Nothing that may touch a wall, at places (n, d), starts inside it."""
    for wall in walls:
        for surface, gap in wall.gaps(places).items():
            if gap.min() < -ALLOWED_PENETRATION:
                name = surface.partition(".")[0]
                scene_wall = names.scene.environment.walls[name]
                raise OVERLAPS[type(scene_wall)](names, name, wall, places)


def plain_overlap(key: str, names: Names, name: str, wall: Wall, places: np.ndarray) -> SceneError:
    """What is wrong where places (n, d) start in the wall `name`, told at one of its keys."""
    problem = how_deep(name, wall, places)
    return names.loaded.error(("environment", "walls", name, key), problem, APART)


def pipe_overlap(names: Names, name: str, wall: Wall, places: np.ndarray) -> SceneError:
    """What is wrong where places (n, d) start inside the wall of the straight pipe `name`."""
    keys = ("environment", "walls", name, "diameter")
    pipe = names.scene.environment.walls[name]
    assert isinstance(pipe, PipeWall)
    # All of its gaps: the pipe may be too narrow on both sides.
    widest = pipe.diameter - 2.0 * least_gap(name, wall, places).min()
    enough = np.ceil((widest - 2.0 * ALLOWED_PENETRATION) * 1e6) / 1e3  # mm, up to a um
    hint = f"a pipe that takes it has a diameter of at least {enough:g} mm"
    return names.loaded.error(keys, how_deep(name, wall, places), hint)


def how_deep(name: str, wall: Wall, places: np.ndarray) -> str:
    """Where and how far places (n, d) are inside a wall."""
    gap = least_gap(name, wall, places)
    worst = int(np.argmin(gap))
    return (
        f"wall '{name}' starts {-gap[worst] * 1e3:.3g} mm inside the body, deepest at "
        f"{in_mm(places[worst])}"
    )


def least_gap(name: str, wall: Wall, places: np.ndarray) -> np.ndarray:
    """Gap (n,) [m] of places (n, d) to the nearest of the surfaces of the wall `name`."""
    gaps = wall.gaps(places).items()
    return np.min([gap for surface, gap in gaps if surface.partition(".")[0] == name], axis=0)


# What to say of bodies that start inside a wall, by the class of the wall in the scene.
OVERLAPS: dict[type, Callable[[Names, str, Any, np.ndarray], SceneError]] = {
    PlaneWall: partial(plain_overlap, "point"),
    SphereWall: partial(plain_overlap, "center"),
    PipeWall: pipe_overlap,
    PipePathWall: overlap,
    PolylineWall: partial(plain_overlap, "kind"),
    SurfaceWall: partial(plain_overlap, "kind"),
}
