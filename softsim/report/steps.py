"""Figure of a run in steps: the joined histories and the time of each step."""

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
"""Column that only static steps have."""

A_NAME = 0.12
"""Height of the panel of steps per name, relative to an ordinary panel."""


def draw_steps(folder: Path) -> Path | None:
    """Draw the figure steps.png of the steps in a folder and return it.

    The result is None if no step has started, or nothing changed in any. Raises OutputError if
    a history has no rows, a file is damaged, or the file cannot be written.
    """
    path, diagram = folder / FIGURE, steps_diagram(recorded_steps(folder))
    if diagram is None:
        path.unlink(missing_ok=True)
        return None
    draw(path, diagram)
    return path


def recorded_steps(folder: Path) -> dict[str, Recorded]:
    """Return the steps in a folder that have started, by name."""
    paths = {step["name"]: folder / step["folder"] for step in read_summary(folder)["steps"]}
    # A step that has not has no summary, but maybe the history of an earlier course of the run.
    return {name: recorded(path) for name, path in paths.items() if (path / SUMMARY).is_file()}


def steps_diagram(runs: Mapping[str, Recorded]) -> Diagram | None:
    """Return the diagram of all steps over time, or None if there is nothing to show.

    It shows position, pressure, contact, pull and probes, and below them the time of each step.
    Energies are omitted, because each step starts a new energy balance.
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
    """Return the joined histories of steps, with NaN in those that lack a column.

    The first row of a later step is omitted: it is the same moment as the last row before,
    without mean values.
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
    """Return the panel with a line per step from its start to its end (2,) [s], first on top."""
    names = tuple(spans)[::-1]
    lines = [Series("", spans[name], np.full(2, float(k))) for k, name in enumerate(names)]
    return Panel(Axis(Scale("step", labels=names), lines), height=max(FLAT, A_NAME * len(names)))
