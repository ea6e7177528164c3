"""All figures of a study's folder, from its files alone."""

from collections.abc import Callable
from pathlib import Path

from softsim.report.study.curve import draw_curve
from softsim.report.study.findings import Findings
from softsim.report.study.heat_map import draw_heat_map
from softsim.report.study.plots import CURVE, HEAT_MAP, SCATTER, drawn_plots
from softsim.report.study.scatter import draw_scatter
from softsim.report.study.search import draw_factors, draw_progress
from softsim.study.axes import Plot

DRAWINGS: dict[str, Callable[[Findings, Plot, Path], None]] = {
    CURVE: draw_curve,
    HEAT_MAP: draw_heat_map,
    SCATTER: draw_scatter,
}

PROGRESS, FACTORS = "progress.png", "factors.png"


def draw_study(folder: Path) -> list[Path]:
    """Draw the plots of the study, and how its optimisation went; the figures' paths. Figures of
    plots that it has no longer go.

    Raises OutputError where the folder holds no study, a plot names no axis of it, or the disk
    refuses.
    """
    findings = Findings.read(folder)
    drawn = []
    for plot in drawn_plots(findings):
        drawn.append(folder / file_name(plot))
        DRAWINGS[plot.kind](findings, plot, drawn[-1])
    goal = findings.record.goal
    if goal is not None:
        drawn += [folder / PROGRESS, folder / FACTORS]
        draw_progress(findings, goal, drawn[-2])
        draw_factors(findings, goal, drawn[-1])
    for kind in (*DRAWINGS, "progress", "factors"):
        for file in folder.glob(f"{kind}*.png"):
            if file not in drawn:
                file.unlink()
    return drawn


def file_name(plot: Plot) -> str:
    """Of a plot: curve_speed_over_rate_by_pipe.png."""
    words = [plot.kind, plot.y, "over", plot.x]
    for joined, name in (("by", plot.by), ("coloured_by", plot.colour)):
        words += [joined, name] if name else []
    return "".join(c if c.isalnum() or c in "_-" else "_" for c in "_".join(words)) + ".png"
