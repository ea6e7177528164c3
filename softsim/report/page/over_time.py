"""Charts of signals over time: panels upon one another, with one time below them all."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb

from softsim.report.page.charts import Chart
from softsim.report.style import INK
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


@dataclass(frozen=True)
class Line:
    """A signal: its name, values (rows,) in the unit of its axis, colour, and kind of line."""

    name: str
    values: np.ndarray
    colour: str
    kind: str = "-"


@dataclass(frozen=True)
class Axis:
    """Lines of one quantity; from_zero: the axis shows zero too."""

    title: str
    lines: Sequence[Line]
    from_zero: bool = False


@dataclass(frozen=True)
class Panel:
    """What is drawn upon one another: an axis on the left, maybe another one on the right."""

    left: Axis
    right: Axis | None = None


def over_time(title: str, time: np.ndarray, panels: Sequence[Panel], label: str) -> Chart:
    """Panels over the time [s] (rows,) of a run, whose axis is called `label`."""
    height = (1.0 - GAP * (len(panels) - 1)) / len(panels)
    traces: list[Trace] = []
    layout: dict[str, Any] = {"hovermode": "x"}
    numbers = map(str, ["", *range(2, 2 * len(panels) + 1)])  # plotly's names: y, y2, y3 ...
    for place, panel in enumerate(panels):
        top = 1.0 - place * (height + GAP)
        left = next(numbers)
        layout[f"yaxis{left}"] = {"domain": [max(top - height, 0.0), top], **scale_of(panel.left)}
        traces += traces_of(panel.left, time, f"y{left}")
        if panel.right is not None:
            right = next(numbers)
            layout[f"yaxis{right}"] = {"overlaying": f"y{left}", **BESIDE, **scale_of(panel.right)}
            traces += traces_of(panel.right, time, f"y{right}")
    span = [float(time[0]), float(time[-1])]
    layout["xaxis"] = {"title": {"text": label}, "anchor": f"y{left}"} | (
        {"range": span} if span[1] > span[0] else {}
    )
    return Chart(title, traces, layout, RIM + PANEL * len(panels), over_time=True)


def scale_of(axis: Axis) -> dict[str, Any]:
    """An axis in plotly's words, in the colour of its line where it has only one."""
    colours = {line.colour for line in axis.lines}
    colour = colours.pop() if len(colours) == 1 else INK
    return {
        "title": {"text": axis.title, "font": {"color": colour}},
        "rangemode": "tozero" if axis.from_zero else "normal",
    }


def traces_of(axis: Axis, time: np.ndarray, name: str) -> Iterator[Trace]:
    """A line for each signal of an axis, before it the band between which it vibrates."""
    for line in axis.lines:
        band = thinned(time, line.values, BINS)
        place = {"x": rounded(band.time), "yaxis": name, "mode": "lines", "legendgroup": line.name}
        if band.low is not band.mean:
            rim = {**place, "line": {"width": 0}, "hoverinfo": "skip", "showlegend": False}
            yield {**rim, "y": rounded(band.low)}
            shade = f"rgba({', '.join(str(round(255 * c)) for c in to_rgb(line.colour))}, 0.25)"
            yield {**rim, "y": rounded(band.high), "fill": "tonexty", "fillcolor": shade}
        look = {"color": line.colour, "dash": DASHES[line.kind], "width": 1.6}
        named = {"name": line.name, "showlegend": len(axis.lines) > 1}
        yield {**place, **named, "y": rounded(band.mean), "line": look}


def rounded(values: np.ndarray) -> list[float]:
    """Values (n,) with DIGITS digits each."""
    return [float(f"{value:.{DIGITS}g}") for value in values]
