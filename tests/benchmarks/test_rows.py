"""The table of the benchmarks and its JSON."""

import io
import json
import subprocess
import sys

import pytest
import typer
from rich.console import Console

import benchmarks.__main__ as command
from benchmarks import flex
from benchmarks.gpu import bytes_an_increment
from benchmarks.scenes import ROOT, block
from benchmarks.solver_process import SolverProcess
from benchmarks.table import Row, limit_row, machine, ratio_row, show, write_json


def test_rows_say_whether_the_target_is_met():
    assert ratio_row("a", 40.0, 100.0, 0.5).met is False
    assert ratio_row("a", 50.0, 100.0, 0.5).met is True
    assert limit_row("b", 2.9, "s", 3.0).met is True
    assert limit_row("b", 3.1, "s", 3.0).met is False


def test_without_a_compiler_there_is_no_ratio():
    row = ratio_row("a", 40.0, None, 0.5)
    assert (row.rate, row.ceiling, row.ratio, row.met) == (40.0, None, None, None)


def test_json_and_table_hold_every_row(tmp_path):
    rows = [ratio_row("fast", 60.0, 100.0, 0.5), Row("other", 7.0, "GB/s", remark="said")]
    write_json(tmp_path / "rows.json", rows, machine())
    written = json.loads((tmp_path / "rows.json").read_text())
    assert written["cores"] >= 1
    assert written["precision"] == "f64"
    assert "taichi" in written["versions"]
    assert written["rows"][0] == {
        "name": "fast", "rate": 60.0, "unit": "M/s", "ceiling": 100.0, "ratio": 0.6,
        "target": ">= 0.5", "met": True, "remark": "",
    }  # fmt: skip
    text = io.StringIO()
    show(Console(file=text, width=100), rows, machine())
    assert all(word in text.getvalue() for word in ("fast", "0.6", "met", "other", "said"))


@pytest.mark.physics
def test_a_worker_builds_a_mesh_and_measures_it(tmp_path, monkeypatch, kernel_cache):
    monkeypatch.setenv("SOFTSIM_CACHE", str(kernel_cache))
    with SolverProcess(block(tmp_path, "triangles", 200)) as solver:
        assert solver.element_count == 200
        solver.start(5)
        assert solver.rate() > 0.0
    assert solver.process.returncode == 0


@pytest.mark.physics
def test_an_unknown_measurement_is_refused():
    command = [sys.executable, "-m", "benchmarks", "--only", "everything"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 2
    assert "everything" in done.stderr


@pytest.mark.parametrize(("installed", "used"), [("3.17.0", None), ("4.0.0", "4.0.0")])
def test_a_mujoco_with_other_elastic_constants_is_not_used(monkeypatch, installed, used):
    monkeypatch.setattr(flex, "version", lambda name: installed)
    assert flex.mujoco_version() == used


def test_without_mujoco_its_row_is_left_out(monkeypatch, capsys):
    monkeypatch.setattr(command, "mujoco_version", lambda: None)
    with pytest.raises(typer.BadParameter, match="flex: there is pfr"):
        command.main(only=["flex"])
    assert "the row flex is left out" in capsys.readouterr().out


def test_bytes_of_an_increment(build):
    """Two triangles on four nodes, counted by hand: x, v, J in and out for each scenario; three
    corners, four gradient components, volume of each triangle, mass and volume of each node once.
    """
    model = build(
        """
        bodies:
          block: {mesh: {generator: block, length: 1 mm, height: 1 mm, element_size: 1 mm},
                  formulation: plane_strain, thickness: 1 mm, material: rubber, fixed: [bottom]}
        materials:
          rubber: {law: yeoh, C10: 36 kPa, density: 1000 kg/m^3}
        time: {end: 1 s}
        """
    )
    each, once = 4 * 5 * 2 * 8, 2 * (3 * 4 + 5 * 8) + 4 * 2 * 8
    assert bytes_an_increment(model, 1) == each + once
    assert bytes_an_increment(model, 64) == 64 * each + once
