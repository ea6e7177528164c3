"""The plots of a study: what they say, whoever draws them. `figures.py` draws them as PNG,
`charts.py` for the page.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
import polars

from softsim.report.study.cells import Cells, remark_on_cells
from softsim.report.study.curve import has_bar, line_colours, line_labels, lines, remark
from softsim.report.study.findings import DONE_COUNT, Findings
from softsim.report.study.scale import Scale, title_of
from softsim.report.style import BLUE, ORANGE, QUIET, RED, SKY
from softsim.study.axes import Axis, Goal, Plot
from softsim.study.cases import FAILED, LOST, PRUNED

CURVE, HEAT_MAP, SCATTER = "curve", "heat_map", "scatter"

SPARSEST = 4
"""Cells of a heat map for each design point that it has."""

MOST_MARKERS = 60
"""Points on a line that each have a marker."""

TRIAL = Axis("case", about="trial")

WITHOUT_RESULT = {"failed": ([FAILED, LOST], "x", RED), "pruned": ([PRUNED], "|", QUIET)}
"""Word -> statuses, marker and colour of cases that have no result."""

EMPTY = np.zeros(0)


@dataclass(frozen=True)
class Series:
    """Points, perhaps joined: places x and y (n,), and the case of each (n,).

    colour: of all, unless the colours of the plot tell values (n,) apart. join: "" for single
    points, "line" or "steps". band: its lowest and highest values (2, n), NaN where there is none.
    mean: a place stands for several cases.
    """

    x: np.ndarray
    y: np.ndarray
    cases: np.ndarray
    colour: str = BLUE
    values: np.ndarray = field(default_factory=lambda: EMPTY)
    name: str = ""
    join: str = ""
    band: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))
    mean: bool = False

    @property
    def has_markers(self) -> bool:
        """Whether each place is marked: on a line not where there are many."""
        return self.join == "" or (self.join == "line" and len(self.x) <= MOST_MARKERS)


@dataclass(frozen=True)
class Edge:
    """Marks along the lower edge for cases that have no result: places x (n,), cases (n,)."""

    name: str
    marker: str
    colour: str
    x: np.ndarray
    cases: np.ndarray


@dataclass(frozen=True)
class StudyPlot:
    """A plot: series or cells over one another, cases without a result, the best design point.

    colours: the scale of the bar, and the places (n,) that it must show. best: one place or none.
    """

    x: Scale
    y: Scale
    series: tuple[Series, ...] = ()
    cells: Cells | None = None
    colours: tuple[Scale, np.ndarray] | None = None
    edges: tuple[Edge, ...] = ()
    best: tuple[Series, ...] = ()
    remark: str = ""

    @property
    def title(self) -> str:
        """What is drawn over what."""
        shown = f"{title_of(self.y.axis)} over {title_of(self.x.axis)}"
        if self.cells is not None and self.colours is not None:
            across = f"{title_of(self.x.axis)} and {title_of(self.y.axis)}"
            shown = f"{title_of(self.colours[0].axis)} over {across}"
        return f"{shown}; {self.remark}" if self.remark else shown

    @property
    def is_empty(self) -> bool:
        """Whether no case has a result yet."""
        shown = [s.x + s.y for s in self.series]
        return self.cells is None and not np.isfinite(np.concatenate([EMPTY, *shown])).any()


def drawn_plots(findings: Findings) -> list[Plot]:
    """The plots of the study. Over a factor that was sampled no two cases share a line or a row of
    cells: a curve or a heat map of it is a scatter.

    Raises OutputError if a plot names no axis of the study.
    """
    return list(dict.fromkeys(_suited(findings, plot) for plot in findings.record.plots))


def study_plot(findings: Findings, plot: Plot) -> StudyPlot:
    """What a plot says. Raises OutputError if it names no axis of the study."""
    return PLOTS[plot.kind](findings, plot)


def curve(findings: Findings, plot: Plot) -> StudyPlot:
    """A measure over a factor, a line each level of another one."""
    x, y = findings.scale(plot.x), findings.scale(plot.y)
    by = findings.axis(plot.by) if plot.by else None
    found = list(lines(findings, x, y, by))
    looks = zip(
        found, line_colours(findings, found, by), line_labels(findings, found, by), strict=True
    )
    series = tuple(
        Series(
            line.x, line.mean, line.points["case"].to_numpy(), colour, name=label, join="line",
            band=line.band, mean=_stands_for_several(line.points),
        )
        for line, colour, label in looks
    )  # fmt: skip
    bar = None
    if by is not None and has_bar(findings, by):
        scale = findings.scale(by.name)
        bar = scale, scale.places(findings.table[by.column])
    return _marked(findings, x, y, series, bar, remark(findings, x.axis, y.axis, by))


def heat_map(findings: Findings, plot: Plot) -> StudyPlot:
    """A measure, the first one where the plot does not say which, as the colour of cells over two
    factors; the mean of all cases in a cell.
    """
    x, y = findings.scale(plot.x), findings.scale(plot.y)
    z = findings.scale(plot.colour or findings.measures[0].name)
    cells, said = Cells.of(findings, x, y, z), remark_on_cells(findings, x, y)
    best = best_point(findings, x, y)
    return StudyPlot(x, y, cells=cells, colours=(z, cells.values), best=best, remark=said)


def scatter(findings: Findings, plot: Plot) -> StudyPlot:
    """Each case a point."""
    x, y = findings.scale(plot.x), findings.scale(plot.y)
    z = findings.scale(plot.colour) if plot.colour else None
    return _points(findings, x, y, z)


def progress(findings: Findings, goal: Goal) -> StudyPlot:
    """The objective over the trials, the best so far as steps."""
    x, y, done = Scale(TRIAL, whole=True), findings.scale(goal.measure), findings.done.sort("case")
    trials, objective = x.places(done["case"]), y.places(done[y.axis.column])
    cases = done["case"].to_numpy()
    so_far = best_so_far(objective, goal.sense)
    each = Series(trials, objective, cases, SKY, name="a trial")
    best = Series(trials, so_far, cases, ORANGE, name="best so far", join="steps")
    return _marked(findings, x, y, (each, best))


def over_factors(findings: Findings, goal: Goal) -> Iterator[tuple[Axis, StudyPlot]]:
    """The objective over each factor, coloured by the trial."""
    y, trial = findings.scale(goal.measure), Scale(TRIAL, whole=True)
    for factor in findings.varied or findings.factors:
        yield factor, _points(findings, findings.scale(factor.name), y, trial)


PLOTS: dict[str, Callable[[Findings, Plot], StudyPlot]] = {
    CURVE: curve,
    HEAT_MAP: heat_map,
    SCATTER: scatter,
}


def best_so_far(objective: np.ndarray, sense: str) -> np.ndarray:
    """The best value up to each trial (n,); NaN before the first that has one."""
    best = np.fmax if sense == "maximize" else np.fmin
    return best.accumulate(objective)


def best_point(findings: Findings, x: Scale, y: Scale) -> tuple[Series, ...]:
    """Where the best design point lies, if there is one."""
    best = findings.best
    if best is None:
        return ()
    at_x, at_y = (np.array([scale.place(best.values[scale.axis.column])]) for scale in (x, y))
    return (Series(at_x, at_y, np.array([best.case]), RED, mean=best.values[DONE_COUNT] > 1),)


def _points(findings: Findings, x: Scale, y: Scale, z: Scale | None) -> StudyPlot:
    """The cases that are done, coloured by an axis z or all alike."""
    done = findings.done
    places = EMPTY if z is None else z.places(done[z.axis.column])
    series = Series(
        x.places(done[x.axis.column]), y.places(done[y.axis.column]), done["case"].to_numpy(),
        values=places,
    )  # fmt: skip
    return _marked(findings, x, y, (series,), None if z is None else (z, places))


def _marked(
    findings: Findings, x: Scale, y: Scale, series: tuple[Series, ...],
    colours: tuple[Scale, np.ndarray] | None = None, said: str = "",
) -> StudyPlot:  # fmt: skip
    """A plot with the marks that all over a factor or the trials have."""
    has_edge = x.axis in findings.factors or x.axis is TRIAL
    marks = tuple(_edges(findings, x)) if has_edge else ()
    best = best_point(findings, x, y)
    return StudyPlot(x, y, series, None, colours, marks, best, said)


def _edges(findings: Findings, x: Scale) -> Iterator[Edge]:
    for word, (statuses, marker, colour) in WITHOUT_RESULT.items():
        rows = findings.table.filter(polars.col("status").is_in(statuses))
        if rows.height:
            places, cases = x.places(rows[x.axis.column]), rows["case"].to_numpy()
            yield Edge(f"{rows.height} {word}", marker, colour, places, cases)


def _stands_for_several(rows: polars.DataFrame) -> bool:
    return bool((rows[DONE_COUNT] > 1).any())


def _suited(findings: Findings, plot: Plot) -> Plot:
    points = findings.design_points.height
    x, y = (findings.level_count(findings.axis(name)) for name in (plot.x, plot.y))
    if plot.kind == CURVE and x == points and len(findings.varied) > 1:
        return Plot(SCATTER, plot.x, plot.y, colour=plot.by)
    if plot.kind == HEAT_MAP and x * y > SPARSEST * points:
        return Plot(SCATTER, plot.x, plot.y, colour=plot.colour)
    return plot
