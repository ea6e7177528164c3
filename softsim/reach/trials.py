"""The scenes of trials: the robot in a straight pipe, level or upright, pulls with a steady drag.

Level, the drag is friction: the robot's own load `tether` with another `drag`, which holds at rest
but does not pull back. Upright it is weight: a force on the frame against the way, at rest too,
which comes on with the first inflation; the robot starts on a floor. A section that stands for a
part of the robot along its axis (`axial_relief`) is given that part of the drag.

A trial lasts from the start to where the pressure begins to fall for the second time: its answer is
how far the robot is then from where it was when it began to fall for the first time, at the same
place of the cycle.

The pressure cycle is the robot's own, with the deflation rate and the lowest pressure that serve
its pipe best: Table 6.2 of the thesis, linear between its diameters.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np

from softsim.errors import StabilityError
from softsim.output.motion import fall_begins
from softsim.scene.assessment import QUESTIONS, REACH, robot_tree, said
from softsim.scene.bodies import BallOutline
from softsim.scene.chambers import FollowerPressure, Pneumatic
from softsim.scene.loading import LoadedScene, overridden, read_scene, validated
from softsim.scene.loads import AxialRelief, Tether
from softsim.scene.profiles import CyclesProfile, EventCyclesProfile
from softsim.scene.tree import Tree, merged

BEST = ((30e-3, 1.4e3, 9e3), (36e-3, 1.3e3, 11e3), (41e-3, 1.3e3, 12.5e3))
"""Diameter of the pipe [m], deflation rate [Pa/s], lowest pressure [Pa]: those that serve the
PufferFace Robot best (Table 6.2).
"""
DIAMETERS, DEFLATION_RATES, LOWEST = zip(*BEST, strict=True)

CYCLES = 2  # of a trial at most: from where the first begins to fall to where the second does
GAP = 1.5e-3  # m, between robot and floor at the start
SPARE = 0.1  # s, for rows of the history, and a controlled pressure that waits
SETTLE = "2 s"  # at most, before a level trial

NOT_OF_A_TRIAL = ("layout", "trailed", "expect", "time")
NOT_OF_ITS_SURROUNDINGS = ("walls", "inclination", "roll", "gravity")
"""Keys of a layout, and of its environment, that a trial does not take over."""


class Heading(Enum):
    """Where the pipe of a trial leads."""

    level = "level"
    upright = "upright"


@dataclass(frozen=True, order=True)
class TrialPipe:
    """A straight pipe: diameter [m]."""

    diameter: float
    heading: Heading

    @property
    def name(self) -> str:
        """Of its scene."""
        return f"{1e3 * self.diameter:g}mm_{self.heading.value}"


@dataclass(frozen=True)
class Puller:
    """What of a robot's scene a trial refers to: frame and loads by name; half of its length [m];
    the share of the robot that it stands for along its axis; its pressure cycle.
    """

    frame: str
    tether: str
    chamber: str
    half_length: float
    share: float
    profile: CyclesProfile | EventCyclesProfile

    @classmethod
    def of(cls, loaded: LoadedScene) -> "Puller":
        """Found in a scene. SceneError where it lacks what a trial needs."""
        scene = loaded.scene
        loads = scene.loads.items()
        frame = scene.robot.frame or next(iter(scene.rigid_bodies), "")
        outline = scene.rigid_bodies[frame].outline if frame in scene.rigid_bodies else None
        if outline is None or isinstance(outline, BallOutline):
            raise loaded.error(
                ("rigid_bodies",),
                "the robot has no frame with an outline length, from which the start of a tether "
                "follows",
                "give its rigid body an outline, such as {length: 33 mm, height: 15 mm}",
            )
        tethers = [n for n, load in loads if isinstance(load, Tether) and load.acts_on == frame]
        if not tethers:
            raise loaded.error(
                ("loads",),
                f"'{frame}' has no tether: there is no load of kind tether on it",
                "include robot:pfr/tether, or robot:pfr/solid_tether in 3D",
            )
        chambers = [n for n, load in loads if isinstance(load, FollowerPressure | Pneumatic)]
        chamber = scene.robot.chamber or next(iter(chambers), "")
        profile = getattr(scene.loads.get(chamber), "profile", None)
        if not isinstance(profile, CyclesProfile | EventCyclesProfile):
            raise loaded.error(
                ("loads", chamber, "profile") if chamber else ("loads",),
                "the pulling force is searched with the pressure cycle of the robot, and it has "
                "none",
                "give its pressure a profile of kind cycles, with rates, or event_cycles",
            )
        relief = [load.share for _, load in loads if isinstance(load, AxialRelief)]
        return cls(
            frame, tethers[0], chamber, 0.5 * outline.length, 1.0 - sum(relief), profile
        )  # fmt: skip


def trial_scene(
    layout: Path, robot: str, overrides: list[str], puller: Puller, pipe: TrialPipe, gravity: float
) -> LoadedScene:
    """The scene of the trials in a pipe, under `gravity` [m/s^2], without a drag.

    What the layout and the overrides say of the robot, its contact and the solver wins over the
    robot's standard and Table 6.2.
    """
    lower = merged(robot_tree(layout.parent, robot), said(best_cycle(puller, pipe), REACH))
    tree = merged(merged(said(QUESTIONS[REACH], REACH), lower), read_scene(layout))
    for override in overrides:
        tree = overridden(tree, override)
    own = Puller.of(validated(tree, layout, []))
    tree = without(tree, NOT_OF_A_TRIAL)
    assert isinstance(tree.value, dict)
    tree.value["environment"] = without(tree.value["environment"], NOT_OF_ITS_SURROUNDINGS)
    for text in surroundings(own, pipe, gravity):
        tree = merged(tree, said(text, REACH))
    return validated(tree, layout, [])


def without(tree: Tree, keys: tuple[str, ...]) -> Tree:
    """A mapping without some of its keys."""
    assert isinstance(tree.value, dict)
    kept = {key: value for key, value in tree.value.items() if key not in keys}
    return Tree(kept, tree.origin, tree.key_origin)


def best_cycle(puller: Puller, pipe: TrialPipe) -> str:
    """The pressure cycle that serves a pipe best, as YAML."""
    rate = np.interp(pipe.diameter, DIAMETERS, DEFLATION_RATES)
    lowest = np.interp(pipe.diameter, DIAMETERS, LOWEST)
    return f"""
