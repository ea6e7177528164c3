"""The plots of a study as interactive charts, with every case to hand. Whatever a study calls its
things is text to plotly.js, not markup.
"""

from base64 import b64encode
from collections.abc import Iterator, Mapping
from html import escape
from textwrap import wrap
from typing import Any

import numpy as np
from matplotlib.colors import to_hex
from matplotlib.ticker import LogLocator

from softsim.report.colours import colour_scale
from softsim.report.page.charts import Chart
from softsim.report.study.cells import Cells
from softsim.report.study.figures import MOST_NUMBERS
from softsim.report.study.findings import Findings
from softsim.report.study.plots import (
    Edge,
    Series,
    StudyPlot,
    drawn_plots,
    over_factors,
    progress,
    study_plot,
)
from softsim.report.study.scale import Scale, title_of
from softsim.report.style import RED

Trace = dict[str, Any]

HEIGHT = 380

FEWEST_PARALLEL, PARALLEL_WIDTH = 3, 110
"""Factors from which on a chart shows all of them side by side; room that each takes [px]."""

WIDE, TALL = 60, 30
"""Characters of a title that fit along the horizontal and the vertical axis of a chart."""

CROWD = 2000
"""Cases from which on their points are smaller, and the graphics card draws them."""

EDGE: Mapping[str, Any] = {
    "overlaying": "y", "range": [0.0, 1.0], "visible": False, "fixedrange": True,
}  # fmt: skip
"""A vertical axis for marks along the lower edge."""

BELOW: Mapping[str, Any] = {
    "legend": {"orientation": "h", "x": 0, "y": -0.2, "yanchor": "top"},
    "margin": {"l": 60, "r": 16, "t": 34, "b": 44},
}
"""The legend below the chart: above it are its buttons."""

DECADES = [float(f"{digit}e{decade}") for decade in range(-9, 10) for digit in (1, 2, 5)]
"""Where a logarithmic axis may have its numbers; plotly.js would write 0.5 as a small 5."""

SYMBOLS = {"x": "x-thin-open", "|": "line-ns-open"}

STAR = {"symbol": "star", "size": 15, "color": RED, "line": {"color": "white", "width": 1}}

SHAPES = {"line": "linear", "steps": "hv"}
"""How points are joined -> the same of plotly."""


def study_charts(findings: Findings) -> list[Chart]:
    """All charts of a study: its plots, how its optimisation went, all factors side by side.

    Raises OutputError if a plot names no axis of the study.
    """
    asked, goal = drawn_plots(findings), findings.record.goal
    plots = [study_plot(findings, plot) for plot in asked]
    if goal is not None:
        plots.append(progress(findings, goal))
        shown = {(plot.x, plot.y) for plot in asked}
        over = over_factors(findings, goal)
        plots += [plot for factor, plot in over if (factor.name, goal.measure) not in shown]
    charts = [chart_of(plot, findings.table.height > CROWD) for plot in plots]
    if len(findings.varied) >= FEWEST_PARALLEL and findings.done.height:
        charts.append(parallel_chart(findings))
    return charts


def chart_of(plot: StudyPlot, crowded: bool) -> Chart:
    """A plot in a page; `crowded` where the study has many cases."""
    layout: Trace = {**BELOW, "xaxis": along(plot.x, WIDE), "yaxis": along(plot.y, TALL)}
    scale = None
    if plot.colours is not None:
        scale, places = plot.colours
        layout["coloraxis"] = colour_axis(scale, places)
    if plot.cells is not None and scale is not None:
        layout["xaxis"] |= {"range": _ends(plot.x, plot.cells.at_x), "showgrid": False}
        layout["yaxis"] |= {"range": _ends(plot.y, plot.cells.at_y), "showgrid": False}
        traces = list(cell_traces(plot.cells, scale, bool(plot.remark)))
        traces += [frame(plot.cells, point) for point in plot.best]
        return Chart(plot.title, traces, layout, HEIGHT)
    layout["yaxis2"] = EDGE
    traces = [trace for s in plot.series for trace in series_traces(s, scale, crowded)]
    if scale is not None:  # for the bar, where lines have the colours
        traces.append(
            {"x": [None], "y": [None], "mode": "markers", "showlegend": False,
             "marker": {"color": [0.0], "coloraxis": "coloraxis"}}
        )  # fmt: skip
    traces += [edge_trace(edge) for edge in plot.edges]
    named = {"name": "best", "showlegend": True, "cliponaxis": False, "marker": STAR}
    traces += [points(point) | named for point in plot.best]
    if crowded:
        traces = [t | {"type": "scattergl"} if t["mode"] == "markers" else t for t in traces]
    return Chart(plot.title, traces, layout, HEIGHT)


