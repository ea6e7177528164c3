"""The parts of a scene that a calibration uses, found by their kinds."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from softsim.scene.loading import LoadedScene
from softsim.scene.loads import FollowerPressureSpec
from softsim.scene.walls import PipeWall


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
