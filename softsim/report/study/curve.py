"""A measure over a factor: a line for each level of another one, in a band where cases repeat."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars
from matplotlib.axes import Axes
from matplotlib.colors import to_hex

from softsim.report.study.findings import DONE_COUNT, SPREAD, Findings
from softsim.report.study.marks import add_legend, mark_best, mark_without_result, say_if_empty
from softsim.report.study.scale import COLOURS, Scale, shortened
from softsim.report.study.wording import written
from softsim.report.style import BLUE, drawing
from softsim.study.axes import Axis, Plot

BAND = 3.0
"""Half of a band [standard deviations]."""

MOST_MARKERS = 60
"""Points on a line that each have a marker."""


@dataclass(frozen=True)
class Line:
    """Design points that differ in x alone, a row each: their places (n,), means (n,) and half of
    the band (n,), NaN where there is none. level: of the factor that tells lines apart.
    """

    level: float | str | None
    points: polars.DataFrame
    x: np.ndarray
    mean: np.ndarray
    band: np.ndarray


def draw_curve(findings: Findings, plot: Plot, path: Path) -> None:
    """Draw it as PNG. Raises OutputError if the disk refuses or an axis is unknown."""
    x, y = findings.scale(plot.x), findings.scale(plot.y)
    by = findings.axis(plot.by) if plot.by else None
    found = list(lines(findings, x, y, by))
    with drawing(path, height=3.8) as figure:
        axes = figure.add_subplot()
        colours, labels = line_colours(findings, found, by), line_labels(found, by)
        with_bar = has_bar(findings, by)
        for line, colour, label in zip(found, colours, labels, strict=True):
            _draw_line(axes, line, colour, None if with_bar else label)
        if by is not None and with_bar:
            scale = findings.scale(by.name)
            scale.beside(figure, axes, scale.colours(scale.places(findings.table[by.column])))
        x.along_x(axes)
        y.along_y(axes)
        mark_without_result(axes, findings, x)
        mark_best(axes, findings, x, y)
        say_if_empty(axes, np.concatenate([line.mean for line in found]))
        axes.set_title(remark(findings, x.axis, by))
        add_legend(figure, axes)


def lines(findings: Findings, x: Scale, y: Scale, by: Axis | None) -> Iterator[Line]:
    """The lines, in the order of the table; what else varies makes lines of its own."""
    points, spread = findings.design_points, SPREAD + y.axis.column
    apart = [axis.column for axis in findings.factors if axis not in (x.axis, by)]
    first = [by.column] if by else []
    groups = points.group_by([*first, *apart], maintain_order=True) if first + apart else [
        ((None,), points)
    ]  # fmt: skip
    for key, group in groups:
        line = group[np.argsort(x.places(group[x.axis.column]), kind="stable")]
        places, mean = x.places(line[x.axis.column]), y.places(line[y.axis.column])
        has_band = spread in line.columns  # labels have none
        band = BAND * line[spread].to_numpy() if has_band else np.full(len(places), np.nan)
        yield Line(key[0] if by else None, line, places, mean, band)


def remark(findings: Findings, x: Axis, by: Axis | None) -> str:
    """What a reader must know of the lines: over how many cases the mean is, what else varies."""
    said = []
    counts = findings.design_points[DONE_COUNT].filter(findings.design_points[DONE_COUNT] > 0)
    if len(counts) and counts.max() > 1:
        low, high = counts.min(), counts.max()
        n = f"{high}" if low == high else f"{low} to {high}"
        said.append(f"mean and {BAND:g} standard deviations of n = {n} repeats")
    apart = [axis.name for axis in findings.varied if axis not in (x, by)]
    if apart:
        said.append(f"a line each of {', '.join(apart)}")
    return "; ".join(said)


def line_colours(findings: Findings, found: list[Line], by: Axis | None) -> list[str]:
    """A colour for each line: told apart by level, or rising with it where there are many."""
    if by is None:
        return [BLUE] * len(found)
    if has_bar(findings, by):
        scale = findings.scale(by.name)
        places = scale.places(polars.Series([line.level for line in found]))
        return [to_hex(colour) for colour in scale.colours(places).to_rgba(places)]
    levels = list(dict.fromkeys(line.level for line in found))
    return [COLOURS[levels.index(line.level)] for line in found]


def has_bar(findings: Findings, by: Axis | None) -> bool:
    """Whether a bar says what the colours of lines mean: there are too many for a legend."""
    return by is not None and findings.level_count(by) > len(COLOURS)


def line_labels(found: list[Line], by: Axis | None) -> list[str | None]:
    """What the legend calls each line; nothing a second time."""
    labels: list[str | None] = []
    for line in found:
        label = f"{by.name} {shortened(written(by, line.level))}" if by else None
        labels.append(None if label in labels else label)
    return labels


def _draw_line(axes: Axes, line: Line, colour: str, label: str | None) -> None:
    low, high = line.mean - line.band, line.mean + line.band
    if np.isfinite(low).any():
        axes.fill_between(line.x, low, high, color=colour, alpha=0.2, linewidth=0)
    marker = "o" if len(line.x) <= MOST_MARKERS else ""
    axes.plot(line.x, line.mean, marker=marker, markersize=3.5, color=colour, label=label)
