"""Terrain of a scene: shapes on level ground, as walls along polylines."""

from collections.abc import Callable

import numpy as np

from softsim.builder.names import Names
from softsim.builder.polylines import in_plane, placed_wall
from softsim.contact import terrain
from softsim.contact.polyline import checked_polyline
from softsim.contact.polyline_wall import PolylineWall
from softsim.errors import MeshError
from softsim.scene.terrain import PrintedTerrain, RampWall, SemicircleWall, StepFieldWall, Terrain
from softsim.scene.tree import Keys

GROUND = 0.2
"""Length of the drawn ground before and behind a shape [m]; the ground continues beyond."""


def terrains(names: Names) -> list[PolylineWall]:
    """Return the terrains of a scene."""
    walls = names.scene.environment.walls.items()
    return [built_terrain(names, name, w) for name, w in walls if isinstance(w, Terrain)]


def built_terrain(names: Names, name: str, wall: Terrain) -> PolylineWall:
    """Return a shape on its ground."""
    keys = ("environment", "walls", name)
    shape = SHAPES[type(wall)](names, wall, keys)
    if isinstance(wall, PrintedTerrain) and wall.layers is not None:
        shape = terrain.layered(shape, wall.layers)
    ground = terrain.on_ground(shape, in_plane(names, wall.foot, (*keys, "foot")), GROUND)
    return placed_wall(names, name, checked_polyline(ground, False))


def ramp(names: Names, wall: RampWall, keys: Keys) -> np.ndarray:
    """Return the points of a ramp."""
    if wall.plateau < wall.height:
        raise names.loaded.error(
            (*keys, "plateau"),
            f"plateau: {1e3 * wall.plateau:g} mm is less than the height of the ramp, "
            f"{1e3 * wall.height:g} mm",
            "the body must fit on the plateau: make it at least as long as the robot",
        )
    return terrain.ramp(wall.slope, wall.height, wall.plateau)


def semicircle(names: Names, wall: SemicircleWall, keys: Keys) -> np.ndarray:
    """Return the points of the upper half of a cylinder."""
    return terrain.half_round(wall.radius)


def step_field(names: Names, wall: StepFieldWall, keys: Keys) -> np.ndarray:
    """Return the points of a field of steps."""
    try:
        heights = terrain.step_heights(
            wall.rugosity, 1e3 * wall.mean_height, wall.blocks, wall.seed
        )
    except MeshError as error:
        raise names.loaded.error((*keys, "rugosity"), error.message, error.hint) from None
    return terrain.steps(1e-3 * heights, wall.block_length)


SHAPES: dict[type[Terrain], Callable[..., np.ndarray]] = {
    RampWall: ramp, SemicircleWall: semicircle, StepFieldWall: step_field,
}  # fmt: skip
