"""`softsim chain` as a user types it."""

import json

import pytest
from typer.testing import CliRunner

from softsim.cli import app
from softsim.output.history import read_history


def chain(*arguments):
    return CliRunner().invoke(app, ["chain", *map(str, arguments)])


def test_a_chain_is_run_and_drawn(tmp_path):
    done = chain(
        "leafbot3", "--frequency", "132 Hz", "--slope", "10 deg", "--set", "time.end=0.2 s",
        "--out", tmp_path / "out",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    assert "mm/s" in done.output and "results in" in done.output
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["node_count"] == 3
    figure = tmp_path / "out" / "chain.png"
    assert figure.stat().st_size > 20_000
    figure.unlink()
    assert CliRunner().invoke(app, ["report", str(tmp_path / "out")]).exit_code == 0
    assert figure.is_file()


def test_two_motors_are_run_and_their_tracks_drawn(tmp_path):
    done = chain(
        "leafbot_x5", "--frequency", "150 Hz", "--set", "sides.running=right",
        "--set", "limbs.thrust=all", "--set", "time.end=0.2 s", "--out", tmp_path / "out",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    assert "1/mm to the left" in done.output
    told = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert told["heads"] == [3, 8] and told["curvature"] > 0.0
    history = read_history(tmp_path / "out" / "history.csv")
    between = 0.5 * (history["y3"] + history["y8"])
    assert history["centre_y"] == pytest.approx(between, abs=1e-12)
    assert (tmp_path / "out" / "chain.png").stat().st_size > 20_000


@pytest.mark.parametrize(
    "arguments",
    [["leafbot5", "--slope", "95 deg"], ["leafbot5", "--frequency", "142"], ["leafbot"]],
)
def test_bad_input_ends_with_code_2(tmp_path, arguments):
    done = chain(*arguments, "--out", tmp_path / "out")
    assert done.exit_code == 2 and not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    assert chain("leafbot5", "--out", tmp_path / "file" / "out").exit_code == 2
