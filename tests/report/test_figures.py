"""The figures of a run folder: which are drawn, and what is said when they cannot be."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from softsim.errors import OutputError
from softsim.output.folder import HISTORY, RESULTS
from softsim.output.history import History
from softsim.report.diagram import Diagram, Panel, PlotAxis, PlotSeries, Scale
from softsim.report.figures import draw_all
from softsim.report.png import draw

FIGURES = ["displacement_pressure.png", "energies.png", "contact_rows.png", "snapshots.png"]
"""Of the strip."""


def test_a_full_run_gets_every_figure_and_no_other_file(strip_run: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(strip_run, tmp_path / "run")
    drawn = draw_all(folder, "stretch")
    assert drawn == [folder / name for name in FIGURES]
    assert {f.name for f in folder.iterdir()} == {HISTORY, RESULTS, *FIGURES}
    for path in drawn:
        picture = imread(path)
        assert picture.shape[1] > 1400
        assert picture[..., :3].std() > 0.02, f"{path.name} is blank"


def test_an_axisymmetric_run_gets_its_figures(ring_run: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(ring_run, tmp_path / "run")
    names = ["displacement_pressure.png", "energies.png", "probes.png", "pressure_probe.png"]
    assert draw_all(folder, "stretch") == [folder / name for name in (*names, "snapshots.png")]


def test_a_run_in_space_gets_its_figures(box_run: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(box_run, tmp_path / "run")
    names = ["displacement_pressure.png", "energies.png", "probes.png", "snapshots.png"]
    assert draw_all(folder, "displacement") == [folder / name for name in names]


@pytest.mark.physics
def test_figures_that_an_earlier_run_left_go(box_run: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(box_run, tmp_path / "run")
    (folder / "contact_rows.png").touch()
    (folder / "mine.png").touch()
    draw_all(folder, "stretch")
    assert not (folder / "contact_rows.png").exists()
    assert (folder / "mine.png").exists()


def test_a_run_without_fields_or_contact_gets_the_figures_it_has_data_for(tmp_path: Path) -> None:
    history = History(tmp_path / HISTORY, {"time": "s", "body_x": "m", "internal_energy": "J"})
    for time in (0.0, 0.1, 0.2):
        history.append({"time": time, "body_x": time**2, "internal_energy": 1e-4 * time})
    history.close()
    assert [f.name for f in draw_all(tmp_path, "stretch")] == FIGURES[:2]


def test_a_run_of_one_row_is_drawn(tmp_path: Path) -> None:
    columns = {"time": 0.0, "frame_x": 0.0, "pressure": 1e3, "internal_energy": 1e-3}
    history = History(tmp_path / HISTORY, dict.fromkeys(columns, "-"))
    history.append(columns)
    history.close()
    assert [f.name for f in draw_all(tmp_path, "stretch")] == FIGURES[:2]


def test_a_run_in_which_nothing_happens_has_no_figures(tmp_path: Path) -> None:
    columns = {"frame_x": 0.01, "pressure": np.nan, "internal_energy": 0.0, "rows_in_contact": 0.0}
    history = History(tmp_path / HISTORY, dict.fromkeys(["time", *columns], "-"))
    for time in (0.0, 0.1):
        history.append({"time": time, **columns})
    history.close()
    assert draw_all(tmp_path, "stretch") == []


def test_a_logarithmic_axis_without_a_result_is_drawn(tmp_path: Path) -> None:
    """Of a study whose cases ended before what it asks for: places, and no value at any."""
    rates = np.array([1.3, 3.0, 10.0])
    nothing = PlotSeries("speed", rates, np.full(3, np.nan))
    panel = Panel(PlotAxis(Scale("speed", logarithmic=True), [nothing]))
    draw(tmp_path / "empty.png", Diagram("", Scale("rate", logarithmic=True), [panel]))
    assert imread(tmp_path / "empty.png").size


def test_a_missing_history_is_named(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"cannot read the history .*history\.csv"):
        draw_all(tmp_path, "stretch")


def test_an_empty_history_is_named(tmp_path: Path) -> None:
    History(tmp_path / HISTORY, {"time": "s", "frame_x": "m"}).close()
    with pytest.raises(OutputError, match="no rows yet"):
        draw_all(tmp_path, "stretch")


@pytest.mark.parametrize("field", ["colour", "von_mises"])
def test_a_field_that_is_not_there_is_named_with_those_that_are(
    strip_run: Path, tmp_path: Path, field: str
) -> None:
    folder = shutil.copytree(strip_run, tmp_path / "run")
    with pytest.raises(OutputError, match=field) as refused:
        draw_all(folder, field)
    assert "displacement, stretch" in refused.value.hint


def test_figures_are_drawn_without_taichi() -> None:
    code = "import sys, softsim.report.figures; sys.exit('taichi' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
