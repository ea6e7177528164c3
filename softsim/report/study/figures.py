"""All figures of a study's folder, from its files alone."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from softsim.report.study.cells import Cells
from softsim.report.study.findings import BEST, Findings, best_in_words
from softsim.report.study.plots import (
    PLOTS,
    Edge,
    Series,
    StudyPlot,
    drawn_plots,
    over_factors,
    progress,
    study_plot,
)
from softsim.report.study.scale import TALL, WIDE, Scale
from softsim.report.style import INK, QUIET, RED, drawing
from softsim.study.axes import Plot

PROGRESS, FACTORS = "progress.png", "factors.png"

HEIGHT, PANEL_HEIGHT = 4.0, 2.3
"""Of a figure, and of one of several panels [inch]."""

PANELS_IN_A_ROW = 3

CROWD = 400
"""Points from which on they become smaller and let others shine through."""

EDGE_CROWD = 60.0
"""The same of marks along an edge."""

STEPS = {"line": "default", "steps": "steps-post"}
"""How points are joined -> the same of matplotlib."""

STAR: dict[str, Any] = {"marker": "*", "markersize": 13.0, "color": RED, "markeredgecolor": "white"}

LEGEND_ROOM = 100
"""Characters of a line of the legend, with what stands before its entries."""

MOST_NUMBERS = 80
"""Cells that have their value written in them."""

LEGIBLE = 0.06, 0.045
"""Least width and height of such a cell, as shares of the axes."""

BRIGHT = 0.5
"""Lightness of a colour above which what is written on it is dark."""


def draw_study(folder: Path) -> list[Path]:
    """Draw the plots of the study, and how its optimisation went; the figures' paths. Figures of
    plots that it has no longer go.

    Raises OutputError where the folder holds no study, a plot names no axis of it, or the disk
    refuses.
    """
    findings = Findings.read(folder)
    best = fill(best_in_words(findings), LEGEND_ROOM - 10)
    figures = {file_name(plot): [study_plot(findings, plot)] for plot in drawn_plots(findings)}
    goal = findings.record.goal
    if goal is not None:
        figures[PROGRESS] = [progress(findings, goal)]
        figures[FACTORS] = [plot for _, plot in over_factors(findings, goal)]
    for name, plots in figures.items():
        draw_plots(plots, best, folder / name)
    for kind in (*PLOTS, "progress", "factors"):
        for file in folder.glob(f"{kind}*.png"):
            if file.name not in figures:
                file.unlink()
    return [folder / name for name in figures]


def file_name(plot: Plot) -> str:
    """Of a plot: curve_speed_over_rate_by_pipe.png."""
    words = [plot.kind, plot.y, "over", plot.x]
    for joined, name in (("by", plot.by), ("coloured_by", plot.colour)):
        words += [joined, name] if name else []
    return "".join(c if c.isalnum() or c in "_-" else "_" for c in "_".join(words)) + ".png"


def draw_plots(plots: Sequence[StudyPlot], best: str, path: Path) -> None:
    """Plots side by side, of one measure and with one bar, as PNG; best: what the legend says of
    the best design point. Raises OutputError if the disk refuses.
    """
    columns = min(len(plots), PANELS_IN_A_ROW)
    rows = -(-len(plots) // columns)
    height = HEIGHT if len(plots) == 1 else 0.8 + PANEL_HEIGHT * rows
    with drawing(path, height) as figure:
        panels = figure.subplots(rows, columns, sharey=True, squeeze=False)
        for axes in panels.flat[len(plots) :]:
            axes.set_axis_off()
        for number, (axes, plot) in enumerate(zip(panels.flat, plots, strict=False)):
            draw_plot(axes, plot, best)
            plot.x.along_x(axes, WIDE // columns)
            if number % columns == 0:
                plot.y.along_y(axes, TALL // min(rows, 2))
            finish(axes, plot)
        if plots[0].colours is not None:
            scale, places = plots[0].colours
            scale.beside(figure, panels, scale.colours(places))
        add_legend(figure, panels.flat[0])


def draw_plot(axes: Axes, plot: StudyPlot, best: str) -> None:
    """Cells, or series with the cases that have no result, and the best design point."""
    if plot.cells is not None and plot.colours is not None:
        scale, places = plot.colours
        draw_cells(axes, plot.cells, scale.colours(places))
        for point in plot.best:
            frame_cell(axes, plot.cells, point, best)
        return
    for series in plot.series:
        draw_series(axes, series, plot.colours)
    for edge in plot.edges:
        draw_edge(axes, edge)
    for point in plot.best:
        axes.plot(point.x, point.y, linestyle="", zorder=6, clip_on=False, label=best, **STAR)


def finish(axes: Axes, plot: StudyPlot) -> None:
    """What needs the axes as they are: numbers in cells, limits, a word where nothing is drawn."""
    axes.set_title(plot.remark)
    if plot.cells is not None and plot.colours is not None:
        axes.grid(False)
        axes.set(xlim=plot.cells.at_x[[0, -1]], ylim=plot.cells.at_y[[0, -1]])
        write_values(axes, plot.cells, *plot.colours)
    if plot.is_empty:
        axes.set_yticks([])
        axes.text(
            0.5, 0.5, "no case has a result yet", transform=axes.transAxes, ha="center",
            va="center", color=QUIET,
        )  # fmt: skip


def draw_series(axes: Axes, series: Series, colours: tuple[Scale, np.ndarray] | None) -> None:
    """Points of a size that suits their number, or a line in its band."""
    if np.isfinite(series.band).any():
        axes.fill_between(series.x, *series.band, color=series.colour, alpha=0.2, linewidth=0)
    if series.join:
        axes.plot(
            series.x, series.y, marker="o" if series.has_markers else "", markersize=3.5,
            color=series.colour, drawstyle=STEPS[series.join], label=series.name,
        )  # fmt: skip
        return
    look: dict[str, Any] = {"color": series.colour}
    if colours is not None:
        scale, places = colours
        map_ = scale.colours(places)
        look = {"c": series.values, "cmap": map_.cmap, "norm": map_.norm}
    crowded = len(series.x) > CROWD
    axes.scatter(
        series.x, series.y, s=7.0 if crowded else 18.0, alpha=0.6 if crowded else 0.9,
        linewidths=0, label=series.name, **look,
    )  # fmt: skip


def draw_edge(axes: Axes, edge: Edge) -> None:
    """Small marks along the lower edge where cases failed or were pruned."""
    places = edge.x[np.isfinite(edge.x)]
    look: dict[str, Any] = {"marker": edge.marker, "color": edge.colour, "markersize": 4.5}
    axes.plot(
        places, np.full(len(places), 0.015), linestyle="", clip_on=False, zorder=5,
        alpha=min(1.0, EDGE_CROWD / max(len(places), 1)), transform=axes.get_xaxis_transform(),
        **look,
    )  # fmt: skip
    axes.plot([], [], linestyle="", label=edge.name, **look)


def draw_cells(axes: Axes, cells: Cells, colours: ScalarMappable) -> None:
    """Cells in their colours, hatched where cases failed and none is done."""
    mesh = axes.pcolormesh(cells.at_x, cells.at_y, np.ma.masked_invalid(cells.values))
    mesh.set(cmap=colours.cmap, norm=colours.norm)
    look: dict[str, Any] = {"facecolor": "none", "edgecolor": QUIET, "hatch": "////", "lw": 0.0}
    for number, (j, i) in enumerate(np.argwhere(cells.failed)):
        x, y, width, height = cells.box(i, j)
        label = None if number else "failed"
        axes.add_patch(Rectangle((x, y), width, height, label=label, **look))


def frame_cell(axes: Axes, cells: Cells, point: Series, label: str) -> None:
    """A frame around the cell of a point."""
    left, bottom, width, height = cells.box(*cells.at(point.x[0], point.y[0]))
    look: dict[str, Any] = {"facecolor": "none", "edgecolor": RED, "linewidth": 2.0, "zorder": 6}
    axes.add_patch(Rectangle((left, bottom), width, height, clip_on=False, label=label, **look))


def write_values(axes: Axes, cells: Cells, z: Scale, places: np.ndarray) -> None:
    """The value in the middle of each cell, where all have room for it."""
    x, y = _shares(axes.xaxis, cells.at_x), _shares(axes.yaxis, cells.at_y)
    narrow = np.diff(x).min() < LEGIBLE[0] or np.diff(y).min() < LEGIBLE[1]
    if cells.values.size > MOST_NUMBERS or narrow:
        return
    colours = z.colours(places)
    for j, i in np.argwhere(np.isfinite(cells.values)):
        value = cells.values[j, i]
        lightness = np.dot(colours.to_rgba(value)[:3], [0.299, 0.587, 0.114])
        middle = x[i : i + 2].mean(), y[j : j + 2].mean()
        axes.text(
            *middle, z.text(value), transform=axes.transAxes, ha="center", va="center",
            fontsize=7.5, color=INK if lightness > BRIGHT else "white",
        )  # fmt: skip


def add_legend(figure: Figure, axes: Axes) -> None:
    """What the marks mean above the figure, in as many columns as fit, the best below it."""
    handles, labels = axes.get_legend_handles_labels()
    places: dict[Any, bool] = {"outside upper center": False, "outside lower center": True}
    for place, of_best in places.items():
        shown = [k for k, label in enumerate(labels) if label.startswith(BEST) == of_best]
        if shown:
            longest = max(len(line) for k in shown for line in labels[k].split("\n"))
            figure.legend(
                [handles[k] for k in shown], [labels[k] for k in shown], loc=place,
                ncols=max(1, min(len(shown), LEGEND_ROOM // (longest + 8))), columnspacing=1.4,
            )  # fmt: skip


def _shares(axis: Axis, edges: np.ndarray) -> np.ndarray:
    """Where edges (n,) lie, from 0 to 1 along an axis that ends at the outer ones."""
    at = axis.get_transform().transform(edges)
    shares: np.ndarray = (at - at[0]) / (at[-1] - at[0])
    return shares
