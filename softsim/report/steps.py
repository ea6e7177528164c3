"""The steps of a run in one figure: their histories put together, and when each of them was."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from softsim.output.folder import SUMMARY, read_summary
from softsim.output.travel import History
from softsim.report.diagram import FLAT, Axis, Diagram, Panel, Scale, Series
from softsim.report.png import draw
from softsim.report.recorded import Recorded, recorded
from softsim.report.signals import contact, motion, probes, pull

FIGURE = "steps.png"

OF_A_STATIC_STEP = "unbalanced_share"
"""A column that is only there."""

A_NAME = 0.12
"""Height of a panel for each name in it, of that of an ordinary one."""


def draw_steps(folder: Path) -> Path | None:
    """Draw the figure of the steps in a folder, steps.png; None where none of them has begun, or
    nothing changed in any.

    Raises OutputError if a history has no rows, a file is damaged, or the disk refuses.
    """
    path, diagram = folder / FIGURE, steps_diagram(recorded_steps(folder))
    if diagram is None:
        path.unlink(missing_ok=True)
        return None
    draw(path, diagram)
    return path


def recorded_steps(folder: Path) -> dict[str, Recorded]:
    """The steps in a folder that have begun, by name."""
    paths = {step["name"]: folder / step["folder"] for step in read_summary(folder)["steps"]}
    # A step that has not has no summary, but maybe the history of an earlier course of the run.
    return {name: recorded(path) for name, path in paths.items() if (path / SUMMARY).is_file()}


def steps_diagram(runs: Mapping[str, Recorded]) -> Diagram | None:
    """Where the robot is, its pressure, what it touches, pull and probes over the time of all
    steps, and below when each step was; None where none of these changed. Without energies, whose
    books each step begins anew.
    """
    if not runs:
        return None
    history = joined([run.history for run in runs.values()])
    units = {name: unit for run in runs.values() for name, unit in run.units.items()}
    panels = [*motion(history), *contact(history), *pull(history), *probes(history, units)]
    if not panels:
        return None
    spans = {name: run.history["time"][[0, -1]] for name, run in runs.items()}
    bounds = tuple(float(span[0]) for span in spans.values())[1:]
    is_static = any(OF_A_STATIC_STEP in run.history for run in runs.values())
    time = Scale("time, of a static step that of its loads [s]" if is_static else "time [s]")
    shown = [*panels, when(spans)]
    return Diagram("All steps", time, shown, over_time=True, bounds=bounds)


def joined(histories: Sequence[History]) -> History:
    """The histories of steps, one after another; NaN in those that lack a column. The first row of
    a later step is left out: it is the moment of the last row before, without mean values.
    """
    columns = {name for history in histories for name in history} - {OF_A_STATIC_STEP}
    begins = [0] + [1] * (len(histories) - 1)

    def parts(column: str) -> list[np.ndarray]:
        return [
            history.get(column, np.full_like(history["time"], np.nan))[begin:]
            for history, begin in zip(histories, begins, strict=True)
        ]

    return {column: np.concatenate(parts(column)) for column in columns}


def when(spans: Mapping[str, np.ndarray]) -> Panel:
    """A line for each step from its begin to its end (2,) [s], the first on top."""
    names = tuple(spans)[::-1]
    lines = [Series("", spans[name], np.full(2, float(k))) for k, name in enumerate(names)]
    return Panel(Axis(Scale("step", labels=names), lines), height=max(FLAT, A_NAME * len(names)))
