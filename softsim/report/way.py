"""Path of a robot along its pipe over time, with the segments of the layout."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from softsim.output.travel import History
from softsim.report.colours import MILLI
from softsim.report.curves import pressurised, time_label
from softsim.report.diagram import (
    FLAT,
    POINTS,
    Axis,
    Diagram,
    Panel,
    Scale,
    Series,
    Stripe,
)
from softsim.report.style import BLUE, GREEN, ORANGE, RED

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
        Series("centre", time, s, BLUE),
        Series("goal", time, np.full_like(s, goal), GREEN, "--"),
        Series(report["verdict"], time[-1:], s[-1:], end, POINTS),
    ]
    low, high = min(float(s.min()), report["start"] * MILLI), max(goal, float(s.max()))
    room = ROOM * (high - low)
    stripes = tuple(stripes_of(way_taken(report), low - room, high + room))
    panels = [Panel(Axis(Scale("centre along the pipe [mm]"), series), stripes=stripes)]
    if pressurised(history):
        air = Series("air", time, history["pressure"] / 1e3, ORANGE)
        panels.append(Panel(Axis(Scale("pressure [kPa]", from_zero=True), [air]), height=FLAT))
    rows = Series("rows", time, history["rows_in_contact"], BLUE)
    touching = Axis(Scale("rows in contact", whole=True, from_zero=True), [rows])
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
