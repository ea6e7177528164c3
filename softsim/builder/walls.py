"""Walls and pipes of a scene: construction, motion, checks for bodies that start inside them."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from softsim.applications import entry
from softsim.contact import pipe_layout
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
from softsim.scene.bodies import WallMotion
from softsim.scene.names import Names, close_names, in_mm
from softsim.scene.text import Keys, nearest
from softsim.scene.walls import (
    WALLS,
    BendItem,
    CrossItem,
    PipeItem,
    PipePathWall,
    PipeWall,
    StepItem,
    StraightItem,
    TaperItem,
    TeeItem,
)

# -------------------------------------------------------------------------------------------------
# Pipes along a path: conversion of the items of a scene to segments, with checks.


# Key of the pipe of the start, beside which its branches stand.
PIPE = "pipe"
# Angle [rad] about the direction of travel, from the left, by the side that a branch leaves to.
SIDES = {"left": 0.0, "right": np.pi}
# Diameters and lengths that differ by less are the same: rounding of units.
SAME_LENGTH = 1e-9
LENGTHS = ("straight", "radius", "taper", "to", "step", "tee", "cross", "fillet", "diameter")
# A pipe is at most so many times as long as it is wide at its start, and may widen by as much.
LARGEST_RATIO = 1e5


def pipe_networks(names: Names, motions: Collection[str]) -> list[PipeNetwork]:
    """Return all pipes along a path.

    Raises SceneError if one cannot be built, or crosses itself.
    """
    return [pipe_network(names, *named) for named in names.walls(PipePathWall).items()]


def pipe_network(names: Names, name: str, wall: PipePathWall) -> PipeNetwork:
    """Return the pipes of one wall along a path.

    Raises SceneError if they cannot be built, or cross each other.
    """
    keys = ("environment", "walls", name)
    if names.is_axisymmetric:
        raise names.loaded.error(
            (*keys, "kind"),
            "a pipe_path is not possible in an axisymmetric model",
            "write kind: pipe, a straight pipe around the axis y",
        )
    refuse_loose_branches(names, keys, wall)
    refuse_unknown_ends(names, keys, wall)
    refuse_idle_steps(names, keys, wall)
    refuse_absurd_sizes(names, keys, wall)
    start_diameter = {PIPE: wall.diameter}
    laid: dict[str, list[pipe_layout.Item]] = {}
    for place, listed in reached_from_the_start(wall):
        along = list(with_diameters(listed, start_diameter[str(place[-1])]))
        refuse_wrong_diameters(names, (*keys, *place), along)
        laid[str(place[-1])] = [
            layout_item(names, (*keys, *place, k), item, diameter)
            for k, (item, diameter) in enumerate(along)
        ]
        for item in laid[str(place[-1])]:
            if isinstance(item, pipe_layout.Fork):
                start_diameter |= dict.fromkeys(item.sides, item.to)
    network = pipe_layout.network_of_items(
        name, laid[PIPE], {branch: laid[branch] for branch in wall.branches}, wall.diameter,
        names.vector(wall.start, (*keys, "start")), wall.closed,
    )  # fmt: skip
    refuse_short_forks(names, keys, wall, network)
    refuse_tight_bends(names, keys, wall, network)
    refuse_crossing(names, keys, wall, network)
    return network


def pipes(wall: PipePathWall) -> dict[Keys, tuple[PipeItem, ...]]:
    """Return the items of each pipe by its keys in the wall: the main pipe, then the branches."""
    return {(PIPE,): wall.pipe} | {("branches", n): listed for n, listed in wall.branches.items()}


def key_of_item(wall: PipePathWall, number: int) -> Keys:
    """Return the keys in the wall of an item as pipe_layout.network_of_items numbers them."""
    return [(*place, k) for place, listed in pipes(wall).items() for k in range(len(listed))][
        number
    ]


def label(key: Keys) -> str:
    """Return the name of an item for messages: pipe[2], or left[0] of a branch."""
    return f"{key[-2]}[{key[-1]}]"


def sides_of(item: PipeItem) -> dict[str, str]:
    """Return the branches that leave at an item, by the side: left, right."""
    if not isinstance(item, TeeItem | CrossItem):
        return {}
    return {side: name for side in SIDES if (name := getattr(item, side)) is not None}


def ends_in_a_tee(listed: Sequence[PipeItem]) -> bool:
    """Return True if a pipe ends where two others leave it."""
    return isinstance(listed[-1], TeeItem) and len(sides_of(listed[-1])) == len(SIDES)


def reached_from_the_start(wall: PipePathWall) -> list[tuple[Keys, tuple[PipeItem, ...]]]:
    """Return the pipes reached from the start, each after the one it leaves: keys and items."""
    found: list[tuple[Keys, tuple[PipeItem, ...]]] = [((PIPE,), wall.pipe)]
    for _, listed in found:  # grows on the way
        found += [
            (("branches", name), wall.branches[name])
            for item in listed
            for name in sides_of(item).values()
        ]
    return found


def refuse_loose_branches(names: Names, keys: Keys, wall: PipePathWall) -> None:
    """Raise SceneError unless each branch leaves exactly one pipe and is reached from the start."""
    taken: dict[str, str] = {}
    for place, listed in pipes(wall).items():
        for k, item in enumerate(listed):
            for side, branch in sides_of(item).items():
                at = (*keys, *place, k, side)
                if branch not in wall.branches:
                    raise names.loaded.error(
                        at,
                        f"there is no branch '{branch}'",
                        close_names(branch, list(wall.branches), "branches"),
                    )
                if branch in taken:
                    raise names.loaded.error(
                        at,
                        f"the branch '{branch}' already leaves from {taken[branch]}",
                        "give each side its own branch",
                    )
                taken[branch] = label((*place, k))
            if k + 1 < len(listed) and ends_in_a_tee(listed[: k + 1]):
                raise names.loaded.error(
                    (*keys, *place, k + 1),
                    f"no pipe leads to this item: the path ends in {label((*place, k))}, a tee "
                    "with pipes to both sides",
                    "write cross instead of tee to continue straight on",
                )
    # Every branch leaves one pipe at most: so those that meet are no ring, and can be followed.
    reached = {place[-1] for place, _ in reached_from_the_start(wall)}
    for branch in wall.branches:
        if branch not in reached:
            raise names.loaded.error(
                (*keys, "branches", branch),
                f"the pipes are not connected: no path leads from the start to the exit '{branch}'",
                f"add a tee or cross that leads there, such as {{tee: 90 mm, left: {branch}}}",
            )


def refuse_unknown_ends(names: Names, keys: Keys, wall: PipePathWall) -> None:
    """Raise SceneError if the scene closes an end that does not exist."""
    ends = ["start"] + [
        "end" if place == (PIPE,) else str(place[-1])
        for place, listed in pipes(wall).items()
        if not ends_in_a_tee(listed)
    ]
    for k, end in enumerate(wall.closed):
        if end not in ends:
            raise names.loaded.error(
                (*keys, "closed", k),
                f"'{end}' is not one of: {', '.join(ends)}",
                close_names(end, ends, "ends"),
            )


def with_diameters(listed: Sequence[PipeItem], diameter: float) -> Iterator[tuple[PipeItem, float]]:
    """Yield each item of a pipe and the diameter [m] of the pipe where the item begins."""
    for item in listed:
        yield item, diameter
        if isinstance(item, TaperItem):
            diameter = item.to
        elif isinstance(item, StepItem):
            diameter = item.step


def layout_item(names: Names, keys: Keys, item: PipeItem, diameter: float) -> pipe_layout.Item:
    """Return an item in the form of `pipe_layout`, where the pipe is `diameter` [m] wide.

    Bends turn by a positive angle towards a side.
    """
    if isinstance(item, StraightItem):
        return pipe_layout.Straight(item.straight)
    if isinstance(item, TaperItem):
        return pipe_layout.Taper(item.taper, item.to)
    if isinstance(item, StepItem):
        return pipe_layout.DiameterStep(item.step)
    if names.dimension == 2 and item.turned != 0.0:
        raise names.loaded.error(
            (*keys, "turned"),
            f"a {('bend' if isinstance(item, BendItem) else 'pipe')} cannot be turned out of the "
            "plane of a 2D model",
            "leave turned out; for a bend to the right write bend: -90 deg, or the side right",
        )
    if isinstance(item, BendItem):
        turned = item.turned + (item.bend < 0.0) * np.pi
        return pipe_layout.Bend(abs(item.bend), item.radius, turned)
    return fork(names, keys, item, diameter)


def fork(names: Names, keys: Keys, item: TeeItem | CrossItem, diameter: float) -> pipe_layout.Fork:
    """Return a tee or a cross in a pipe `diameter` [m] wide.

    Raises SceneError if a pipe that leaves it is wider than the one that it leaves.
    """
    goes_on = not ends_in_a_tee([item])
    to = diameter if item.to is None else item.to
    run, branch = (diameter, to) if goes_on else (to, diameter)
    if branch > run + SAME_LENGTH:
        raise names.loaded.error(
            (*keys, "to"),
            f"a pipe {in_words(branch)} wide does not fit a pipe {in_words(run)} wide: it would "
            "stick out of it",
            f"the side pipes must be at {('most' if goes_on else 'least')} {in_words(diameter)} "
            "wide",
        )
    length = item.cross if isinstance(item, CrossItem) else item.tee
    angles = {n: item.turned + SIDES[side] for side, n in sides_of(item).items()}
    return pipe_layout.Fork(length, angles, to, goes_on, item.fillet)


def refuse_short_forks(names: Names, keys: Keys, wall: PipePathWall, network: PipeNetwork) -> None:
    """Raise SceneError if a branch's first segment is shorter than the reach of its junction."""
    lengths = {
        branch.path.segments[0].item: branch.path.segments[0].length
        for branch in network.branches[1:]
    }
    junctions = pipe_layout.junctions_by_item(network)
    for number, length in lengths.items():
        reach = junctions[number].reach
        if length < reach - SAME_LENGTH:
            at = key_of_item(wall, number)
            raise names.loaded.error(
                (*keys, *at),
                f"{label(at)} is {in_words(2.0 * length)} long: too short for its pipes and edges",
                f"make it at least {in_words(np.ceil(2000.0 * reach) / 1e3)} long",
            )


