"""Walls of a scene: construction, motion, and checks for bodies that start inside them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from softsim.applications import entry
from softsim.builder.pipe_path import overlap
from softsim.contact.forces import Penalty
from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.simple_walls import Cylinder, Sphere
from softsim.contact.surface_contact import ALLOWED_PENETRATION, ContactData
from softsim.contact.wall import FittedWall, Wall
from softsim.errors import SceneError
from softsim.loads.prescribed import MovingWall, displacement
from softsim.mesh.mesh import SURFACE
from softsim.mesh.surface import nodal_extents, weights_in_line
from softsim.model import Body, CornerData
from softsim.scene.conditions import WallMotion
from softsim.scene.names import Names, in_mm
from softsim.scene.text import Keys
from softsim.scene.walls import WALLS, PipePathWall, PipeWall

ON_AXIS = (Sphere, Cylinder)
FITS = "for an interference fit write contact.interference_fit: [{}] and a time.settle"
APART = f"move the wall or the body so that they do not overlap; {FITS}"
# Part of the settling time in which a wall with an interference fit closes.
CLOSING = 0.5


def walls(names: Names) -> tuple[Wall, ...]:
    """Return all walls of the scene; those of a kind that kernels treat together are one."""
    motions = wall_motions(names)
    return tuple(
        moving(names, wall, motions) for point in WALLS for wall in entry(point)(names, motions)
    )


def wall_motions(names: Names) -> dict[str, tuple[Keys, WallMotion]]:
    """Return the keys and the data of the condition that moves each moving wall, by its name."""
    moved: dict[str, tuple[Keys, WallMotion]] = {}
    for keys, condition in names.conditions(WallMotion):
        names.require_wall(condition.wall, (*keys, "wall"))
        if condition.wall in moved:
            raise names.loaded.error(
                (*keys, "wall"),
                f"'{condition.wall}' is already moved by conditions.{moved[condition.wall][0][-1]}",
                "use only one condition for it",
            )
        moved[condition.wall] = keys, condition
    return moved


def moving(names: Names, wall: Wall, motions: Mapping[str, tuple[Keys, WallMotion]]) -> Wall:
    """Return the wall, moved by its condition, if it has one."""
    name = wall_of(wall.names[0])
    if name not in motions:
        return wall
    keys, condition = motions[name]
    axis = names.axis(condition.direction, (*keys, "direction"))
    if names.is_axisymmetric and axis == 0 and isinstance(wall, ON_AXIS):
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
                said = OVERLAPS.get(type(scene_wall), plain_overlap)
                raise said(names, name, wall, places)


def plain_overlap(names: Names, name: str, wall: Wall, places: np.ndarray) -> SceneError:
    """Return the error, at the key of its place, for places (n, d) that start inside a wall."""
    keys = ("environment", "walls", name, names.scene.environment.walls[name].placed_by)
    return names.loaded.error(keys, how_deep(name, wall, places), APART.format(name))


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


# What to say of bodies that start inside a wall whose size is at fault.
OVERLAPS: dict[type, Callable[[Names, str, Any, np.ndarray], SceneError]] = {
    PipeWall: pipe_overlap,
    PipePathWall: overlap,
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

    def least(constants: np.ndarray) -> np.ndarray:
        """Return the smallest constant (1,) of the facets' nodes that may touch walls."""
        return constants[bears].min(keepdims=True)

    of_nodes = contact.penalty
    springs, dashpots = (of_nodes.k_n, of_nodes.k_t), (of_nodes.c_n, of_nodes.c_t)
    k_n, k_t = (share * least(constants) for constants in springs)
    c_n, c_t = (np.sqrt(share) * least(constants) for constants in dashpots)
    return CornerData(facets, size, Penalty(k_n, k_t, c_n, c_t), together)


def distance_between(corners: np.ndarray) -> float:
    """Return the least distance [m] between two of the corners (c, 2); infinite for one."""
    if len(corners) < 2:
        return np.inf
    distance, _ = cKDTree(corners).query(corners, 2)
    return float(distance[:, 1].min())
