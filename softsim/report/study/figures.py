"""All figures of a study: as PNG in its folder, with the table of its boundaries, and as charts of
its page, with every case to hand.
"""

from html import escape
from pathlib import Path

from softsim.output.folder import RunFolder
from softsim.output.study_folder import inert
from softsim.report.page.charts import Chart, Trace, chart_of, colour_axis, rounded, shades
from softsim.report.png import draw
from softsim.report.study.boundary import TABLE, boundary_maps, boundary_table
from softsim.report.study.findings import Findings
from softsim.report.study.plots import PLOTS, drawn_plots, over_factors, progress, study_plot
from softsim.study.axes import Plot

PROGRESS, FACTORS, BOUNDARIES = "progress.png", "factors.png", "boundary_map.png"

FEWEST_PARALLEL, PARALLEL_WIDTH = 3, 110
"""Factors from which on a chart shows all of them side by side; room that each takes [px]."""


def draw_study(folder: Path) -> list[Path]:
    """Draw the plots of the study, how its optimisation went, and the boundaries of a bisection, of
    which boundaries.csv is written too; the figures' paths. Figures of plots that it has no longer
    go.

    Raises OutputError where the folder holds no study, a plot names no axis of it, or the disk
    refuses.
    """
    findings = Findings.read(folder)
    figures = {file_name(plot): [study_plot(findings, plot)] for plot in drawn_plots(findings)}
    goal = findings.record.goal
    if goal is not None:
        figures[PROGRESS] = [progress(findings, goal)]
        figures[FACTORS] = [plot for _, plot in over_factors(findings, goal)]
    sought = findings.record.bisection
    if sought is not None:
        figures[BOUNDARIES] = boundary_maps(findings, sought)
        table = inert(boundary_table(findings, sought)).write_csv()
        RunFolder(folder).write_text_atomic(TABLE, table)
    for name, plots in figures.items():
        draw(folder / name, *plots)
    for kind in (*PLOTS, "progress", "factors", "boundary_map"):
        for file in folder.glob(f"{kind}*.png"):
            if file.name not in figures:
                file.unlink()
    return [folder / name for name in figures]


def file_name(plot: Plot) -> str:
    """Of a plot: curve_speed_over_rate_by_pipe.png."""
    words = [plot.kind, plot.y, "over", plot.x]
    for joined, name in (("by", plot.by), ("coloured_by", plot.colour)):
        words += [joined, name] if name else []
    return "".join(c if c.isalnum() or c in "_-" else "_" for c in "_".join(words)) + ".png"


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
        f"all factors, one line per case, coloured by {colour.axis.name}; drag along an axis to "
        "select"
    )
    return Chart(title, [trace], layout, 420, width=PARALLEL_WIDTH * len(scales))
