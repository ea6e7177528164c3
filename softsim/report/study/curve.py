"""A measure over a factor: a line for each level of another one, in a band where cases repeat."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars
from matplotlib.axes import Axes

from softsim.output.study_folder import Axis, Plot
from softsim.report.study.findings import DONE_COUNT, SPREAD, Findings
from softsim.report.study.marks import add_legend, mark_best, mark_without_result, say_if_empty
from softsim.report.study.scale import COLOURS, Scale, shortened
from softsim.report.study.wording import written
from softsim.report.style import BLUE, drawing

BAND = 3.0
"""Half of a band [standard deviations]."""

MOST_MARKERS = 60
"""Points on a line that each have a marker."""


@dataclass(frozen=True)
class Line:
    """Design points that differ in x alone: places (n,), means (n,), half of the band (n,), NaN
    where there is none. level: of the factor that tells lines apart.
    """

    level: float | str | None
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
        if by is not None and findings.level_count(by) > len(COLOURS):
            _draw_many(axes, findings, found, by)
        else:
            _draw_few(axes, found, by)
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
        places = x.places(group[x.axis.column])
        order = np.argsort(places, kind="stable")
        half = (
            BAND * group[spread].cast(polars.Float64).to_numpy()
            if spread in group.columns
            else np.full(len(places), np.nan)
        )
        mean = y.places(group[y.axis.column])
        yield Line(key[0] if by else None, places[order], mean[order], half[order])


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


def _draw_few(axes: Axes, found: list[Line], by: Axis | None) -> None:
    """A colour each level, named in the legend."""
    colours: dict[float | str | None, str] = {}
    for line in found:
        new = line.level not in colours
        colour = colours.setdefault(line.level, COLOURS[len(colours) % len(COLOURS)])
        label = f"{by.name} {shortened(written(by, line.level))}" if by and new else None
        _draw_line(axes, line, colour if by else BLUE, label)


def _draw_many(axes: Axes, findings: Findings, found: list[Line], by: Axis) -> None:
    """Colours that rise with the level, and a bar that says which is which."""
    scale = findings.scale(by.name)
    places = scale.places(polars.Series([line.level for line in found]))
    colours = scale.colours(places)
    for line, colour in zip(found, colours.to_rgba(places), strict=True):
        _draw_line(axes, line, tuple(colour), None)
    scale.beside(axes.figure, axes, colours)  # type: ignore[arg-type]


def _draw_line(axes: Axes, line: Line, colour: str | tuple[float, ...], label: str | None) -> None:
    low, high = line.mean - line.band, line.mean + line.band
    if np.isfinite(low).any():
        axes.fill_between(line.x, low, high, color=colour, alpha=0.2, linewidth=0)
    marker = "o" if len(line.x) <= MOST_MARKERS else ""
    axes.plot(line.x, line.mean, marker=marker, markersize=3.5, color=colour, label=label)
