"""Figure of the reach of a robot: trials of its pull, and the tension along the layout."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from softsim.analysis.travel import History
from softsim.output.folder import read_json
from softsim.report.curves import pressurised, time_label
from softsim.report.diagram import (
    FLAT,
    MILLI,
    POINTS,
    Diagram,
    Panel,
    PlotAxis,
    PlotSeries,
    Scale,
    Stripe,
)
from softsim.report.style import BLUE, COLOURS, GREEN, INK, ORANGE, QUIET, RED, drawing

ANSWER, FIGURE = "reach.json", "reach.png"
MARGIN = 1.6  # of the axis of forces over the largest pull

Content = Mapping[str, Any]


def read_reach(folder: Path) -> dict[str, Any]:
    """Return the result in a folder of softsim reach.

    Raises OutputError if the file is damaged.
    """
    return read_json(folder / ANSWER, "repeat the command to write it again")


def draw_reach(folder: Path) -> Path:
    """Draw the result in a folder of softsim reach; return the figure."""
    found, path = read_reach(folder), folder / FIGURE
    exits = found["exits"]
    with drawing(path, 2.9 + 2.3 * len(exits)) as figure:
        panels = figure.subplots(1 + len(exits), 1, squeeze=False)[:, 0]
        _draw_trials(panels[0], found["pulls"])
        for axes, way in zip(panels[1:], exits, strict=True):
            _draw_way(axes, way, len(exits) > 1)
    return path


def _draw_trials(axes: Axes, pulls: list[Content]) -> None:
    """Draw the displacement per pressure cycle over the drag, and the bracket of each pull."""
    axes.axhline(0.0, color=QUIET, linewidth=0.7)
    for pull, colour in zip(pulls, COLOURS * len(pulls), strict=False):
        trials = sorted(pull["trials"], key=lambda trial: float(trial["drag"]))
        drag = [MILLI * trial["drag"] for trial in trials]
        way = [MILLI * trial["progress"] for trial in trials]
        name = f"{MILLI * pull['diameter']:g} mm, {pull['heading']}"
        axes.plot(drag, way, color=colour, marker="o", markersize=4, label=name)
        if pull["high"] is not None:
            axes.axvspan(MILLI * pull["low"], MILLI * pull["high"], color=colour, alpha=0.2, lw=0)
    axes.set_xscale("symlog", linthresh=10.0)
    axes.set_xlim(left=0.0)
    axes.set_title("Pulling force of the robot (between the shaded bounds)")
    axes.set(xlabel="drag on the robot [mN]", ylabel="displacement per cycle [mm]")
    axes.legend()


def _draw_way(axes: Axes, way: Content, is_one_of_several: bool) -> None:
    """Draw the tension of the tether and the pull of the robot along a path, and the reach."""
    arc = np.array(way["arc_length"])
    pull, tension = (MILLI * np.array(way[name], dtype=float) for name in ("pull", "tension"))
    axes.fill_between(arc, *pull, color=INK, alpha=0.15, lw=0, label="pulling force of the robot")
    axes.plot(arc, pull[0], color=INK, linewidth=0.8)
    axes.fill_between(arc, *tension, color=ORANGE, alpha=0.3, lw=0, label="tension of the tether")
    axes.plot(arc, tension[1], color=ORANGE, linewidth=1.0)
    for at in (way["least"], way["most"]):
        axes.axvline(at, color=QUIET, linewidth=0.9, linestyle="--")
    largest = max(np.nanmax(pull[np.isfinite(pull)], initial=0.0), MILLI * 1e-3)
    axes.set_ylim(0.0, MARGIN * largest)
    to = f" to '{way['exit']}'" if is_one_of_several else ""
    axes.set_title(f"Path{to}: {way['sentence']}")
    axes.set(xlabel="arc length of the layout [m]", ylabel="force [mN]")
    axes.legend(loc="upper left")


def pull_rows(found: Content) -> list[tuple[str, str, str]]:
    """Return, for each pipe of trials, its name, the pulling force, and the reach in this pipe."""
    return [
        (
            pull["pipe"],
            in_words([pull["low"], pull["high"]], MILLI, "mN"),
            in_words(pull["straight_distance"], 1.0, "m"),
        )
        for pull in found["pulls"]
    ]


def in_words(band: list[float | None], factor: float, unit: str) -> str:
    """Return a range of numbers in words; a missing number is infinite."""
    low, high = band
    if low is None:
        return "unlimited"
    if high is None:
        return f"at least {factor * low:.3g} {unit}"
    return f"{factor * low:.3g} to {factor * high:.3g} {unit}"


# -------------------------------------------------------------------------------------------------
# Path of a robot along its pipe over time, with the segments of the layout.

Report = Mapping[str, Any]

ENDS = {"passed": GREEN, "stuck": RED, "unfinished": ORANGE}
"""Colour of the robot at the end, by verdict."""

ROOM = 0.05
"""Margin above and below the range of arc lengths, as a fraction of it."""


def way(history: History, report: Report) -> Diagram:
    """Return the diagram of arc length over time up to the goal, with the visible segments.

    Below are the air pressure, if any, and the rows in contact. report: `layout` of the
    summary.
    """
    time, s = history["time"], history["arc_length"] * MILLI
    goal, end = report["goal"] * MILLI, ENDS[report["verdict"]]
    series = [
        PlotSeries("centre", time, s, BLUE),
        PlotSeries("goal", time, np.full_like(s, goal), GREEN, "--"),
        PlotSeries(report["verdict"], time[-1:], s[-1:], end, POINTS),
    ]
    low, high = min(float(s.min()), report["start"] * MILLI), max(goal, float(s.max()))
    room = ROOM * (high - low)
    stripes = tuple(stripes_of(way_taken(report), low - room, high + room))
    panels = [Panel(PlotAxis(Scale("centre along the pipe [mm]"), series), stripes=stripes)]
    if pressurised(history):
        air = PlotSeries("air", time, history["pressure"] / 1e3, ORANGE)
        panels.append(Panel(PlotAxis(Scale("pressure [kPa]", from_zero=True), [air]), height=FLAT))
    rows = PlotSeries("rows", time, history["rows_in_contact"], BLUE)
    touching = PlotAxis(Scale("rows in contact", whole=True, from_zero=True), [rows])
    panels.append(Panel(touching, height=FLAT))
    return Diagram("Path through the layout", Scale(time_label(history)), panels, over_time=True)


def way_taken(report: Report) -> list[Report]:
    """Return the segments of the farthest branch, and those that the robot passed before it."""
    farthest = report["where"]["branch"]
    own = [one for one in report["segments"] if one["branch"] == farthest]
    before = [
        one
        for one in report["segments"]
        if one["branch"] != farthest
        and one["entered"] is not None
        and one["start"] < own[0]["start"]
    ]
    return [*before, *own]


def stripes_of(segments: Sequence[Report], low: float, high: float) -> Iterator[Stripe]:
    """Yield a labelled stripe for each segment between two arc lengths [mm].

    Every other stripe is shaded. The last one continues beyond the end of its segment.
    """
    tops = [*(segment["start"] * MILLI for segment in segments[1:]), high]
    for number, (segment, top) in enumerate(zip(segments, tops, strict=True)):
        bottom, top = max(segment["start"] * MILLI, low), min(top, high)
        if bottom < top:
            said = f"{segment['segment']}  {segment['what']}"
            yield Stripe(bottom, top, said, shaded=number % 2 == 0)