def refuse_idle_steps(names: Names, keys: Keys, wall: PipePathWall) -> None:
    """Raise SceneError if the main pipe starts with a step, or any pipe ends with one."""
    if isinstance(wall.pipe[0], StepItem):
        raise names.loaded.error(
            (*keys, "pipe", 0),
            "a pipe cannot start with a step",
            "set the initial diameter as the diameter of the wall",
        )
    for place, listed in pipes(wall).items():
        if isinstance(listed[-1], StepItem):
            raise names.loaded.error(
                (*keys, *place, len(listed) - 1),
                "a step cannot be the last item",
                "add a straight after it, or leave the step out",
            )


def refuse_absurd_sizes(names: Names, keys: Keys, wall: PipePathWall) -> None:
    """Raise SceneError if a size is more than LARGEST_RATIO times the wall's diameter.

    Diameters of tapers and steps must not be smaller by more than this factor either.
    """
    for place, listed in pipes(wall).items():
        for k, item in enumerate(listed):
            for key in LENGTHS:
                size = getattr(item, key, None) or wall.diameter
                ratio = size / wall.diameter
                if key in ("to", "step"):
                    ratio = max(ratio, 1.0 / ratio)
                if ratio > LARGEST_RATIO:
                    raise names.loaded.error(
                        (*keys, *place, k, key),
                        f"{in_words(size)} in a pipe that starts {in_words(wall.diameter)} wide: "
                        f"the sizes differ by more than a factor of {LARGEST_RATIO:g}",
                        "check the units of this size and of the wall's diameter",
                    )


