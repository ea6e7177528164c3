"""Figure of a robot in a layout: its position at several moments and over time."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from softsim.errors import OutputError
from softsim.output.fields import Frames
from softsim.output.travel import History
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
from softsim.report.png import PANEL_HEIGHT, draw_panels
from softsim.report.style import GREEN, PAGE_WIDTH, QUIET, SKY, drawing
from softsim.report.way import ENDS, Report, way

MOST_MOMENTS, LEAST_MOMENTS = 8, 5
"""Largest and intended smallest number of robots in the picture."""

APART = 1.3
"""Smallest distance between two robots in robot lengths, so that they do not overlap."""

LEGIBLE = 0.09
"""Smallest distance between two robots as a fraction of the picture, so that labels do not overlap.
"""

EXIT_INSIDE = 8.0
"""Distance of the name of an exit from the end of the pipe [mm]."""

TALLEST = 4.6
"""Largest height of the picture of the pipe [inch]."""

WEIGHT_AT = (1.1, 0.85)
"""Tip of the weight arrow in axes fractions."""

WEIGHT_ARROW = 34.0
"""Length of the weight arrow [points]."""

LEAST_WEIGHT = 1e-3
"""Gravity in the plane of the picture [m/s^2] below which no arrow is drawn."""


def draw_layout(history: History, frames: Frames, report: Report, path: Path) -> None:
    """Draw the pipe with the robot at several moments, and below it the progress over time.

    The panels show the progress with shaded segments, the pressure and the rows in contact.
    report: `layout` of the summary. Raises OutputError if the file cannot be written, or the
    run is of a version without branches.
    """
    if "branch" not in history:
        raise OutputError(
            f"{path.parent}: this run was made by a version of softsim without branched pipes, so "
            "its layout is not drawn. Run the scene again"
        )
    pipes = pipes_described(frames.described)
    shown = robots(pipes, history, frames, report)
    view = view_of(pipes, frames, shown)
    width, height = view[1] - view[0], view[3] - view[2]
    picture = min(PAGE_WIDTH * height / width, TALLEST)
    progress = way(history, report)
    heights = [picture, *(PANEL_HEIGHT * panel.height for panel in progress.panels)]
    with drawing(path, sum(heights) + 0.9) as figure:
        grid = figure.add_gridspec(len(heights), 1, height_ratios=heights)
        top = figure.add_subplot(grid[0])
        top.set(xlim=view[:2], ylim=view[2:], aspect="equal", xlabel="[mm]", ylabel="[mm]")
        top.grid(False)
        top.set_title(report["sentence"])
        draw_picture(top, pipes, frames, shown, report)
        draw_weight(top, pipes[0].project(frames.described["gravity"]))
        first = figure.add_subplot(grid[1])
        lower = [figure.add_subplot(grid[k], sharex=first) for k in range(2, len(heights))]
        for axes in (first, *lower[:-1]):
            axes.tick_params(labelbottom=False)
        draw_panels([first, *lower], progress)
        figure.align_ylabels([first, *lower])


def by_branch(segments: Sequence[Report]) -> list[list[Report]]:
    """Return the segments of each branch in order."""
    names = dict.fromkeys(segment["branch"] for segment in segments)
    return [[one for one in segments if one["branch"] == name] for name in names]


def draw_picture(
    axes: Axes,
    pipes: Sequence[Pipe],
    frames: Frames,
    shown: Sequence[Robot],
    report: Report,
) -> None:
    """Draw the pipes, the numbers of segments, the names of several exits, and the robots.

    The number of a tee is written once, before its middle, where branches leave.
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
    """Write the names of the exits in the ends of their pipes: the branch, or "end"."""
    names = ["end", *(own[0]["branch"] for own in segments[1:])]
    for pipe, name in zip(pipes, names, strict=True):
        if name in exits:
            along = pipe.left[-1] @ -LEFT
            x, y = pipe.centre[-1] - EXIT_INSIDE * along
            axes.text(x, y, name, ha="center", va="center", fontsize=8.0, color=GREEN, zorder=6)


def draw_weight(axes: Axes, gravity: np.ndarray) -> None:
    """Draw an arrow beside the picture in the direction of gravity, or note that it is transverse.

    gravity (2,) [m/s^2]: its components in the plane of the picture.
    """
    strength = float(np.linalg.norm(gravity))
    if strength < LEAST_WEIGHT:
        axes.text(
            *WEIGHT_AT, "weight acts\ntransversely", transform=axes.transAxes, ha="center",
            va="center", fontsize=7.5, color=QUIET,
        )  # fmt: skip
        return
    away = -WEIGHT_ARROW * gravity / strength
    axes.annotate(
        "weight", WEIGHT_AT, (away[0], away[1]), xycoords="axes fraction",
        textcoords="offset points", ha="center", va="center", fontsize=7.5, color=QUIET,
        arrowprops={"arrowstyle": "-|>", "color": QUIET, "shrinkA": 6.0}, annotation_clip=False,
    )  # fmt: skip


def robots(pipes: Sequence[Pipe], history: History, frames: Frames, report: Report) -> list[Robot]:
    """Return the robot at the stored frames nearest to its selected positions, and at its end."""
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
    """Return the middles of the segments [mm]."""
    return [0.5 * (g["start"] + g["end"]) * MILLI for g in report["segments"]]


def places(start: float, farthest: float, wanted: list[float], apart: float) -> list[float]:
    """Return positions [mm] along the pipe at which to draw the robot.

    These are the start, the middle of each segment that was reached, and points in the largest
    gaps between them, no closer than `apart`.
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
    """Return the index of the stored frame nearest to a time [s]."""
    return int(np.argmin(np.abs(frames.times - time)))
