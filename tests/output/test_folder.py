"""The run folder: files are whole or not there, and a disk that refuses is named."""

import json
import math
import os
from collections import namedtuple
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.errors import OutputError
from softsim.output import folder as folder_module
from softsim.output.folder import RunFolder, explained, replacing

Usage = namedtuple("Usage", "total used free")


def test_the_folder_is_made_with_its_parents_and_left_clean(tmp_path: Path) -> None:
    run = RunFolder(tmp_path / "study" / "run 1")
    assert run.path.is_dir() and not list(run.path.iterdir())


def test_a_file_in_the_way_is_named(tmp_path: Path) -> None:
    (tmp_path / "run").write_text("not a folder")
    with pytest.raises(OutputError, match=r"cannot write to the run folder .*run") as refused:
        RunFolder(tmp_path / "run")
    assert "--out" in refused.value.hint


def test_a_full_disk_is_refused_before_the_run(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(folder_module.shutil, "disk_usage", lambda _: Usage(2**30, 2**30, 2**20))
    with pytest.raises(OutputError, match=r"has 1\.0 MiB left; a run needs at least 64\.0 MiB"):
        RunFolder(tmp_path / "run")


def test_text_takes_the_place_of_the_old(tmp_path: Path) -> None:
    run = RunFolder(tmp_path)
    run.write_text_atomic("run.log", "old")
    run.write_text_atomic("run.log", "neu, µm")
    assert (tmp_path / "run.log").read_text(encoding="utf-8") == "neu, µm"
    assert [f.name for f in tmp_path.iterdir()] == ["run.log"]


def test_a_failure_on_the_way_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text("old")
    with pytest.raises(KeyError), replacing(tmp_path / "summary.json") as partial:
        partial.write_text("half")
        raise KeyError
    assert (tmp_path / "summary.json").read_text() == "old"
    assert [f.name for f in tmp_path.iterdir()] == ["summary.json"]


def test_a_refused_write_names_the_file_and_the_room(tmp_path: Path) -> None:
    full = OSError(28, os.strerror(28))
    said = r"history\.csv: No space left.*MiB free"
    with pytest.raises(OutputError, match=said) as refused, explained(tmp_path / "history.csv"):
        raise full
    assert refused.value.__cause__ is full


def test_a_folder_that_has_gone_is_named(tmp_path: Path) -> None:
    run = RunFolder(tmp_path / "run")
    run.path.rmdir()
    with pytest.raises(OutputError, match=r"summary\.json.*its folder .*run does not exist"):
        run.write_json_atomic("summary.json", {})


def test_json_holds_numpy_values_and_paths_as_plain_ones(tmp_path: Path) -> None:
    RunFolder(tmp_path).write_json_atomic(
        "summary.json",
        {
            "status": "done",
            "node_count": np.int64(1750),
            "energy_error": np.float64(0.25),
            "poses": np.array([[1.0, np.nan]]),
            "scene": Path("scenes") / "pfr.yaml",
            "nested": {"converged": np.bool_(True), "limits": (1.0, math.inf)},
        },
    )
    assert json.loads((tmp_path / "summary.json").read_text()) == {
        "status": "done",
        "node_count": 1750,
        "energy_error": 0.25,
        "poses": [[1.0, None]],
        "scene": str(Path("scenes") / "pfr.yaml"),
        "nested": {"converged": True, "limits": [1.0, None]},
    }


@given(value=st.floats(allow_subnormal=False))
def test_a_number_survives_json_bit_by_bit_or_is_null(value: float, tmp_path_factory) -> None:
    path = tmp_path_factory.mktemp("run")
    RunFolder(path).write_json_atomic("summary.json", {"value": value})
    read = json.loads((path / "summary.json").read_text())["value"]
    assert read == (value if math.isfinite(value) else None)


def test_what_json_cannot_hold_is_a_mistake_and_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(TypeError):
        RunFolder(tmp_path).write_json_atomic("summary.json", {"mesh": object()})
    assert not list(tmp_path.iterdir())
