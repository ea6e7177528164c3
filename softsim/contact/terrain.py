"""Terrains of known shape as points of a polyline: ramp, half round, field of steps.

x points forward, y up, and the ground before the obstacle is at y = 0; the free side is on the left
in the direction of the points. These are the terrains of the thesis (5.3.1, 5.3.2).
"""

from collections.abc import Callable, Collection

import numpy as np

from softsim.contact.polyline import PolylineWall, checked_polyline, in_plane, placed_wall
from softsim.errors import MeshError
from softsim.scene.names import Names
from softsim.scene.text import Keys
from softsim.scene.walls import (
    PrintedTerrain,
    RampWall,
    SemicircleWall,
    StepFieldWall,
    Terrain,
)

HEIGHTS = 1, 8  # mm of the thesis's blocks
BLOCK_HEIGHT = 8.0  # mm: of the rugosity Rg = SD / 8 mm (Eq 5.31)
MET = 0.02  # mm, by which mean and deviation of a field of steps may be off
MOST_DRAWS = 20_000
CHORD = 12.5e-6  # m, by which chords are off a circle


def ramp(slope: float, height: float, plateau: float) -> np.ndarray:
    """Return the points (5, 2) [m] of a ramp whose foot is the origin.

    It rises by `slope` [rad], vertically at 90 degrees, to a plateau, and drops vertically.
    """
    edge = height / np.tan(slope) if slope < 0.5 * np.pi - 1e-9 else 0.0
    end = edge + plateau
    return np.array([[0.0, 0.0], [edge, height], [end, height], [end, 0.0]])


def half_round(radius: float) -> np.ndarray:
    """Return the points (n, 2) [m] of the upper half of a circle whose foot is the origin, Eq 5.30.

    Its chords are off by CHORD at most.
    """
    turn = 2.0 * np.arccos(1.0 - min(1.0, CHORD / radius))
    angles = np.linspace(np.pi, 0.0, 2 + int(np.ceil(np.pi / turn)))
    points = radius * np.column_stack([1.0 + np.cos(angles), np.sin(angles)])
    points[[0, -1], 1] = 0.0
    return points


def step_heights(rugosity: float, mean: float, count: int, seed: int) -> np.ndarray:
    """Return the heights (count,) [mm] of the blocks of a field.

    They are whole millimetres from 1 to 8, drawn from a normal distribution until their mean and
    their standard deviation, rugosity times 8 mm, are met within MET. Raises MeshError if no draw
    meets them.
    """
    generator = np.random.default_rng(seed)
    deviation = BLOCK_HEIGHT * rugosity
    for _ in range(MOST_DRAWS):
        drawn = generator.normal(mean, deviation, count).round().clip(*HEIGHTS)
        if abs(drawn.mean() - mean) <= MET and abs(drawn.std() - deviation) <= MET:
            return drawn
    low, high = HEIGHTS
    raise MeshError(
        f"{MOST_DRAWS} random fields of {count} blocks of {low} to {high} mm include none with a "
        f"mean of {mean:g} mm and a standard deviation of {deviation:.3g} mm, within {MET:g} "
        "mm",
        hint="the fields of the thesis have 4.66 mm at a rugosity of 0.185 and 5.17 mm at 0.284; "
        "with more blocks a match is more likely",
    )


def steps(heights: np.ndarray, length: float) -> np.ndarray:
    """Return the points (n, 2) [m] of upright blocks side by side, the first at the origin.

    Heights are (k,) [m], `length` in [m]; blocks as high as their neighbour are merged.
    """
    levels = np.concatenate([[0.0], heights, [0.0]])
    places = length * np.arange(len(heights) + 1)
    corners = [
        [x, y]
        for x, before, after in zip(places, levels[:-1], levels[1:], strict=True)
        if before != after
        for y in (before, after)
    ]
    return np.array(corners)


