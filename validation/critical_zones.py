"""Section 6.6 of the thesis, Fig 6.9: elbows, a C-shaped bend, transitions between pipes.

Every layout under scenes/layouts with the standard robot in it, as `softsim assess` runs it. The
history is kept as often as the scene says, since the robot's pressure follows what it reads there.
The thesis says which zones are passed and which more easily, and gives no numbers: Fig 6.9 has
pictures only. An S-bend and the layout of five segments it does not have: they are shown, nothing
is claimed of them. A layout that is added to the folder is shown too.

Two ways through a transition are compared by the mean speed from where the robot's front comes to
the taper until its rear is behind it: the same way in both directions.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from softsim.report.along_pipe import ENDS
from softsim.report.style import BLUE, GREEN, QUIET, SKY, drawing
from validation.cases import SCENES, Case, LayoutCase, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points
from validation.motion import MILLI, NAN
from validation.script import Listing, Script
from validation.statements import BENDS, CLIMBS, EASIER, TRANSITIONS, WIDER
from validation.verdicts import (
    AGREES,
    DISAGREES,
    MISSING,
    UNKNOWN,
    Finding,
    Row,
    judged,
    row,
    shown,
)

NAME = "critical_zones"
FOLDER = "layouts"
PICTURES = "output.frame_interval=0.1 s"  # robots for the picture of the way
COLUMNS = 2  # of panels

PASSED, STUCK, UNFINISHED = "passed", "stuck", "unfinished"
JUDGED = {PASSED: AGREES, STUCK: DISAGREES, UNFINISHED: UNKNOWN}
"""Verdict of a layout that the thesis's robot passed -> verdict of that claim."""

WIDENING, NARROWING = "transition_30_to_41", "transition_41_to_30"
UPWARDS = "_vertical"
SMALL, LARGE = "elbow_90_30mm", "elbow_90_36mm"

IN_BENDS = "6.6, Fig 6.9 A to C, I to K"
CLAIMED = {
    SMALL: (BENDS, "passes an elbow of 90 degrees, level, 30 mm", IN_BENDS),
    LARGE: (BENDS, "passes an elbow of 90 degrees, level, 36 mm", IN_BENDS),
    f"{SMALL}_up": (BENDS, "passes an elbow of 90 degrees against gravity, 30 mm", IN_BENDS),
    f"{LARGE}_up": (BENDS, "passes an elbow of 90 degrees against gravity, 36 mm", IN_BENDS),
    "c_bend": (BENDS, "passes a C-shaped bend, level, 36 mm", IN_BENDS),
    "c_bend_up": (BENDS, "passes a C-shaped bend against gravity, 36 mm", IN_BENDS),
    WIDENING: (TRANSITIONS, "passes from 30 to 41 mm, level", "6.6, Fig 6.9 E to G"),
    NARROWING: (TRANSITIONS, "passes from 41 to 30 mm, level", "6.6"),
    WIDENING + UPWARDS: (TRANSITIONS, "passes from 30 to 41 mm, upwards", "6.6, Fig 6.9 D, H"),
    NARROWING + UPWARDS: (TRANSITIONS, "passes from 41 to 30 mm, upwards", "6.6"),
    "slope_45": (CLIMBS, "climbs a slope of 45 degrees, 36 mm", "6.4, Fig 6.7"),
}
"""Layout -> statement, claim on the layout, and where the thesis makes it."""


def layouts() -> list[str]:
    """Names of all layouts, which are those of the cases."""
    return sorted(file.stem for file in (SCENES / FOLDER).glob("*.yaml"))


def cases() -> list[Case]:
    """One a layout."""
    return [LayoutCase(name, f"{FOLDER}/{name}.yaml", (PICTURES,)) for name in layouts()]


def report(outcome: Outcome) -> Mapping[str, Any]:
    """What the summary says of the layout; nothing of a run that failed."""
    found: Mapping[str, Any] = outcome.summary.get("layout", {})
    return found


def verdict(outcome: Outcome) -> str:
    """passed, stuck or unfinished; MISSING of a run that failed."""
    return str(report(outcome).get("verdict", MISSING))


def mean_speed(outcome: Outcome) -> float:
    """As far as it came, over the whole time, the first inflation too [mm/s]."""
    found = report(outcome)
    if not found:
        return NAN
    return float(MILLI * (found["where"]["arc_length"] - found["start"]) / found["time"])


