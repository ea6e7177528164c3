"""Parts of interactive charts, as plotly.js takes them. Whatever a study calls its things is text
to it, not markup.
"""

from base64 import b64encode
from collections.abc import Mapping
from html import escape
from textwrap import wrap
from typing import Any

import numpy as np
import polars
from matplotlib.colors import to_hex
from matplotlib.ticker import LogLocator

from softsim.report.study.findings import DONE_COUNT, Findings
from softsim.report.study.marks import WITHOUT_RESULT
from softsim.report.study.scale import Scale, title_of
from softsim.report.style import RED

Trace = dict[str, Any]

COLOUR_SCALE = "Viridis"

WIDE, TALL = 60, 30
"""Characters of a title that fit along the horizontal and the vertical axis of a chart."""

CROWD = 2000
"""Cases from which on their points are smaller, and the graphics card draws them."""

EDGE: Mapping[str, Any] = {
    "overlaying": "y", "range": [0.0, 1.0], "visible": False, "fixedrange": True,
}  # fmt: skip
"""A vertical axis for marks along the lower edge."""

BELOW: dict[str, Any] = {
    "legend": {"orientation": "h", "x": 0, "y": -0.2, "yanchor": "top"},
    "margin": {"l": 60, "r": 16, "t": 34, "b": 44},
}
"""The legend below the chart: above it are its buttons."""

DECADES = [float(f"{digit}e{decade}") for decade in range(-9, 10) for digit in (1, 2, 5)]
"""Where a logarithmic axis may have its numbers; plotly.js would write 0.5 as a small 5."""

WHITE_RIM = {"color": "white", "width": 1}

SYMBOLS = {"x": "x-thin-open", "|": "line-ns-open"}


def along(scale: Scale, room: int = WIDE) -> dict[str, Any]:
    """An axis of a chart, along which `room` characters fit: title, spacing, labels."""
    axis: dict[str, Any] = {"title": {"text": in_lines(title_of(scale.axis), room), "standoff": 8}}
    if scale.logarithmic:
        axis |= {"type": "log", "tickvals": DECADES, "ticktext": [f"{t:g}" for t in DECADES]}
    if scale.axis.is_label:
        axis |= ticks(scale) | {"range": [-0.5, max(len(scale.labels), 1) - 0.5]}
    return axis


def in_lines(text: str, room: int) -> str:
    """A text in lines of `room` characters at most, where it has spaces."""
    return "<br>".join(map(escape, wrap(text, room)))


def ticks(scale: Scale) -> dict[str, Any]:
    """Where the labels of a scale are written."""
    places, texts = scale.ticks()
    return {"tickvals": places, "ticktext": list(map(escape, texts))}


def colour_axis(scale: Scale, places: np.ndarray) -> dict[str, Any]:
    """Colours of the values at `places`, as `shades` has them, and the bar beside the chart."""
    bar: dict[str, Any] = {
        "title": {"text": in_lines(title_of(scale.axis), TALL), "side": "right"}, "thickness": 14,
        "outlinewidth": 0,
    }  # fmt: skip
    low, high = scale.limits(places)
    if scale.axis.is_label:
        bar |= ticks(scale)
    elif scale.logarithmic:
        around = LogLocator(subs=(1.0, 2.0, 5.0)).tick_values(low, high)
        at = np.array([tick for tick in around if low <= tick <= high])
        bar |= {"tickvals": np.log10(at).tolist(), "ticktext": [f"{tick:g}" for tick in at]}
    least, most = shades(scale, np.array([low, high]))
    steps = _steps(scale) if scale.axis.is_label else COLOUR_SCALE
    return {"colorscale": steps, "colorbar": bar, "cmin": least, "cmax": most}


def shades(scale: Scale, places: np.ndarray) -> np.ndarray:
    """What is coloured: the logarithm where the scale is logarithmic, which plotly.js is not."""
    return np.log10(places) if scale.logarithmic else places


def points(rows: polars.DataFrame, x: np.ndarray, y: np.ndarray) -> Trace:
    """Rows of the table or of the design points at places (n,). The page shows the case under the
    cursor, `mean` of its repeats where it has some, and leads to it at a click.
    """
    return {
        "type": "scatter",
        "mode": "markers",
        "x": packed_numbers(x),
        "y": packed_numbers(y),
        "customdata": packed_numbers(rows["case"].to_numpy()),
        "meta": {"mean": DONE_COUNT in rows.columns and bool((rows[DONE_COUNT] > 1).any())},
        "hoverinfo": "none",
        "showlegend": False,
    }


def point_look(count: int) -> dict[str, Any]:
    """Size and opacity of so many points."""
    return {"size": 4, "opacity": 0.5} if count > CROWD else {"size": 7, "opacity": 0.75}


def packed_numbers(numbers: np.ndarray) -> dict[str, str]:
    """Numbers (n,) or (r, c) as plotly.js unpacks them, much shorter than written."""
    packed = {"dtype": "f4", "bdata": b64encode(numbers.astype("<f4").tobytes()).decode("ascii")}
    return packed if numbers.ndim == 1 else packed | {"shape": "{}, {}".format(*numbers.shape)}


def best_trace(findings: Findings, x: Scale, y: Scale) -> list[Trace]:
    """A star where the best design point lies."""
    best = findings.best
    if best is None:
        return []
    place = [scale.place(best.values[scale.axis.column]) for scale in (x, y)]
    star = points(polars.DataFrame([best.values]), *np.reshape(place, (2, 1)))
    look = {"symbol": "star", "size": 15, "color": RED, "line": WHITE_RIM}
    return [star | {"name": "best", "showlegend": True, "cliponaxis": False, "marker": look}]


def without_result(findings: Findings, x: Scale) -> list[Trace]:
    """Marks along the lower edge where cases failed or were pruned; they need the axis EDGE."""
    traces = []
    for word, (statuses, marker, colour) in WITHOUT_RESULT.items():
        rows = findings.table.filter(polars.col("status").is_in(statuses))
        if rows.height:
            places = x.places(rows[x.axis.column])
            look = {"symbol": SYMBOLS[marker], "size": 7, "color": colour}
            traces.append(
                points(rows, places, np.full(rows.height, 0.02))
                | {"yaxis": "y2", "name": f"{rows.height} {word}", "showlegend": True}
                | {"marker": look, "opacity": 0.7, "cliponaxis": False}
            )
    return traces


def _steps(scale: Scale) -> list[tuple[float, str]]:
    """A colour scale of steps, one each label."""
    count = max(len(scale.labels), 1)
    colours = map(to_hex, scale.colours(np.arange(count)).to_rgba(np.arange(count)))
    return [((k + end) / count, colour) for k, colour in enumerate(colours) for end in (0, 1)]
