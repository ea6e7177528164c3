"""The limb study (3.2.1.2, Fig 3.6, App. A): curved against straight limbs, ramp by ramp.

Leafbot with five rows at 170 Hz, its real force, walks onto a ramp. The thesis gives no height of
it. The straight limb is a bar inclined by 57 degrees, 1.6 mm thick along the ground: pressed by
0.25 mm it is as stiff as the curved one (270 against 267 N/m). The ramp is passed when the
backbone's tail is behind its upper edge. Near the limit chance decides: each ramp is met with three
coefficients of friction, and counts as passed, or as climbed up to, where all three robots do.
Contacts of limbs, and the mean area on the ground, count until the tail is over.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from softsim.analysis.catalogue import contact_count
from softsim.report.style import BLUE, ORANGE, QUIET, drawing
from softsim.scene.quantities import ROW_FORCE
from validation.cases import Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points
from validation.motion import MILLI, NAN
from validation.script import Listing, Script
from validation.statements import RAMPS
from validation.verdicts import Row, below, between, judged, row, shown

NAME = "leafbot_ramps"
SLOPES = (20, 30, 40, 50, 60, 70, 80, 90)  # deg
HEIGHTS = (5.0, 10.0)  # mm
FRICTIONS = (0.68, 0.7, 0.72)
FOOT = 40.0  # mm, where the ramp begins; the robot's front stands at 32 mm
TAIL = 53.0  # mm, of the backbone behind the head's centre
TIME = 3.0  # s
FINE = ("output.history_interval=0.5 ms", "output.frame_interval=1000 s")
"""Rows with which contacts are counted that are 1 ms apart, and no fields."""
LIMBS = {
    "curved": (),
    "straight": tuple(
        f"bodies.body.mesh.{value}"
        for value in (
            "root_thickness=1.6 mm", "tip_thickness=1.6 mm", "lean=3.247 mm",
            "front_radius=1 m", "rear_radius=1 m",
        )
    ),
}  # fmt: skip
CURVED_LIMIT, STRAIGHT_LIMIT = 70.0, 40.0  # deg: climbs up to, is halted at
SPREAD = 10.0  # deg
COLOURS = {"curved": BLUE, "straight": ORANGE}


def edge(slope: int, height: float) -> float:
    """Where the ramp's upper edge lies [mm]."""
    return FOOT + height / float(np.tan(np.radians(slope)))


def case(limb: str, slope: int, height: float, friction: float) -> Case:
    """A robot before a ramp."""
    ground = f"{{kind: ramp, slope: {slope} deg, height: {height} mm, foot: [{FOOT} mm, 0 mm]}}"
    overrides = (
        *LIMBS[limb], f"environment.walls.ground={ground}", f"time.end={TIME} s",
        f"contact.friction_coefficient={friction}", *FINE,
    )  # fmt: skip
    return Case(label(limb, slope, height, friction), "leafbot_ramp.yaml", overrides)


def label(limb: str, slope: int, height: float, friction: float) -> str:
    """The name of a case."""
    return f"{limb}, {slope} deg, {height:g} mm, friction {friction:g}"


def cases() -> list[Case]:
    """One a limb, slope, height and friction."""
    ramps = [(slope, height) for height in HEIGHTS for slope in SLOPES]
    return [case(limb, *ramp, mu) for limb in LIMBS for ramp in ramps for mu in FRICTIONS]


def beyond(outcome: Outcome, slope: int, height: float) -> float:
    """How far the tail came behind the ramp's upper edge [mm]; NaN of a run that failed."""
    if not outcome.history:
        return NAN
    tail = MILLI * outcome.history["frame_x"].max() - TAIL
    return float(tail - edge(slope, height))


def until_over(outcome: Outcome, slope: int, height: float) -> tuple[float, float]:
    """Contacts of all limbs, and the mean area on the ground [mm^2], until the tail is over; NaN
    where it never is.
    """
    if not beyond(outcome, slope, height) > 0.0:
        return NAN, NAN
    history = outcome.history
    tail = MILLI * history["frame_x"] - TAIL
    end = int(np.argmax(tail > edge(slope, height))) + 1
    t = history["time"][:end]
    rows = [name for name in history if name.startswith(ROW_FORCE)]
    counts = [contact_count(t, history[name][:end] > 0.0) for name in rows]
    return float(sum(counts)), float(1e6 * history["contact_area"][:end].mean())


def means_until_over(outcomes: Outcomes, limb: str, height: float) -> np.ndarray:
    """`until_over` (8, 2) of each of SLOPES, the mean of all robots; NaN where not all are over."""
    found = [
        [until_over(outcomes[label(limb, s, height, mu)], s, height) for mu in FRICTIONS]
        for s in SLOPES
    ]
    return np.array(found).mean(axis=1)


def tails(outcomes: Outcomes, limb: str, height: float) -> np.ndarray:
    """`beyond` [mm] of each of SLOPES and FRICTIONS (8, 3)."""
    return np.array(
        [
            [beyond(outcomes[label(limb, s, height, mu)], s, height) for mu in FRICTIONS]
            for s in SLOPES
        ]
    )


