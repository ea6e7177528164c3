"""Scenes of trials: the robot in a straight pipe, level or upright, pulls against a steady drag.

In a level pipe the drag is friction: the robot's own load `tether` with another `drag`, which holds
at rest but does not pull back. In an upright pipe it is weight: a force on the frame against the
direction of travel, at rest too, which rises during the first inflation; the robot starts on a
floor. A section that represents a part of the robot along its axis (`axial_relief`) has that part
of the drag.

A trial lasts from the start until the pressure begins to fall for the second time. Its result is
the displacement of the robot since the pressure began to fall for the first time, at the same phase
of the cycle.

The pressure cycle is the robot's own, with the deflation rate and the lowest pressure that are
optimal for its pipe: Table 6.2 of the thesis, linear between its diameters.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np

from softsim.analysis.travel import fall_begins
from softsim.errors import StabilityError
from softsim.scene.bodies import BallOutline
from softsim.scene.loading import (
    QUESTIONS,
    REACH,
    LoadedScene,
    overridden,
    read_scene,
    robot_tree,
    said,
    validated,
)
from softsim.scene.loads import AxialReliefSpec, FollowerPressureSpec, Pneumatic, TetherSpec
from softsim.scene.profiles import CyclesProfile, EventCyclesProfile
from softsim.scene.text import Tree, merged

BEST = ((30e-3, 1.4e3, 9e3), (36e-3, 1.3e3, 11e3), (41e-3, 1.3e3, 12.5e3))
"""Diameter of the pipe [m] with the deflation rate [Pa/s] and lowest pressure [Pa] that are optimal
for the PufferFace Robot (Table 6.2).
"""
DIAMETERS, DEFLATION_RATES, LOWEST = zip(*BEST, strict=True)

CYCLES = 2  # of a trial at most: from where the first begins to fall to where the second does
GAP = 1.5e-3  # m, between robot and floor at the start
SPARE = 0.1  # s, for rows of the history, and a controlled pressure that waits
SETTLE = "2 s"  # at most, before a level trial

NOT_OF_A_TRIAL = ("layout", "trailed", "expect", "time")
NOT_OF_ITS_SURROUNDINGS = ("walls", "inclination", "roll", "gravity")
"""Keys of a layout, and of its environment, that a trial does not have."""


class Heading(Enum):
    """Direction of the pipe of a trial."""

    level = "level"
    upright = "upright"


@dataclass(frozen=True, order=True)
class TrialPipe:
    """Straight pipe of a trial, with its diameter [m]."""

    diameter: float
    heading: Heading

    @property
    def name(self) -> str:
        """Name of the scene of the trials in this pipe."""
        return f"{1e3 * self.diameter:g}mm_{self.heading.value}"


@dataclass(frozen=True)
class Puller:
    """Data of a robot's scene that a trial needs.

    frame, tether, chamber: names of the rigid body and of the loads. half_length [m]: of the frame.
    share: fraction of the robot along its axis that the model represents [-]. profile: pressure
    cycle.
    """

    frame: str
    tether: str
    chamber: str
    half_length: float
    share: float
    profile: CyclesProfile | EventCyclesProfile

    @classmethod
    def of(cls, loaded: LoadedScene) -> "Puller":
        """Return the data of a scene. Raises SceneError if it lacks data that a trial needs."""
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
        tethers = [n for n, load in loads if isinstance(load, TetherSpec) and load.acts_on == frame]
        if not tethers:
            raise loaded.error(
                ("loads",),
                f"'{frame}' has no tether: there is no load of kind tether on it",
                "include robot:pfr/tether, or robot:pfr/solid_tether in 3D",
            )
        chambers = [n for n, load in loads if isinstance(load, FollowerPressureSpec | Pneumatic)]
        chamber = scene.robot.chamber or next(iter(chambers), "")
        profile = getattr(scene.loads.get(chamber), "profile", None)
        if not isinstance(profile, CyclesProfile | EventCyclesProfile):
            raise loaded.error(
                ("loads", chamber, "profile") if chamber else ("loads",),
                "the pulling force is searched with the pressure cycle of the robot, and it has "
                "none",
                "give its pressure a profile of kind cycles, with rates, or event_cycles",
            )
        relief = [load.share for _, load in loads if isinstance(load, AxialReliefSpec)]
        return cls(
            frame, tethers[0], chamber, 0.5 * outline.length, 1.0 - sum(relief), profile
        )  # fmt: skip


def trial_scene(
    layout: Path, robot: str, overrides: list[str], puller: Puller, pipe: TrialPipe, gravity: float
) -> LoadedScene:
    """Return the scene of the trials in a pipe, under `gravity` [m/s^2], without a drag.

    Values of the layout and the overrides for the robot, its contact and the solver take precedence
    over the standard robot and Table 6.2.
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
    """Return a mapping without some of its keys."""
    assert isinstance(tree.value, dict)
    kept = {key: value for key, value in tree.value.items() if key not in keys}
    return Tree(kept, tree.origin, tree.key_origin)


