"""A measure as the colour of cells over two factors."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.patches import Rectangle

from softsim.report.study.cells import Cells
from softsim.report.study.findings import FAILED_COUNT, Findings
from softsim.report.study.marks import add_legend, best_label
from softsim.report.study.scale import Scale
from softsim.report.style import INK, QUIET, RED, drawing
from softsim.study.axes import Plot

MOST_NUMBERS = 80
"""Cells that have their value written in them."""

LEGIBLE = 0.06, 0.045
"""Least width and height of such a cell, as shares of the axes."""

BRIGHT = 0.5
"""Lightness of a colour above which what is written on it is dark."""


def draw_heat_map(findings: Findings, plot: Plot, path: Path) -> None:
    """Draw it as PNG: the mean of all cases in a cell; hatched where they failed, empty where none
    was run. Raises OutputError if the disk refuses or an axis is unknown.
    """
    x, y, z = heat_map_scales(findings, plot)
    cells = Cells.of(findings, x, y, z)
    colours = z.colours(cells.values)
    with drawing(path, height=4.4) as figure:
        axes = figure.add_subplot()
        axes.grid(False)
        mesh = axes.pcolormesh(cells.at_x, cells.at_y, np.ma.masked_invalid(cells.values))
        mesh.set(cmap=colours.cmap, norm=colours.norm)
        x.along_x(axes)
        y.along_y(axes)
        axes.set(xlim=cells.at_x[[0, -1]], ylim=cells.at_y[[0, -1]])
        if cells.values.size <= MOST_NUMBERS:
            _write_values(axes, cells, z, colours)
        _hatch_failed(axes, cells)
        _frame_best(axes, findings, cells, x, y)
        axes.set_title(remark_on_cells(findings, x, y))
        z.beside(figure, axes, colours)
        add_legend(figure, axes)


def heat_map_scales(findings: Findings, plot: Plot) -> tuple[Scale, Scale, Scale]:
    """Across, upwards, and what the colour shows: the first measure where the plot does not say.

    Raises OutputError if an axis is unknown.
    """
    colour = plot.colour or findings.measures[0].name
    return findings.scale(plot.x), findings.scale(plot.y), findings.scale(colour)


def remark_on_cells(findings: Findings, x: Scale, y: Scale) -> str:
    """What a reader must know of the cells: over what they are means, and what is left out."""
    others = [factor.name for factor in findings.varied if factor not in (x.axis, y.axis)]
    others += ["repeats"] * (findings.record.repeats > 1)
    said = [f"mean over {', '.join(others)}"] if others else []
    failed = findings.design_points[FAILED_COUNT].sum()
    if others and failed:
        said.append(f"without {failed} that failed")
    return ", ".join(said)


def _write_values(axes: Axes, cells: Cells, z: Scale, colours: ScalarMappable) -> None:
    """The value in the middle of each cell, where all have room for it."""
    x, y = _shares(axes.xaxis, cells.at_x), _shares(axes.yaxis, cells.at_y)
    if np.diff(x).min() < LEGIBLE[0] or np.diff(y).min() < LEGIBLE[1]:
        return
    for j, i in np.argwhere(np.isfinite(cells.values)):
        value = cells.values[j, i]
        lightness = np.dot(colours.to_rgba(value)[:3], [0.299, 0.587, 0.114])
        middle = x[i : i + 2].mean(), y[j : j + 2].mean()
        axes.text(
            *middle, z.text(value), transform=axes.transAxes, ha="center", va="center",
            fontsize=7.5, color=INK if lightness > BRIGHT else "white",
        )  # fmt: skip


def _shares(axis: Axis, edges: np.ndarray) -> np.ndarray:
    """Where edges (n,) lie, from 0 to 1 along an axis that ends at the outer ones."""
    at = axis.get_transform().transform(edges)
    shares: np.ndarray = (at - at[0]) / (at[-1] - at[0])
    return shares


def _hatch_failed(axes: Axes, cells: Cells) -> None:
    """Hatch cells where cases failed and none is done."""
    look: dict[str, Any] = {"facecolor": "none", "edgecolor": QUIET, "hatch": "////", "lw": 0.0}
    for number, (j, i) in enumerate(np.argwhere(cells.failed)):
        x, y, width, height = cells.box(i, j)
        label = None if number else "failed"
        axes.add_patch(Rectangle((x, y), width, height, label=label, **look))


def _frame_best(axes: Axes, findings: Findings, cells: Cells, x: Scale, y: Scale) -> None:
    """A frame around the cell in which the best design point is."""
    if findings.best is None:
        return
    place = [scale.place(findings.best.values[scale.axis.column]) for scale in (x, y)]
    left, bottom, width, height = cells.box(*cells.at(*place))
    frame: dict[str, Any] = {"facecolor": "none", "edgecolor": RED, "linewidth": 2.0, "zorder": 6}
    label = best_label(findings)
    axes.add_patch(Rectangle((left, bottom), width, height, clip_on=False, label=label, **frame))