def passed(outcomes: Outcomes, limb: str, height: float) -> np.ndarray:
    """How many robots pass each of SLOPES; NaN where one is not known."""
    far = tails(outcomes, limb, height)
    return np.where(np.isnan(far).any(axis=1), NAN, (far > 0.0).sum(axis=1))


def highest_passed(found: np.ndarray) -> float:
    """The highest slope [deg] up to which all robots pass all; 0 where not even the first."""
    first = lowest_failed(found)
    lower = [float(slope) for slope in SLOPES if slope < first]
    return NAN if np.isnan(first) else max(lower, default=0.0)


def lowest_failed(found: np.ndarray) -> float:
    """The lowest slope [deg] that not all robots pass; 100 where they pass all."""
    if np.isnan(found).any():
        return NAN
    return min(
        (float(s) for s, n in zip(SLOPES, found, strict=True) if n < len(FRICTIONS)), default=100.0
    )


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Up to where both limbs climb, and which climbs farther."""
    for height in HEIGHTS:
        curved, straight = (passed(outcomes, limb, height) for limb in LIMBS)
        behind = {
            limb: [outcomes[label(limb, s, height, mu)] for s in SLOPES for mu in FRICTIONS]
            for limb in LIMBS
        }
        where = f"ramp {height:g} mm high"
        up = between(highest_passed(curved), CURVED_LIMIT - SPREAD, CURVED_LIMIT + SPREAD, "deg")
        reference = f"{CURVED_LIMIT:g} deg within {SPREAD:g}"
        yield row(RAMPS, f"curved limbs climb up to; {where}", reference, up, behind["curved"])
        halt = between(
            lowest_failed(straight), STRAIGHT_LIMIT - SPREAD, STRAIGHT_LIMIT + SPREAD, "deg"
        )
        reference = f"{STRAIGHT_LIMIT:g} deg within {SPREAD:g}"
        yield row(
            RAMPS, f"straight limbs are halted at; {where}", reference, halt, behind["straight"]
        )
        times = float(curved.sum()), float(straight.sum())
        text = f"{shown(times[0])} against {shown(times[1])} of {curved.size * len(FRICTIONS)}"
        more = judged(times[0] > times[1], text, *times)
        claim = f"curved limbs pass more often than straight ones; {where}"
        both = [*behind["curved"], *behind["straight"]]
        yield row(RAMPS, claim, "more", more, both)
        ratios = np.divide(*(means_until_over(outcomes, limb, height) for limb in LIMBS))
        compared = ratios[np.isfinite(ratios).all(axis=1)]
        for k, what in enumerate(("contacts of curved limbs", "area of curved limbs")):
            largest = float(compared[:, k].max()) if len(compared) else NAN
            claim = f"fewer {what} until over where both pass; {where}"
            yield row(RAMPS, claim, "below 1 times the straight ones'", below(largest, 1.0), both)


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """How many robots pass each ramp."""
    lines = [
        (limb, f"{height:g}", *map(shown, passed(outcomes, limb, height)))
        for height in HEIGHTS
        for limb in LIMBS
    ]
    headings = ("limbs", "height [mm]", *(f"{slope} deg" for slope in SLOPES))
    for k, what in enumerate(("Contacts until over", "Mean area until over [mm^2]")):
        found = tuple(
            (limb, f"{height:g}", *map(shown, means_until_over(outcomes, limb, height)[:, k]))
            for height in HEIGHTS
            for limb in LIMBS
        )
        yield Listing(f"{what}, of robots that all pass", headings, found)
    yield Listing(f"Robots that pass, of {len(FRICTIONS)}", headings, tuple(lines))


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """How far the tails come behind the upper edge, over the slope."""
    with drawing(path, 2.8) as figure:
        panels = figure.subplots(1, len(HEIGHTS), sharey=True, squeeze=False)[0]
        for axes, height in zip(panels, HEIGHTS, strict=True):
            for limb, colour in COLOURS.items():
                far = tails(outcomes, limb, height)
                axes.plot(SLOPES, far.mean(axis=1), color=colour, linewidth=0.8, label=limb)
                axes.plot(SLOPES, far, color=colour, linestyle="none", marker="o", markersize=3)
            axes.axhline(0.0, color=QUIET, linewidth=0.7)
            axes.set(title=f"ramp {height:g} mm high", xlabel="slope [deg]")
        panels[0].set_ylabel("tail behind the\nupper edge [mm]")
        panels[0].legend()


SCRIPT = Script(
    name=NAME,
    figure="Fig 3.6, App. A",
    about=(
        "Leafbot with curved limbs and with straight ones that are as stiff, before ramps of 20 to "
        "90 degrees and two heights: passed when its tail is behind the upper edge within "
        f"{TIME:g} s. Claims: curved limbs climb up to 70 degrees, straight ones are halted at 40; "
        "curved ones come down less often, and on less, until they are over. "
        "The thesis does not say how high its ramp is. Its scaled force with mass and thickness "
        "scaled alike is the same motion, and is not run again."
    ),
    cases=cases,
    rows=rows,
    draw=draw,
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
