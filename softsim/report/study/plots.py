"""Plots of a study as diagrams, independent of their output."""

from base64 import b64encode
from collections.abc import Callable, Iterator
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import polars
from matplotlib.colors import to_hex

from softsim.analysis.passage import Verdict
from softsim.output.folder import TABLE_TEXT, WARNINGS, RunFolder, inert
from softsim.report.diagram import (
    POINTS,
    STEPS,
    TALL,
    Cells,
    Diagram,
    EdgeMarks,
    Panel,
    PlotAxis,
    PlotSeries,
    Scale,
    colours_of,
    shortened,
)
from softsim.report.figures import Line, duration
from softsim.report.page.charts import Chart, Trace, chart_of, colour_axis, rounded, shades
from softsim.report.page.run import PAGE, write_page
from softsim.report.png import draw
from softsim.report.study.findings import (
    DONE_COUNT,
    FAILED_COUNT,
    SPREAD,
    TABLE,
    VERDICT,
    AxisScale,
    Findings,
    best_in_words,
    boundaries_in_words,
    boundary_maps,
    boundary_table,
    title_of,
    usual,
    written,
)
from softsim.report.style import BLUE, COLOURS, ORANGE, QUIET, RED, SKY
from softsim.report.table import Row, Table, cell
from softsim.study.cases import DONE, FAILED, LOST, PRUNED, WAITING
from softsim.study.schema import Goal, Plot, StudyAxis

# -------------------------------------------------------------------------------------------------
# Curves of a measure over a factor, one per level of another, with a band for repeated cases.

BAND = 3.0
"""Half-width of a band [standard deviations]."""

CONFIDENCE = 0.95
"""Confidence level of the interval of a proportion of cases."""


Level = float | str | None


def lines(
    findings: Findings, x: AxisScale, y: AxisScale, by: StudyAxis | None
) -> Iterator[tuple[Level, PlotSeries]]:
    """Yield the lines in the order of the table, each with its level of `by`.

    A line joins design points that differ in x alone; each combination of the other factors has
    its own line.
    """
    points, spread = findings.design_points, SPREAD + y.axis.column
    apart = [axis.column for axis in findings.factors if axis not in (x.axis, by)]
    first = [by.column] if by else []
    groups = points.group_by([*first, *apart], maintain_order=True) if first + apart else [
        ((None,), points)
    ]  # fmt: skip
    for key, group in groups:
        line = group[np.argsort(x.places(group[x.axis.column]), kind="stable")]
        mean = y.places(line[y.axis.column])
        if is_share(findings, y.axis):
            band = wilson_band(mean, line[DONE_COUNT].to_numpy())
        elif spread in line.columns:
            half = BAND * line[spread].to_numpy()
            band = np.stack([mean - half, mean + half])
        else:  # labels have none
            band = np.full((2, len(mean)), np.nan)
        places, cases = x.places(line[x.axis.column]), line["case"].to_numpy()
        several = bool((line[DONE_COUNT] > 1).any())
        series = PlotSeries("", places, mean, band=band, cases=cases, mean=several)
        yield key[0] if by else None, series


def is_share(findings: Findings, y: StudyAxis) -> bool:
    """Return True if a measure is 0 or 1 in repeated cases, so that its mean is a proportion."""
    repeats = findings.design_points[DONE_COUNT].max()
    if y.is_label or not isinstance(repeats, int) or repeats < 2:
        return False
    return bool(findings.done[y.column].drop_nulls().is_in([0.0, 1.0]).all())