def layered(points: np.ndarray, thickness: float) -> np.ndarray:
    """Return the outline of a print in layers of this thickness [m].

    Each layer is as long as the shape is at its middle: a stair of vertical and horizontal edges
    along points (n, 2) that rise, then fall.
    """
    top = int(points[:, 1].argmax())
    height = points[top, 1]
    count = max(1, round(height / thickness))
    tops = height / count * np.arange(1, count + 1)
    middles = tops - 0.5 * height / count
    up, down = points[: top + 1], points[top:][::-1]
    rising = np.interp(middles, up[:, 1], up[:, 0])
    falling = np.interp(middles, down[:, 1], down[:, 0])
    left = stair(rising, tops)
    right = stair(falling, tops)[::-1]
    return np.vstack([left, right])


def stair(places: np.ndarray, tops: np.ndarray) -> np.ndarray:
    """Return the corners (n, 2) of the risers of layers at x = places (k,).

    Each runs from the top of the layer below up to y = tops (k,).
    """
    below = np.concatenate([[0.0], tops[:-1]])
    corners = np.stack([np.column_stack([places, below]), np.column_stack([places, tops])], axis=1)
    flat = corners.reshape(-1, 2)
    same = np.append((np.diff(flat, axis=0) == 0.0).all(axis=1), False)
    return flat[~same]


def on_ground(points: np.ndarray, foot: np.ndarray, before: float) -> np.ndarray:
    """Return the shape (n, 2) with its foot at `foot` (2,) [m] and level ground around it.

    The ground extends `before` [m] in front of it and behind its last point, where the polyline
    continues straight.
    """
    placed = points + foot
    front, behind = foot - [before, 0.0], placed[-1] + [before, 0.0]
    return np.vstack([front[None], placed, behind[None]])


# -------------------------------------------------------------------------------------------------
# Terrains of a scene, as walls along polylines.


GROUND = 0.2
"""Length of the drawn ground before and behind a shape [m]; the ground continues beyond."""


def terrains(names: Names, motions: Collection[str]) -> list[PolylineWall]:
    """Return the terrains of a scene."""
    found = names.walls(Terrain)  # type: ignore[type-abstract]
    return [built_terrain(names, *named) for named in found.items()]


def built_terrain(names: Names, name: str, wall: Terrain) -> PolylineWall:
    """Return a shape on its ground."""
    keys = ("environment", "walls", name)
    shape = SHAPES[type(wall)](names, wall, keys)
    if isinstance(wall, PrintedTerrain) and wall.layers is not None:
        shape = layered(shape, wall.layers)
    ground = on_ground(shape, in_plane(names, wall.foot, (*keys, "foot")), GROUND)
    return placed_wall(names, name, checked_polyline(ground, False))


def built_ramp(names: Names, wall: RampWall, keys: Keys) -> np.ndarray:
    """Return the points of a ramp."""
    if wall.plateau < wall.height:
        raise names.loaded.error(
            (*keys, "plateau"),
            f"plateau: {1e3 * wall.plateau:g} mm is less than the height of the ramp, "
            f"{1e3 * wall.height:g} mm",
            "the body must fit on the plateau: make it at least as long as the robot",
        )
    return ramp(wall.slope, wall.height, wall.plateau)


def built_semicircle(names: Names, wall: SemicircleWall, keys: Keys) -> np.ndarray:
    """Return the points of the upper half of a cylinder."""
    return half_round(wall.radius)


def built_step_field(names: Names, wall: StepFieldWall, keys: Keys) -> np.ndarray:
    """Return the points of a field of steps."""
    try:
        heights = step_heights(wall.rugosity, 1e3 * wall.mean_height, wall.blocks, wall.seed)
    except MeshError as error:
        raise names.loaded.error((*keys, "rugosity"), error.message, error.hint) from None
    return steps(1e-3 * heights, wall.block_length)


SHAPES: dict[type[Terrain], Callable[..., np.ndarray]] = {
    RampWall: built_ramp, SemicircleWall: built_semicircle, StepFieldWall: built_step_field,
}  # fmt: skip
