"""A measure as the colour of cells over two factors."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.patches import Rectangle

from softsim.output.study_folder import Plot
from softsim.report.study.findings import FAILED_COUNT, Findings
from softsim.report.study.marks import add_legend, best_label
from softsim.report.study.scale import Scale, shortened
from softsim.report.style import INK, QUIET, RED, drawing

MOST_NUMBERS = 80
"""Cells that have their value written in them."""

LEGIBLE = 0.065, 0.045
"""Least width and height of such a cell, as shares of the axes."""

BRIGHT = 0.5
"""Lightness of a colour above which what is written on it is dark."""


@dataclass(frozen=True)
class Cells:
    """Places of the levels, columns (c,) and rows (r,), the value in each cell (r, c), NaN where no
    case is done, and whether cases failed there (r, c).
    """

    columns: np.ndarray
    rows: np.ndarray
    values: np.ndarray
    failed: np.ndarray


def draw_heat_map(findings: Findings, plot: Plot, path: Path) -> None:
    """Draw it as PNG: the mean of all cases in a cell; hatched where they failed, empty where none
    was run. Raises OutputError if the disk refuses or an axis is unknown.
    """
    x, y, z = (findings.scale(name) for name in (plot.x, plot.y, plot.colour or plot.y))
    cells = cells_of(findings, x, y, z)
    colours = z.colours(cells.values)
    at_x, at_y = edges(cells.columns, x.logarithmic), edges(cells.rows, y.logarithmic)
    with drawing(path, height=4.4) as figure:
        axes = figure.add_subplot()
        axes.grid(False)
        axes.pcolormesh(at_x, at_y, np.ma.masked_invalid(cells.values),
                        cmap=colours.cmap, norm=colours.norm)  # fmt: skip
        x.along_x(axes)
        y.along_y(axes)
        axes.set(xlim=at_x[[0, -1]], ylim=at_y[[0, -1]])
        if cells.values.size <= MOST_NUMBERS and legible(axes, at_x, at_y):
            _write_values(axes, cells, z, colours)
        _hatch_failed(axes, cells, at_x, at_y)
        _frame_best(axes, findings, cells, (x, y), (at_x, at_y))
        others = [f.name for f in findings.varied if f not in (x.axis, y.axis)]
        if others:
            axes.set_title(f"mean over {', '.join(others)}")
        z.beside(figure, axes, colours)
        add_legend(figure, axes)


def cells_of(findings: Findings, x: Scale, y: Scale, z: Scale) -> Cells:
    """The design points by the levels of two factors."""
    column = polars.col(z.axis.column)
    grouped = findings.design_points.group_by(
        [x.axis.column, y.axis.column], maintain_order=True
    ).agg(
        (column.drop_nulls().mode().sort().first() if z.axis.is_label else column.mean()).alias(
            "value"
        ),
        polars.col(FAILED_COUNT).sum(),
    )
    columns, i = np.unique(x.places(grouped[x.axis.column]), return_inverse=True)
    rows, j = np.unique(y.places(grouped[y.axis.column]), return_inverse=True)
    values = np.full((len(rows), len(columns)), np.nan)
    values[j, i] = z.places(grouped["value"])
    failed = np.zeros(values.shape, dtype=bool)
    failed[j, i] = grouped[FAILED_COUNT].to_numpy() > 0
    return Cells(columns, rows, values, failed)


def edges(levels: np.ndarray, logarithmic: bool) -> np.ndarray:
    """Edges (n + 1,) of cells around rising levels (n,): half-way between them, by their ratio
    where they are spaced logarithmically; the outer cells reach as far beyond their level.
    """
    at = np.log(levels) if logarithmic else levels
    if len(at) == 1:
        found = at[0] + np.array([-0.5, 0.5]) * (1.0 if logarithmic else abs(at[0]) or 1.0)
    else:
        middle = 0.5 * (at[:-1] + at[1:])
        found = np.array([2.0 * at[0] - middle[0], *middle, 2.0 * at[-1] - middle[-1]])
    return np.exp(found) if logarithmic else found


def legible(axes: Axes, at_x: np.ndarray, at_y: np.ndarray) -> bool:
    """Whether the smallest cell has room for a number."""
    scaled = [
        axis.get_transform().transform(at) for axis, at in ((axes.xaxis, at_x), (axes.yaxis, at_y))
    ]
    return all(
        np.diff(at).min() / np.ptp(at) >= least for at, least in zip(scaled, LEGIBLE, strict=True)
    )


def _write_values(axes: Axes, cells: Cells, z: Scale, colours: ScalarMappable) -> None:
    for j, i in np.argwhere(np.isfinite(cells.values)):
        value = cells.values[j, i]
        text = shortened(z.labels[int(value)]) if z.axis.is_label else f"{value:.3g}"
        lightness = np.dot(colours.to_rgba(value)[:3], [0.299, 0.587, 0.114])
        axes.text(
            cells.columns[i], cells.rows[j], text, ha="center", va="center", fontsize=7.5,
            color=INK if lightness > BRIGHT else "white",
        )  # fmt: skip


def _hatch_failed(axes: Axes, cells: Cells, at_x: np.ndarray, at_y: np.ndarray) -> None:
    """Hatch cells where cases failed and none is done."""
    lost = np.argwhere(cells.failed & ~np.isfinite(cells.values))
    look: dict[str, Any] = {
        "facecolor": "none",
        "edgecolor": QUIET,
        "hatch": "////",
        "linewidth": 0.0,
    }
    for j, i in lost:
        axes.add_patch(_cell(at_x, at_y, i, j, **look))
    if len(lost):
        axes.add_patch(Rectangle((np.nan, np.nan), 0.0, 0.0, label="failed", **look))


def _frame_best(
    axes: Axes, findings: Findings, cells: Cells,
    scales: tuple[Scale, Scale], at: tuple[np.ndarray, np.ndarray],
) -> None:  # fmt: skip
    """A frame around the cell in which the best design point is."""
    if findings.best is None:
        return
    i, j = (
        int(np.flatnonzero(levels == scale.place(findings.best.values[scale.axis.column]))[0])
        for scale, levels in zip(scales, (cells.columns, cells.rows), strict=True)
    )
    axes.add_patch(
        _cell(*at, i, j, facecolor="none", edgecolor=RED, linewidth=2.0, clip_on=False, zorder=6,
              label=best_label(findings))
    )  # fmt: skip


def _cell(at_x: np.ndarray, at_y: np.ndarray, i: int, j: int, **look: Any) -> Rectangle:
    corner = (at_x[i], at_y[j])
    return Rectangle(corner, at_x[i + 1] - at_x[i], at_y[j + 1] - at_y[j], **look)
