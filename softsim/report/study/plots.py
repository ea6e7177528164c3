"""Which plots a study has where it does not say so itself."""

from math import prod

from softsim.report.study.findings import REPEAT, Findings
from softsim.study.axes import Plot

CURVE, HEAT_MAP, SCATTER = "curve", "heat_map", "scatter"

SPARSEST = 4
"""Cells of a heat map for each design point that it has."""


def planned_plots(findings: Findings) -> list[Plot]:
    """The plots that the study asks for, or those that suit its factors.

    Over a factor that was sampled no two cases share a line or a row of cells: a curve or a heat
    map of it is a scatter.
    """
    asked = findings.record.plots or default_plots(findings)
    return list(dict.fromkeys(_drawable(findings, plot) for plot in asked))


def default_plots(findings: Findings) -> list[Plot]:
    """Of each measure a curve where one number varies, a line each label; a heat map where two
    factors make a grid. Of anything else the first measure, or the one to be made best, over each
    factor; an optimisation shows that by itself.
    """
    varied = findings.varied
    numbers = [axis.name for axis in varied if not axis.is_label]
    labels = [axis.name for axis in varied if axis.is_label]
    measures = [axis.name for axis in findings.measures]
    bare = [axis.name for axis in findings.measures if not axis.is_label]
    if len(numbers) == 1 and numbers != [REPEAT] and (is_grid(findings) or not labels):
        by = labels[0] if labels else None
        return [Plot(CURVE, numbers[0], measure, by=by) for measure in bare]
    if len(varied) == 2 and is_grid(findings):
        x, y = (axis.name for axis in varied)
        return [Plot(HEAT_MAP, x, y, colour=measure) for measure in measures]
    if findings.record.goal is not None:
        return []
    shown = varied or findings.factors[:1]
    return [Plot(SCATTER, axis.name, measure) for measure in bare[:1] for axis in shown]


def is_grid(findings: Findings) -> bool:
    """Whether every combination of the levels of the factors is in the table."""
    cells = prod(findings.level_count(factor) for factor in findings.varied)
    return findings.design_points.height == cells


def _drawable(findings: Findings, plot: Plot) -> Plot:
    points = findings.design_points.height
    x, y = (findings.level_count(findings.axis(name)) for name in (plot.x, plot.y))
    if plot.kind == CURVE and x == points and len(findings.varied) > 1:
        return Plot(SCATTER, plot.x, plot.y, colour=plot.by)
    if plot.kind == HEAT_MAP and x * y > SPARSEST * points:
        return Plot(SCATTER, plot.x, plot.y, colour=plot.colour)
    return plot