def best_cycle(puller: Puller, pipe: TrialPipe) -> str:
    """Return the optimal pressure cycle for a pipe, as YAML."""
    rate = np.interp(pipe.diameter, DIAMETERS, DEFLATION_RATES)
    lowest = np.interp(pipe.diameter, DIAMETERS, LOWEST)
    return f"""
loads:
  {puller.chamber}:
    profile: {{deflation_rate: {rate:.6g} Pa/s, lowest: {lowest:.6g} Pa}}
"""


def surroundings(puller: Puller, pipe: TrialPipe, gravity: float) -> tuple[str, str]:
    """Return the pipe and duration of a trial, and the additions for its heading, as YAML."""
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
"""Additions to the scene of a trial for each heading, as YAML."""


def drag_override(puller: Puller, pipe: TrialPipe, drag: float) -> str:
    """Return the override that sets the drag [N] on the robot in a trial."""
    own = puller.share * drag
    if pipe.heading is Heading.upright:
        return f"loads.trailed.force=[{-own:.9g} N, 0 N]"
    return f"loads.{puller.tether}.drag={own:.9g} N"


def progress(history: Mapping[str, np.ndarray]) -> tuple[float, float]:
    """Return the displacement [m] and time [s] between the first two starts of a pressure fall.

    With an air line the target pressure is used, because the pressure at the sensor falls with each
    stroke of the pump. Raises StabilityError if the pressure does not fall twice.
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


# -------------------------------------------------------------------------------------------------
# Pulling force of a robot: the largest drag with which it still advances in each cycle.
#
# It is found by bisection, in equal ratios, between LEAST and MOST; each step is a trial whether
# the robot advances with a drag. A drag that stops the robot is assumed to stop it when larger,
# too. The result is a bracket: the largest drag with which the robot advanced, and the least with
# which it did not.

LEAST, MOST = 0.01, 2.0
"""Range of the searched drags [N] on the robot.

A tenth of the PFR's weight, and twenty times it, which is its pulling force on a force gauge."""


@dataclass(frozen=True)
class Bracket:
    """Bracket of the pulling force, between low and high [N].

    high is infinite if the robot advanced with all drags that were tried, the largest of which lies
    below MOST by less than the required ratio. Both are zero if it does not advance without drag.
    """

    low: float
    high: float


def trials_left(seen: Mapping[float, bool], ratio: float) -> int:
    """Return the largest number of trials until the ends of the bracket differ by at most `ratio`.

    seen: drag -> True if the robot advanced with it.
    """
    low, high = bounds(seen)
    halvings = math.ceil(math.log2(max(1.0, math.log(high / low) / math.log(ratio))) - 1e-9)
    last = 0.0 not in seen and not any(seen.values())
    return max(0, halvings) + int(last)


def next_drag(seen: Mapping[float, bool], ratio: float) -> float | None:
    """Return the drag [N] of the next trial, or None if there is no more trial.

    It is the geometric mean of the bounds. If the robot advanced with none of the drags, 0 N
    follows last.
    """
    low, high = bounds(seen)
    if high / low > ratio * (1.0 + 1e-9):
        return math.sqrt(low * high)
    return 0.0 if not any(seen.values()) and 0.0 not in seen else None


def bounds(seen: Mapping[float, bool]) -> tuple[float, float]:
    """Return the lower and upper bound [N] of the limit, within LEAST and MOST."""
    low = max((drag for drag, moved in seen.items() if moved), default=LEAST)
    high = min((drag for drag, moved in seen.items() if not moved and drag > 0.0), default=MOST)
    return max(low, LEAST), high


def bracket(seen: Mapping[float, bool]) -> Bracket:
    """Return the bracket that results from the trials."""
    moved = [drag for drag, it_moved in seen.items() if it_moved]
    stood = [drag for drag, it_moved in seen.items() if not it_moved]
    if 0.0 in stood:
        return Bracket(0.0, 0.0)
    return Bracket(max(moved, default=0.0), min(stood, default=math.inf))
