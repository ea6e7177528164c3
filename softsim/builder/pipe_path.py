"""Pipes along a path: from the items of a scene to segments, and what is wrong with them."""

import numpy as np

from softsim.builder.contact import ALLOWED_PENETRATION
from softsim.builder.names import Names, in_mm
from softsim.contact import pipe_layout
from softsim.contact.pipe_path import PipePath
from softsim.elements.axisymmetric import Axisymmetric
from softsim.errors import SceneError
from softsim.scene.pipe_items import PipeItem, StepItem, StraightItem, TaperItem
from softsim.scene.surroundings import PipePathWall
from softsim.scene.tree import Keys, nearest

# Diameters and lengths that differ by less are the same: rounding of units.
ALIKE = 1e-9


def pipe_paths(names: Names) -> list[PipePath]:
    """All pipes along a path. SceneError where one cannot be built, or runs into itself."""
    return [
        pipe_path(names, name, wall)
        for name, wall in names.scene.environment.walls.items()
        if isinstance(wall, PipePathWall)
    ]


def pipe_path(names: Names, name: str, wall: PipePathWall) -> PipePath:
    """One of them."""
    keys = ("environment", "walls", name)
    if isinstance(names.geometry, Axisymmetric):
        raise names.loaded.error(
            (*keys, "kind"),
            "a half section of revolution has no path to follow",
            "write kind: pipe, a straight pipe about the axis y",
        )
    refuse_idle_steps(names, keys, wall)
    refuse_wrong_diameters(names, keys, wall)
    items = [layout_item(names, (*keys, "pipe", k), item) for k, item in enumerate(wall.pipe)]
    path = pipe_layout.path_of_items(
        name, items, wall.diameter, names.vector(wall.start, (*keys, "start")),
        ("start" in wall.closed, "end" in wall.closed),
    )  # fmt: skip
    refuse_tight_bends(names, keys, path)
    refuse_crossing(names, keys, path)
    return path


def layout_item(names: Names, keys: Keys, item: PipeItem) -> pipe_layout.Item:
    """An item as `pipe_layout` takes it: bends turn by a positive angle towards a side."""
    if isinstance(item, StraightItem):
        return pipe_layout.Straight(item.straight)
    if isinstance(item, TaperItem):
        return pipe_layout.Taper(item.taper, item.to)
    if isinstance(item, StepItem):
        return pipe_layout.Step(item.step)
    if names.dimension == 2 and item.turned != 0.0:
        raise names.loaded.error(
            (*keys, "turned"),
            "a bend cannot be turned out of the plane of a section",
            "leave turned out; to the right: bend: -90 deg",
        )
    return pipe_layout.Bend(abs(item.bend), item.radius, item.turned + (item.bend < 0.0) * np.pi)


def refuse_idle_steps(names: Names, keys: Keys, wall: PipePathWall) -> None:
    """A step lies between two items that have a length."""
    if isinstance(wall.pipe[0], StepItem):
        raise names.loaded.error(
            (*keys, "pipe", 0),
            "a pipe cannot begin with a step",
            "give the diameter at which it starts as diameter of the wall",
        )
    last = len(wall.pipe) - 1
    if isinstance(wall.pipe[last], StepItem):
        raise names.loaded.error(
            (*keys, "pipe", last),
            "nothing comes after this step",
            "go on with a straight, or leave the step out",
        )


def refuse_wrong_diameters(names: Names, keys: Keys, wall: PipePathWall) -> None:
    """An item that states its diameter begins where the last one ended."""
    diameter = wall.diameter
    for k, item in enumerate(wall.pipe):
        if item.diameter is not None and abs(item.diameter - diameter) > ALIKE:
            raise names.loaded.error(
                (*keys, "pipe", k, "diameter"),
                f"the pipe is {in_words(diameter)} wide where this begins, not "
                f"{in_words(item.diameter)}",
                "put a taper or a step between",
            )
        if isinstance(item, TaperItem):
            diameter = item.to
        elif isinstance(item, StepItem):
            diameter = item.step


def refuse_tight_bends(names: Names, keys: Keys, path: PipePath) -> None:
    """On the inner side of a bend there is a wall only if its radius is larger than the pipe's."""
    for segment in path.segments:
        least = segment.radii[0]
        if segment.bend_radius <= least + ALIKE:
            raise names.loaded.error(
                (*keys, "pipe", segment.item, "radius"),
                f"a bend of radius {in_words(segment.bend_radius)} is too tight for a pipe "
                f"{in_words(2.0 * least)} wide: its inner side would run into itself",
                f"the radius of the centre line must be more than {in_words(least)}",
            )


def refuse_crossing(names: Names, keys: Keys, path: PipePath) -> None:
    """No two segments lie in each other."""
    found = pipe_layout.crossing(path)
    if found is None:
        return
    first, second = (segment.item for segment in found)
    origin = nearest(names.loaded.tree, (*keys, "pipe", first))[0].origin
    raise names.loaded.error(
        (*keys, "pipe", second),
        f"the pipe runs into itself: pipe[{second}], {found[1].kind}, meets pipe[{first}], "
        f"{found[0].kind}, of {origin}",
        "make it lead past itself, in space by bends that are turned",
    )


def overlap(names: Names, name: str, path: PipePath, places: np.ndarray) -> SceneError:
    """What is wrong where places (n, d) of bodies start inside the wall of the path `name`."""
    keys = ("environment", "walls", name)
    gap = path.gap(places)
    worst = int(np.argmin(gap))
    number, along, _ = (one[worst] for one in path.coordinates(places))
    deepest = f"deepest at {in_mm(places[worst])}"
    if along < 0.0 or along > path.segments[number].length:
        end = "start" if along < 0.0 else "end"
        return names.loaded.error(
            (*keys, "closed"),
            f"a body starts beyond the closed {end} of '{name}', {deepest}",
            f"move the body, or the pipe, or leave its {end} open",
        )
    segment = path.segments[number]
    numbers, lengths, distances = path.coordinates(places)
    inside = (numbers == number) & (gap < -ALLOWED_PENETRATION)
    # As far out as that of the radius at its beginning.
    farthest = (distances - segment.slope * lengths)[inside].max()
    enough = np.ceil((2.0 * farthest - 2.0 * ALLOWED_PENETRATION) * 1e6) / 1e3  # mm, up to a um
    return names.loaded.error(
        (*keys, "pipe", segment.item),
        f"pipe[{segment.item}] of '{name}', {segment.kind}, starts {-gap[worst] * 1e3:.3g} mm "
        f"inside the body, {deepest}",
        f"a pipe that takes it is at least {enough:g} mm wide where this begins",
    )


def in_words(length: float) -> str:
    """A length [m] as people read it."""
    return f"{length * 1e3:g} mm"
