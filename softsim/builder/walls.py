"""Walls of a scene, and bodies that start inside them."""

from collections.abc import Sequence

import numpy as np

from softsim.builder.contact import ALLOWED_PENETRATION
from softsim.builder.gridded_walls import gridded_walls
from softsim.builder.names import Names, in_mm
from softsim.contact.half_spaces import HalfSpaces
from softsim.contact.round_pipes import RoundPipes
from softsim.contact.wall import Wall
from softsim.elements.geometry import Axisymmetric
from softsim.scene.surroundings import PipeWall, PlaneWall


def walls(names: Names) -> tuple[Wall, ...]:
    """All walls of the scene; those of a kind that kernels take together are one."""
    return (*flat_walls(names), *round_pipes(names), *gridded_walls(names))


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


def refuse_penetration(names: Names, walls: Sequence[Wall], places: np.ndarray) -> None:
    """Nothing that may touch a wall, at places (n, d), starts inside it."""
    gaps = {name: gap for wall in walls for name, gap in wall.gaps(places).items()}
    for name, gap in gaps.items():
        worst = int(np.argmin(gap))
        if gap[worst] >= -ALLOWED_PENETRATION:
            continue
        key = name.partition(".")[0]
        wall = names.scene.environment.walls[key]
        hint, value = "move the wall or the body so that they do not overlap", "point"
        if isinstance(wall, PipeWall):
            # All of its gaps: the pipe may be too narrow on both sides.
            sides = [g.min() for side, g in gaps.items() if side.partition(".")[0] == key]
            widest = wall.diameter - 2.0 * min(sides)
            enough = np.ceil((widest - 2.0 * ALLOWED_PENETRATION) * 1e6) / 1e3  # mm, up to a um
            hint = f"a pipe that takes it has a diameter of at least {enough:g} mm"
            value = "diameter"
        raise names.loaded.error(
            ("environment", "walls", key, value),
            f"wall '{key}' starts {-gap[worst] * 1e3:.3g} mm inside the body, deepest at "
            f"{in_mm(places[worst])}",
            hint,
        )
