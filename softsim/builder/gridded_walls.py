"""Walls represented by a grid of distances: STL surfaces in space."""

from softsim.builder.names import Names
from softsim.contact import triangle_surface
from softsim.contact.distance_grid import DistanceGrid, SpacingError
from softsim.errors import MeshError
from softsim.mesh.surface import read_surface
from softsim.scene.gridded_walls import SurfaceWall


def surface_walls(names: Names) -> list[DistanceGrid]:
    """Return the surface walls of a scene."""
    walls = names.scene.environment.walls.items()
    return [surface_wall(names, n, w) for n, w in walls if isinstance(w, SurfaceWall)]


def surface_wall(names: Names, name: str, wall: SurfaceWall) -> DistanceGrid:
    """Return a closed surface in space, with normals that point to the free side."""
    keys = ("environment", "walls", name)
    if names.dimension != 3:
        raise names.loaded.error(
            (*keys, "kind"),
            "a surface file describes a wall in 3D, but this model is 2D",
            "give the section of the wall as points: kind: polyline",
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


def grid_spacing(names: Names, wall: SurfaceWall) -> float:
    """Return the grid spacing [m]: the user's, or the median edge of the surfaces of all bodies.

    Nodes at that distance do not resolve anything finer.
    """
    if isinstance(wall.spacing, float):
        return wall.spacing
    return names.median_side
