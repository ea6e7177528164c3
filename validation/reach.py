"""6.5 and Fig 6.8 of the thesis: how far the robot gets, trailing its tether.

The thesis let the robot carry weights up vertical pipes, took them for the length of tether that
weighs as much, and divided by the friction coefficient for level pipes. Back from what it states,
8.45 to 13 m level in 30 and 36 mm, 4.5 to 7 m in 41 mm with friction coefficients 0.5 to 0.75: some
6.5 and 3.5 m upwards, pulls in the proportion of 1 : 1 : 0.54.

Here the section of the shipped scenes is given a weight upright, or a friction that drags level,
as `softsim reach` does (apps/reach/trials.py): with the robot's own controlled pressure within
Table 6.2, for with a fixed one the section loses a vertical pipe's wall before P_M3^S, whatever it
carries. It gets on if a cycle brings it more than the recoil of its spikes. The pull lies between
two drags that were tried; where the way of a cycle passes the recoil between them is its estimate.
A section pulls half as hard as the robot, and gets half of the drag. The tether weighs 3 g/m, a
tube of 2.4 g/m and wires of which the thesis says nothing.
Digitised points: pipe_mm, carried_g.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from softsim.analysis.travel import LEAST_PROGRESS
from softsim.apps.reach.trials import progress
from softsim.errors import StabilityError
from softsim.report.style import QUIET, drawing
from validation.cases import THINNED, Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points, deviation
from validation.motion import MILLI, NAN
from validation.pipes import LOOKS
from validation.script import Listing, Script
from validation.statements import LOADED, REACH_LEVEL, REACH_UP
from validation.thesis import EFFECTIVE_RATE, HIGHEST, LOWEST, PIPES, RING, WEIGHT
from validation.verdicts import (
    AGREES,
    DISAGREES,
    UNKNOWN,
    Finding,
    Row,
    judged,
    row,
    shown,
    within,
)
from validation.verdicts import falls as decreases

NAME = "reach"
UPRIGHT, LEVEL = "upright", "level"
DRAGS = {UPRIGHT: (0, 5, 10, 15, 25), LEVEL: (300, 600, 1000)}  # mN, on the robot
INFLATION, HOLD, SPARE = 1.0, 0.1, 0.2  # s
TETHER = 3e-3 * 9.81  # N/m
FRICTION = (0.5, 0.75)
STATED = {30: (8.45, 13.0), 36: (8.45, 13.0), 41: (4.5, 7.0)}  # m, level
UP = {pipe: FRICTION[0] * STATED[pipe][1] for pipe in PIPES}  # m
ALIKE, PROPORTION, PROPORTION_SPREAD, HIGH_SPREAD = 0.2, 0.54, 0.3, 0.3


def label(pipe: int, heading: str, drag: int) -> str:
    """The name of a case."""
    return f"{pipe} mm {heading}, {drag} mN"


def case(pipe: int, heading: str, drag: int) -> Case:
    """A trial in a pipe [mm] with a drag on the robot [mN], from the first to the second fall."""
    own = drag / RING
    fall = (HIGHEST - LOWEST[pipe]) / EFFECTIVE_RATE[pipe]
    end = 2.0 * (INFLATION + HOLD) + fall + SPARE
    pulled = {
        LEVEL: (f"loads.tether.drag={own:g} mN",),
        UPRIGHT: (
            "environment.inclination=90 deg",
            "environment.walls.floor={kind: plane, point: [-18 mm, 0 mm], normal: [1, 0]}",
            "time.settle=null",
            f"loads.relief={{kind: axial_relief, acts_on: frame, share: {1.0 - 1.0 / RING:g}}}",
            "loads.tether.drag=0 mN",
            "loads.tether.weight=0 mN",
            f"loads.trailed={{kind: rigid_force, acts_on: frame, force: [{-own:g} mN, 0 N], "
            f"profile: {{kind: ramp, duration: {INFLATION} s}}}}",
        ),
    }
    profile = (
        f"loads.air.profile={{kind: event_cycles, highest: {HIGHEST} kPa, inflation_rate: "
        f"{HIGHEST / INFLATION} kPa/s, contact_force: 0.6 N, contact_rows: 2, hold: {HOLD} s, "
        f"deflation_rate: {EFFECTIVE_RATE[pipe]} kPa/s, lowest: {LOWEST[pipe]} kPa}}"
    )
    time = (f"time.end={end:.4g} s", "time.cycles=2")
    overrides = (*pulled[heading], profile, *time, *THINNED)
    return Case(label(pipe, heading, drag), f"pfr_{pipe}mm.yaml", overrides)


def cases() -> list[Case]:
    """One a pipe, heading and drag."""
    return [case(p, heading, d) for p in PIPES for heading, ds in DRAGS.items() for d in ds]


def way_and_speed(outcome: Outcome) -> tuple[float, float]:
    """Of a cycle [m], and over its time [m/s]; NaN of a run that failed."""
    if not outcome.history:
        return NAN, NAN
    try:
        way, time = progress(outcome.history)
    except StabilityError:
        return NAN, NAN
    return way, way / time


@dataclass(frozen=True)
class Pull:
    """Of the robot [N]: at least, at most, and in between where the way passes the recoil."""

    low: float
    high: float
    estimate: float

    def told(self) -> str:
        """In words."""
        if math.isinf(self.high):
            return f"above {shown(MILLI * self.low, 'mN')}"
        if math.isnan(self.estimate):
            return shown(NAN)
        band = f"{MILLI * self.low:.3g} to {MILLI * self.high:.3g} mN"
        return f"{shown(MILLI * self.estimate, 'mN')} ({band})"


def pull(outcomes: Outcomes, pipe: int, heading: str) -> Pull:
    """From the trials of a pipe that are there, of which there are two at least; else NaN.

    Where it does not get on with the least drag, it is zero at least, and at most if that was none;
    where it does with the largest there is no upper end.
    """
    names = {drag: label(pipe, heading, drag) for drag in DRAGS[heading]}
    tried = np.array([1e-3 * drag for drag in names])
    way = np.array([way_and_speed(outcomes[name])[0] for name in names.values()])
    tried, way = tried[np.isfinite(way)], way[np.isfinite(way)]
    if len(tried) < 2:
        return Pull(NAN, NAN, NAN)
    stood = np.flatnonzero(way <= LEAST_PROGRESS)
    if not len(stood):
        return Pull(float(tried[-1]), math.inf, NAN)
    k = int(stood[0])
    if k == 0:
        return Pull(0.0, float(tried[0]), 0.5 * float(tried[0]))
    share = (way[k - 1] - LEAST_PROGRESS) / (way[k - 1] - way[k])
    return Pull(
        float(tried[k - 1]),
        float(tried[k]),
        float(tried[k - 1] + share * (tried[k] - tried[k - 1])),
    )


def behind(outcomes: Outcomes, *pipes: int, heading: str = UPRIGHT) -> list[Outcome]:
    """The trials of pipes."""
    return [outcomes[label(pipe, heading, drag)] for pipe in pipes for drag in DRAGS[heading]]


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Pulls upright in proportion; speed over the weight; metres."""
    found = {pipe: pull(outcomes, pipe, UPRIGHT) for pipe in PIPES}
    for pipe, proportion, spread in ((36, 1.0, ALIKE), (41, PROPORTION, PROPORTION_SPREAD)):
        claim = f"pull upright, {pipe} mm over 30 mm"
        reference = f"{proportion:g} within {100 * spread:g} %"
        ratio = in_proportion(found[30], found[pipe], proportion, spread)
        yield row(REACH_UP, claim, reference, ratio, behind(outcomes, 30, pipe))
    for pipe in PIPES:
        speeds = until_it_stands(outcomes, pipe)
        claim = (
            f"slower the more it carries, {carried()} mN, until it stands; upright {pipe} mm pipe"
        )
        slower = decreases(speeds, "mm/s")
        if len(speeds) == 1:
            slower = Finding("it does not get on without any weight", UNKNOWN)
        yield row(LOADED, claim, "falls", slower, behind(outcomes, pipe))
    for pipe in PIPES:
        metres = within(found[pipe].estimate / TETHER, UP[pipe], HIGH_SPREAD, "m")
        claim = f"tether that it carries up; {pipe} mm pipe"
        reference = f"{UP[pipe]:.3g} m within {100 * HIGH_SPREAD:g} %"
        yield row(REACH_UP, claim, reference, metres, behind(outcomes, pipe))
    for pipe in PIPES:
        level = pull(outcomes, pipe, LEVEL)
        claim = f"level distance, by the pull against friction; {pipe} mm pipe"
        reference = f"{STATED[pipe][0]:g} to {STATED[pipe][1]:g} m, bands that meet"
        rests_on = behind(outcomes, pipe, heading=LEVEL)
        yield row(REACH_LEVEL, claim, reference, level_distance(level, STATED[pipe]), rests_on)
    if points is not None:
        computed = [
            1e3 * found[int(pipe)].estimate / 9.81 if pipe in PIPES else NAN
            for pipe in points["pipe_mm"]
        ]
        finding = deviation(np.array(computed), points["carried_g"], points["spread"], "g")
        claim = "Fig 6.8: mass that it carries up"
        yield row(REACH_UP, claim, "digitised points", finding, outcomes.values())


