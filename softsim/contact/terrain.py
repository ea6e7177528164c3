"""Walls along polylines in a scene: given by points, or terrains of known shape."""

from collections.abc import Callable, Collection

import numpy as np

from softsim.contact.polyline import Polyline, PolylineWall, cross
from softsim.errors import MeshError
from softsim.mesh.reading import read_points
from softsim.scene.names import Names
from softsim.scene.quantities import Point
from softsim.scene.text import Keys
from softsim.scene.walls import (
    PolylineWallSpec,
    PrintedTerrain,
    RampWall,
    SemicircleWall,
    StepFieldWall,
    Terrain,
)

# -------------------------------------------------------------------------------------------------
# Checks of a polyline.


def checked_polyline(points: np.ndarray, closed: bool) -> Polyline:
    """Return the polyline along points (n, 2) [m] after checks.

    The last point of a closed one may repeat the first. Raises MeshError if there are too few
    points, two neighbours are the same, an edge folds back on the one before it, or edges cross or
    touch, including the straight continuations of an open one.
    """
    if closed and len(points) > 1 and np.array_equal(points[0], points[-1]):
        points = points[:-1]
    least = 3 if closed else 2
    if len(points) < least:
        raise MeshError(
            f"a polyline of {len(points)} different points: at least {least} are needed",
            hint="list its points in order, with the free side on the left",
        )
    polyline = Polyline(points, closed)
    alike = np.flatnonzero((polyline.ways == 0.0).all(axis=1))
    if len(alike):
        raise MeshError(
            f"points {alike[0]} and {(alike[0] + 1) % len(points)} (counted from 0) are the same",
            hint="leave one of them out",
        )
    size = np.ptp(points, axis=0).max()
    crossing = first_crossing(polyline.prolonged(1e3 * size))
    if crossing is not None:
        one, other, place = crossing
        where = " (extended straight beyond the ends)" if not closed else ""
        raise MeshError(
            f"the polyline crosses itself: edges {one} and {other}{where}, counted from 0, at "
            f"({place[0] * 1e3:.6g}, {place[1] * 1e3:.6g}) mm",
            hint="a wall has a free and a solid side: it must not cross, touch or fold back on "
            "itself",
        )
    return polyline


def first_crossing(polyline: Polyline) -> tuple[int, int, np.ndarray] | None:
    """Return two edges of a polyline with a common point, and that point (2,) [m]; or None.

    The common corner of neighbours does not count.
    """
    low, high = polyline.boxes()
    count = len(low)
    order = np.argsort(low[:, 0], kind="stable")
    # Edges whose ranges of x overlap: in order of their beginnings, those up to the own end.
    last = np.searchsorted(low[order, 0], high[order, 0], side="right")
    for k in range(count):
        one, others = order[k], order[k + 1 : last[k]]
        others = others[(low[others, 1] <= high[one, 1]) & (high[others, 1] >= low[one, 1])]
        for other in others[_meet(polyline, one, others)]:
            i, j = sorted((int(one), int(other)))
            return i, j, _meeting_place(polyline, i, j)
    return None


def _meet(polyline: Polyline, one: int, others: np.ndarray) -> np.ndarray:
    """Return a mask of the edges `others` (k,) that meet edge `one`.

    Neighbours count only where they fold back.
    """
    starts, ways, count = polyline.starts, polyline.ways, len(polyline.starts)
    a, b = starts[one], starts[one] + ways[one]
    c, d = starts[others], starts[others] + ways[others]
    across = np.sign(cross(ways[one], c - a)) * np.sign(cross(ways[one], d - a)) <= 0.0
    across &= np.sign(cross(ways[others], a - c)) * np.sign(cross(ways[others], b - c)) <= 0.0
    step = others - one
    if polyline.closed:
        neighbours = (step % count == 1) | (step % count == count - 1)
    else:
        neighbours = np.abs(step) == 1
    along = (polyline.directions[others] * polyline.directions[one]).sum(axis=1)
    folded = along < -1.0 + 1e-12
    return np.where(neighbours, folded, across)


def _meeting_place(polyline: Polyline, one: int, other: int) -> np.ndarray:
    """Return the common point (2,) [m] of two edges; of two on one line, a corner on both."""
    starts, ways = polyline.starts, polyline.ways
    a, way, c = starts[one], ways[one], starts[other]
    turn = float(cross(way, ways[other]))
    if turn != 0.0:
        return np.asarray(a + way * cross(c - a, ways[other]) / turn)
    for corner in (c, c + ways[other]):
        if 0.0 <= (corner - a) @ way <= way @ way:
            return corner
    return a


# -------------------------------------------------------------------------------------------------
# Polylines of a scene, in a section or the same at every z.

DRAWN_BESIDE = 0.25
"""Width of a drawn wall in space beyond each side of the bodies, relative to their width."""


def polyline_walls(names: Names, motions: Collection[str]) -> list[PolylineWall]:
    """Return the polyline walls of a scene."""
    return [polyline_wall(names, *named) for named in names.walls(PolylineWallSpec).items()]


def polyline_wall(names: Names, name: str, wall: PolylineWallSpec) -> PolylineWall:
    """Return one polyline wall, with its points from the scene or from a file."""
    keys = ("environment", "walls", name)
    source = "points" if wall.file is None else "file"
    try:
        if wall.points is not None:
            places = [in_plane(names, p, (*keys, source, k)) for k, p in enumerate(wall.points)]
            points = np.array(places).reshape(-1, 2)
        else:
            points = read_points(names.loaded.resolve_file((*keys, source)), wall.length_unit)
        return placed_wall(names, name, checked_polyline(points, wall.closed))
    except MeshError as error:
        raise names.loaded.error((*keys, source), error.message, error.hint) from None


def placed_wall(names: Names, name: str, line: Polyline) -> PolylineWall:
    """Return the wall `name` along a polyline; in space it is drawn wider than the bodies."""
    if names.dimension == 2:
        return PolylineWall(name, line, None)
    z = np.concatenate([body.mesh.points[:, 2] for body in names.bodies.values()])
    beside = DRAWN_BESIDE * float(np.ptp(z))
    return PolylineWall(name, line, (float(z.min()) - beside, float(z.max()) + beside))


def in_plane(names: Names, point: Point, keys: Keys) -> np.ndarray:
    """Return a point (2,) [m] of a polyline."""
    place = names.vector(point, keys)
    if place[2:].any():
        raise names.loaded.error(
            keys,
            "the wall is the same at every z, so its points have no z coordinate",
            "leave the third coordinate out",
        )
    return place[:2]


# -------------------------------------------------------------------------------------------------
# Terrains as points of a polyline: ramp, half round, field of steps.
#
# x points forward, y up, and the ground before the obstacle is at y = 0; the free side is on the
# left in the direction of the points. These are the terrains of the thesis (5.3.1, 5.3.2).

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
