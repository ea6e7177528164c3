"""The plots of a study that suit the cases it has."""

from softsim.report.study.findings import Findings
from softsim.study.axes import Plot

CURVE, HEAT_MAP, SCATTER = "curve", "heat_map", "scatter"

SPARSEST = 4
"""Cells of a heat map for each design point that it has."""


def drawn_plots(findings: Findings) -> list[Plot]:
    """The plots of the study. Over a factor that was sampled no two cases share a line or a row of
    cells: a curve or a heat map of it is a scatter.

    Raises OutputError if a plot names no axis of the study.
    """
    return list(dict.fromkeys(_suited(findings, plot) for plot in findings.record.plots))


def _suited(findings: Findings, plot: Plot) -> Plot:
    points = findings.design_points.height
    x, y = (findings.level_count(findings.axis(name)) for name in (plot.x, plot.y))
    if plot.kind == CURVE and x == points and len(findings.varied) > 1:
        return Plot(SCATTER, plot.x, plot.y, colour=plot.by)
    if plot.kind == HEAT_MAP and x * y > SPARSEST * points:
        return Plot(SCATTER, plot.x, plot.y, colour=plot.colour)
    return plot
