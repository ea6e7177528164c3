"""The robot between its walls at a few moments, coloured by a field."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from softsim.errors import OutputError
from softsim.output.fields import Frames
from softsim.report.moments import Moment
from softsim.report.style import FRAME, INK, PAGE_WIDTH, QUIET, WALL, drawing

MILLI = 1e3


@dataclass(frozen=True)
class ColourField:
    """A field to colour by: its label with unit, and the factor from SI to that unit."""

    label: str
    factor: float


FIELDS = {
    "stretch": ColourField("largest principal stretch [-]", 1.0),
    "von_mises": ColourField("von Mises stress [kPa]", 1e-3),
    "pressure": ColourField("pressure in the material [kPa]", 1e-3),
    "displacement": ColourField("displacement [mm]", MILLI),
}

OUTLIERS = 0.005
"""Part of the cells at each end of the scale that may lie past it: one spike tip in a corner must
not take the whole scale for itself."""


@dataclass(frozen=True)
class Snapshot:
    """One frame, ready to draw: title, corner positions (m, 3|4, 2) [mm], values (m,), rigid
    outlines (k, 4, 2) [mm], edges of the free surface (e, 2, 2) [mm]."""

    title: str
    corners: np.ndarray
    values: np.ndarray
    outlines: np.ndarray
    boundary: np.ndarray


def draw_snapshots(
    frames: Frames,
    moments: list[Moment],
    time: np.ndarray,
    pressure: np.ndarray | None,
    field: str,
    path: Path,
) -> None:
    """The stored frames nearest to the moments, with one scale and one view.

    time [s] and pressure [Pa], (rows,) each, are the history's, for the titles; None without
    pressure. field: one of FIELDS. Raises OutputError for another field or one the frames do not
    have, for a mesh in space, for results without a frame, or if the disk refuses.
    """
    if frames.points.shape[1] != 2:
        raise OutputError(
            "snapshots show plane meshes, this one is in space", hint="open the results in ParaView"
        )
    if len(frames) == 0:
        raise OutputError("the results hold no frame to draw: the run stopped before the first")
    if field not in FIELDS or field not in {**frames.point_data, **frames.cell_data}:
        there = sorted(FIELDS.keys() & {**frames.point_data, **frames.cell_data}.keys())
        raise OutputError(
            f"cannot colour the snapshots by {field!r}", hint=f"these are there: {', '.join(there)}"
        )
    shown: dict[int, list[str]] = {}
    for moment in moments:
        nearest = int(np.argmin(np.abs(frames.times - moment.time)))
        shown.setdefault(nearest, []).append(moment.name)
    boundary = boundary_edges(frames.cells)
    snapshots = [
        _snapshot(frames, index, " and ".join(names), boundary, field, time, pressure)
        for index, names in shown.items()
    ]
    walls = frames.described.get("walls", np.zeros((0, 4))) * [MILLI, MILLI, 1.0, 1.0]
    _draw(snapshots, walls, field, path)


def boundary_edges(cells: np.ndarray) -> np.ndarray:
    """Edges that only one cell has, (e, 2) nodes; cells (m, 3 or 4), in order around."""
    edges = np.concatenate([cells[:, [i, i - 1]] for i in range(cells.shape[1])])
    unique, first, count = np.unique(
        np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True
    )
    return edges[first[count == 1]] if len(unique) else edges


def outline_corners(outlines: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """Corners of the rigid outlines in space, (k, 4, 2) [m].

    outlines: (k, 4) centre in the body's axes, length, height [m]. poses: (k, 3) x, y [m], angle.
    """
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2
    local = outlines[:, None, :2] + signs * outlines[:, None, 2:]
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    turn = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    return poses[:, None, :2] + np.einsum("kij,knj->kni", turn, local)


def _snapshot(
    frames: Frames,
    index: int,
    name: str,
    boundary: np.ndarray,
    field: str,
    time: np.ndarray,
    pressure: np.ndarray | None,
) -> Snapshot:
    at = frames.times[index]
    title = f"{name}: {at:.3g} s"
    if pressure is not None:
        title += f", {np.interp(at, time, pressure) / 1e3:.2f} kPa"
    positions = (frames.points + frames.point_data["displacement"][index][:, :2]) * MILLI
    outlines = np.zeros((0, 4, 2))
    if "outlines" in frames.described and "frame_pose" in frames.extra:
        poses = frames.extra["frame_pose"][index]
        if "outline_bodies" in frames.described:  # not every rigid body has an outline
            poses = poses[frames.described["outline_bodies"].astype(int)]
        outlines = outline_corners(frames.described["outlines"], poses) * MILLI
    return Snapshot(
        title,
        positions[frames.cells],
        _cell_values(frames, index, field) * FIELDS[field].factor,
        outlines,
        positions[boundary],
    )


def _cell_values(frames: Frames, index: int, field: str) -> np.ndarray:
    """The field on each cell, (m,): the mean of its nodes for point data, the size of a vector."""
    of_cells = field in frames.cell_data
    values = (frames.cell_data if of_cells else frames.point_data)[field][index]
    if values.ndim == 2:
        values = np.linalg.norm(values, axis=1)
    return values if of_cells else values[frames.cells].mean(axis=1)


def _draw(snapshots: list[Snapshot], walls: np.ndarray, field: str, path: Path) -> None:
    view = _view(snapshots, walls)
    columns = _columns(len(snapshots), view)
    rows = -(-len(snapshots) // columns)
    width = (PAGE_WIDTH - 0.5) / columns - 0.1
    height = rows * (width * (view[3] - view[2]) / (view[1] - view[0]) + 0.3) + 0.95
    scale, extend = _scale(np.concatenate([s.values for s in snapshots]))
    with drawing(path, height) as figure:
        panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes in panels.flat[len(snapshots) :]:
            axes.set_axis_off()
        for axes, snapshot in zip(panels.flat, snapshots, strict=False):
            _draw_walls(axes, walls, view)
            coloured = _draw_body(axes, snapshot, scale)
            axes.set_title(snapshot.title)
            axes.set(xlim=view[:2], ylim=view[2:], aspect="equal")
        _label(figure, panels)
        bar = figure.colorbar(
            coloured, ax=panels, location="bottom", shrink=0.6, aspect=45, pad=0.02, extend=extend
        )
        bar.set_label(FIELDS[field].label)
        bar.outline.set_linewidth(0.5)


def _label(figure: Figure, panels: np.ndarray) -> None:
    for axes in panels[-1]:
        axes.set_xlabel("x [mm]")
    for axes in panels[:, 0]:
        axes.set_ylabel("y [mm]")
    for axes in panels.flat:
        axes.grid(False)


def _draw_body(axes: Axes, snapshot: Snapshot, scale: Normalize) -> PolyCollection:
    for outline in snapshot.outlines:
        axes.add_patch(Polygon(outline, facecolor=FRAME, edgecolor=INK, linewidth=0.7, zorder=2))
    body = PolyCollection(
        list(snapshot.corners), array=snapshot.values, norm=scale, edgecolors="face", linewidths=0.4
    )
    body.set_zorder(3)
    axes.add_collection(body, autolim=False)
    skin = LineCollection(list(snapshot.boundary), colors=INK, linewidths=0.35, zorder=4)
    axes.add_collection(skin, autolim=False)
    return body


def _draw_walls(axes: Axes, walls: np.ndarray, view: np.ndarray) -> None:
    """Each wall as the solid behind it, as far as the view goes, and its face as a line."""
    reach = 2 * np.hypot(view[1] - view[0], view[3] - view[2])
    centre = np.array([view[:2].mean(), view[2:].mean()])
    for wall in walls:
        normal = wall[2:]
        along = np.array([-normal[1], normal[0]])
        foot = centre + ((wall[:2] - centre) @ normal) * normal
        face = np.array([foot - reach * along, foot + reach * along])
        solid = np.concatenate([face, face[::-1] - reach * normal])
        axes.add_patch(
            Polygon(solid, facecolor=WALL, edgecolor=QUIET, hatch="////", linewidth=0, zorder=1)
        )
        axes.plot(*face.T, color=INK, linewidth=0.9, zorder=1.5)


def _view(snapshots: list[Snapshot], walls: np.ndarray) -> np.ndarray:
    """xmin, xmax, ymin, ymax [mm]: all that moves in every snapshot, the near walls, a margin."""
    moving = np.concatenate(
        [part.reshape(-1, 2) for s in snapshots for part in (s.corners, s.outlines)]
    )
    moving = moving[
        np.isfinite(moving).all(axis=1)
    ]  # a failed run's last frame may have lost nodes
    size = np.ptp(moving, axis=0).max()
    gaps = np.array([((moving - w[:2]) @ w[2:]).min() for w in walls])
    feet = [
        moving[np.argmin((moving - w[:2]) @ w[2:])] - gap * w[2:]
        for w, gap in zip(walls, gaps, strict=True)
        if gap < size / 2
    ]
    shown = np.concatenate([moving, np.reshape(feet, (-1, 2))])
    low, high = shown.min(axis=0), shown.max(axis=0)
    margin = 0.06 * size
    return np.array([low[0] - margin, high[0] + margin, low[1] - margin, high[1] + margin])


def _columns(count: int, view: np.ndarray) -> int:
    """Panels side by side: as many as bring the figure nearest to a page-wide 4:3 picture."""
    aspect = (view[3] - view[2]) / (view[1] - view[0])
    heights = {c: -(-count // c) * aspect / c for c in range(1, count + 1)}
    return min(heights, key=lambda c: abs(np.log(heights[c] / 0.75)))


def _scale(values: np.ndarray) -> tuple[Normalize, str]:
    """The shared colour scale, and at which ends there are values past it."""
    values = values[np.isfinite(values)]
    low, high = np.quantile(values, [OUTLIERS, 1 - OUTLIERS])
    below, above = values.min() < low, values.max() > high
    extend = {(False, False): "neither", (True, False): "min", (False, True): "max"}
    return Normalize(low, high), extend.get((bool(below), bool(above)), "both")
