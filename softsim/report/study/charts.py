"""The plots of a study as interactive charts: what the figures show, with every case to hand."""

from collections.abc import Callable
from html import escape
from typing import Any

import numpy as np

from softsim.report.page.charts import Chart
from softsim.report.study.cells import Cells
from softsim.report.study.curve import (
    MOST_MARKERS,
    Line,
    has_bar,
    line_colours,
    line_labels,
    lines,
    remark,
)
from softsim.report.study.findings import Findings
from softsim.report.study.heat_map import MOST_NUMBERS, heat_map_scales, remark_on_cells
from softsim.report.study.plots import CURVE, HEAT_MAP, SCATTER, drawn_plots
from softsim.report.study.scale import Scale, title_of
from softsim.report.study.search import TRIAL, best_so_far
from softsim.report.study.traces import (
    BELOW,
    CROWD,
    EDGE,
    TALL,
    Trace,
    along,
    best_trace,
    colour_axis,
    packed_numbers,
    point_look,
    points,
    shades,
    without_result,
)
from softsim.report.style import BLUE, ORANGE, RED, SKY
from softsim.study.axes import Goal, Plot

HEIGHT = 380

FEWEST_PARALLEL, PARALLEL_WIDTH = 3, 110
"""Factors from which on a chart shows all of them side by side; room that each takes [px]."""


def study_charts(findings: Findings) -> list[Chart]:
    """All charts of a study: its plots, how its optimisation went, all factors side by side.

    Raises OutputError if a plot names no axis of the study.
    """
    plots = drawn_plots(findings)
    charts = [CHARTS[plot.kind](findings, plot) for plot in plots]
    goal = findings.record.goal
    if goal is not None:
        charts.append(progress_chart(findings, goal))
        shown = {(plot.x, plot.y) for plot in plots}
        over = [Plot(SCATTER, factor.name, goal.measure) for factor in findings.varied]
        charts += [scatter_chart(findings, plot) for plot in over if (plot.x, plot.y) not in shown]
    if len(findings.varied) >= FEWEST_PARALLEL and findings.done.height:
        charts.append(parallel_chart(findings))
    return charts


def curve_chart(findings: Findings, plot: Plot) -> Chart:
    """A measure over a factor, a line each level of another one."""
    x, y = findings.scale(plot.x), findings.scale(plot.y)
    by = findings.axis(plot.by) if plot.by else None
    found = list(lines(findings, x, y, by))
    colours, labels = line_colours(findings, found, by), line_labels(found, by)
    with_bar = has_bar(findings, by)
    traces: list[Trace] = []
    for line, colour, label in zip(found, colours, labels, strict=True):
        traces += _band(line, colour)
        traces.append(
            points(line.points, line.x, line.mean)
            | {"mode": "lines+markers" if len(line.x) <= MOST_MARKERS else "lines"}
            | {"line": {"color": colour, "width": 2}, "marker": {"size": 6}}
            | ({"name": escape(label), "showlegend": True} if label and not with_bar else {})
        )
    layout: dict[str, Any] = {}
    if by is not None and with_bar:
        scale = findings.scale(by.name)
        layout["coloraxis"] = colour_axis(scale, scale.places(findings.table[by.column]))
        traces.append({"x": [None], "y": [None], "mode": "markers", "showlegend": False,
                       "marker": {"color": [0.0], "coloraxis": "coloraxis"}})  # fmt: skip
    notes = remark(findings, x.axis, by)
    return _chart(findings, x, y, traces, layout, f"; {notes}" if notes else "")


def heat_map_chart(findings: Findings, plot: Plot) -> Chart:
    """A measure as the colour of cells over two factors."""
    x, y, z = heat_map_scales(findings, plot)
    cells, notes = Cells.of(findings, x, y, z), remark_on_cells(findings, x, y)
    mesh: Trace = {
        "type": "heatmap", "x": cells.at_x.tolist(), "y": cells.at_y.tolist(),
        "z": packed_numbers(shades(z, cells.values)), "coloraxis": "coloraxis",
        "customdata": cells.cases.tolist(), "hoverongaps": False, "hoverinfo": "none",
        "text": [[z.text(value) for value in row] for row in cells.values],
        "meta": {"mean": bool(notes)},
    }  # fmt: skip
    if cells.values.size <= MOST_NUMBERS:
        mesh["texttemplate"] = "%{text}"
    j, i = np.nonzero(cells.failed)
    failed = {
        "type": "scatter", "mode": "markers", "x": cells.columns[i].tolist(),
        "y": cells.rows[j].tolist(), "name": "failed", "customdata": cells.cases[j, i].tolist(),
        "hoverinfo": "none", "marker": {"symbol": "x-thin-open", "size": 9, "color": RED},
    }  # fmt: skip
    traces = [mesh, *([failed] if len(i) else []), *_best_cell(findings, cells, x, y)]
    layout = BELOW | {
        "coloraxis": colour_axis(z, cells.values),
        "xaxis": along(x) | {"range": _ends(x, cells.at_x), "showgrid": False},
        "yaxis": along(y, TALL) | {"range": _ends(y, cells.at_y), "showgrid": False},
    }
    title = f"{title_of(z.axis)} over {title_of(x.axis)} and {title_of(y.axis)}"
    title += f", {notes}" if notes else ""
    return Chart(title, traces, layout, HEIGHT)


