"""The plots of a study as interactive charts, with every case to hand."""

from html import escape

from softsim.report.page.charts import Chart, Trace, chart_of, colour_axis, rounded, shades
from softsim.report.study.boundary import boundary_maps
from softsim.report.study.findings import Findings
from softsim.report.study.plots import drawn_plots, over_factors, progress, study_plot

FEWEST_PARALLEL, PARALLEL_WIDTH = 3, 110
"""Factors from which on a chart shows all of them side by side; room that each takes [px]."""


def study_charts(findings: Findings) -> list[Chart]:
    """All charts of a study: its boundaries, its plots, how its optimisation went, all factors side
    by side.

    Raises OutputError if a plot names no axis of the study.
    """
    asked, goal = drawn_plots(findings), findings.record.goal
    sought = findings.record.bisection
    plots = [] if sought is None else boundary_maps(findings, sought)
    plots += [study_plot(findings, plot) for plot in asked]
    if goal is not None:
        plots.append(progress(findings, goal))
        shown = {(plot.x, plot.y) for plot in asked}
        over = over_factors(findings, goal)
        plots += [plot for factor, plot in over if (factor.name, goal.measure) not in shown]
    charts = [chart_of(plot) for plot in plots]
    if len(findings.varied) >= FEWEST_PARALLEL and findings.done.height:
        charts.append(parallel_chart(findings))
    return charts


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
        dimension["values"] = rounded(shades(scale, places))
        bar = colour_axis(scale, places)["colorbar"]
        dimension |= {key: bar[key] for key in ("tickvals", "ticktext") if key in bar}
        dimensions.append(dimension)
    values = colour.places(done[colour.axis.column])
    line = {"color": rounded(shades(colour, values)), "coloraxis": "coloraxis"}
    trace = {"type": "parcoords", "dimensions": dimensions, "line": line}
    shown = colour_axis(colour, values) | {"showscale": False}  # the last axis says it
    layout = {"coloraxis": shown, "margin": {"l": 70, "r": 70, "t": 60, "b": 24}}
    title = (
        f"all factors, a line a case, coloured by {colour.axis.name}; drag along an axis to select"
    )
    return Chart(title, [trace], layout, 420, width=PARALLEL_WIDTH * len(scales))
