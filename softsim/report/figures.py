"""All figures of a run folder, drawn from its files alone."""

from pathlib import Path

import numpy as np

from softsim.output.fields import Frames
from softsim.output.travel import History, displacement, travelling_column, travels
from softsim.report.curves import chamber_pressures, single_pressure
from softsim.report.layout import draw_layout
from softsim.report.moments import moments
from softsim.report.png import draw
from softsim.report.recorded import recorded
from softsim.report.signals import TITLES, signals
from softsim.report.snapshots import draw_snapshots

SNAPSHOTS, LAYOUT = "snapshots.png", "layout.png"


def draw_all(folder: Path, snapshot_field: str) -> list[Path]:
    """Draw the figures for which the files of `folder` have data; return the figures' paths.

    snapshot_field: the field that colours the snapshots: stretch, von_mises, pressure,
    displacement. A run without field output has no snapshots, one without contact no contact
    figure; such a figure left by an earlier run is deleted. Raises OutputError if the history
    is missing or empty, the results lack `snapshot_field`, or a file cannot be written.
    """
    run = recorded(folder)
    history, frames = run.history, run.frames
    drawn, curves = [], signals(history, run.units)
    for name in TITLES:
        path = folder / f"{name}.png"
        if name in curves:
            draw(path, curves[name])
            drawn.append(path)
        else:
            path.unlink(missing_ok=True)
    if frames is not None:
        _draw_snapshots_of_run(history, frames, snapshot_field, folder / SNAPSHOTS)
        drawn.append(folder / SNAPSHOTS)
    if frames is not None and run.layout is not None:
        draw_layout(history, frames, run.layout, folder / LAYOUT)
        drawn.append(folder / LAYOUT)
    else:
        (folder / LAYOUT).unlink(missing_ok=True)
    return drawn


def _draw_snapshots_of_run(history: History, frames: Frames, field: str, path: Path) -> None:
    time = history["time"]
    # Only a robot, which has a frame, sets off; a body that merely deforms does not.
    sets_off = travels(history) and travelling_column(history).startswith("frame")
    at = moments(
        time,
        chamber_pressures(history),
        displacement(history) if sets_off else np.zeros(len(time)),
    )
    draw_snapshots(frames, at, time, single_pressure(history), field, path)
