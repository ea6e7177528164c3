"""How a robot got through a layout: where it was when, over time, and where it got stuck."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from softsim.errors import OutputError
from softsim.output.fields import Frames
from softsim.report.along_pipe import (
    LEFT,
    Pipe,
    Robot,
    draw_pipe,
    draw_robot,
    pipes_described,
    view_of,
    write_beside,
)
from softsim.report.colours import MILLI
from softsim.report.curves import History, pressurised, time_label
from softsim.report.diagram import Axis, Panel, Scale, Series
from softsim.report.png import draw_panel, draw_series
from softsim.report.style import BLUE, GREEN, INK, ORANGE, PAGE_WIDTH, QUIET, RED, SKY, drawing

Report = Mapping[str, Any]

MOST_MOMENTS, LEAST_MOMENTS = 8, 5
"""Robots in the picture."""

APART = 1.3
"""Distance between two of them, in lengths of the robot, so that they do not cover each other."""

LEGIBLE = 0.09
"""The same as a share of the picture, so that what is written beside them does not."""

LINE = 0.075
"""Height of a line of text as a share of the panel of the progress."""

EXIT_INSIDE = 8.0
"""How far before its end the name of an exit stands [mm]."""

TALLEST = 4.6
"""Of the picture of the pipe [inch]."""

WEIGHT_AT = (1.1, 0.85)
"""Where the arrow of the weight ends, in shares of the picture."""

WEIGHT_ARROW = 34.0
"""Its length [points]."""

LEAST_WEIGHT = 1e-3
"""Below this [m/s^2] there is none in the plane of the picture."""

ENDS = {"passed": GREEN, "stuck": RED, "unfinished": ORANGE}
"""Colour of the robot at the end."""


def draw_layout(history: History, frames: Frames, report: Report, path: Path) -> None:
    """The pipe with the robot at moments along it; below, progress over time with the segments
    shaded, pressure and rows in contact.

    report: what the summary says under `layout`. Raises OutputError if the disk refuses, or if the
    run is of a version that knew no branches.
    """
    if "branch" not in history:
        raise OutputError(
            f"{path.parent}: a run of a version of softsim that knew no pipes with branches: its "
            "layout is not drawn. Run the scene again"
        )
    pipes = pipes_described(frames.described)
    shown = robots(pipes, history, frames, report)
    view = view_of(pipes, frames, shown)
    width, height = view[1] - view[0], view[3] - view[2]
    picture = min(PAGE_WIDTH * height / width, TALLEST)
    panels = below(history)
    heights = [picture, 2.2, *(0.8 for _ in panels)]
    with drawing(path, sum(heights) + 0.9) as figure:
        grid = figure.add_gridspec(len(heights), 1, height_ratios=heights)
        top = figure.add_subplot(grid[0])
        top.set(xlim=view[:2], ylim=view[2:], aspect="equal", xlabel="[mm]", ylabel="[mm]")
        top.grid(False)
        top.set_title(report["sentence"])
        draw_picture(top, pipes, frames, shown, report)
        draw_weight(top, pipes[0].project(frames.described["gravity"]))
        progress = figure.add_subplot(grid[1])
        draw_progress(progress, history, report)
        lower = [figure.add_subplot(grid[k], sharex=progress) for k in range(2, len(heights))]
        for axes in (progress, *lower[:-1]):
            axes.tick_params(labelbottom=False)
        for axes, panel in zip(lower, panels, strict=True):
            draw_panel(axes, panel)
        lower[-1].set_xlabel(time_label(history))
        lower[-1].set_xlim(history["time"][0], history["time"][-1])
        figure.align_ylabels([progress, *lower])


def below(history: History) -> list[Panel]:
    """What stands below the progress: the air pressure, if there is any, and rows in contact."""
    time, panels = history["time"], []
    if pressurised(history):
        air = Series("air", time, history["pressure"] / 1e3, ORANGE)
        panels.append(Panel(Axis(Scale("air [kPa]", from_zero=True), [air])))
    rows = Series("rows", time, history["rows_in_contact"], BLUE)
    return [*panels, Panel(Axis(Scale("rows in contact", whole=True, from_zero=True), [rows]))]


def by_branch(segments: Sequence[Report]) -> list[list[Report]]:
    """The segments of each branch, in their order."""
    names = dict.fromkeys(segment["branch"] for segment in segments)
    return [[one for one in segments if one["branch"] == name] for name in names]


def draw_picture(
    axes: Axes,
    pipes: Sequence[Pipe],
    frames: Frames,
    shown: Sequence[Robot],
    report: Report,
) -> None:
    """The pipes, the number of each segment, exits where there are several, and the robot at its
    moments. A tee has its number before its middle, where branches leave, and none beyond.
    """
    segments = by_branch(report["segments"])
    for pipe, own in zip(pipes, segments, strict=True):
        draw_pipe(axes, pipe, [segment["start"] * MILLI for segment in own[1:]])
    numbers = [segment["segment"] for segment in report["segments"]]
    seen = set()
    for pipe, own in zip(pipes, segments, strict=True):
        for segment in own:
            number = segment["segment"]
            if number in seen:
                continue
            seen.add(number)
            share = 0.5 if numbers.count(number) == 1 else 0.2
            middle = (segment["start"] + share * (segment["end"] - segment["start"])) * MILLI
            inner = -pipe.outer_side(middle)
            write_beside(axes, pipe, middle, inner, str(number), QUIET)
    if len(report["exits"]) > 1:
        draw_exits(axes, pipes, segments, report["exits"])
    for robot in shown:
        draw_robot(axes, pipes[robot.branch], frames, robot)


def draw_exits(
    axes: Axes, pipes: Sequence[Pipe], segments: Sequence[Sequence[Report]], exits: Sequence[str]
) -> None:
    """The names of the exits in the ends of their pipes: of branches their own, else end."""
    names = ["end", *(own[0]["branch"] for own in segments[1:])]
    for pipe, name in zip(pipes, names, strict=True):
        if name in exits:
            along = pipe.left[-1] @ -LEFT
            x, y = pipe.centre[-1] - EXIT_INSIDE * along
            axes.text(x, y, name, ha="center", va="center", fontsize=8.0, color=GREEN, zorder=6)


def draw_weight(axes: Axes, gravity: np.ndarray) -> None:
    """Beside the picture an arrow the way weight acts in it, or that it acts across; gravity (2,)
    [m/s^2], its part in the plane of the picture.
    """
    strength = float(np.linalg.norm(gravity))
    if strength < LEAST_WEIGHT:
        axes.text(
            *WEIGHT_AT, "weight acts\nacross", transform=axes.transAxes, ha="center", va="center",
            fontsize=7.5, color=QUIET,
        )  # fmt: skip
        return
    away = -WEIGHT_ARROW * gravity / strength
    axes.annotate(
        "weight", WEIGHT_AT, (away[0], away[1]), xycoords="axes fraction",
        textcoords="offset points", ha="center", va="center", fontsize=7.5, color=QUIET,
        arrowprops={"arrowstyle": "-|>", "color": QUIET, "shrinkA": 6.0}, annotation_clip=False,
    )  # fmt: skip


def robots(pipes: Sequence[Pipe], history: History, frames: Frames, report: Report) -> list[Robot]:
    """The robot at the frames nearest to when it came to its places, and at its end."""
    time, s, branch = history["time"], history["arc_length"] * MILLI, history["branch"]
    extent = float(max(np.ptp(np.concatenate([pipe.centre for pipe in pipes]), axis=0)))
    apart = max(APART * float(np.ptp(frames.points[:, 0])) * MILLI, LEGIBLE * extent)
    end = Robot(
        int(branch[-1]),
        float(s[-1]),
        f"{time[-1]:.1f} s",
        ENDS[report["verdict"]],
        nearest(frames, time[-1]),
    )
    found = [end]
    for place in places(float(s[0]), float(s.max()), segment_middles(report), apart):
        when = float(time[np.argmax(s >= place)])
        frame = nearest(frames, when)
        at = float(np.interp(frames.times[frame], time, s))
        if all(abs(at - other.place) >= 0.9 * apart for other in found):
            label = f"{frames.times[frame]:.1f} s"
            nearest_row = int(np.argmin(np.abs(time - frames.times[frame])))
            number = int(branch[nearest_row])
            found.append(Robot(number, at, label, SKY if len(found) > 1 else QUIET, frame))
    return found


def segment_middles(report: Report) -> list[float]:
    """Middles of the segments [mm]."""
    return [0.5 * (g["start"] + g["end"]) * MILLI for g in report["segments"]]


def places(start: float, farthest: float, wanted: list[float], apart: float) -> list[float]:
    """Where along the pipe [mm] to show the robot: at its start, in the middle of each segment as
    far as it came, and in the largest gaps between, no closer than `apart`.
    """
    chosen = [start]
    ends = [start, farthest]
    for place in wanted:
        inside = start < place < farthest
        if inside and min(abs(place - other) for other in [*ends, *chosen]) >= apart:
            chosen.append(place)
    while len(chosen) + 1 < LEAST_MOMENTS:
        taken = sorted([*chosen, farthest])
        gaps = np.diff(taken)
        widest = int(np.argmax(gaps))
        if gaps[widest] < 2.0 * apart:
            break
        chosen.append(0.5 * (taken[widest] + taken[widest + 1]))
    return sorted(chosen[: MOST_MOMENTS - 1])


def nearest(frames: Frames, time: float) -> int:
    """The stored frame nearest to a time [s]."""
    return int(np.argmin(np.abs(frames.times - time)))


def draw_progress(axes: Axes, history: History, report: Report) -> None:
    """Arc length over time, up to the goal; a band for each segment that is in view."""
    s = history["arc_length"] * MILLI
    goal = report["goal"] * MILLI
    low, high = min(float(s.min()), report["start"] * MILLI), max(goal, float(s.max()))
    room = 0.05 * (high - low)
    low, high = low - room, high + room
    axes.set_ylim(low, high)
    draw_bands(axes, way_taken(report), low, high)
    axes.axhline(goal, color=GREEN, linewidth=0.9, linestyle="--")
    write_at_height(axes, "goal", 0.0, goal, (3.0, 2.0), GREEN)
    draw_series(axes, Series("centre", history["time"], s, BLUE))
    end = (history["time"][-1], s[-1])
    axes.plot(*end, "X", color=ENDS[report["verdict"]], markersize=8, clip_on=False, zorder=5)
    axes.set_ylabel("centre along\nthe pipe [mm]")


def way_taken(report: Report) -> list[Report]:
    """The segments of the branch in which the robot came farthest, and those before it that it went
    through.
    """
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


def draw_bands(axes: Axes, segments: Sequence[Report], low: float, high: float) -> None:
    """Every other segment shaded; to the right what the user wrote of each. low, high: of the axis
    [mm]. The last segment goes on beyond its end.
    """
    seen = []
    tops = [*(segment["start"] for segment in segments[1:]), np.inf]
    for number, (segment, end) in enumerate(zip(segments, tops, strict=True)):
        bottom = max(segment["start"] * MILLI, low)
        top = min(end * MILLI, high)
        if bottom >= top:
            continue
        if number % 2 == 0:
            axes.axhspan(bottom, top, color=SKY, alpha=0.16, linewidth=0)
        seen.append((0.5 * (bottom + top), f"{segment['segment']}  {segment['what']}"))
    heights = spread([height for height, _ in seen], LINE * (high - low))
    for height, (_, said) in zip(heights, seen, strict=True):
        write_at_height(axes, said, 1.0, height, (8.0, -2.5), INK)


def write_at_height(
    axes: Axes, text: str, x: float, y: float, offset: tuple[float, float], colour: str
) -> None:
    """A small text at the share x of the width and the value y, moved by `offset` [points]."""
    axes.annotate(
        text, (x, y), offset, xycoords=("axes fraction", "data"), textcoords="offset points",
        fontsize=7.5, color=colour, annotation_clip=False,
    )  # fmt: skip


def spread(heights: list[float], apart: float) -> list[float]:
    """Rising heights moved up as far as needed for each to be `apart` above the one before."""
    result: list[float] = []
    for height in heights:
        result.append(max(height, result[-1] + apart) if result else height)
    return result
