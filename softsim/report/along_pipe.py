"""Robot in its pipe: picture at several moments in the plane of the pipe, and path over time."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from softsim.analysis.travel import History
from softsim.errors import OutputError
from softsim.output.fields import Frames
from softsim.report.body import (
    LINES,
    WallSolid,
    draw_faces,
    draw_lines,
    draw_outlines,
    draw_solid,
    lines_at,
    outlines_at,
    places_at,
    skin_of,
)
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
from softsim.report.png import PANEL_HEIGHT, draw_panels
from softsim.report.style import BLUE, GREEN, INK, ORANGE, PAGE_WIDTH, QUIET, RED, SKY, drawing

Report = Mapping[str, Any]

ENDS = {"passed": GREEN, "stuck": RED, "unfinished": ORANGE}
"""Colour of the robot at the end, by verdict."""

WALL_DEPTH = 3.0
"""Thickness of the hatched wall [mm]."""

LABEL_GAP = 4.0
"""Gap between a wall and the label beside it [mm]."""

LEFT = np.array([[0.0, 1.0], [-1.0, 0.0]])
"""Matrix that, multiplied from the right, turns directions (..., 2) by 90 degrees to the left."""

STRAIGHT = 1e-6
"""Angle [rad] below which a pipe counts as straight."""


@dataclass(frozen=True)
class Pipe:
    """Pipe in the picture.

    s (n,): arc lengths; centre (n, 2): centre line; left (n, 2): unit normals to its left;
    radius (n,), all in mm. Where the radius jumps, two samples have the same position. origin
    (d,) [mm] and axes (2, d) define the plane of the picture.
    """

    s: np.ndarray
    centre: np.ndarray
    left: np.ndarray
    radius: np.ndarray
    origin: np.ndarray
    axes: np.ndarray

    def project(self, places: np.ndarray) -> np.ndarray:
        """Project points (..., d) [mm] to the picture (..., 2)."""
        return places @ self.axes.T

    def side(self, sign: float, beyond: float = 0.0) -> np.ndarray:
        """Return the left (sign 1) or right (-1) wall (n, 2), moved outwards by `beyond` [mm]."""
        return self.centre + sign * (self.radius + beyond)[:, None] * self.left

    def beside(self, s: float, sign: float, beyond: float) -> tuple[np.ndarray, np.ndarray]:
        """Return a point (2,) outside the wall, and its direction (2,) from the centre line.

        The point is `beyond` [mm] from the wall at the arc length s [mm].
        """
        outward = sign * self._at(s, self.left)
        return self._at(s, self.centre) + (self._at(s, self.radius) + beyond) * outward, outward

    def _at(self, s: float, values: np.ndarray) -> np.ndarray:
        columns = values.reshape(len(self.s), -1).T
        found = np.array([np.interp(s, self.s, column) for column in columns])
        return found[0] if values.ndim == 1 else found

    def outer_side(self, s: float) -> float:
        """Return the side (1 left, -1 right) with more space for a label at the arc length s.

        This is the outer side of a bend; elsewhere it is that of the whole pipe.
        """
        here = np.array([self._at(s + way, self.left) for way in (-1.0, 1.0)])
        for left in (here, self.left):
            turn = float(((left[:-1] @ LEFT) * left[1:]).sum())
            if abs(turn) > STRAIGHT:
                return -np.sign(turn)
        return 1.0


def pipes_described(described: Mapping[str, np.ndarray]) -> tuple[Pipe, ...]:
    """Return the pipes of a run, ordered by branch, from the data stored with its results.

    The data is a path (n, 2 d + 2) of arc lengths, points, tangents and radii, and the branch
    of each row (n,). All pipes lie in one plane.
    """
    path, branch = described["path"], described["path_branch"]
    d = (path.shape[1] - 2) // 2
    points, tangents = path[:, 1 : 1 + d] * MILLI, path[:, 1 + d : 1 + 2 * d]
    origin, axes = points[0], plane_of(points, tangents[0])
    along = tangents @ axes.T
    along /= np.linalg.norm(along, axis=1)[:, None]
    left, centre = along @ LEFT, (points - origin) @ axes.T + origin @ axes.T
    return tuple(
        Pipe(path[own, 0] * MILLI, centre[own], left[own], path[own, -1] * MILLI, origin, axes)
        for own in (branch == number for number in range(int(branch.max()) + 1))
    )


def plane_of(points: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return unit vectors (2, d) of the plane of a centre line: its first direction and the normal.

    The second vector points to the left in the plane; in space towards the farthest point of
    the centre line, or into the x-y plane if the line is straight.
    """
    if len(first) == 2:
        return np.array([first, first @ LEFT])
    away = points - points[0]
    away = away - np.outer(away @ first, first)
    across = away[np.argmax(np.linalg.norm(away, axis=1))]
    if np.linalg.norm(across) < 1e-6:
        across = np.array([0.0, 1.0, 0.0]) - first[1] * first
    return np.array([first, across / np.linalg.norm(across)])


@dataclass(frozen=True)
class RobotSnapshot:
    """Robot at one moment.

    branch: number of the pipe that its centre is in; place: its arc length there [mm]; label
    and colour; the stored frame that shows it.
    """

    branch: int
    place: float
    label: str
    colour: str
    frame: int