def series_traces(series: Series, scale: Scale | None, crowded: bool) -> Iterator[Trace]:
    """Points, coloured by a scale if they have values, or a line upon its band."""
    lowest, highest = series.band
    for part in np.ma.clump_unmasked(np.ma.masked_invalid(lowest)) if len(lowest) else ():
        x, low, high = series.x[part], lowest[part], highest[part]
        yield {
            "type": "scatter", "mode": "lines", "x": packed(np.append(x, x[::-1])),
            "y": packed(np.concatenate([high, low[::-1]])), "fill": "toself",
            "fillcolor": series.colour + "33", "line": {"width": 0}, "hoverinfo": "skip",
            "showlegend": False,
        }  # fmt: skip
    marker: Trace = {"size": 4, "opacity": 0.5} if crowded else {"size": 7, "opacity": 0.75}
    if scale is not None and len(series.values):
        marker |= {"color": packed(shades(scale, series.values)), "coloraxis": "coloraxis"}
    else:
        marker |= {"color": series.colour}
    trace = points(series) | {"marker": marker, "name": escape(series.name)}
    if series.join:
        shape = {"color": series.colour, "width": 2, "shape": SHAPES[series.join]}
        mode = "lines+markers" if series.has_markers else "lines"
        trace |= {"mode": mode, "line": shape}
    yield trace | {"showlegend": bool(series.name)}


def points(series: Series) -> Trace:
    """The page shows the case under the cursor, `mean` of several where a point stands for them,
    and leads to it at a click.
    """
    return {
        "type": "scatter", "mode": "markers", "x": packed(series.x), "y": packed(series.y),
        "customdata": packed(series.cases), "meta": {"mean": series.mean}, "hoverinfo": "none",
    }  # fmt: skip


def edge_trace(edge: Edge) -> Trace:
    """Marks along the lower edge, upon the axis EDGE."""
    at = Series(edge.x, np.full(len(edge.x), 0.02), edge.cases)
    marker = {"symbol": SYMBOLS[edge.marker], "size": 7, "color": edge.colour}
    look = {"marker": marker, "opacity": 0.7, "cliponaxis": False, "showlegend": True}
    return points(at) | look | {"yaxis": "y2", "name": edge.name}


def cell_traces(cells: Cells, z: Scale, mean: bool) -> Iterator[Trace]:
    """The cells, with their values where they are few, and marks on those that failed."""
    mesh: Trace = {
        "type": "heatmap", "x": cells.at_x.tolist(), "y": cells.at_y.tolist(),
        "z": packed(shades(z, cells.values)), "coloraxis": "coloraxis", "meta": {"mean": mean},
        "customdata": cells.cases.tolist(), "hoverongaps": False, "hoverinfo": "none",
        "text": [[z.text(value) for value in row] for row in cells.values],
    }  # fmt: skip
    yield mesh | ({"texttemplate": "%{text}"} if cells.values.size <= MOST_NUMBERS else {})
    j, i = np.nonzero(cells.failed)
    if len(i):
        failed = Series(cells.columns[i], cells.rows[j], cells.cases[j, i])
        marker = {"symbol": SYMBOLS["x"], "size": 9, "color": RED}
        yield points(failed) | {"name": "failed", "showlegend": True, "marker": marker}


def frame(cells: Cells, point: Series) -> Trace:
    """A frame around the cell of a point."""
    left, bottom, width, height = cells.box(*cells.at(point.x[0], point.y[0]))
    across = [left, left + width, left + width, left, left]
    up = [bottom, bottom, bottom + height, bottom + height, bottom]
    return {"type": "scatter", "mode": "lines", "x": across, "y": up, "name": "best",
            "line": {"color": RED, "width": 3}, "hoverinfo": "skip"}  # fmt: skip