def front_at_taper(found: Mapping[str, Any]) -> float:
    """Arc length of the robot's centre [m] where its front comes to the taper, which lies before
    the last segment: as far before the taper as the goal is behind it.
    """
    taper, last = found["segments"][-2:]
    return float(taper["start"] - (found["goal"] - last["start"]))


def crossing_speed(outcome: Outcome) -> float:
    """Mean speed through the transition [mm/s] of a robot that passed it."""
    begin, goal = front_at_taper(report(outcome)), report(outcome)["goal"]
    time, s = outcome.history["time"], outcome.history["arc_length"]
    came, left = (time[np.argmax(s >= place)] for place in (begin, goal))
    return float(MILLI * (goal - begin) / (left - came))


def ease(outcome: Outcome) -> float:
    """How easily a transition is passed: the speed [mm/s], zero of a robot that is stuck; NaN where
    that cannot be told.
    """
    if verdict(outcome) == PASSED:
        return crossing_speed(outcome)
    return 0.0 if verdict(outcome) == STUCK else NAN


def stopped_before(outcome: Outcome) -> bool:
    """Whether it got stuck before it came to the transition."""
    found = report(outcome)
    return verdict(outcome) == STUCK and found["where"]["arc_length"] < front_at_taper(found)


def told(outcome: Outcome) -> str:
    """How it went through a transition, in words."""
    if verdict(outcome) == PASSED:
        return f"passed at {shown(crossing_speed(outcome), 'mm/s')}"
    return "stuck before it" if stopped_before(outcome) else verdict(outcome)


def is_passed(outcome: Outcome) -> Finding:
    """It passes; one that still moved when the time was up may yet."""
    computed = report(outcome).get("sentence", MISSING)
    return Finding(computed, JUDGED.get(verdict(outcome), UNKNOWN))


def is_easier(outcome: Outcome, other: Outcome) -> Finding:
    """It passes where the other does not, or faster; of two that are stuck none is easier."""
    speeds = ease(outcome), ease(other)
    computed = f"{told(outcome)} against {told(other)}"
    if speeds == (0.0, 0.0):
        return Finding(computed, UNKNOWN)
    return judged(speeds[0] > speeds[1], computed, *speeds)


def is_easier_to_cross(outcome: Outcome, other: Outcome) -> Finding:
    """The same of transitions that both robots came to: who is stuck before says nothing of it."""
    if stopped_before(outcome) or stopped_before(other):
        return Finding(f"{told(outcome)} against {told(other)}", UNKNOWN)
    return is_easier(outcome, other)