def until_it_stands(outcomes: Outcomes, pipe: int) -> list[float]:
    """Speeds upright [mm/s] up to the first weight with which it does not get on: beyond that it
    stands on its floor, or slips back to it, and there is nothing to tell.
    """
    speeds = []
    for drag in DRAGS[UPRIGHT]:
        way, speed = way_and_speed(outcomes[label(pipe, UPRIGHT, drag)])
        speeds.append(MILLI * speed)
        if way <= LEAST_PROGRESS:
            break
    return speeds


def carried() -> str:
    """The weights tried upright, in mN."""
    return ", ".join(map(str, DRAGS[UPRIGHT]))


def in_proportion(narrow: Pull, wide: Pull, proportion: float, spread: float) -> Finding:
    """The estimates are in a proportion within a spread; told with the band of the brackets."""
    if math.isnan(wide.estimate + narrow.estimate):
        return Finding(shown(NAN), UNKNOWN)
    if narrow.high == 0.0:
        return Finding("it does not get on in the narrow pipe, without any weight", DISAGREES)
    ratio = wide.estimate / narrow.estimate
    least, most = wide.low / narrow.high, wide.high / max(narrow.low, 1e-9)
    text = f"{ratio:.3g} ({least:.3g} to {most:.3g})"
    allowed = proportion * (1.0 - spread), proportion * (1.0 + spread)
    if least < allowed[0] < most or least < allowed[1] < most:
        text += ", band across the limits"
        return Finding(text, AGREES if allowed[0] <= ratio <= allowed[1] else UNKNOWN)
    return judged(allowed[0] <= ratio <= allowed[1], text, ratio)


