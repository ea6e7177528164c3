"""All figures of a study: PNG files in its folder, and charts of its page.

The table of boundaries is written with the PNG files; the charts give access to every case.
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
"""Smallest number of factors drawn in a parallel chart, and width of each [px]."""


def draw_study(folder: Path) -> list[Path]:
    """Draw the figures of a study and return their paths.

    These are its plots, the progress of its optimisation, and the boundaries of a bisection,
    for which boundaries.csv is written too. Figures of plots that it no longer has are deleted.
    Raises OutputError if the folder holds no study, a plot names no axis of it, or a file
    cannot be written.
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
    """Return the file name of a plot, such as curve_speed_over_rate_by_pipe.png."""
    words = [plot.kind, plot.y, "over", plot.x]
    for joined, name in (("by", plot.by), ("coloured_by", plot.colour)):
        words += [joined, name] if name else []
    return "".join(c if c.isalnum() or c in "_-" else "_" for c in "_".join(words)) + ".png"


def study_charts(findings: Findings) -> list[Chart]:
    """Return all charts of a study: boundaries, plots, progress of its optimisation, all factors.

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
    """Return the chart with one line per case through all factors.

    The lines are coloured by the goal or the first measure.
    """
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