def parallel_chart(findings: Findings) -> Chart:
    """A line a case through all factors, coloured by the goal or the first measure."""
    goal = findings.record.goal
    colour = findings.scale(goal.measure if goal else findings.measures[0].name)
    scales = [findings.scale(factor.name) for factor in findings.varied] + [colour]
    done = findings.done
    dimensions = []
    for scale in scales:
        places = scale.places(done[scale.axis.column])
        dimension: Trace = {"label": escape(scale.axis.column)}
        dimension["values"] = packed(shades(scale, places))
        bar = colour_axis(scale, places)["colorbar"]
        dimension |= {key: bar[key] for key in ("tickvals", "ticktext") if key in bar}
        dimensions.append(dimension)
    values = colour.places(done[colour.axis.column])
    line = {"color": packed(shades(colour, values)), "coloraxis": "coloraxis"}
    trace = {"type": "parcoords", "dimensions": dimensions, "line": line}
    shown = colour_axis(colour, values) | {"showscale": False}  # the last axis says it
    layout = {"coloraxis": shown, "margin": {"l": 70, "r": 70, "t": 60, "b": 24}}
    title = (
        f"all factors, a line a case, coloured by {colour.axis.name}; drag along an axis to select"
    )
    return Chart(title, [trace], layout, 420, width=PARALLEL_WIDTH * len(scales))


def along(scale: Scale, room: int) -> Trace:
    """An axis of a chart, along which `room` characters fit: title, spacing, labels."""
    axis: Trace = {"title": {"text": in_lines(title_of(scale.axis), room), "standoff": 8}}
    if scale.logarithmic:
        axis |= {"type": "log", "tickvals": DECADES, "ticktext": [f"{t:g}" for t in DECADES]}
    if scale.axis.is_label:
        axis |= ticks(scale) | {"range": [-0.5, max(len(scale.labels), 1) - 0.5]}
    return axis


def colour_axis(scale: Scale, places: np.ndarray) -> Trace:
    """Colours of the values at `places`, as `shades` has them, and the bar beside the chart."""
    title = {"text": in_lines(title_of(scale.axis), TALL), "side": "right"}
    bar: Trace = {"title": title, "thickness": 14, "outlinewidth": 0}
    low, high = scale.limits(places)
    if scale.axis.is_label:
        bar |= ticks(scale)
    elif scale.logarithmic:
        around = LogLocator(subs=(1.0, 2.0, 5.0)).tick_values(low, high)
        at = np.array([tick for tick in around if low <= tick <= high])
        bar |= {"tickvals": np.log10(at).tolist(), "ticktext": [f"{tick:g}" for tick in at]}
    least, most = shades(scale, np.array([low, high]))
    steps = _steps(scale) if scale.axis.is_label else colour_scale()
    return {"colorscale": steps, "colorbar": bar, "cmin": least, "cmax": most}


def in_lines(text: str, room: int) -> str:
    """A text in lines of `room` characters at most, where it has spaces."""
    return "<br>".join(map(escape, wrap(text, room)))


def ticks(scale: Scale) -> Trace:
    """Where the labels of a scale are written."""
    places, texts = scale.ticks()
    return {"tickvals": places, "ticktext": list(map(escape, texts))}


def shades(scale: Scale, places: np.ndarray) -> np.ndarray:
    """What is coloured: the logarithm where the scale is logarithmic, which plotly.js is not."""
    return np.log10(places) if scale.logarithmic else places


def packed(numbers: np.ndarray) -> dict[str, str]:
    """Numbers (n,) or (r, c) as plotly.js unpacks them, much shorter than written."""
    text = {"dtype": "f4", "bdata": b64encode(numbers.astype("<f4").tobytes()).decode("ascii")}
    return text if numbers.ndim == 1 else text | {"shape": "{}, {}".format(*numbers.shape)}


def _steps(scale: Scale) -> list[tuple[float, str]]:
    """A colour scale of steps, one each label."""
    count = max(len(scale.labels), 1)
    colours = map(to_hex, scale.colours(np.arange(count)).to_rgba(np.arange(count)))
    return [((k + end) / count, colour) for k, colour in enumerate(colours) for end in (0, 1)]


def _ends(scale: Scale, edges: np.ndarray) -> list[float]:
    """First and last edge, as an axis of plotly.js takes them."""
    found: list[float] = shades(scale, edges[[0, -1]]).tolist()
    return found
