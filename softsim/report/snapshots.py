"""Pictures of bodies: snapshots at a few moments, coloured by a field, and meshes with sets."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Patch

from softsim.errors import OutputError
from softsim.mesh.cad import END_NAMES
from softsim.mesh.mesh import SURFACE, Mesh, boundary_facets, facet_keys, find_rows
from softsim.output.fields import Frames
from softsim.report.body import (
    CAMERA,
    Section,
    Surface,
    draw_faces,
    lit,
    plane_picture,
    visible_side,
)
from softsim.report.diagram import FIELDS, MILLI, refuse_missing_field, shared_scale
from softsim.report.style import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PAGE_WIDTH,
    PALE,
    PURPLE,
    QUIET,
    RED,
    SKY,
    WALL,
    drawing,
)

# -------------------------------------------------------------------------------------------------
# Moments of a run that are drawn: start, full inflation, onset of motion, end.

FULL = 0.999
"""Fraction of the highest pressure above which the body counts as fully inflated."""

SMOOTHING = 20
"""Ratio of the observed time to the window over which the vibration is averaged."""

MOVED, AT_REST = 0.10, 0.05
"""Fractions of the total displacement that define motion and rest.

Above the first the body has moved, below the second it is at rest.
"""


WORTH_A_PICTURE = 0.02
"""Fraction of the displacement of the whole run below which a motion has no onset."""


@dataclass(frozen=True)
class Moment:
    """Named time [s]."""

    name: str
    time: float


def moments(
    time: np.ndarray, pressures: Mapping[str, np.ndarray], displacement: np.ndarray
) -> list[Moment]:
    """Return the moments of a run that inflates and deflates, in order of time.

    With several chambers these are the start, the full inflation of each chamber, and the end.
    time [s], pressures [Pa] by the name of each chamber, and displacement [m] along the pipe
    have the shape (rows,). Without pressure (none, all zero or NaN) the moments are start,
    quarter, half and end. A run without motion has no onset.
    """
    begin, end = float(time[0]), float(time[-1])
    fulls = {
        name: pressure >= FULL * np.nanmax(pressure)
        for name, pressure in pressures.items()
        if np.nanmax(pressure, initial=0.0) > 0.0
    }
    if not fulls:
        names = {"start": 0.0, "quarter": 0.25, "half": 0.5, "end": 1.0}
        return [Moment(name, begin + part * (end - begin)) for name, part in names.items()]
    if len(pressures) > 1:
        inflated_at = {name: float(time[np.argmax(full)]) for name, full in fulls.items()}
        found = [Moment(f"{name} inflated", at) for name, at in inflated_at.items()]
        found.sort(key=lambda moment: moment.time)
        return [Moment("start", begin), *found, Moment("end", end)]
    [full] = fulls.values()
    inflated = int(np.argmax(full))
    found = [Moment("start", begin), Moment("full inflation", float(time[inflated]))]
    if inflated == 0:
        found.pop(0)
    falling = inflated + _first(~full[inflated:])
    after = slice(falling, falling + _first(full[falling:]))  # up to the next full inflation
    watched = displacement[after]
    onset = onset_of_motion(watched)
    if onset is not None and np.ptp(watched) > WORTH_A_PICTURE * np.ptp(displacement):
        found.append(Moment("onset of motion", float(time[after][onset])))
    return [*found, Moment("end", end)]


def onset_of_motion(displacement: np.ndarray) -> int | None:
    """Return the index at which a vibrating body starts to move; None if it stays in place.

    The vibration is averaged out. The body has moved once its displacement exceeds the fraction
    MOVED of the total and the amplitude of its oscillation. The onset is the last row before
    that below AT_REST / MOVED of this threshold: an oscillation that returns is no motion.
    """
    if len(displacement) < 2 or not np.isfinite(displacement).all():
        return None
    window = max(len(displacement) // SMOOTHING, 1)
    # The ends are extended by the mean of a window there, because an end value may be a peak.
    around = window // 2, (window - 1) // 2
    padded = np.pad(displacement, around, mode="mean", stat_length=window)
    smooth = np.convolve(padded, np.full(window, 1.0 / window), mode="valid")
    swing = float(np.quantile(np.abs(displacement - smooth), 0.99))
    away = smooth - smooth[0]
    away = away * np.sign(away[np.argmax(np.abs(away))])
    moved = max(MOVED * float(away.max()), swing)
    if away.max() <= moved:
        return None
    first = int(np.argmax(away > moved))
    resting = np.flatnonzero(away[:first] < moved * AT_REST / MOVED)
    return int(resting[-1])


def _first(condition: np.ndarray) -> int:
    """Return the index of the first true value, or the length if there is none."""
    return int(np.argmax(condition)) if condition.any() else len(condition)


AT_ONCE = 0.02
"""Fraction of the run by which a frame may miss a moment that is not the nearest to it."""

LETTERS_AN_INCH = 14
"""Approximate number of characters of a title per inch."""


Pictures = Section | Surface
"""Pictures of some frames of a run."""


def pictures(frames: Frames, indices: list[int], field: str) -> Pictures:
    """Return the pictures of frames for their mesh: in space, axisymmetric, or plane."""
    if frames.points.shape[1] == 3:
        return Surface(frames, indices, field)
    return plane_picture(frames, indices, field)


def draw_snapshots(
    frames: Frames,
    moments: list[Moment],
    time: np.ndarray,
    pressure: np.ndarray | None,
    field: str,
    path: Path,
) -> None:
    """Draw the stored frames nearest to the moments, with a common colour scale and view.

    time [s] and pressure [Pa], (rows,) each, are those of the history, for the titles; None
    without pressure. field: one of FIELDS. Raises OutputError for another field or one the
    frames do not have, for results without a frame, or if the file cannot be written.
    """
    if len(frames) == 0:
        raise OutputError("the results contain no frame to draw: the run stopped before the first")
    refuse_missing_field(frames, field)
    shown = {
        index: names
        for index, names in frames_at(moments, frames.times).items()
        if np.isfinite(frames.point_data["displacement"][index]).all(axis=1).any()
    }
    if not shown:
        raise OutputError("the results hold no frame in which a node still has a place")
    titles = [
        (" and ".join(names), state(frames.times[index], time, pressure))
        for index, names in shown.items()
    ]
    body = pictures(frames, list(shown), field)
    grid = arranged(len(titles), body.view)
    one_line = max(len(name + now) for name, now in titles) + 2 <= LETTERS_AN_INCH * grid.width
    between = ": " if one_line else "\n"
    height = grid.rows * (grid.height + (0.3 if one_line else 0.45)) + 0.95
    colours, extend = shared_scale(body.values)
    with drawing(path, height) as figure:
        panels = panels_for(figure, body, grid, list(map(between.join, titles)))
        for number, axes in enumerate(panels.flat[: len(titles)]):
            body.draw(axes, number, colours)
        add_scale(figure, panels, colours, extend, FIELDS[field].label)


def frames_at(moments: list[Moment], times: np.ndarray) -> dict[int, list[str]]:
    """Return the names of the moments that each frame shows; times (frames,) [s].

    A moment between two frames is omitted if the nearest one shows another moment better.
    """
    nearest: dict[int, list[Moment]] = {}
    for moment in moments:
        nearest.setdefault(int(np.argmin(np.abs(times - moment.time))), []).append(moment)
    allowed = AT_ONCE * (moments[-1].time - moments[0].time)
    shown = {}
    for index, there in nearest.items():
        misses = [abs(moment.time - times[index]) for moment in there]
        limit = max(min(misses), allowed)
        shown[index] = [m.name for m, miss in zip(there, misses, strict=True) if miss <= limit]
    return shown


def state(at: float, time: np.ndarray, pressure: np.ndarray | None) -> str:
    """Return time and pressure as the text of a title."""
    if pressure is None:
        return f"{at:.3g} s"
    now = round(float(np.interp(at, time, pressure)) / 1e3, 2) + 0.0  # no "-0.00"
    return f"{at:.3g} s, {now:.2f} kPa"


def panels_for(
    part: Figure | SubFigure, body: Pictures, grid: "Arrangement", titles: Sequence[str]
) -> np.ndarray:
    """Return axes (rows, columns) for pictures of a body with these titles."""
    panels = part.subplots(grid.rows, grid.columns, sharex=True, sharey=True, squeeze=False)
    for axes in panels.flat[len(titles) :]:
        axes.set_axis_off()
    for axes, title in zip(panels.flat, titles, strict=False):
        show(axes, body, title)
    lowest = [panels[(len(titles) - 1 - c) // grid.columns, c] for c in range(grid.columns)]
    body.label(lowest, list(panels[:, 0]))
    return panels


def show(axes: Axes, body: Pictures, title: str) -> None:
    """Set up the axes of one frame."""
    axes.set(xlim=body.view[:2], ylim=body.view[2:], aspect="equal")
    axes.grid(False)
    axes.set_title(title)


def add_scale(
    figure: Figure, panels: Axes | np.ndarray, colours: ScalarMappable, extend: str, label: str
) -> None:
    """Add the colour scale below the pictures."""
    bar = figure.colorbar(
        colours, ax=panels, location="bottom", shrink=0.6, aspect=45, pad=0.02, extend=extend
    )
    bar.set_label(label)
    bar.outline.set_linewidth(0.5)


@dataclass(frozen=True)
class Arrangement:
    """Arrangement of panels in a figure; width, height of each picture [inch]."""

    rows: int
    columns: int
    width: float
    height: float


def arranged(count: int, view: np.ndarray) -> Arrangement:
    """Return the arrangement that brings the figure closest to a page-wide 4:3 picture.

    Empty places are penalised. view: xmin, xmax, ymin, ymax of each.
    """
    aspect = (view[3] - view[2]) / (view[1] - view[0])

    def flaws(columns: int) -> float:
        rows = -(-count // columns)
        empty = 1.0 - count / (rows * columns)
        return abs(np.log(rows * aspect / columns / 0.75)) + 3.0 * empty

    columns = min(range(1, count + 1), key=flaws)
    width = (PAGE_WIDTH - 0.5) / columns - 0.1
    return Arrangement(-(-count // columns), columns, width, float(width * aspect))


# -------------------------------------------------------------------------------------------------
# Picture of a mesh: the whole body, and the body cut open, with its sets in colour.

OF_AXES = {"x": BLUE, "y": GREEN, "z": PURPLE}
OTHERS = (ORANGE, RED, SKY)
"""Colours of the ends of each axis, of which the lower one is paler, and of all other sets."""


def draw_mesh(mesh: Mesh, path: Path) -> None:
    """Draw a mesh of a solid as PNG: the body, and its farther half, cut along its longest side.

    Raises OutputError if the file cannot be written.
    """
    colours = _colours([name for name in mesh.facet_sets if name != SURFACE])
    extent = np.ptp(mesh.points, axis=0)
    towards = np.where(np.arange(3) == np.argmax(extent), 0.0, CAMERA.towards)
    axis = int(np.argmax(np.abs(towards)))
    middle = mesh.points[:, axis].min() + 0.5 * extent[axis]
    centres = mesh.points[mesh.cells].mean(axis=1)[:, axis]
    farther = mesh.cells[(centres - middle) * towards[axis] < 1e-6 * extent[axis]]
    flat = CAMERA.project(mesh.points * MILLI)
    low, high = flat.min(axis=0), flat.max(axis=0)
    low, high = low - 0.02 * (high - low).max(), high + 0.02 * (high - low).max()
    aspect = float((high[1] - low[1]) / (high[0] - low[0]))
    height = min(0.5 * PAGE_WIDTH * aspect, PAGE_WIDTH) + 0.7
    with drawing(path, height) as figure:
        panels = figure.subplots(1, 2)
        titles = "whole", f"cut open at {'xyz'[axis]} = {middle * MILLI:.4g} mm"
        for axes, cells, title in zip(panels, (mesh.cells, farther), titles, strict=True):
            facets = boundary_facets(cells, 3)
            faces = np.array([to_rgb(WALL)] * len(facets))
            keys = facet_keys(facets)
            for name, colour in colours.items():
                found = find_rows(facet_keys(mesh.facet_sets[name]), keys)
                faces[found[found >= 0]] = to_rgb(colour)
            shot = visible_side(mesh.points[facets] * MILLI, np.zeros(len(facets)), CAMERA)
            draw_faces(axes, shot.corners, lit(faces[shot.numbers], shot.light), INK)
            axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", title=title)
            axes.set_axis_off()
        figure.legend(
            handles=[Patch(color=colour, label=name) for name, colour in colours.items()],
            loc="outside lower center",
            ncols=7,
            labelcolor=QUIET,
        )


def _colours(names: list[str]) -> dict[str, str]:
    """Return the colour of each set."""
    colours: dict[str, str] = {}
    for name in names:
        if name in END_NAMES:
            pale = PALE if name.endswith("min") else 0.0
            red, green, blue = (pale + (1.0 - pale) * c for c in to_rgb(OF_AXES[name[0]]))
            colours[name] = to_hex((red, green, blue))
    others = [name for name in names if name not in colours]
    return colours | {n: OTHERS[k % len(OTHERS)] for k, n in enumerate(others)}
