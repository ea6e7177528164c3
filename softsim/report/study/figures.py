"""All figures of a study's folder, and the table of its boundaries, from its files alone."""

from pathlib import Path

from softsim.output.folder import RunFolder
from softsim.report.png import draw
from softsim.report.study.boundary import TABLE, boundary_maps, boundary_table
from softsim.report.study.findings import Findings
from softsim.report.study.plots import PLOTS, drawn_plots, over_factors, progress, study_plot
from softsim.study.axes import Plot

PROGRESS, FACTORS, BOUNDARIES = "progress.png", "factors.png", "boundary_map.png"


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
        table = boundary_table(findings, sought).write_csv()
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