def draw_pipe(axes: Axes, pipe: Pipe, joints: Sequence[float]) -> None:
    """Draw the walls of a pipe, the solid behind them, and a line across it at each joint [mm].

    The free interior is drawn above all walls, so that pipes that meet open into each other.
    """
    sides = [pipe.side(sign) for sign in (1.0, -1.0)]
    for sign, face in zip((1.0, -1.0), sides, strict=True):
        solid = np.concatenate([face, pipe.side(sign, WALL_DEPTH)[::-1]])
        # The half of the line that lies in the pipe is covered.
        draw_solid(axes, WallSolid(solid, face), linewidth=1.8, zorder=1.05)
    bore = np.concatenate([sides[0], sides[1][::-1]])
    axes.add_patch(Polygon(bore, facecolor="white", linewidth=0, zorder=1.1))
    axes.plot(*pipe.centre.T, color=QUIET, linewidth=0.5, linestyle=(0, (9, 3, 1.5, 3)), zorder=1.2)
    for joint in joints:
        across = np.array([pipe.beside(joint, sign, 0.0)[0] for sign in (1.0, -1.0)])
        axes.plot(*across.T, color=QUIET, linewidth=0.7, linestyle=":", zorder=1.6)


def draw_robot(axes: Axes, pipe: Pipe, frames: Frames, robot: RobotSnapshot) -> None:
    """Draw the deformed mesh, the outlines of rigid bodies and the label outside the wall."""
    x, look = pipe.project(places_at(frames, robot.frame)), LINES["cables"]
    cables = [pipe.project(line) for line in lines_at(frames, robot.frame)["cables"]]
    draw_lines(axes, cables, look.colour, look.width, zorder=1.9)
    skin = skin_of(frames)
    if frames.points.shape[1] == 2:
        draw_outlines(axes, outlines_at(frames, robot.frame))
    draw_lines(axes, x[skin.rim], INK)
    draw_faces(axes, x[skin.faces], robot.colour, robot.colour, width=0.3, zorder=3.0)
    write_beside(axes, pipe, robot.place, pipe.outer_side(robot.place), robot.label, INK)


def write_beside(axes: Axes, pipe: Pipe, place: float, sign: float, text: str, colour: str) -> None:
    """Write a text outside the wall, on one side of the pipe, at the arc length `place` [mm]."""
    at, outward = pipe.beside(place, sign, WALL_DEPTH + LABEL_GAP)
    steep = abs(outward[1]) > abs(outward[0])
    axes.text(
        at[0], at[1], text, color=colour, fontsize=8.0, zorder=6,
        ha="center" if steep else ("left" if outward[0] > 0.0 else "right"),
        va="center" if not steep else ("bottom" if outward[1] > 0.0 else "top"),
    )  # fmt: skip


def view_of(pipes: Sequence[Pipe], frames: Frames, robots: Sequence[RobotSnapshot]) -> np.ndarray:
    """Return xmin, xmax, ymin, ymax [mm] of the picture.

    It includes the pipes with their walls and labels, and robots that protrude from an end.
    """
    margin = WALL_DEPTH + LABEL_GAP + 12.0
    shown = [pipe.side(sign, margin) for pipe in pipes for sign in (1.0, -1.0)]
    shown += [pipes[0].project(places_at(frames, robot.frame)) for robot in robots]
    everything = np.concatenate(shown)
    everything = everything[np.isfinite(everything).all(axis=1)]
    return np.column_stack([everything.min(axis=0), everything.max(axis=0)]).ravel()


# -------------------------------------------------------------------------------------------------
# Figure of a robot in a layout: its position at several moments and over time.

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


def draw_picture(
    axes: Axes,
    pipes: Sequence[Pipe],
    frames: Frames,
    shown: Sequence[RobotSnapshot],
    report: Report,
) -> None:
    """Draw the pipes, the numbers of segments, the names of several exits, and the robots.

    The number of a tee is written once, before its middle, where branches leave.
    """
    names = dict.fromkeys(segment["branch"] for segment in report["segments"])
    segments = [[one for one in report["segments"] if one["branch"] == name] for name in names]
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


def robots(
    pipes: Sequence[Pipe], history: History, frames: Frames, report: Report
) -> list[RobotSnapshot]:
    """Return the robot at the stored frames nearest to its selected positions, and at its end."""
    time, s, branch = history["time"], history["arc_length"] * MILLI, history["branch"]
    extent = float(max(np.ptp(np.concatenate([pipe.centre for pipe in pipes]), axis=0)))
    apart = max(APART * float(np.ptp(frames.points[:, 0])) * MILLI, LEGIBLE * extent)
    end = RobotSnapshot(
        int(branch[-1]),
        float(s[-1]),
        f"{time[-1]:.1f} s",
        ENDS[report["verdict"]],
        int(np.argmin(np.abs(frames.times - time[-1]))),
    )
    found = [end]
    middles = [0.5 * (g["start"] + g["end"]) * MILLI for g in report["segments"]]
    for place in places(float(s[0]), float(s.max()), middles, apart):
        when = float(time[np.argmax(s >= place)])
        frame = int(np.argmin(np.abs(frames.times - when)))
        at = float(np.interp(frames.times[frame], time, s))
        if all(abs(at - other.place) >= 0.9 * apart for other in found):
            label = f"{frames.times[frame]:.1f} s"
            nearest_row = int(np.argmin(np.abs(time - frames.times[frame])))
            number = int(branch[nearest_row])
            found.append(RobotSnapshot(number, at, label, SKY if len(found) > 1 else QUIET, frame))
    return found


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


# -------------------------------------------------------------------------------------------------
# Path of a robot along its pipe over time, with the segments of the layout.

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
