"""Curves in panels as an interactive chart: panels upon one another, with one axis below all."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb

from softsim.report.page.charts import Chart
from softsim.report.panels import FLAT, Axis, Curves, Line
from softsim.report.thinning import thinned

Trace = dict[str, Any]

BINS = 1000
"""Of a signal that vibrates; one of up to twice as many rows is shown as it is."""

DIGITS = 6
"""Of the numbers in a page: more than a screen shows, and less than a history has."""

DASHES = {"-": "solid", "--": "dash", ":": "dot"}
"""A line of the figures -> the same of plotly."""

BESIDE = {"side": "right", "showgrid": False, "tickmode": "auto"}
"""Of a second axis, on the right."""

PANEL, RIM, GAP = 210, 100, 0.06
"""Heights of a panel and of what is around all of them [px]; between panels, of the whole."""


def chart_of(curves: Curves) -> Chart:
    """The same in a page."""
    shares = np.array([FLAT if panel.flat else 1.0 for panel in curves.panels])
    heights = shares / shares.sum() * (1.0 - GAP * (len(shares) - 1))
    traces: list[Trace] = []
    layout: dict[str, Any] = {"hovermode": "x" if curves.over_time else "closest"}
    numbers = map(str, ["", *range(2, 2 * len(shares) + 1)])  # plotly's names: y, y2, y3 ...
    top = 1.0
    for panel, height in zip(curves.panels, heights, strict=True):
        left = next(numbers)
        for place, axis in enumerate(panel.axes):
            number = next(numbers) if place else left
            where = {"overlaying": f"y{left}", **BESIDE} if place else {
                "domain": [max(top - height, 0.0), top]
            }  # fmt: skip
            layout[f"yaxis{number}"] = where | scale_of(axis)
            for line in axis.lines:
                traces += traces_of(line, f"y{number}", panel.has_legend)
        top -= height + GAP
    low, high = curves.span
    span = {"range": [low, high]} if curves.over_time and low < high else {}
    layout["xaxis"] = {"title": {"text": curves.x_title}, "anchor": f"y{left}"} | span
    height = int(RIM + PANEL * shares.sum())
    return Chart(curves.title, traces, layout, height, over_time=curves.over_time)


def scale_of(axis: Axis) -> dict[str, Any]:
    """An axis in plotly's words."""
    return {
        "title": {"text": axis.title, "font": {"color": axis.colour}},
        "rangemode": "tozero" if axis.from_zero else "normal",
    }


def traces_of(line: Line, axis: str, named: bool) -> Iterator[Trace]:
    """A line, before it the band between which it vibrates."""
    band = thinned(line.x, line.values, BINS)
    place = {"x": rounded(band.time), "yaxis": axis, "mode": "lines", "legendgroup": line.name}
    if band.low is not band.mean:
        rim = {**place, "line": {"width": 0}, "hoverinfo": "skip", "showlegend": False}
        yield {**rim, "y": rounded(band.low)}
        shade = f"rgba({', '.join(str(round(255 * c)) for c in to_rgb(line.colour))}, 0.25)"
        yield {**rim, "y": rounded(band.high), "fill": "tonexty", "fillcolor": shade}
    look = {"color": line.colour, "dash": DASHES[line.kind], "width": 1.6}
    label = {"name": line.name, "showlegend": named}
    yield {**place, **label, "y": rounded(band.mean), "line": look}


def rounded(values: np.ndarray) -> list[float]:
    """Values (n,) with DIGITS digits each."""
    return [float(f"{value:.{DIGITS}g}") for value in values]