def is_faster(outcome: Outcome, other: Outcome) -> Finding:
    """The higher mean speed over the whole way, which both have to pass."""
    pair = outcome, other
    speeds = [mean_speed(each) if verdict(each) == PASSED else NAN for each in pair]
    texts = [
        verdict(each) if np.isnan(speed) else shown(speed, "mm/s")
        for each, speed in zip(pair, speeds, strict=True)
    ]
    return judged(speeds[0] > speeds[1], " against ".join(texts), *speeds)


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Passed; wider easier than narrower; level easier than upwards; slower in larger pipes."""
    for name, (statement, claim, where) in CLAIMED.items():
        outcome = outcomes[name]
        yield row(statement, claim, f"passed ({where})", is_passed(outcome), [outcome])
    for said, direction in (("level", ""), ("upwards", UPWARDS)):
        pair = outcomes[WIDENING + direction], outcomes[NARROWING + direction]
        claim = f"from 30 to 41 mm more easily than from 41 to 30 mm; {said}"
        yield row(EASIER, claim, "passes alone, or faster", is_easier_to_cross(*pair), pair)
    for said, layout in (("30 to 41 mm", WIDENING), ("41 to 30 mm", NARROWING)):
        pair = outcomes[layout], outcomes[layout + UPWARDS]
        claim = f"more easily level than upwards; from {said}"
        yield row(EASIER, claim, "passes alone, or faster", is_easier(*pair), pair)
    pair = outcomes[SMALL], outcomes[LARGE]
    claim = "slower in larger pipes: mean speed in the elbows of 30 and 36 mm"
    yield row(WIDER, claim, "faster in the smaller", is_faster(*pair), pair)


def remarks(outcomes: Outcomes) -> Iterator[str]:
    """What the robots that are stuck did at last."""
    for name, outcome in outcomes.items():
        if verdict(outcome) == STUCK:
            found = report(outcome)
            yield f"{name}, {found['blocked_by']}: {found['remark']}."


HEADINGS = (
    "layout", "verdict", "where", "blocked by", "time [s]", "mean speed [mm/s]", "rows there",
    "least clearance [mm]", "wall time [s]",
)  # fmt: skip


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """All layouts, a line each."""
    lines = tuple(line(name, outcome) for name, outcome in outcomes.items())
    yield Listing("All layouts, robot pfr", HEADINGS, lines)


def line(name: str, outcome: Outcome) -> tuple[str, ...]:
    """The cells of a layout; why there are none of one that failed."""
    found = report(outcome)
    if not found:
        reason = outcome.failure.splitlines()[0]
        return name, reason, *[""] * (len(HEADINGS) - 2)
    where = found["where"]
    return (
        name,
        found["verdict"],
        f"segment {where['segment']} ({where['what']}) at {MILLI * where['arc_length']:.0f} mm",
        found.get("blocked_by", ""),
        shown(found["time"]),
        shown(mean_speed(outcome)),
        shown(found["at_end"]["rows_in_contact"]),
        shown(least_clearance(found)),
        f"{outcome.number('wall_time'):.0f}",
    )


def least_clearance(found: Mapping[str, Any]) -> float:
    """Of the frame to the wall, on the whole way [mm]."""
    of_segments = (segment["least_clearance"] for segment in found["segments"])
    return MILLI * min((value for value in of_segments if value is not None), default=NAN)


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Progress over time, a panel a layout, all with the same axis of time."""
    names = layouts()
    count = -(-len(names) // COLUMNS)
    with drawing(path, 1.5 * count + 0.4) as figure:
        panels = figure.subplots(count, COLUMNS, sharex=True, squeeze=False)
        for axes in panels.flat[len(names) :]:
            axes.set_visible(False)
        for axes, name in zip(panels.flat, names, strict=False):
            axes.set_title(f"{name}: {verdict(outcomes[name])}")
            if verdict(outcomes[name]) in JUDGED:
                draw_way(axes, outcomes[name])
        for axes in panels[:, 0]:
            axes.set_ylabel("along the\npipe [mm]")
        for axes in panels[-1]:
            axes.set_xlabel("time [s]")
            axes.set_xlim(left=0.0)


def draw_way(axes: Axes, outcome: Outcome) -> None:
    """Arc length over time up to the goal, every other segment shaded, the end by its verdict."""
    found, history = report(outcome), outcome.history
    s, goal = MILLI * history["arc_length"], MILLI * found["goal"]
    top = 1.2 * max(goal, s.max())
    axes.set_ylim(min(0.0, s.min()), top)
    draw_segments(axes, found["segments"], goal, top)
    axes.axhline(goal, color=GREEN, linewidth=0.9, linestyle="--")
    axes.plot(history["time"], s, color=BLUE)
    axes.plot(history["time"][-1], s[-1], "X", color=ENDS[found["verdict"]], clip_on=False)


def draw_segments(
    axes: Axes, segments: Sequence[Mapping[str, Any]], goal: float, top: float
) -> None:
    """A band for each segment below `top` [mm], and what the layout says of it; of the last one
    that stands above the goal [mm], since the line runs through it.
    """
    for number, segment in enumerate(segments):
        low, high = MILLI * segment["start"], min(MILLI * segment["end"], top)
        if low >= high:
            continue
        if number % 2 == 0:
            axes.axhspan(low, high, color=SKY, alpha=0.16, linewidth=0)
        bottom = max(low, goal) if segment is segments[-1] else low
        axes.annotate(
            segment["what"], (1.0, 0.5 * (bottom + high)), xytext=(-3, 0), va="center", ha="right",
            xycoords=("axes fraction", "data"), textcoords="offset points", fontsize=6,
            color=QUIET,
        )  # fmt: skip


SCRIPT = Script(
    name=NAME,
    figure="section 6.6, Fig 6.9",
    about=(
        "Every layout of scenes/layouts with the standard robot: Mode 3 at 192 Hz and 23 kPa, the "
        "pressure following what the robot feels. Claims: it passes elbows of 90 degrees and a "
        "C-shaped bend against gravity, and transitions between 30 and 41 mm in both directions, "
        "level and upwards; more easily from small to big, and level; it climbs a slope; it is "
        "slower in larger pipes. Of the S-bend and the layout of five segments the thesis says "
        "nothing. Shown: the way of the robot's centre, the goal dashed, every other segment "
        "shaded."
    ),
    cases=cases,
    rows=rows,
    draw=draw,
    remarks=remarks,
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
