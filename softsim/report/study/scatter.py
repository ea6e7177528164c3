"""Each case a point: one axis over another, perhaps coloured by a third."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from softsim.report.study.findings import Findings
from softsim.report.study.marks import add_legend, mark_best, mark_without_result, say_if_empty
from softsim.report.style import BLUE, drawing
from softsim.study.axes import Plot

CROWD = 400
"""Points from which on they become smaller and let others shine through."""


def draw_scatter(findings: Findings, plot: Plot, path: Path) -> None:
    """Draw it as PNG. Raises OutputError if the disk refuses or an axis is unknown."""
    x, y = findings.scale(plot.x), findings.scale(plot.y)
    done = findings.done
    at_x, at_y = x.places(done[x.axis.column]), y.places(done[y.axis.column])
    with drawing(path, height=4.0) as figure:
        axes = figure.add_subplot()
        if plot.colour is None:
            draw_points(axes, at_x, at_y, color=BLUE)
        else:
            z = findings.scale(plot.colour)
            at_z = z.places(done[z.axis.column])
            colours = z.colours(at_z)
            draw_points(axes, at_x, at_y, c=at_z, cmap=colours.cmap, norm=colours.norm)
            z.beside(figure, axes, colours)
        x.along_x(axes)
        y.along_y(axes)
        if x.axis in findings.factors:
            mark_without_result(axes, findings, x)
        mark_best(axes, findings, x, y)
        say_if_empty(axes, at_x + at_y)
        add_legend(figure, axes)


def draw_points(axes: Axes, x: np.ndarray, y: np.ndarray, **colours: Any) -> None:
    """Points of a size that suits their number."""
    crowded = len(x) > CROWD
    axes.scatter(
        x, y, s=7.0 if crowded else 18.0, alpha=0.6 if crowded else 0.9, linewidths=0, **colours
    )
