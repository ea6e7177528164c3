"""Run folders made up for the figures: a strip that bends between two walls, then creeps along."""

from pathlib import Path

import numpy as np
import pytest

from softsim.output.fields import FieldWriter
from softsim.output.folder import HISTORY, RESULTS
from softsim.output.history import History

UNITS = {
    "time": "s", "pressure": "Pa", "frame_x": "m", "rows_in_contact": "-",
    "wall_force_normal": "N", "internal_energy": "J", "kinetic_energy": "J", "energy_error": "-",
}  # fmt: skip

FULL_AT, MOVES_AT, END = 1.0, 2.0, 4.0


def pressure(time: float) -> float:
    return float(np.interp(time, [0.0, FULL_AT, 1.2, END], [0.0, 5e3, 5e3, 1e3]))


def travel(time: float) -> float:
    return 4e-3 * max(time - MOVES_AT, 0.0)


def write_history(folder: Path, rows: int) -> None:
    history = History(folder / HISTORY, UNITS)
    for time in np.linspace(0.0, END, rows):
        swing = np.sin(2 * np.pi * 64 * time)
        history.append(
            {
                "time": time,
                "pressure": pressure(time),
                "frame_x": travel(time) + 1e-4 * swing,
                "rows_in_contact": round(pressure(time) / 1250),
                "wall_force_normal": pressure(time) * 1e-4,
                "internal_energy": 1e-9 * pressure(time),
                "kinetic_energy": 1e-8 * swing**2,
                "energy_error": 1e-4 * swing,
            }
        )
    history.close()


def write_results(folder: Path) -> None:
    x, y = np.meshgrid(np.linspace(-15e-3, 15e-3, 31), [8e-3, 9e-3], indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel()])
    corner = 2 * np.arange(30)
    cells = np.column_stack([corner, corner + 2, corner + 3, corner + 1])
    writer = FieldWriter(folder / RESULTS, points, cells)
    writer.describe(
        walls=np.array([[0.0, -15e-3, 0.0, 1.0], [0.0, 15e-3, 0.0, -1.0]]),
        outlines=np.array([[0.0, 0.0, 33e-3, 12e-3]]),
        title="strip between walls",
    )
    for time in np.linspace(0.0, END, 41):
        bulge = pressure(time) * 1e-6 * np.cos(np.pi * points[:, 0] / 30e-3)
        moved = np.column_stack([np.full(len(points), travel(time)), bulge])
        writer.append(
            time,
            {"displacement": moved},
            {"stretch": 1.0 + 50.0 * bulge[cells].mean(axis=1)},
            extra={"frame_pose": np.array([[travel(time), 0.0, 0.0]])},
        )


@pytest.fixture(scope="session")
def strip_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run: history.csv with vibration, results.vtkhdf."""
    folder = tmp_path_factory.mktemp("strip_run")
    write_history(folder, rows=4001)
    write_results(folder)
    return folder
