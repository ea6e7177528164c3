"""Curves in panels upon one another: what a figure says, whoever draws it, and the figure as PNG.
`page/over_time.py` draws the same for a page.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from softsim.report.style import INK, drawing
from softsim.report.thinning import thinned

FLAT = 0.62
"""Height of a panel that is `flat`, of that of another one."""

LEGEND_COLUMNS = 4


@dataclass(frozen=True)
class Line:
    """A curve: its name, places x (rows,) and values (rows,) in the units of its axes, colour, and
    kind of line: "-", "--" or ":".
    """

    name: str
    x: np.ndarray
    values: np.ndarray
    colour: str
    kind: str = "-"


@dataclass(frozen=True)
class Axis:
    """Lines of one quantity. from_zero: the axis shows zero too; whole: it counts."""

    title: str
    lines: Sequence[Line]
    from_zero: bool = False
    whole: bool = False

    @property
    def colour(self) -> str:
        """Of its title: that of the line, where all have the same."""
        colours = {line.colour for line in self.lines}
        return colours.pop() if len(colours) == 1 else INK


@dataclass(frozen=True)
class Panel:
    """What is drawn upon one another: an axis on the left, maybe another one on the right."""

    left: Axis
    right: Axis | None = None
    flat: bool = False

    @property
    def axes(self) -> list[Axis]:
        """Its axes."""
        return [self.left] if self.right is None else [self.left, self.right]

    @property
    def has_legend(self) -> bool:
        """Whether there are lines to tell apart, or one that its axis does not name."""
        lines = [line for axis in self.axes for line in axis.lines]
        return len(lines) > 1 or lines[0].name not in self.left.title


@dataclass(frozen=True)
class Curves:
    """A figure: panels over one quantity x. over_time: that is the time of the run [s]."""

    title: str
    x_title: str
    panels: Sequence[Panel]
    over_time: bool = True

    @property
    def span(self) -> tuple[float, float]:
        """From the first to the last place; equal for a run of one sample."""
        x = self.panels[0].left.lines[0].x
        return float(x[0]), float(x[-1])


def draw_curves(curves: Curves, path: Path) -> None:
    """Draw them as PNG. Raises OutputError if the disk refuses."""
    heights = [FLAT if panel.flat else 1.0 for panel in curves.panels]
    with drawing(path, height=0.9 + 2.1 * sum(heights)) as figure:
        grid = figure.subplots(len(heights), sharex=True, squeeze=False, height_ratios=heights)
        for axes, panel in zip(grid[:, 0], curves.panels, strict=True):
            draw_panel(axes, panel)
        lowest = grid[-1, 0]
        lowest.set_xlabel(curves.x_title)
        if curves.over_time and curves.span[0] < curves.span[1]:
            lowest.set_xlim(curves.span)
        figure.align_ylabels()


def draw_panel(axes: Axes, panel: Panel) -> None:
    """The lines of a panel, its titles, and above it its legend."""
    sides = [axes]
    if panel.right is not None:
        sides.append(axes.twinx())
        sides[1].spines["right"].set_visible(True)
        sides[1].grid(False)
    for side, axis in zip(sides, panel.axes, strict=True):
        for line in axis.lines:
            draw_line(side, line)
        side.set_ylabel(axis.title, color=axis.colour)
        if axis.from_zero:
            side.set_ylim(bottom=min(0.0, side.get_ylim()[0]))
        if axis.whole:
            side.yaxis.set_major_locator(MaxNLocator(4, integer=True))
    if panel.has_legend:
        axes.legend(
            handles=[line for side in sides for line in side.lines], loc="lower left",
            bbox_to_anchor=(0.0, 1.0), ncols=LEGEND_COLUMNS, columnspacing=1.4,
        )  # fmt: skip


def draw_line(axes: Axes, line: Line) -> None:
    """A line through a curve, in the band between which it vibrates."""
    band = thinned(line.x, line.values)
    axes.fill_between(band.time, band.low, band.high, color=line.colour, alpha=0.25, linewidth=0)
    axes.plot(band.time, band.mean, line.kind, color=line.colour, label=line.name)
