"""Walls along polylines, in a section or the same at every z."""

import numpy as np

from softsim.builder.names import Names
from softsim.contact.polyline import Polyline, checked_polyline
from softsim.contact.polyline_wall import PolylineWall
from softsim.errors import MeshError
from softsim.mesh.points_reading import read_points
from softsim.scene import polylines
from softsim.scene.quantities import Point
from softsim.scene.tree import Keys

DRAWN_BESIDE = 0.25
"""Width of a drawn wall in space beyond each side of the bodies, relative to their width."""


def polyline_walls(names: Names) -> list[PolylineWall]:
    """Return the polyline walls of a scene."""
    walls = names.scene.environment.walls.items()
    return [polyline_wall(names, n, w) for n, w in walls if isinstance(w, polylines.PolylineWall)]


def polyline_wall(names: Names, name: str, wall: polylines.PolylineWall) -> PolylineWall:
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
