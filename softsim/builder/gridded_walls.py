"""Walls that go through a grid of distances: polylines in sections, STL surfaces in space."""

import numpy as np

from softsim.builder.names import Names
from softsim.contact import polyline, triangle_surface
from softsim.contact.distance_grid import DistanceGrid, SpacingError
from softsim.errors import MeshError
from softsim.mesh.mesh import SURFACE
from softsim.mesh.points_reading import read_points
from softsim.mesh.surface import read_surface
from softsim.scene.gridded_walls import PolylineWall, SurfaceWall


def gridded_walls(names: Names) -> list[DistanceGrid]:
    """The polylines and surfaces of a scene."""
    walls = names.scene.environment.walls.items()
    lines = [polyline_wall(names, n, w) for n, w in walls if isinstance(w, PolylineWall)]
    surfaces = [surface_wall(names, n, w) for n, w in walls if isinstance(w, SurfaceWall)]
    return lines + surfaces


def polyline_wall(names: Names, name: str, wall: PolylineWall) -> DistanceGrid:
    """A polyline of a section, its points from the scene or from a file."""
    keys = ("environment", "walls", name)
    if names.dimension != 2:
        raise names.loaded.error(
            (*keys, "kind"),
            "a polyline is a wall in the plane; this model is in space",
            "give its surface as an STL: kind: surface",
        )
    source = "points" if wall.file is None else "file"
    try:
        if wall.points is not None:
            places = [names.vector(p, (*keys, source, k)) for k, p in enumerate(wall.points)]
            points = np.array(places).reshape(-1, 2)
        else:
            points = read_points(names.loaded.resolve_file((*keys, source)), wall.length_unit)
        line = polyline.checked_polyline(points, wall.closed)
        return polyline.gridded(name, line, grid_spacing(names, wall))
    except SpacingError as error:
        raise names.loaded.error((*keys, "spacing"), error.message, error.hint) from None
    except MeshError as error:
        raise names.loaded.error((*keys, source), error.message, error.hint) from None


def surface_wall(names: Names, name: str, wall: SurfaceWall) -> DistanceGrid:
    """A closed surface in space, its normals turned into the free side."""
    keys = ("environment", "walls", name)
    if names.dimension != 3:
        raise names.loaded.error(
            (*keys, "kind"),
            "a surface is a wall in space; this model is in the plane",
            "give its section as points: kind: polyline",
        )
    try:
        mesh = read_surface(names.loaded.resolve_file((*keys, "file")), wall.length_unit)
        outwards = mesh.triangles
        triangles = {"outside": outwards, "inside": outwards[:, ::-1]}[wall.free_side]
        points = mesh.points + names.vector(wall.position, (*keys, "position"))
        surface = triangle_surface.TriangleSurface(points, triangles)
        return triangle_surface.gridded(name, surface, grid_spacing(names, wall))
    except SpacingError as error:
        raise names.loaded.error((*keys, "spacing"), error.message, error.hint) from None
    except MeshError as error:
        raise names.loaded.error((*keys, "file"), error.message, error.hint) from None


def grid_spacing(names: Names, wall: PolylineWall | SurfaceWall) -> float:
    """The user's, or the median edge of the surfaces of all bodies [m]: their nodes, as far apart,
    feel nothing finer.
    """
    if isinstance(wall.spacing, float):
        return wall.spacing
    edges = []
    for body in names.bodies.values():
        corners = body.mesh.points[body.mesh.facet_sets[SURFACE]]
        edges.append(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).ravel())
    return float(np.median(np.concatenate(edges)))
