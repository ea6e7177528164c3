"""How an optimisation went: the objective over the trials, and over each factor."""

from pathlib import Path

import numpy as np
import polars
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.ticker import MaxNLocator

from softsim.report.colours import COLOUR_MAP
from softsim.report.study.findings import Findings
from softsim.report.study.marks import add_legend, mark_best, mark_without_result, say_if_empty
from softsim.report.study.scale import TALL, WIDE, Scale
from softsim.report.study.scatter import draw_points
from softsim.report.style import ORANGE, SKY, drawing
from softsim.study.axes import Axis, Goal

PANELS_IN_A_ROW = 3

TRIAL = Axis("case", about="trial")


def draw_progress(findings: Findings, goal: Goal, path: Path) -> None:
    """The objective over the number of the trial, the best so far as steps.

    Raises OutputError if the disk refuses.
    """
    x, y = Scale(TRIAL, whole=True), findings.scale(goal.measure)
    done = findings.done.sort("case")
    trials, objective = x.places(done["case"]), y.places(done[y.axis.column])
    with drawing(path, height=3.6) as figure:
        axes = figure.add_subplot()
        draw_points(axes, trials, objective, color=SKY, label="a trial")
        axes.plot(
            trials, best_so_far(objective, goal.sense), color=ORANGE, drawstyle="steps-post",
            label="best so far",
        )  # fmt: skip
        x.along_x(axes)
        axes.set_xlim(0.5, findings.table.height + 0.5)
        y.along_y(axes)
        mark_without_result(axes, findings, x)
        mark_best(axes, findings, x, y)
        say_if_empty(axes, objective)
        add_legend(figure, axes)


def draw_factors(findings: Findings, goal: Goal, path: Path) -> None:
    """A panel a factor: the objective over it, later trials lighter.

    Raises OutputError if the disk refuses.
    """
    y, done = findings.scale(goal.measure), findings.done
    objective = y.places(done[y.axis.column])
    trials = done["case"].cast(polars.Float64).to_numpy()
    last = max([2, *findings.table["case"]])  # a colour map needs two ends
    colours = ScalarMappable(Normalize(1, last), COLOUR_MAP)
    shown = findings.varied or findings.factors
    rows = -(-len(shown) // PANELS_IN_A_ROW)
    columns = min(len(shown), PANELS_IN_A_ROW)
    with drawing(path, height=0.8 + 2.3 * rows) as figure:
        panels = figure.subplots(rows, columns, sharey=True, squeeze=False)
        for axes, factor in zip(panels.flat, shown, strict=False):
            x = findings.scale(factor.name)
            draw_points(axes, x.places(done[factor.column]), objective, c=trials,
                        cmap=colours.cmap, norm=colours.norm)  # fmt: skip
            x.along_x(axes, WIDE // columns)
            mark_without_result(axes, findings, x)
            mark_best(axes, findings, x, y)
            say_if_empty(axes, objective)
        for axes in panels.flat[len(shown) :]:
            axes.set_axis_off()
        for axes in panels[:, 0]:
            y.along_y(axes, TALL // 2)
        bar = figure.colorbar(
            colours, ax=panels, label="trial", pad=0.02, ticks=MaxNLocator(integer=True)
        )
        bar.outline.set_visible(False)
        add_legend(figure, panels.flat[0])


def best_so_far(objective: np.ndarray, sense: str) -> np.ndarray:
    """The best value up to each trial (n,); NaN before the first that has one."""
    best = np.fmax if sense == "maximize" else np.fmin
    return best.accumulate(objective)