def refuse_wrong_diameters(
    names: Names, keys: Keys, along: Sequence[tuple[PipeItem, float]]
) -> None:
    """Raise SceneError if an item states another diameter than that at which the last one ended."""
    for k, (item, diameter) in enumerate(along):
        if item.diameter is not None and abs(item.diameter - diameter) > SAME_LENGTH:
            raise names.loaded.error(
                (*keys, k, "diameter"),
                f"the pipe is {in_words(diameter)} wide at the start of this item, not "
                f"{in_words(item.diameter)}",
                "add a taper or a step before it",
            )


def refuse_tight_bends(names: Names, keys: Keys, wall: PipePathWall, network: PipeNetwork) -> None:
    """Raise SceneError if the radius of a bend is not larger than that of its pipe.

    The inner side of such a bend has no wall.
    """
    for segment in (segment for branch in network.branches for segment in branch.path.segments):
        least = segment.radii[0]
        if segment.bend_radius <= least + SAME_LENGTH:
            raise names.loaded.error(
                (*keys, *key_of_item(wall, segment.item), "radius"),
                f"a bend of radius {in_words(segment.bend_radius)} is too tight for a pipe "
                f"{in_words(2.0 * least)} wide: its inner side would overlap itself",
                f"the radius of the centre line must be greater than {in_words(least)}",
            )