def level_distance(level: Pull, stated: tuple[float, float]) -> Finding:
    """P / (mu w) for the ends of bracket and friction meets what is stated."""
    if math.isnan(level.low):
        return Finding(shown(NAN), UNKNOWN)
    low, high = level.low / (FRICTION[1] * TETHER), level.high / (FRICTION[0] * TETHER)
    text = f"{low:.3g} m and more" if math.isinf(high) else f"{low:.3g} to {high:.3g} m"
    holds = low <= stated[1] and high >= stated[0]
    return Finding(text, AGREES if holds else DISAGREES)


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """Pulls and what follows for a tether."""
    found = [(pipe, heading, pull(outcomes, pipe, heading)) for pipe in PIPES for heading in DRAGS]
    yield Listing(
        "What the robot pulls, and over its weight",
        ("pipe", "pull", "over the weight"),
        tuple(
            (f"{pipe} mm, {heading}", one.told(), shown(one.estimate / WEIGHT))
            for pipe, heading, one in found
        ),
    )


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Way of a cycle over the drag, upright and level, a curve a pipe."""
    with drawing(path, 3.0) as figure:
        for axes, (heading, drags) in zip(figure.subplots(1, 2), DRAGS.items(), strict=True):
            axes.axhline(0.0, color=QUIET, linewidth=0.7)
            axes.axhline(MILLI * LEAST_PROGRESS, color=QUIET, linewidth=0.8, linestyle="--")
            for pipe, look in LOOKS.items():
                way = [way_and_speed(outcomes[label(pipe, heading, drag)])[0] for drag in drags]
                axes.plot(drags, MILLI * np.array(way), label=f"{pipe} mm pipe", **look)
            axes.set_title(heading)
            axes.set(xlabel="drag on the robot [mN]", ylabel="way of a cycle [mm]")
            axes.set_xlim(0.0, 1.05 * drags[-1])
        figure.axes[0].legend()


SCRIPT = Script(
    name=NAME,
    figure="Fig 6.8",
    about=(
        "What the robot pulls while it walks: a weight up a vertical pipe, friction along a level "
        "one; from it the metres of tether that it can trail. Claims: as much in 30 as in 36 mm, "
        "half of it in 41 mm; slower under load; 8.45 to 13 m level, 4.5 to 7 m in 41 mm. That "
        "level over vertical distance is 1 / mu, 1.33 to 2, where the pull is the same in both, is "
        "algebra, for which no row takes credit; here the level pull is its own, for friction does "
        "not pull a robot back that stands, weight does."
    ),
    cases=cases,
    rows=rows,
    draw=draw,
    columns=("pipe_mm", "carried_g"),
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
