"""All figures of a run folder, from its files alone."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from softsim.output.fields import Frames
from softsim.report.curves import (
    History,
    contacts_drawn,
    displacement,
    draw_contact_rows,
    draw_displacement_pressure,
    draw_energies,
    draw_pull,
    energies_drawn,
    has,
    pressurised,
    travelling_column,
    travels,
)
from softsim.report.layout import draw_layout
from softsim.report.moments import moments
from softsim.report.probes import curves_of, draw_pressure_probe, draw_probes, inflation_curves
from softsim.report.recorded import recorded
from softsim.report.snapshots import draw_snapshots

Units = Mapping[str, str]
Content = Callable[[History, Units], object]
Drawing = Callable[[History, Units, Path], None]

CURVES: dict[str, tuple[Content, Drawing]] = {
    "displacement_pressure.png": (
        lambda history, _: travels(history) or pressurised(history),
        lambda history, _, path: draw_displacement_pressure(history, path),
    ),
    "energies.png": (
        lambda history, _: energies_drawn(history),
        lambda history, _, path: draw_energies(history, path),
    ),
    "contact_rows.png": (
        lambda history, _: contacts_drawn(history),
        lambda history, _, path: draw_contact_rows(history, path),
    ),
    "pull.png": (
        lambda history, _: has(history, "pull"),
        lambda history, _, path: draw_pull(history, path),
    ),
    "probes.png": (curves_of, draw_probes),
    "pressure_probe.png": (inflation_curves, draw_pressure_probe),
}
"""Figure -> whether a history has something to show in it, and how it is drawn."""

SNAPSHOTS, LAYOUT = "snapshots.png", "layout.png"


def draw_all(folder: Path, snapshot_field: str) -> list[Path]:
    """Draw the figures that the files of `folder` have the data for; the figures' paths.

    snapshot_field: what the snapshots are coloured by: stretch, von_mises, pressure, displacement.
    A run without field output has no snapshots, one without contact no contact figure: one that
    an earlier run left in the folder goes.
    Raises OutputError if the history is missing or empty, the results do not have
    `snapshot_field`, or the disk refuses.
    """
    run = recorded(folder)
    history, units, frames = run.history, run.units, run.frames
    drawn = []
    for name, (content, draw) in CURVES.items():
        if content(history, units):
            draw(history, units, folder / name)
            drawn.append(folder / name)
        else:
            (folder / name).unlink(missing_ok=True)
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
    pressure = history["pressure"] if pressurised(history) else None
    # Only a robot, which has a frame, sets off; a body that merely deforms does not.
    sets_off = travels(history) and travelling_column(history).startswith("frame")
    at = moments(
        time,
        np.zeros(len(time)) if pressure is None else pressure,
        displacement(history) if sets_off else np.zeros(len(time)),
    )
    draw_snapshots(frames, at, time, pressure, field, path)
