"""Plots of a study as diagrams, independent of their output."""

from collections.abc import Callable, Iterator

import numpy as np
import polars

from softsim.report.diagram import (
    POINTS,
    STEPS,
    TALL,
    Axis,
    Cells,
    Diagram,
    Edge,
    Panel,
    Scale,
    Series,
)
from softsim.report.study.curve import curves, has_bar, remark
from softsim.report.study.findings import (
    DONE_COUNT,
    FAILED_COUNT,
    AxisScale,
    Findings,
    best_in_words,
    usual,
)
from softsim.report.style import BLUE, ORANGE, QUIET, RED, SKY
from softsim.study.axes import Axis as StudyAxis
from softsim.study.axes import Goal, Plot
from softsim.study.cases import FAILED, LOST, PRUNED

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
    panel = Panel(Axis(y), None, cells, (), best, (z, cells.values), TALL)
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
    each = Series("trial", trials, objective, SKY, POINTS, cases=cases)
    best = Series("best so far", trials, so_far, ORANGE, STEPS, cases=cases)
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


def best_point(findings: Findings, x: AxisScale, y: AxisScale) -> tuple[Series, ...]:
    """Return the best design point as a series, if there is one."""
    best = findings.best
    if best is None:
        return ()
    at_x, at_y = (np.array([scale.place(best.values[scale.axis.column])]) for scale in (x, y))
    several = best.values[DONE_COUNT] > 1
    cases = np.array([best.case])
    return (
        Series(best_in_words(findings), at_x, at_y, RED, POINTS, cases=cases, mean=several),
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
    series = Series(
        "", x.places(done[x.axis.column]), y.places(done[y.axis.column]), BLUE, POINTS,
        shades=places, cases=done["case"].to_numpy(),
    )  # fmt: skip
    colours = None if z is None or places is None else (z, places)
    return _marked(findings, x, y, (series,), colours)


def _marked(
    findings: Findings, x: AxisScale, y: AxisScale, series: tuple[Series, ...],
    colours: tuple[Scale, np.ndarray] | None = None, said: str = "",
) -> Diagram:  # fmt: skip
    """Return a diagram with the best point and the marks of cases without a result."""
    has_edge = x.axis in findings.factors or x is TRIAL
    edges = tuple(_edges(findings, x)) if has_edge else ()
    best = best_point(findings, x, y)
    panel = Panel(Axis(y, series), None, None, edges, best, colours, TALL)
    return Diagram(f"{y.title} over {x.title}", x, (panel,), said)


def _edges(findings: Findings, x: AxisScale) -> Iterator[Edge]:
    for word, (statuses, marker, colour) in WITHOUT_RESULT.items():
        rows = findings.table.filter(polars.col("status").is_in(statuses))
        if rows.height:
            places, cases = x.places(rows[x.axis.column]), rows["case"].to_numpy()
            yield Edge(f"{rows.height} {word}", marker, colour, places, cases)


def _suited(findings: Findings, plot: Plot) -> Plot:
    points = findings.design_points.height
    x, y = (findings.level_count(findings.axis(name)) for name in (plot.x, plot.y))
    if plot.kind == CURVE and x == points and len(findings.varied) > 1:
        return Plot(SCATTER, plot.x, plot.y, colour=plot.by)
    if plot.kind == HEAT_MAP and x * y > SPARSEST * points:
        return Plot(SCATTER, plot.x, plot.y, colour=plot.colour)
    return plot
