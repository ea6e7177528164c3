"""All figures of a run folder, from its files alone."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from softsim.errors import OutputError
from softsim.output.fields import read_frames
from softsim.output.folder import HISTORY, RESULTS
from softsim.output.history import read_history
from softsim.report.curves import (
    History,
    displacement,
    draw_contact_rows,
    draw_displacement_pressure,
    draw_energies,
    has,
    pressurised,
)
from softsim.report.moments import moments
from softsim.report.snapshots import draw_snapshots

Drawing = Callable[[History, Path], None]

CURVES: dict[str, tuple[Drawing, tuple[str, ...]]] = {
    "displacement_pressure.png": (draw_displacement_pressure, ("frame_x", "body_x")),
    "energies.png": (draw_energies, ("internal_energy", "kinetic_energy", "external_work")),
    "contact_rows.png": (draw_contact_rows, ("rows_in_contact", "wall_force_normal")),
}
"""Figure -> how it is drawn, and the columns of which it needs one."""

SNAPSHOTS = "snapshots.png"


def draw_all(folder: Path, snapshot_field: str) -> list[Path]:
    """Draw the figures that the files of `folder` have the data for; the figures' paths.

    snapshot_field: what the snapshots are coloured by: stretch, von_mises, pressure, displacement.
    A run without field output has no snapshots, one without contact no contact figure.
    Raises OutputError if the history is missing or empty, the results do not have
    `snapshot_field`, or the disk refuses.
    """
    history = read_history(folder / HISTORY)
    if len(history["time"]) == 0:
        raise OutputError(
            f"{folder / HISTORY} has no rows yet, there is nothing to draw",
            hint="the run was stopped before its first sample: run longer or sample more often",
        )
    drawn = []
    for name, (draw, columns) in CURVES.items():
        if any(has(history, column) for column in columns):
            draw(history, folder / name)
            drawn.append(folder / name)
    if (folder / RESULTS).exists():
        _draw_snapshots_of_run(history, folder, snapshot_field)
        drawn.append(folder / SNAPSHOTS)
    return drawn


def _draw_snapshots_of_run(history: History, folder: Path, field: str) -> None:
    time = history["time"]
    pressure = history["pressure"] if pressurised(history) else None
    moving = has(history, "frame_x") or has(history, "body_x")
    at = moments(
        time,
        np.zeros(len(time)) if pressure is None else pressure,
        displacement(history) if moving else np.zeros(len(time)),
    )
    draw_snapshots(read_frames(folder / RESULTS), at, time, pressure, field, folder / SNAPSHOTS)
