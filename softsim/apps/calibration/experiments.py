"""Experiments of a calibration: slow inflation, and a push at one pressure.

The frame is held: the nodes tied to it get a prescribed displacement, zero except in a push.
Gravity, motors and other forces are left out; contact and friction stay as in the scene.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from softsim.scene.loading import LoadedScene, overridden
from softsim.scene.loads import FollowerPressureSpec
from softsim.scene.schema import Scene
from softsim.scene.text import Tree, plain
from softsim.scene.walls import PipeWall

# -------------------------------------------------------------------------------------------------
# Parts of a scene that a calibration uses, found by their kinds.


@dataclass(frozen=True)
class Specimen:
    """Scene with one air pressure in one pipe.

    pressure: name of the load. body: name of the body that it inflates. frame: name of the rigid
    body tied to that, None if its ends are fixed. pipe: name of the wall. diameter [m]: of the
    pipe.
    """

    loaded: LoadedScene
    pressure: str
    body: str
    frame: str | None
    pipe: str
    diameter: float

    @property
    def formulation(self) -> str:
        """Kinematics of the body."""
        return self.loaded.scene.bodies[self.body].formulation

    @property
    def axes(self) -> str:
        """Letters of the model's axes."""
        return "xyz" if self.formulation == "solid" else "xy"


def section_specimen(loaded: LoadedScene) -> Specimen:
    """Return the specimen of the plane section.

    Raises
    ------
    SceneError: it is not plane strain, or has not one follower pressure and one pipe.
    """
    return _specimen(loaded, ("plane_strain", "ring_section"), "the section must be")


def reference_specimen(loaded: LoadedScene) -> Specimen:
    """Return the specimen of the body that the section represents.

    Raises
    ------
    SceneError: it is neither solid nor axisymmetric, or has not one follower pressure and one pipe.
    """
    return _specimen(
        loaded, ("solid", "axisymmetric"), "the reference must be a body of formulation"
    )


def refuse_other_pipe(section: Specimen, reference: Specimen) -> None:
    """Raise SceneError unless both specimens are in pipes of the same diameter."""
    if abs(section.diameter - reference.diameter) > 1e-9 * reference.diameter:
        raise section.loaded.error(
            ("environment", "walls", section.pipe, "diameter"),
            f"the pipe of the section is {section.diameter * 1e3:g} mm wide, that of the "
            f"reference {reference.diameter * 1e3:g} mm",
            "choose one with --set or --set-reference "
            f"environment.walls.{reference.pipe}.diameter='{section.diameter * 1e3:g} mm'",
        )


def _specimen(loaded: LoadedScene, formulations: tuple[str, ...], role: str) -> Specimen:
    scene = loaded.scene
    for name, body in scene.bodies.items():
        if body.formulation not in formulations:
            raise loaded.error(
                ("bodies", name, "formulation"),
                f"'{name}' is {body.formulation}: {role} {' or '.join(formulations)}",
                "softsim calibrate-section SECTION_SCENE --reference SOLID_SCENE",
            )
    air = {n: load for n, load in scene.loads.items() if isinstance(load, FollowerPressureSpec)}
    if len(air) != 1:
        raise loaded.error(
            ("loads",),
            f"has {len(air)} loads of kind follower_pressure; one is needed",
            "give the scene one such load; its profile has no effect here",
        )
    pipes = {n: w for n, w in scene.environment.walls.items() if isinstance(w, PipeWall)}
    others = len(scene.environment.walls) - len(pipes)
    if len(pipes) != 1 or others:
        raise loaded.error(
            ("environment", "walls"),
            f"has {len(pipes)} pipes and {others} other walls; exactly one pipe is needed",
            "write environment: {walls: {pipe: {kind: pipe, diameter: 36 mm}}}",
        )
    (pressure, load), (pipe, wall) = next(iter(air.items())), next(iter(pipes.items()))
    inflated = load.facets[0].partition(".")[0]
    frames = [n for n, r in scene.rigid_bodies.items() if r.tied]
    if len(frames) > 1:
        raise loaded.error(
            ("rigid_bodies",),
            f"bodies are tied to {len(frames)} rigid bodies: {', '.join(frames)}; one is needed",
            "remove the others",
        )
    return Specimen(loaded, pressure, inflated, frames[0] if frames else None, pipe, wall.diameter)


# -------------------------------------------------------------------------------------------------
# The stiffness with which spikes hold a frame in its pipe, from a small displacement of it.


@dataclass(frozen=True)
class Move:
    """A displacement of the frame along `axis` by `distance` [m], from `begin` to `end` [s].

    Forces are read in the `rest` [s] before it and in the last `rest` before `until` [s].
    """

    axis: str
    distance: float
    begin: float
    end: float
    until: float
    rest: float


@dataclass(frozen=True)
class SpecimenStiffness:
    """Force over displacement [N/m], and how far the force still swings, over its change [-]."""

    value: float
    unrest: float


def stiffness(history: Mapping[str, np.ndarray], move: Move) -> SpecimenStiffness:
    """Stiffness along a move's axis: by how much the walls push back, over the distance."""
    time, force = history["time"], history[f"wall_force_{move.axis}"]
    before = force[(time > move.begin - move.rest) & (time <= move.begin)]
    after = force[(time > move.until - move.rest) & (time <= move.until)]
    change = float(before.mean() - after.mean())
    swing = 0.5 * float(np.ptp(after))
    return SpecimenStiffness(change / move.distance, abs(swing / change) if change else np.inf)


# -------------------------------------------------------------------------------------------------
# Scenes of the experiments.

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
