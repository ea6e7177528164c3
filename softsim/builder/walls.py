"""Walls of a scene: construction, motion, and checks for bodies that start inside them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from softsim.builder.pipe_path import overlap, pipe_networks
from softsim.contact import terrain
from softsim.contact.grid import DistanceGrid, SpacingError, TriangleSurface, gridded
from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.polyline import Polyline, PolylineWall, checked_polyline
from softsim.contact.simple_walls import Cylinder, HalfSpaces, RoundPipes, Sphere
from softsim.contact.surface_contact import ALLOWED_PENETRATION, ContactData
from softsim.contact.wall import FittedWall, Wall
from softsim.elements.axisymmetric import Axisymmetric
from softsim.errors import MeshError, SceneError
from softsim.loads.prescribed import MovingWall, displacement
from softsim.mesh.mesh import SURFACE
from softsim.mesh.reading import read_points
from softsim.mesh.surface import nodal_extents, read_surface, weights_in_line
from softsim.model import Body, CornerData
from softsim.scene.conditions import WallMotion
from softsim.scene.names import Names, in_mm
from softsim.scene.quantities import Point
from softsim.scene.text import Keys
from softsim.scene.walls import (
    CylinderWall,
    PipePathWall,
    PipeWall,
    PlaneWall,
    PolylineWallSpec,
    PrintedTerrain,
    RampWall,
    SemicircleWall,
    SphereWall,
    StepFieldWall,
    SurfaceWall,
    Terrain,
)

# -------------------------------------------------------------------------------------------------
# Walls represented by a grid of distances: STL surfaces in space.


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
        surface = TriangleSurface(points, triangles)
        return gridded(name, surface, grid_spacing(names, wall))
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


# -------------------------------------------------------------------------------------------------
# Walls along polylines, in a section or the same at every z.

DRAWN_BESIDE = 0.25
"""Width of a drawn wall in space beyond each side of the bodies, relative to their width."""


def polyline_walls(names: Names) -> list[PolylineWall]:
    """Return the polyline walls of a scene."""
    walls = names.scene.environment.walls.items()
    return [polyline_wall(names, n, w) for n, w in walls if isinstance(w, PolylineWallSpec)]


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
# Terrain of a scene: shapes on level ground, as walls along polylines.

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
        keys = ("conditions", key, "wall")
        names.require_wall(condition.wall, keys)
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
        names.require_wall(name, keys)
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
    PolylineWallSpec: partial(plain_overlap, "kind"),
    SurfaceWall: partial(plain_overlap, "kind"),
    RampWall: partial(plain_overlap, "foot"),
    SemicircleWall: partial(plain_overlap, "foot"),
    StepFieldWall: partial(plain_overlap, "foot"),
}


# -------------------------------------------------------------------------------------------------
# Contact data of convex wall corners against the facets of bodies, in the plane.

LEAST_SHARE = 0.125
"""Least stiffness of a corner relative to that of a node, however many corners there are."""


def corner_data(
    bodies: Sequence[Body], points: np.ndarray, walls: Sequence[Wall], contact: ContactData
) -> CornerData | None:
    """Return the contact data of the corners of the walls, or None if they have none.

    A corner has the stiffness and damping of the softest and the lightest of the facets' nodes (of
    those at (n, d) [m]), since one or two of them bear it. The values are lower where corners are
    so close that several press between the same two nodes: together they are as stiff as one, down
    to LEAST_SHARE.
    """
    nearest = [distance_between(wall.corners()) for wall in walls if len(wall.corners())]
    if not nearest:
        return None
    facets = np.concatenate([body.facet_sets[SURFACE] for body in bodies])
    size = np.linalg.norm(points[facets[:, 0]] - points[facets[:, 1]], axis=1)
    widest = float(nodal_extents(points, facets).max())
    together = float(weights_in_line(np.array(widest / min(nearest))))
    share = max(1.0 / together, LEAST_SHARE)
    bears = np.isin(contact.nodes, facets)

    def least(constants: np.ndarray) -> float:
        """Return the smallest constant of those nodes of the facets that may touch walls."""
        return float(constants[bears].min())

    return CornerData(
        facets=facets,
        facet_size=size,
        penalty_stiffness=share * least(contact.penalty_stiffness),
        tangential_stiffness=share * least(contact.tangential_stiffness),
        damping=np.sqrt(share) * least(contact.damping),
        tangential_damping=np.sqrt(share) * least(contact.tangential_damping),
        together=together,
    )


def distance_between(corners: np.ndarray) -> float:
    """Return the least distance [m] between two of the corners (c, 2); infinite for one."""
    if len(corners) < 2:
        return np.inf
    distance, _ = cKDTree(corners).query(corners, 2)
    return float(distance[:, 1].min())