def refuse_crossing(names: Names, keys: Keys, wall: PipePathWall, network: PipeNetwork) -> None:
    """Raise SceneError if two segments overlap."""
    found = pipe_layout.crossing(network)
    if found is None:
        return
    first, second = (key_of_item(wall, segment.item) for segment in found)
    origin = nearest(names.loaded.tree, (*keys, *first))[0].origin
    raise names.loaded.error(
        (*keys, *second),
        f"the pipe crosses itself: {label(second)}, {found[1].kind}, meets {label(first)}, "
        f"{found[0].kind}, of {origin}",
        "change the course of the pipe, in 3D for example by turned bends",
    )


def overlap(names: Names, name: str, network: PipeNetwork, places: np.ndarray) -> SceneError:
    """Return the error for places (n, d) of bodies inside the wall of the pipes `name`."""
    keys = ("environment", "walls", name)
    wall = names.scene.environment.walls[name]
    assert isinstance(wall, PipePathWall)
    gap = network.gap(places)
    worst = int(np.argmin(gap))
    branch = network.branches[network.locate(places[worst : worst + 1])[0][0]]
    path = branch.path
    number, along, _ = (one[worst] for one in path.coordinates(places))
    deepest = f"deepest at {in_mm(places[worst])}"
    before = along < 0.0 and branch.parent is None
    if before or along > path.segments[number].length:
        end = "start" if before else "end"
        return names.loaded.error(
            (*keys, "closed"),
            f"a body starts beyond the closed {end} of '{name}', {deepest}",
            f"move the body or the pipe, or leave the {end} of the pipe open",
        )
    segment = path.segments[number]
    numbers, lengths, distances = path.coordinates(places)
    inside = (numbers == number) & (gap < -ALLOWED_PENETRATION)
    # As far out as that of the radius at its beginning.
    farthest = (distances - segment.slope * lengths)[inside].max()
    enough = np.ceil((2.0 * farthest - 2.0 * ALLOWED_PENETRATION) * 1e6) / 1e3  # mm, up to a um
    at = key_of_item(wall, segment.item)
    return names.loaded.error(
        (*keys, *at),
        f"{label(at)} of '{name}', {segment.kind}, starts {-gap[worst] * 1e3:.3g} mm inside the "
        f"body, {deepest}",
        f"the body needs a pipe at least {enough:g} mm wide at its start",
    )


def in_words(length: float) -> str:
    """Return a length [m] as text in mm."""
    return f"{length * 1e3:g} mm"


# -------------------------------------------------------------------------------------------------
# Walls: construction, motion, and checks for bodies that start inside them.


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
