"""Interactive charts: diagrams in the format of plotly.js, in the style of the figures.

Names given by users are escaped, so that plotly.js does not read them as markup.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from textwrap import wrap
from typing import Any

import numpy as np
from matplotlib.colors import to_hex

from softsim.report.diagram import (
    EMPTY,
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
    colour_scale,
    colours_of,
)
from softsim.report.style import GRID, INK, QUIET, RED, SKY

Trace = dict[str, Any]

AXIS: Mapping[str, Any] = {
    "gridcolor": GRID, "linecolor": QUIET, "showline": True, "zeroline": False, "ticks": "outside",
    "tickcolor": QUIET, "automargin": True, "title": {"standoff": 8},
}  # fmt: skip
"""Properties of every axis."""

LAYOUT: Mapping[str, Any] = {
    "font": {"family": "system-ui, sans-serif", "size": 13, "color": INK},
    "paper_bgcolor": "#ffffff",
    "plot_bgcolor": "#ffffff",
    "margin": {"l": 60, "r": 16, "t": 28, "b": 44},
    "legend": {"orientation": "h", "x": 0, "y": 1, "yanchor": "bottom"},
    "hovermode": "closest",
}
"""Layout of every chart."""

BINS = 1000
"""Number of bins of a vibrating signal; one of up to twice as many rows is drawn unchanged."""

DIGITS = 6
"""Significant digits of numbers in a page, more than a screen shows and fewer than a history has.
"""

CROWD = 2000
"""Number of points above which they are drawn smaller."""

WIDE, HIGH = 60, 30
"""Numbers of characters of a title along the horizontal and the vertical axis of a chart."""

DASHES = {"-": "solid", "--": "dash", ":": "dot", STEPS: "solid"}
"""Line style of plotly.js by kind of series."""

SECOND_AXIS = {"side": "right", "showgrid": False, "tickmode": "auto"}
"""Properties of a second axis, on the right."""

EDGE = {"range": [0.0, 1.0], "visible": False, "fixedrange": True}
"""Properties of an axis for marks along the lower edge."""

STRIPE_LABEL = {"showarrow": False, "xref": "paper", "x": 0.0, "xanchor": "left",
                "font": {"size": 11, "color": QUIET}}  # fmt: skip
"""Properties of the label of a stripe, placed inside it."""

SYMBOLS = {"x": "x-thin-open", "|": "line-ns-open"}

STAR = {"symbol": "star", "size": 15, "color": RED, "line": {"color": "white", "width": 1}}

PANEL, RIM, GAP = 210, 100, 0.06
"""Heights of a panel and of the margins [px], and gap between panels as a fraction of the whole."""

DECADES = [float(f"{digit}e{decade}") for decade in range(-9, 10) for digit in (1, 2, 5)]
"""Tick values of a logarithmic axis; plotly.js would write 0.5 as a small 5."""

BAR = {"x": [None], "y": [None], "mode": "markers", "showlegend": False, "hoverinfo": "skip",
       "marker": {"color": [0.0], "coloraxis": "coloraxis"}}  # fmt: skip
"""Invisible trace that carries the colour bar if no other trace does."""


@dataclass(frozen=True)
class Chart:
    """Chart: traces and layout in the format of plotly.js, with its size on the page.

    height [px]; width: least width [px], 0 for that of the window. A wider chart is scrolled.
    over_time: its axis x is the time of the run [s], which an animation marks.
    """

    title: str
    traces: Sequence[Mapping[str, Any]]
    layout: Mapping[str, Any]
    height: int = 320
    width: int = 0
    over_time: bool = False

    @property
    def figure(self) -> dict[str, Any]:
        """Traces and layout in the common style; properties of the chart take precedence."""
        layout: dict[str, Any] = {**LAYOUT, **self.layout}
        for name in layout:
            if name.startswith(("xaxis", "yaxis")):
                layout[name] = {**AXIS, **layout[name]}
        return {"data": list(self.traces), "layout": layout}


def chart_of(diagram: Diagram) -> Chart:
    """Return a diagram as the chart of a page."""
    shares = np.array([panel.height for panel in diagram.panels])
    heights = shares / shares.sum() * (1.0 - GAP * (len(shares) - 1))
    traces: list[Trace] = []
    layout: dict[str, Any] = {"hovermode": "x" if diagram.over_time else "closest"}
    numbers = map(str, ["", *range(2, 3 * len(shares) + 1)])  # plotly's names: y, y2, y3 ...
    top = 1.0
    for panel, height in zip(diagram.panels, heights, strict=True):
        left = next(numbers)
        layout[f"yaxis{left}"] = vertical(panel.left) | {"domain": [max(top - height, 0.0), top]}
        axes = [(panel.left, left)]
        if panel.right is not None:
            axes.append((panel.right, next(numbers)))
            above = {"overlaying": f"y{left}", **SECOND_AXIS}
            layout[f"yaxis{axes[1][1]}"] = vertical(panel.right) | above
        for axis, number in axes:
            for series in axis.series:
                traces += series_traces(series, f"y{number}", panel)
        if panel.edges:
            number = next(numbers)
            layout[f"yaxis{number}"] = {"overlaying": f"y{left}", **EDGE}
            traces += [edge_trace(edge, f"y{number}") for edge in panel.edges]
        layout.setdefault("shapes", []).extend(stripe_shapes(panel, f"y{left}"))
        label = STRIPE_LABEL | {"yref": f"y{left}"}
        layout.setdefault("annotations", []).extend(
            label | {"y": 0.5 * (s.low + s.high), "text": escape(s.name)} for s in panel.stripes
        )
        traces += marks(panel, f"y{left}")
        if panel.colours is not None:
            layout["coloraxis"] = colour_axis(*panel.colours)
        top -= height + GAP
    layout["shapes"] += [bound(place) for place in diagram.bounds]
    layout["xaxis"] = along(diagram.x, WIDE) | {"anchor": f"y{left}"} | span(diagram)
    if (cells := diagram.panels[0].cells) is not None:
        layout["xaxis"] |= {"range": _ends(diagram.x, cells.at_x), "showgrid": False}
        up = _ends(diagram.panels[0].left.scale, cells.at_y)
        layout["yaxis"] |= {"range": up, "showgrid": False}
    height = int(RIM + PANEL * shares.sum())
    title = f"{diagram.title}; {diagram.remark}" if diagram.remark else diagram.title
    return Chart(title, traces, layout, height, over_time=diagram.over_time)


def span(diagram: Diagram) -> Trace:
    """Return the range of an axis of time, if it is not empty."""
    if not diagram.over_time or diagram.span[0] >= diagram.span[1]:
        return {}
    return {"range": list(diagram.span)}


def along(scale: Scale, room: int) -> Trace:
    """Return an axis of a chart with title, scale and labels, for `room` characters per line."""
    axis: Trace = {"title": {"text": in_lines(scale.title, room)}}
    if scale.logarithmic:
        axis |= {"type": "log", "tickvals": DECADES, "ticktext": [f"{t:g}" for t in DECADES]}
    if scale.labels is not None:
        axis |= ticks(scale) | {"range": list(scale.limits())}
    return axis


def vertical(axis: PlotAxis) -> Trace:
    """Return the vertical axis of a chart."""
    found = along(axis.scale, HIGH)
    found["title"] |= {"font": {"color": axis.colour}}
    return found | {"rangemode": "tozero" if axis.scale.from_zero else "normal"}


def series_traces(series: PlotSeries, axis: str, panel: Panel) -> Iterator[Trace]:
    """Yield single points, optionally in the colours of the panel, or a line over its band."""
    named = {"name": escape(series.name), "showlegend": panel.has_legend and bool(series.name)}
    crowded = len(series.x) > CROWD
    marker: Trace = {"size": 4, "opacity": 0.5} if crowded else {"size": 7, "opacity": 0.75}
    if series.kind == POINTS:
        marker |= {"color": series.colour}
        if series.shades is not None and panel.colours is not None:
            shown = rounded(shades(panel.colours[0], series.shades))
            marker |= {"color": shown, "coloraxis": "coloraxis"}
        yield at_cases(series) | named | {"marker": marker, "yaxis": axis}
        return
    series = series.thinned(BINS)
    if series.band is not None:
        yield from band_traces(series, series.band, axis)
    look = {"color": series.colour, "dash": DASHES[series.kind], "width": 1.6}
    shape = {"shape": "hv" if series.kind == STEPS else "linear"}
    mode = {"mode": "lines+markers" if series.has_markers else "lines"}
    places = {"x": rounded(series.x), "y": rounded(series.y)}
    trace = at_cases(series) if len(series.cases) else places
    group = {"legendgroup": series.name} if series.name else {}
    yield trace | named | mode | group | {"marker": marker, "line": look | shape, "yaxis": axis}


def band_traces(series: PlotSeries, band: np.ndarray, axis: str) -> Iterator[Trace]:
    """Yield the finite parts of the band (2, n) of a series as areas."""
    x, (lowest, highest) = series.x, band
    for part in np.ma.clump_unmasked(np.ma.masked_invalid(lowest)):
        yield {
            "x": rounded(np.append(x[part], x[part][::-1])), "yaxis": axis,
            "y": rounded(np.append(highest[part], lowest[part][::-1])), "mode": "lines",
            "fill": "toself", "fillcolor": series.colour + "33", "line": {"width": 0},
            "hoverinfo": "skip", "showlegend": False, "legendgroup": series.name,
        }  # fmt: skip


def at_cases(series: PlotSeries) -> Trace:
    """Return the points of a series with their cases.

    The page shows the case under the cursor, the `mean` of several if a point represents them,
    and opens it at a click.
    """
    return {
        "mode": "markers", "x": rounded(series.x), "y": rounded(series.y), "hoverinfo": "none",
        "customdata": series.cases.tolist(), "meta": {"mean": series.mean},
    }  # fmt: skip


def edge_trace(edge: EdgeMarks, axis: str) -> Trace:
    """Return the marks along the lower edge, on an axis of their own."""
    at = PlotSeries(edge.name, edge.x, np.full(len(edge.x), 0.02), cases=edge.cases)
    marker = {"symbol": SYMBOLS[edge.marker], "size": 7, "color": edge.colour}
    look = {"marker": marker, "opacity": 0.7, "cliponaxis": False, "showlegend": True}
    return at_cases(at) | look | {"yaxis": axis, "name": edge.name}


def stripe_shapes(panel: Panel, axis: str) -> list[Trace]:
    """Return the shaded stripes."""
    look = {
        "type": "rect",
        "layer": "below",
        "fillcolor": SKY,
        "opacity": 0.16,
        "line": {"width": 0},
    }
    across = {"xref": "paper", "x0": 0.0, "x1": 1.0, "yref": axis}
    return [look | across | {"y0": s.low, "y1": s.high} for s in panel.stripes if s.shaded]


def bound(place: float) -> Trace:
    """Return a line through all panels at a value of x."""
    up = {"x0": place, "x1": place, "yref": "paper", "y0": 0.0, "y1": 1.0}
    return {"type": "line", "line": {"color": QUIET, "dash": "dot", "width": 1}} | up


def marks(panel: Panel, axis: str) -> Iterator[Trace]:
    """Yield the cells of a panel or its colour bar, and its best point."""
    if panel.cells is not None and panel.colours is not None:
        yield from cell_traces(panel.cells, panel.colours[0])
    elif panel.colours is not None:
        yield BAR
    for point in panel.best:
        if panel.cells is not None:
            yield frame(panel.cells, point)
        else:
            look = {"cliponaxis": False, "marker": STAR, "showlegend": True}
            yield at_cases(point) | {"name": "best", "yaxis": axis} | look


def cell_traces(cells: Cells, z: Scale) -> Iterator[Trace]:
    """Yield the cells, with their values if they are few, and marks on failed ones."""
    mesh: Trace = {
        "type": "heatmap", "x": cells.at_x.tolist(), "y": cells.at_y.tolist(),
        "z": list(map(rounded, shades(z, cells.values))), "coloraxis": "coloraxis",
        "customdata": cells.cases.tolist(), "hoverongaps": False, "hoverinfo": "none",
        "text": [[z.text(value) for value in row] for row in cells.values],
        "meta": {"mean": cells.mean},
    }  # fmt: skip
    yield mesh | ({"texttemplate": "%{text}"} if cells.values.size <= MOST_NUMBERS else {})
    j, i = np.nonzero(cells.failed)
    if len(i):
        failed = PlotSeries("failed", cells.columns[i], cells.rows[j], cases=cells.cases[j, i])
        marker = {"symbol": SYMBOLS["x"], "size": 9, "color": RED}
        yield at_cases(failed) | {"name": "failed", "showlegend": True, "marker": marker}


def frame(cells: Cells, point: PlotSeries) -> Trace:
    """Return a frame around the cell of a point."""
    left, bottom, width, height = cells.around(point.x[0], point.y[0])
    across = [left, left + width, left + width, left, left]
    up = [bottom, bottom, bottom + height, bottom + height, bottom]
    return {"mode": "lines", "x": across, "y": up, "name": "best", "hoverinfo": "skip",
            "line": {"color": RED, "width": 3}}  # fmt: skip


def colour_axis(scale: Scale, places: np.ndarray) -> Trace:
    """Return the colour axis of the values `places`, as scaled by `shades`, with its bar."""
    title = {"text": in_lines(scale.title, HIGH), "side": "right"}
    bar: Trace = {"title": title, "thickness": 14, "outlinewidth": 0}
    low, high = scale.limits(places)
    steps: Sequence[tuple[float, str]] = colour_scale()
    if scale.labels is not None:
        bar |= ticks(scale)
        count = max(len(scale.labels), 1)
        colours = map(to_hex, colours_of(scale, EMPTY).to_rgba(np.arange(count)))
        steps = [((k + end) / count, colour) for k, colour in enumerate(colours) for end in (0, 1)]
    elif scale.logarithmic:
        at = np.array([tick for tick in DECADES if low <= tick <= high])
        bar |= {"tickvals": np.log10(at).tolist(), "ticktext": [f"{tick:g}" for tick in at]}
    least, most = shades(scale, np.array([low, high]))
    return {"colorscale": steps, "colorbar": bar, "cmin": least, "cmax": most}


def ticks(scale: Scale) -> Trace:
    """Return the positions and texts of the labels of a scale."""
    places, texts = scale.ticks()
    return {"tickvals": places, "ticktext": list(map(escape, texts))}


def in_lines(text: str, room: int) -> str:
    """Return a text wrapped at spaces into lines of at most `room` characters."""
    return "<br>".join(map(escape, wrap(text, room)))


def shades(scale: Scale, places: np.ndarray) -> np.ndarray:
    """Return the coloured values, or their logarithms if the scale is logarithmic.

    Colour axes of plotly.js are linear.
    """
    return np.log10(places) if scale.logarithmic else places


def rounded(values: np.ndarray) -> list[float]:
    """Return values (n,) rounded to DIGITS significant digits."""
    return [float(f"{value:.{DIGITS}g}") for value in values]


def _ends(scale: Scale, edges: np.ndarray) -> list[float]:
    """Return first and last edge as the range of an axis of plotly.js."""
    found: list[float] = shades(scale, edges[[0, -1]]).tolist()
    return found