loads:
  {puller.chamber}:
    profile: {{deflation_rate: {rate:.6g} Pa/s, lowest: {lowest:.6g} Pa}}
"""


def surroundings(puller: Puller, pipe: TrialPipe, gravity: float) -> tuple[str, str]:
    """The pipe of a trial and how long it lasts; what its heading adds, as YAML."""
    profile = puller.profile
    inflated = profile.start + profile.highest / profile.inflation_rate
    swing = profile.highest - profile.lowest
    longest = inflated + swing / profile.deflation_rate + swing / profile.inflation_rate
    longest += CYCLES * (profile.hold + getattr(profile, "rest", 0.0) + SPARE)
    common = f"""
environment:
  gravity: {gravity:.6g} m/s^2
  walls:
    pipe: {{kind: pipe, diameter: {1e3 * pipe.diameter:.6g} mm}}
time: {{end: {longest:.4g} s, cycles: {CYCLES}}}
output: {{history_interval: 5 ms, frame_interval: {longest:.4g} s}}
"""
    added = ADDED[pipe.heading].format(
        robot=puller, floor=-1e3 * (puller.half_length + GAP), settle=SETTLE, inflated=inflated
    )  # fmt: skip
    return common, added


ADDED = {
    Heading.level: """
title: Pulling force of the robot against friction
time: {{settle: {settle}}}
""",
    Heading.upright: """
title: Pulling force of the robot against a weight
environment:
  inclination: 90 deg
  walls:
    floor: {{kind: plane, point: [{floor:.6g} mm, 0 mm], normal: [1, 0]}}
loads:
  {robot.tether}: {{drag: 0 N, weight: 0 N}}
  trailed:
    kind: rigid_force
    acts_on: {robot.frame}
    force: [0 N, 0 N]
    profile: {{kind: ramp, duration: {inflated:.6g} s}}
""",
}
"""What a heading adds, as YAML."""


def drag_override(puller: Puller, pipe: TrialPipe, drag: float) -> str:
    """What gives a trial its drag [N] on the robot."""
    own = puller.share * drag
    if pipe.heading is Heading.upright:
        return f"loads.trailed.force=[{-own:.9g} N, 0 N]"
    return f"loads.{puller.tether}.drag={own:.9g} N"


def progress(history: Mapping[str, np.ndarray]) -> tuple[float, float]:
    """Way [m] and time [s] of a trial, from a first begin of a fall of the pressure to the next: of
    an air line the one that is wanted, for at its sensor it falls with each stroke of the pump.

    Raises StabilityError: the history has no two.
    """
    begins = fall_begins(history.get("wanted_pressure", history["pressure"]))
    if len(begins) < CYCLES:
        raise StabilityError(
            "the pressure of a trial does not fall twice",
            hint="the cycle takes longer than its profile states: leave the profile to the robot",
        )
    first, second = begins[:CYCLES]
    x, t = history["frame_x"], history["time"]
    return float(x[second] - x[first]), float(t[second] - t[first])
