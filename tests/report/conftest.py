"""Run folders made up for the figures: a strip that bends between two walls, then creeps along; a
ring that swells; a box that leans over."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from browsers import Browser, started_browser

from softsim.mesh.mesh import Mesh
from softsim.output.fields import FieldWriter
from softsim.output.folder import HISTORY, RESULTS
from softsim.output.history import History
from softsim.robots.block import block, box

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


def write_ramp(folder: Path, mesh: Mesh, direction: np.ndarray, **columns: tuple[str, float]):
    """A static run in which all grows from zero, for 1 s: the field writer, to describe the rest.

    direction: displacement of each node at the end (n, d). columns: name -> unit, end value.
    """
    ends = {**columns, "unbalanced_share": ("-", 1e-6)}
    history = History(folder / HISTORY, {"time": "s", **{n: unit for n, (unit, _) in ends.items()}})
    writer = FieldWriter(folder / RESULTS, mesh.points, mesh.cells)
    size = np.linalg.norm(direction[mesh.cells].mean(axis=1), axis=1)
    for time in np.linspace(0.0, 1.0, 11):
        history.append({"time": time, **{n: end * time for n, (_, end) in ends.items()}})
        fields = {"stretch": 1.0 + 100.0 * time * size}
        writer.append(time, {"displacement": time * direction}, fields)
    history.close()
    return writer


@pytest.fixture(scope="session")
def ring_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A static axisymmetric run in a pipe, with a displacement and a volume probe."""
    folder = tmp_path_factory.mktemp("ring_run")
    mesh = block(2e-3, 6e-3, 1e-3)
    mesh = Mesh(mesh.points + np.array([7e-3, 0.0]), mesh.cells)
    outward = np.column_stack([np.full(len(mesh.points), 1e-3), np.zeros(len(mesh.points))])
    writer = write_ramp(
        folder, mesh, outward,
        pressure=("Pa", 6e3), body_x=("m", 1e-3), body_y=("m", 1e-11),
        rows_in_contact=("-", 0.0), internal_energy=("J", 1e-3), friction_dissipation=("J", 0.0),
        equator_x=("m", 1e-3), equator_y=("m", 1e-12), chamber=("m^3", 4e-6),
    )  # fmt: skip
    writer.describe(walls=np.array([[12e-3, 0.0, -1.0, 0.0]]), formulation="axisymmetric")
    return folder


@pytest.fixture(scope="session")
def box_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run in space on a floor and in a pipe, without pressure, with a reaction probe."""
    folder = tmp_path_factory.mktemp("box_run")
    mesh = box(12e-3, 4e-3, 4e-3, 2e-3)
    leaning = mesh.points[:, :1] * [0.0, 0.2, 0.0]
    writer = write_ramp(
        folder, mesh, leaning,
        body_x=("m", 1e-5), body_y=("m", 1e-3), body_z=("m", 0.0),
        wall_force_normal=("N", 0.0), external_work=("J", 1e-3),
        clamp_x=("N", 0.2), clamp_y=("N", -0.1), clamp_z=("N", 0.0),
    )  # fmt: skip
    writer.describe(
        walls=np.array([[0.0, -1e-3, 0.0, 0.0, 1.0, 0.0]]),
        pipes=np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 9e-3]]),
    )
    return folder


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """One browser for all tests of a session."""
    with started_browser(tmp_path_factory.mktemp("browser")) as started:
        yield started
