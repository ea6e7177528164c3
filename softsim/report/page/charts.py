"""Interactive charts: what plotly.js is told to draw, in the look of the figures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from softsim.report.style import GRID, INK, QUIET

AXIS: Mapping[str, Any] = {
    "gridcolor": GRID, "linecolor": QUIET, "showline": True, "zeroline": False, "ticks": "outside",
    "tickcolor": QUIET, "automargin": True, "title": {"standoff": 8},
}  # fmt: skip
"""Of every axis."""

LAYOUT: Mapping[str, Any] = {
    "font": {"family": "system-ui, sans-serif", "size": 13, "color": INK},
    "paper_bgcolor": "#ffffff",
    "plot_bgcolor": "#ffffff",
    "margin": {"l": 60, "r": 16, "t": 28, "b": 44},
    "legend": {"orientation": "h", "x": 0, "y": 1, "yanchor": "bottom"},
    "hovermode": "closest",
}
"""Of every chart."""


@dataclass(frozen=True)
class Chart:
    """A chart: traces and layout as plotly.js takes them, its height on the page [px] and
    the least width, 0: that of the window. A chart that is wider is scrolled.

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
        """The traces, and the layout in the common look; what the chart says itself wins."""
        layout: dict[str, Any] = {**LAYOUT, **self.layout}
        for name in layout:
            if name.startswith(("xaxis", "yaxis")):
                layout[name] = {**AXIS, **layout[name]}
        return {"data": list(self.traces), "layout": layout}