def wilson_band(share: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Return Wilson's interval (2, n) of proportions (n,) of `count` (n,) cases, NaN if none."""
    from scipy.stats import binomtest  # slow to import

    band = np.full((2, len(share)), np.nan)
    for k in np.flatnonzero((count > 0) & np.isfinite(share)):
        found = binomtest(round(share[k] * count[k]), int(count[k]))
        band[:, k] = found.proportion_ci(CONFIDENCE, "wilson")
    return band


def pass_rate_in_words(findings: Findings) -> str:
    """Return how many of the drawn cases of a layout passed, with Wilson's interval.

    The result is empty for a study whose cases are not drawn from ranges, or have no verdict.
    """
    if not findings.record.sampled or VERDICT not in findings.table.columns:
        return ""
    verdicts = findings.done[VERDICT].drop_nulls()
    count, passed = len(verdicts), int((verdicts == Verdict.PASSED.value).sum())
    if count == 0:
        return "no case has a verdict"
    low, high = wilson_band(np.array([passed / count]), np.array([count]))[:, 0]
    others = verdicts.filter(verdicts != Verdict.PASSED.value).value_counts(sort=True)
    rest = "".join(f", {number} {verdict}" for verdict, number in others.iter_rows())
    uncounted = findings.table.height - count
    without = f"; {uncounted} more without a verdict (not counted)" if uncounted else ""
    return (
        f"passed: {passed} of {count} cases, {100.0 * passed / count:.0f} % "
        f"({100.0 * CONFIDENCE:g} % interval, Wilson: {100.0 * low:.0f} to {100.0 * high:.0f} %)"
        f"{rest}{without}"
    )


def remark(findings: Findings, x: StudyAxis, y: StudyAxis, by: StudyAxis | None) -> str:
    """Return a note on the lines: the number of cases behind each mean, and what else varies."""
    said = []
    counts = findings.design_points[DONE_COUNT].filter(findings.design_points[DONE_COUNT] > 0)
    if len(counts) and counts.max() > 1:
        low, high = counts.min(), counts.max()
        n = f"{high}" if low == high else f"{low} to {high}"
        about = f"mean and {BAND:g} standard deviations"
        if is_share(findings, y):
            about = f"fraction with its {100.0 * CONFIDENCE:g} % interval (Wilson)"
        said.append(f"{about} of n = {n} repeats")
    apart = [axis.name for axis in findings.varied if axis not in (x, by)]
    if apart:
        said.append(f"one line for each {', '.join(apart)}")
    return "; ".join(said)


def curves(
    findings: Findings, x: AxisScale, y: AxisScale, by: StudyAxis | None
) -> Iterator[PlotSeries]:  # fmt: skip
    """Yield the lines with their colours and names.

    Colours differ by level, or follow the colour bar if there is one; each level is named once.
    """
    found, named = list(lines(findings, x, y, by)), set()
    for (level, series), colour in zip(found, line_colours(findings, found, by), strict=True):
        name = ""
        if by is not None and level not in named and not has_bar(findings, by):
            name = f"{by.name} {shortened(written(by, level))}"
        named.add(level)
        yield replace(series, name=name, colour=colour)


def line_colours(
    findings: Findings, found: list[tuple[Level, PlotSeries]], by: StudyAxis | None
) -> list[str]:
    """Return a colour for each line."""
    if by is None:
        return [BLUE] * len(found)
    levels = [level for level, _ in found]
    if has_bar(findings, by):
        scale = findings.scale(by.name)
        places = scale.places(polars.Series(levels))
        return [to_hex(colour) for colour in colours_of(scale, places).to_rgba(places)]
    unique = list(dict.fromkeys(levels))
    return [COLOURS[unique.index(level)] for level in levels]


def has_bar(findings: Findings, by: StudyAxis | None) -> bool:
    """Return True if a colour bar explains the lines, because they are too many for a legend."""
    return by is not None and findings.level_count(by) > len(COLOURS)


CURVE, HEAT_MAP, SCATTER = "curve", "heat_map", "scatter"

SPARSEST = 4
"""Number of cells per design point above which a heat map is drawn as a scatter plot."""

TRIAL = AxisScale(title="trial", whole=True, axis=StudyAxis("case", about="trial"))

WITHOUT_RESULT = {"failed": ([FAILED, LOST], "x", RED), "pruned": ([PRUNED], "|", QUIET)}
"""Statuses, marker and colour of cases without a result, by word."""


def drawn_plots(findings: Findings) -> list[Plot]:
    """Return the plots of the study.

    A curve or heat map over a sampled factor becomes a scatter plot, because no two cases share
    a line or a row of cells. Raises OutputError if a plot names no axis of the study.
    """
    return list(dict.fromkeys(_suited(findings, plot) for plot in findings.record.plots))


def study_plot(findings: Findings, plot: Plot) -> Diagram:
    """Return the diagram of a plot.

    Raises OutputError if it names no axis of the study.
    """
    return PLOTS[plot.kind](findings, plot)


def curve(findings: Findings, plot: Plot) -> Diagram:
    """Return the diagram of a measure over a factor, with one line per level of another factor."""
    x, y = findings.scale(plot.x), findings.scale(plot.y)
    by = findings.axis(plot.by) if plot.by else None
    bar = None
    if by is not None and has_bar(findings, by):
        scale = findings.scale(by.name)
        bar = scale, scale.places(findings.table[by.column])
    said = remark(findings, x.axis, y.axis, by)
    return _marked(findings, x, y, tuple(curves(findings, x, y, by)), bar, said)


def heat_map(findings: Findings, plot: Plot) -> Diagram:
    """Return the diagram of a measure as the colour of cells over two factors.

    The measure is the first one unless the plot names another; a cell shows the mean of all its
    cases.
    """
    x, y = findings.scale(plot.x), findings.scale(plot.y)
    z = findings.scale(plot.colour or findings.measures[0].name)
    cells, best = cells_of(findings, x, y, z), best_point(findings, x, y)
    panel = Panel(PlotAxis(y), None, cells, (), best, (z, cells.values), TALL)
    title = f"{z.title} over {x.title} and {y.title}"
    return Diagram(title, x, (panel,), remark_on_cells(findings, x, y))


def scatter(findings: Findings, plot: Plot) -> Diagram:
    """Return the diagram with one point per case."""
    x, y = findings.scale(plot.x), findings.scale(plot.y)
    z = findings.scale(plot.colour) if plot.colour else None
    return _points(findings, x, y, z)


def progress(findings: Findings, goal: Goal) -> Diagram:
    """Return the diagram of the objective over the trials, with the best so far as steps."""
    y, done = findings.scale(goal.measure), findings.done.sort("case")
    trials, objective = TRIAL.places(done["case"]), y.places(done[y.axis.column])
    cases, so_far = done["case"].to_numpy(), best_so_far(objective, goal.sense)
    each = PlotSeries("trial", trials, objective, SKY, POINTS, cases=cases)
    best = PlotSeries("best so far", trials, so_far, ORANGE, STEPS, cases=cases)
    return _marked(findings, TRIAL, y, (each, best))


def over_factors(findings: Findings, goal: Goal) -> Iterator[tuple[StudyAxis, Diagram]]:
    """Yield each factor with the diagram of the objective over it, coloured by the trial."""
    y = findings.scale(goal.measure)
    for factor in findings.varied or findings.factors:
        yield factor, _points(findings, findings.scale(factor.name), y, TRIAL)


PLOTS: dict[str, Callable[[Findings, Plot], Diagram]] = {
    CURVE: curve,
    HEAT_MAP: heat_map,
    SCATTER: scatter,
}


def best_so_far(objective: np.ndarray, sense: str) -> np.ndarray:
    """Return the best value up to each trial (n,); NaN before the first that has one."""
    best = np.fmax if sense == "maximize" else np.fmin
    return best.accumulate(objective)


def best_point(findings: Findings, x: AxisScale, y: AxisScale) -> tuple[PlotSeries, ...]:
    """Return the best design point as a series, if there is one."""
    best = findings.best
    if best is None:
        return ()
    at_x, at_y = (np.array([scale.place(best.values[scale.axis.column])]) for scale in (x, y))
    several = best.values[DONE_COUNT] > 1
    cases = np.array([best.case])
    return (
        PlotSeries(best_in_words(findings), at_x, at_y, RED, POINTS, cases=cases, mean=several),
    )  # fmt: skip


def cells_of(findings: Findings, x: AxisScale, y: AxisScale, z: AxisScale) -> Cells:
    """Return the mean of z, or its most frequent label, over all cases at each pair of levels."""
    found = findings.design_points.group_by(x.axis.column, y.axis.column).agg(
        usual(z.axis, polars.col(z.axis.column)).alias("value"),
        polars.col("case").min(),
        polars.col(FAILED_COUNT).sum(),
    )
    columns, i = np.unique(x.places(found[x.axis.column]), return_inverse=True)
    rows, j = np.unique(y.places(found[y.axis.column]), return_inverse=True)
    values = np.full((len(rows), len(columns)), np.nan)
    values[j, i] = z.places(found["value"])
    cases, failed = np.zeros(values.shape, dtype=int), np.zeros(values.shape, dtype=int)
    cases[j, i], failed[j, i] = found["case"], found[FAILED_COUNT]
    return Cells(
        columns, rows, edges(columns, x.logarithmic), edges(rows, y.logarithmic),
        values, cases, (failed > 0) & np.isnan(values), bool(averaged(findings, x, y)),
    )  # fmt: skip


def edges(levels: np.ndarray, logarithmic: bool) -> np.ndarray:
    """Return edges (n + 1,) of cells around increasing levels (n,).

    An edge is the midpoint of two levels, the geometric one on a logarithmic scale; an outer
    cell extends equally far on both sides of its level.
    """
    at = np.log(levels) if logarithmic else levels
    if len(at) == 1:
        found = at[0] + np.array([-0.5, 0.5]) * (1.0 if logarithmic else abs(at[0]) or 1.0)
    else:
        middle = 0.5 * (at[:-1] + at[1:])
        found = np.array([2.0 * at[0] - middle[0], *middle, 2.0 * at[-1] - middle[-1]])
    return np.exp(found) if logarithmic else found


def averaged(findings: Findings, x: AxisScale, y: AxisScale) -> list[str]:
    """Return the names of the factors over which the cells of two factors are averaged."""
    others = [factor.name for factor in findings.varied if factor not in (x.axis, y.axis)]
    return others + ["repeats"] * (findings.record.repeats > 1)


def remark_on_cells(findings: Findings, x: AxisScale, y: AxisScale) -> str:
    """Return a note on the cells: what they are averaged over, and what is omitted."""
    others = averaged(findings, x, y)
    said = [f"mean over {', '.join(others)}"] if others else []
    failed = findings.design_points[FAILED_COUNT].sum()
    if others and failed:
        said.append(f"without {failed} failed cases")
    return ", ".join(said)


def _points(findings: Findings, x: AxisScale, y: AxisScale, z: AxisScale | None) -> Diagram:
    """Return the diagram of the cases that are done, coloured by an axis z if there is one."""
    done = findings.done
    places = None if z is None else z.places(done[z.axis.column])
    series = PlotSeries(
        "", x.places(done[x.axis.column]), y.places(done[y.axis.column]), BLUE, POINTS,
        shades=places, cases=done["case"].to_numpy(),
    )  # fmt: skip
    colours = None if z is None or places is None else (z, places)
    return _marked(findings, x, y, (series,), colours)


def _marked(
    findings: Findings, x: AxisScale, y: AxisScale, series: tuple[PlotSeries, ...],
    colours: tuple[Scale, np.ndarray] | None = None, said: str = "",
) -> Diagram:  # fmt: skip
    """Return a diagram with the best point and the marks of cases without a result."""
    edges = []
    for word, (statuses, marker, colour) in WITHOUT_RESULT.items():
        rows = findings.table.filter(polars.col("status").is_in(statuses))
        if rows.height and (x.axis in findings.factors or x is TRIAL):
            places, cases = x.places(rows[x.axis.column]), rows["case"].to_numpy()
            edges.append(EdgeMarks(f"{rows.height} {word}", marker, colour, places, cases))
    best = best_point(findings, x, y)
    panel = Panel(PlotAxis(y, series), None, None, edges, best, colours, TALL)
    return Diagram(f"{y.title} over {x.title}", x, (panel,), said)


def _suited(findings: Findings, plot: Plot) -> Plot:
    points = findings.design_points.height
    x, y = (findings.level_count(findings.axis(name)) for name in (plot.x, plot.y))
    if plot.kind == CURVE and x == points and len(findings.varied) > 1:
        return Plot(SCATTER, plot.x, plot.y, colour=plot.by)
    if plot.kind == HEAT_MAP and x * y > SPARSEST * points:
        return Plot(SCATTER, plot.x, plot.y, colour=plot.colour)
    return plot


# -------------------------------------------------------------------------------------------------
# All figures of a study: PNG files in its folder, and charts of its page.
#
# The table of boundaries is written with the PNG files; the charts give access to every case.

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


# -------------------------------------------------------------------------------------------------
# Page of a study: factors, best case, every plot and every case in one file.

MOST_LEVELS = 12
"""Largest number of levels of a factor that are listed individually."""

MOST_NAMED = 8
"""Largest number of cases that are listed for each reason of failure."""


def write_study_page(folder: Path) -> Path:
    """Write report.html into the folder of a study, from the results so far; return its path.

    Raises OutputError if the folder holds no study, a plot names no axis of it, or the file
    cannot be written.
    """
    findings, path = Findings.read(folder), folder / PAGE
    write_page("study.html", page_context(findings, folder), path)
    return path


def page_context(findings: Findings, folder: Path) -> dict[str, Any]:
    """Return the variables of the template."""
    kind, words = state_of(findings)
    table = (folder / TABLE_TEXT).read_bytes()
    return {
        "title": findings.record.title,
        "kind": kind,
        "words": words,
        "best": best_in_words(findings),
        "pass_rate": pass_rate_in_words(findings),
        "boundaries": boundaries_in_words(findings),
        "charts": study_charts(findings),
        "factors": [Line(title_of(f), level_words(findings, f.name)) for f in findings.factors],
        "settings": settings_of(findings),
        "reasons": reasons_of(findings),
        "cases": {
            "headings": findings.table.columns,
            "columns": [column.to_list() for column in findings.table],
            "factors": [axis.column for axis in findings.factors],
            "measures": [axis.column for axis in findings.measures],
        },
        "download": f"data:text/csv;base64,{b64encode(table).decode()}",
        "download_name": TABLE_TEXT,
    }


def state_of(findings: Findings) -> tuple[str, str]:
    """Return the state of the study: good, open or bad, and in words."""
    counts = dict(findings.table["status"].value_counts().iter_rows())
    total = findings.table.height
    said = [f"{counts.get(DONE, 0)} of {total} cases done"]
    said += [f"{counts[s]} {s}" for s in (FAILED, LOST, PRUNED, WAITING) if counts.get(s)]
    table = findings.table
    doubtful = table[WARNINGS].count() if WARNINGS in table.columns else 0
    if doubtful:
        said.append(f"{doubtful} with warnings, listed in summary.json of each case")
    words = f"{findings.record.status}: {', '.join(said)}"
    if findings.record.status != "done" or counts.get(WAITING):
        return "open", words
    if not counts.get(DONE):
        return "bad", words
    is_doubtful = counts.get(FAILED) or counts.get(LOST) or doubtful
    return ("open" if is_doubtful else "good"), words


def level_words(findings: Findings, name: str) -> str:
    """Return the levels of a factor as a list, or their number and range."""
    axis = findings.axis(name)
    levels = findings.table[axis.column].drop_nulls().unique(maintain_order=True)
    if len(levels) <= MOST_LEVELS:
        return ", ".join(written(axis, level) for level in levels)
    if axis.is_label:
        return f"{len(levels)} levels"
    return f"{len(levels)} values, {written(axis, levels.min())} to {written(axis, levels.max())}"


def settings_of(findings: Findings) -> list[Line]:
    """Return the settings, wall time and version of the study."""
    record = findings.record
    return [
        Line("study", record.source),
        *(Line(name, text) for name, text in (record.settings or {}).items()),
        Line("wall time", duration(record.wall_time)),
        Line("softsim", record.version),
    ]


def reasons_of(findings: Findings) -> Table | None:
    """Return the reasons of failed cases, the most frequent first; None if no case failed."""
    failed = findings.table.filter(polars.col("status").is_in([FAILED, LOST]))
    groups = failed.group_by("reason", maintain_order=True).agg("case")
    rows: list[Row] = []
    for reason, cases in sorted(groups.iter_rows(), key=lambda group: -len(group[1])):
        named = ", ".join(map(str, cases[:MOST_NAMED])) + " ..." * (len(cases) > MOST_NAMED)
        rows.append([reason or "no reason recorded", cell(len(cases), "d"), named])
    return Table(rows, ["reason", "number", "cases"], "Causes of failure") if rows else None
