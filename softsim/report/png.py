"""Output of diagrams as PNG."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import XAxis, YAxis
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from softsim.report.diagram import (
    MOST_NUMBERS,
    POINTS,
    STEPS,
    Cells,
    Diagram,
    EdgeMarks,
    Panel,
    PlotAxis,
    PlotSeries,
    Scale,
    Stripe,
    colours_of,
)
from softsim.report.style import INK, QUIET, RED, SKY, drawing

BINS = 400
"""Number of bins of a vibrating signal, about the number of columns that a figure resolves."""

PANEL_HEIGHT, SIDE_BY_SIDE = 2.1, 2.3
"""Heights of an ordinary stacked panel and of one of several side by side [inch]."""

PANELS_IN_A_ROW = 3

WIDE, HIGH = 80, 40
"""Numbers of characters along the horizontal and the vertical axis of a single panel."""

CROWD, EDGE_CROWD = 400, 60.0
"""Numbers of points, and of marks along an edge, above which they are drawn transparent."""

LEGEND_ROOM = 100
"""Number of characters in a line of a legend, including the symbols before its entries."""

LEGIBLE = 0.06, 0.045
"""Smallest width and height of a cell with a number in it, as fractions of the axes."""

DENSE = 1e3
"""Range of a logarithmic axis up to which 2 and 5 of each decade are labelled."""

LINE = 0.075
"""Height of a line of text beside a panel, as a fraction of the panel."""

BRIGHT = 0.5
"""Lightness of a colour above which the text on it is dark."""


def draw(path: Path, *diagrams: Diagram) -> None:
    """Draw one diagram, or several of one panel each side by side.

    The latter have the same vertical quantity and one colour bar. Raises OutputError if the
    file cannot be written.
    """
    if len(diagrams) == 1:
        draw_one(path, diagrams[0])
        return
    columns = min(len(diagrams), PANELS_IN_A_ROW)
    rows = -(-len(diagrams) // columns)
    with drawing(path, 0.8 + SIDE_BY_SIDE * rows) as figure:
        grid = figure.subplots(rows, columns, sharey=True, squeeze=False)
        for axes in grid.flat[len(diagrams) :]:
            axes.set_axis_off()
        for number, (axes, diagram) in enumerate(zip(grid.flat, diagrams, strict=False)):
            draw_panel(axes, diagram.panels[0], HIGH // min(rows, 2))
            along_x(axes, diagram.x, WIDE // columns)
            if number % columns:
                axes.set_ylabel("")
        add_bar(figure, diagrams[0].panels[0], grid)
        add_legend(figure, diagrams[0].panels[0])


def draw_one(path: Path, diagram: Diagram) -> None:
    """Draw the panels of a diagram above one another."""
    heights = [panel.height for panel in diagram.panels]
    with drawing(path, 0.9 + PANEL_HEIGHT * sum(heights)) as figure:
        grid = figure.subplots(len(heights), sharex=True, squeeze=False, height_ratios=heights)
        draw_panels(list(grid[:, 0]), diagram)
        if len(heights) > 1:
            figure.suptitle(diagram.remark, x=0.01, ha="left", fontsize=9.0)
        else:
            grid[0, 0].set_title(diagram.remark)
            add_bar(figure, diagram.panels[0], grid)
            add_legend(figure, diagram.panels[0])
        figure.align_ylabels()


def draw_panels(grid: Sequence[Axes], diagram: Diagram) -> None:
    """Draw the panels of a diagram into axes above one another.

    Each has its legend above, unless it is the only panel.
    """
    for axes, panel in zip(grid, diagram.panels, strict=True):
        sides = draw_panel(axes, panel, int(HIGH * panel.height))
        for place in diagram.bounds:
            axes.axvline(place, color=QUIET, linestyle=":", linewidth=0.9)
        if len(grid) > 1 and panel.has_legend:
            legend(axes, named(sides), loc="lower left", bbox_to_anchor=(0.0, 1.0))
    along_x(grid[-1], diagram.x)
    write_values(grid[0], diagram.panels[0])
    if diagram.over_time and diagram.span[0] < diagram.span[1]:
        grid[-1].set_xlim(diagram.span)


def draw_panel(axes: Axes, panel: Panel, room: int = HIGH) -> list[Axes]:
    """Draw series, cells, marks and titles of a panel; return its axes, one for each side.

    room: number of characters along the axes.
    """
    sides = [axes]
    if panel.right is not None:
        sides.append(axes.twinx())
        sides[1].spines["right"].set_visible(True)
        sides[1].grid(False)
    for side, axis in zip(sides, panel.axes, strict=True):
        for series in axis.series:
            draw_series(side, series, panel.colours)
        along_y(side, axis, room)
    if panel.cells is not None and panel.colours is not None:
        draw_cells(axes, panel.cells, *panel.colours)
    draw_stripes(axes, panel.stripes)
    for edge in panel.edges:
        draw_edge(axes, edge)
    for point in panel.best:
        mark_best(axes, point, panel.cells)
    if panel.is_empty:
        axes.set_yticks([])
        axes.text(
            0.5, 0.5, "no case has a result yet", transform=axes.transAxes, ha="center",
            va="center", color=QUIET,
        )  # fmt: skip
    return sides


def draw_series(
    axes: Axes, series: PlotSeries, colours: tuple[Scale, np.ndarray] | None = None
) -> None:
    """Draw points of a size that suits their number, or a line in its band."""
    if series.kind == POINTS:
        draw_points(axes, series, colours)
        return
    series = series.thinned(BINS)
    if series.band is not None:
        axes.fill_between(series.x, *series.band, color=series.colour, alpha=0.25, linewidth=0)
    axes.plot(
        series.x, series.y, "-" if series.kind == STEPS else series.kind, color=series.colour,
        label=series.name, marker="o" if series.has_markers else "", markersize=3.5,
        drawstyle="steps-post" if series.kind == STEPS else "default",
    )  # fmt: skip


def draw_points(axes: Axes, series: PlotSeries, colours: tuple[Scale, np.ndarray] | None) -> None:
    """Draw single points, smaller if there are many."""
    look: dict[str, Any] = {"color": series.colour}
    if colours is not None and series.shades is not None:
        map_ = colours_of(*colours)
        look = {"c": series.shades, "cmap": map_.cmap, "norm": map_.norm}
    crowded = len(series.x) > CROWD
    axes.scatter(
        series.x, series.y, s=7.0 if crowded else 18.0, alpha=0.6 if crowded else 0.9,
        linewidths=0, clip_on=False, label=series.name, **look,
    )  # fmt: skip


def draw_stripes(axes: Axes, stripes: Sequence[Stripe]) -> None:
    """Draw stripes to the ends of the axis, with their labels on the right.

    Labels of narrow stripes are placed above one another.
    """
    if not stripes:
        return
    low, high = stripes[0].low, stripes[-1].high
    axes.set_ylim(low, high)
    at = -np.inf
    for stripe in stripes:
        if stripe.shaded:
            axes.axhspan(stripe.low, stripe.high, color=SKY, alpha=0.16, linewidth=0)
        at = max(0.5 * (stripe.low + stripe.high), at + LINE * (high - low))
        axes.annotate(
            stripe.name, (1.0, at), (8.0, -2.5), xycoords=("axes fraction", "data"),
            textcoords="offset points", fontsize=7.5, color=INK, annotation_clip=False,
        )  # fmt: skip


def draw_edge(axes: Axes, edge: EdgeMarks) -> None:
    """Draw small marks along the lower edge."""
    places = edge.x[np.isfinite(edge.x)]
    look: dict[str, Any] = {"marker": edge.marker, "color": edge.colour, "markersize": 4.5}
    axes.plot(
        places, np.full(len(places), 0.015), linestyle="", clip_on=False, zorder=5,
        alpha=min(1.0, EDGE_CROWD / max(len(places), 1)), transform=axes.get_xaxis_transform(),
        **look,
    )  # fmt: skip
    axes.plot([], [], linestyle="", label=edge.name, **look)


def mark_best(axes: Axes, point: PlotSeries, cells: Cells | None) -> None:
    """Draw a star at the best point, or a frame around its cell."""
    look: dict[str, Any] = {"zorder": 6, "clip_on": False, "label": point.name}
    if cells is None:
        look |= {"marker": "*", "markersize": 13.0, "color": RED, "markeredgecolor": "white"}
        axes.plot(point.x, point.y, linestyle="", **look)
        return
    left, bottom, width, height = cells.around(point.x[0], point.y[0])
    look |= {"facecolor": "none", "edgecolor": RED, "linewidth": 2.0}
    axes.add_patch(Rectangle((left, bottom), width, height, **look))


def draw_cells(axes: Axes, cells: Cells, z: Scale, places: np.ndarray) -> None:
    """Draw coloured cells, with a cross where cases failed and none is done."""
    colours = colours_of(z, places)
    mesh = axes.pcolormesh(cells.at_x, cells.at_y, np.ma.masked_invalid(cells.values))
    mesh.set(cmap=colours.cmap, norm=colours.norm)
    j, i = np.nonzero(cells.failed)
    if len(i):
        axes.plot(cells.columns[i], cells.rows[j], "x", color=RED, label="failed")
    axes.grid(False)


def write_values(axes: Axes, panel: Panel) -> None:
    """Write the value in the middle of each cell if all cells are large enough and few.

    The scales of the axes must be set before; their limits are set to the outer edges of the
    cells.
    """
    if panel.cells is None or panel.colours is None:
        return
    cells, (z, places) = panel.cells, panel.colours
    axes.set(xlim=cells.at_x[[0, -1]], ylim=cells.at_y[[0, -1]])
    x, y = _shares(axes.xaxis, cells.at_x), _shares(axes.yaxis, cells.at_y)
    narrow = np.diff(x).min() < LEGIBLE[0] or np.diff(y).min() < LEGIBLE[1]
    if cells.values.size > MOST_NUMBERS or narrow:
        return
    colours = colours_of(z, places)
    for j, i in np.argwhere(np.isfinite(cells.values)):
        value = cells.values[j, i]
        lightness = np.dot(colours.to_rgba(value)[:3], [0.299, 0.587, 0.114])
        middle = x[i : i + 2].mean(), y[j : j + 2].mean()
        axes.text(
            *middle, z.text(value), transform=axes.transAxes, ha="center", va="center",
            fontsize=7.5, color=INK if lightness > BRIGHT else "white",
        )  # fmt: skip


def along_x(axes: Axes, scale: Scale, room: int = WIDE) -> None:
    """Set title, scale and labels of the horizontal axis, for `room` characters per line.

    Labels that do not fit side by side are rotated, by 90 degrees if there are many.
    """
    axes.set_xlabel(fill(scale.title, room))
    space(axes.xaxis, scale)
    if scale.labels is not None:
        axes.set_xlim(scale.limits())
        places, texts = scale.ticks()
        axes.set_xticks(places, texts)
        if sum(map(len, texts)) > room * 2 // 3:
            if len(texts) > room // 4:
                axes.tick_params(axis="x", labelrotation=90)
            else:
                axes.set_xticks(places, texts, rotation=35, ha="right", rotation_mode="anchor")


def along_y(axes: Axes, axis: PlotAxis, room: int) -> None:
    """Set title, scale and labels of the vertical axis, for `room` characters per line."""
    scale = axis.scale
    axes.set_ylabel(fill(scale.title, room), color=axis.colour)
    space(axes.yaxis, scale)
    if scale.labels is not None:
        axes.set_ylim(scale.limits())
        axes.set_yticks(*scale.ticks())
    if scale.from_zero:
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))


def space(along: XAxis | YAxis, scale: Scale) -> None:
    """Set a logarithmic scale with plain numbers, or integer ticks."""
    if scale.logarithmic:
        if not np.isfinite(along.get_minpos()):  # nothing to show, of which there is no logarithm
            along.axes.set(**{f"{along.axis_name}lim": scale.limits()})
        along.axes.set(**{f"{along.axis_name}scale": "log"})
        low, high = along.get_view_interval()
        along.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < DENSE * low else (1.0,)))
        along.set_major_formatter("{x:g}")
        along.set_minor_formatter(NullFormatter())
    elif scale.whole:
        along.set_major_locator(MaxNLocator("auto", integer=True))


def add_bar(figure: Figure, panel: Panel, grid: np.ndarray) -> None:
    """Add the colour bar beside all panels, if the panel has colours."""
    if panel.colours is None:
        return
    scale, places = panel.colours
    colours = colours_of(scale, places)
    bar = figure.colorbar(colours, ax=grid, label=scale.title, pad=0.02)
    bar.outline.set_visible(False)
    if scale.labels is not None:
        at, texts = scale.ticks()
        bar.set_ticks(at, labels=texts)
        bar.minorticks_off()
    elif scale.whole and not scale.logarithmic:
        bar.locator = MaxNLocator(integer=True)


def add_legend(figure: Figure, panel: Panel) -> None:
    """Add the legend above the figure, and the entry of the best point below it."""
    if panel.has_legend:
        handles, best = named(figure.axes), {point.name for point in panel.best}
        below = {name: handles.pop(name) for name in list(handles) if name in best}
        legend(figure, handles, loc="outside upper center")
        legend(figure, below, loc="outside lower center")


def named(sides: Sequence[Axes]) -> dict[str, Any]:
    """Return the legend handles of axes by name."""
    pairs = [side.get_legend_handles_labels() for side in sides]
    return {name: handle for pair in pairs for handle, name in zip(*pair, strict=True)}


def legend(place: Axes | Figure, handles: dict[str, Any], **where: Any) -> None:
    """Add a legend of `handles`, if there are any, in as many columns as fit."""
    if handles:
        texts = [fill(name, LEGEND_ROOM - 10) for name in handles]
        lengths = [8 + max(map(len, text.split("\n"))) for text in texts]
        columns = fitting_columns(lengths)
        place.legend(list(handles.values()), texts, ncols=columns, columnspacing=1.4, **where)


def fitting_columns(lengths: Sequence[int]) -> int:
    """Return the number of legend columns for entries of these lengths [characters]."""
    for columns in range(len(lengths), 1, -1):
        if sum(part.max() for part in np.array_split(lengths, columns)) <= LEGEND_ROOM:
            return columns
    return 1


def _shares(along: XAxis | YAxis, edges: np.ndarray) -> np.ndarray:
    """Return the positions of edges (n,) as fractions of an axis that ends at the outer ones."""
    at = along.get_transform().transform(edges)
    shares: np.ndarray = (at - at[0]) / (at[-1] - at[0])
    return shares