def scatter_chart(findings: Findings, plot: Plot) -> Chart:
    """Each case a point."""
    x, y, done = findings.scale(plot.x), findings.scale(plot.y), findings.done
    trace = points(done, x.places(done[x.axis.column]), y.places(done[y.axis.column]))
    layout: dict[str, Any] = {}
    marker = point_look(done.height) | {"color": BLUE}
    if plot.colour is not None:
        z = findings.scale(plot.colour)
        places = z.places(done[z.axis.column])
        layout["coloraxis"] = colour_axis(z, places)
        marker |= {"color": packed_numbers(shades(z, places)), "coloraxis": "coloraxis"}
    return _chart(findings, x, y, [trace | {"marker": marker}], layout)


def progress_chart(findings: Findings, goal: Goal) -> Chart:
    """The objective over the trials, the best so far as steps."""
    x, y, done = Scale(TRIAL, whole=True), findings.scale(goal.measure), findings.done.sort("case")
    trials, objective = x.places(done["case"]), y.places(done[y.axis.column])
    each = points(done, trials, objective)
    look = point_look(done.height) | {"color": SKY}
    each |= {"name": "a trial", "showlegend": True, "marker": look}
    steps = {
        "type": "scatter", "mode": "lines", "x": packed_numbers(trials), "name": "best so far",
        "y": packed_numbers(best_so_far(objective, goal.sense)), "hoverinfo": "y",
        "line": {"color": ORANGE, "width": 2, "shape": "hv"},
    }  # fmt: skip
    return _chart(findings, x, y, [each, steps], {})


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
        dimension["values"] = packed_numbers(shades(scale, places))
        bar = colour_axis(scale, places)["colorbar"]
        dimension |= {key: bar[key] for key in ("tickvals", "ticktext") if key in bar}
        dimensions.append(dimension)
    values = colour.places(done[colour.axis.column])
    trace = {
        "type": "parcoords", "dimensions": dimensions,
        "line": {"color": packed_numbers(shades(colour, values)), "coloraxis": "coloraxis"},
    }  # fmt: skip
    shown = colour_axis(colour, values) | {"showscale": False}  # the last axis says it
    layout = {"coloraxis": shown, "margin": {"l": 70, "r": 70, "t": 60, "b": 24}}
    title = (
        f"all factors, a line a case, coloured by {colour.axis.name}; drag along an axis to select"
    )
    return Chart(title, [trace], layout, 420, width=PARALLEL_WIDTH * len(scales))


CHARTS: dict[str, Callable[[Findings, Plot], Chart]] = {
    CURVE: curve_chart,
    HEAT_MAP: heat_map_chart,
    SCATTER: scatter_chart,
}


def _chart(
    findings: Findings, x: Scale, y: Scale, traces: list[Trace], layout: dict[str, Any],
    remark: str = "",
) -> Chart:  # fmt: skip
    """A chart with the marks that all have: the best case, cases without a result."""
    marked = [*traces, *without_result(findings, x), *best_trace(findings, x, y)]
    if findings.table.height > CROWD:
        marked = [t | {"type": "scattergl"} if t["mode"] == "markers" else t for t in marked]
    title = f"{title_of(y.axis)} over {title_of(x.axis)}{remark}"
    axes = {"xaxis": along(x), "yaxis": along(y, TALL), "yaxis2": EDGE}
    return Chart(title, marked, BELOW | axes | layout, HEIGHT)


def _band(line: Line, colour: str) -> list[Trace]:
    """Mean plus and minus the band, wherever there is one."""
    traces = []
    for part in np.ma.clump_unmasked(np.ma.masked_invalid(line.band)):
        x, mean, band = line.x[part], line.mean[part], line.band[part]
        around = np.concatenate([mean + band, (mean - band)[::-1]])
        traces.append(
            {
                "type": "scatter", "mode": "lines", "x": packed_numbers(np.append(x, x[::-1])),
                "y": packed_numbers(around), "fill": "toself", "fillcolor": colour + "33",
                "line": {"width": 0}, "hoverinfo": "skip", "showlegend": False,
            }
        )  # fmt: skip
    return traces


def _best_cell(findings: Findings, cells: Cells, x: Scale, y: Scale) -> list[Trace]:
    """A frame around the cell in which the best design point is."""
    best = findings.best
    if best is None:
        return []
    i, j = cells.at(*(scale.place(best.values[scale.axis.column]) for scale in (x, y)))
    left, bottom, width, height = cells.box(i, j)
    across = [left, left + width, left + width, left, left]
    up = [bottom, bottom, bottom + height, bottom + height, bottom]
    return [{"type": "scatter", "mode": "lines", "x": across, "y": up, "name": "best",
             "line": {"color": RED, "width": 3}, "hoverinfo": "skip"}]  # fmt: skip


def _ends(scale: Scale, edges: np.ndarray) -> list[float]:
    """First and last edge, as an axis of plotly.js takes them."""
    found: list[float] = shades(scale, edges[[0, -1]]).tolist()
    return found
