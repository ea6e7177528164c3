"""The scenes of a calibration: slow inflation, and a push at one pressure.

The frame is held: the nodes tied to it get a prescribed displacement, zero except in a push.
Gravity, motors and other forces are left out; contact and friction stay as in the scene.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from softsim.calibration.specimen import Move, Specimen
from softsim.scene.loading import LoadedScene, overridden
from softsim.scene.schema import Scene
from softsim.scene.text import Tree, plain

HISTORY_ROWS = 300
FRAMES = 6
RISE_POINTS = 41
"""Points of the smooth rise: its chord is off by at most 6/(8 n^2), 5e-4 of the pressure."""

PUSH_DISTANCE = 0.05e-3
"""Displacement of the frame [m]: half of m_e r_e / m = 0.1 mm, by which its motor shakes a free
robot."""

MOVE_TIME, REST_TIME, SETTLING_TIME = 30e-3, 20e-3, 250e-3
"""Seconds in which the frame moves, over which a force is read, and given to a force to settle:
twice the slowest branch of the library's silicones, 0.12 s, by which an inflated skin creeps on."""

Points = Sequence[tuple[float, float]]


@dataclass(frozen=True)
class Push:
    """A push of the frame: its scene, and the moves in it."""

    scene: LoadedScene
    moves: tuple[Move, ...]


def inflation(specimen: Specimen, highest: float, duration: float) -> LoadedScene:
    """Return the scene of a smooth pressure rise to `highest` [Pa] within `duration` [s]."""
    return _quasi_static(specimen, _smooth_rise(highest, duration), {}, duration)


def push(specimen: Specimen, pressure: float, duration: float) -> Push:
    """Return the scene of a push of the inflated body.

    The pressure rises to `pressure` [Pa] within `duration` [s] and is held; then the frame moves
    transverse to the pipe, along y, and after that along the pipe, x.
    """
    moves, begin = [], duration + SETTLING_TIME
    for axis in ("y", "x"):
        end = begin + MOVE_TIME
        until = end + SETTLING_TIME
        moves.append(Move(axis, PUSH_DISTANCE, begin, end, until, REST_TIME))
        begin = until
    courses = {
        move.axis: [(0.0, 0.0), (move.begin, 0.0), (move.end, move.distance)] for move in moves
    }
    rise = _smooth_rise(pressure, duration)
    return Push(_quasi_static(specimen, rise, courses, begin), tuple(moves))


def _quasi_static(
    specimen: Specimen, pressure: Points, courses: Mapping[str, Points], end: float
) -> LoadedScene:
    """Return the scene with its air pressure as the only load, and the frame held or moved.

    pressure: points [s, Pa]. courses: axis -> points [s, m] of the displacement of the frame.
    """
    tree = _only_load(specimen.loaded.tree, specimen.pressure)
    for override in _overrides(specimen, pressure, courses, end):
        tree = overridden(tree, override)
    return replace(specimen.loaded, scene=Scene.model_validate(plain(tree)), tree=tree)


def _only_load(tree: Tree, name: str) -> Tree:
    """Return `tree` without any other load."""
    top = plain_mapping(tree)
    loads = top["loads"]
    kept = replace(loads, value={name: plain_mapping(loads)[name]})
    return replace(tree, value={**top, "loads": kept})


def plain_mapping(tree: Tree) -> dict[str, Tree]:
    """Return the entries of a tree that is a mapping."""
    assert isinstance(tree.value, dict)  # the scene is valid
    return tree.value


def _overrides(
    specimen: Specimen, pressure: Points, courses: Mapping[str, Points], end: float
) -> Iterator[str]:
    air = f"loads.{specimen.pressure}"
    yield f"{air}.profile={_table(pressure, 'Pa')}"
    yield f"{air}.on_skin=[]"
    yield f"{air}.factor=1.0"
    yield f"{air}.offset=0 Pa"
    yield f"{air}.reacts_on=null"
    yield "environment.gravity=0 m/s^2"
    yield f"time.end={end!r} s"
    yield "time.procedure=dynamic"
    yield f"output.history_interval={end / HISTORY_ROWS!r} s"
    yield f"output.frame_interval={end / FRAMES!r} s"
    yield "expect={}"
    if specimen.frame is None:
        return
    frame = f"rigid_bodies.{specimen.frame}"
    tied = specimen.loaded.scene.rigid_bodies[specimen.frame].tied
    yield f"{frame}.tied=[]"
    yield f"{frame}.free=[]"
    for number, nodes in enumerate(tied):
        for axis in specimen.axes:
            course = courses.get(axis, [(0.0, 0.0), (end, 0.0)])
            yield (
                f"conditions.calibration_{number}_{axis}={{kind: prescribed, nodes: {nodes}, "
                f"direction: {axis}, displacement: {_table(course, 'm')}}}"
            )


def _smooth_rise(highest: float, duration: float) -> Points:
    """Return points [s, Pa] of highest u^2 (3 - 2 u), u = time / duration."""
    u = np.linspace(0.0, 1.0, RISE_POINTS)
    values = highest * u**2 * (3.0 - 2.0 * u)
    return list(zip((duration * u).tolist(), values.tolist(), strict=True))


def _table(points: Points, unit: str) -> str:
    """Return a profile of kind table as YAML."""
    listed = ", ".join(f"[{t!r} s, {value!r} {unit}]" for t, value in points)
    return f"{{kind: table, points: [{listed}]}}"
