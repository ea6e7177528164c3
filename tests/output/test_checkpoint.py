"""Checkpoints keep every bit, and say what is wrong with a file that is none."""

import json

import numpy as np
import pytest

from softsim.errors import OutputError, SceneError
from softsim.output.folder import Checkpoint, read_checkpoint, write_checkpoint
from softsim.scene.loading import load_scene

SCENE_OF_FILES = """
bodies:
  b: {mesh: {file: m.inp}, formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10}
environment:
  walls: {ground: {kind: polyline, file: ground.txt}}
time: {end: 1 s}
"""


def test_round_trip_to_the_bit(tmp_path):
    rng = np.random.default_rng(0)
    memory = {"nodes/position": rng.standard_normal((1, 5, 2)), "a/0/touching": np.arange(3)}
    progress = {"time": 0.1 + 0.2, "increments": 7}
    places = rng.standard_normal((5, 2))
    files = {"parts/m.inp": "0f"}
    kept = Checkpoint(memory, progress, places, "scene: text\n", "cpu", files)
    write_checkpoint(tmp_path / "c.h5", kept)
    read = read_checkpoint(tmp_path / "c.h5")
    assert read.progress == progress
    np.testing.assert_array_equal(read.inspected, places)
    assert (read.scene, read.device, read.files) == ("scene: text\n", "cpu", files)
    assert read.state.keys() == memory.keys()
    for name, array in memory.items():
        np.testing.assert_array_equal(read.state[name], array)


def test_no_checkpoint(tmp_path):
    with pytest.raises(OutputError, match="no checkpoint"):
        read_checkpoint(tmp_path / "c.h5")


def test_a_broken_checkpoint(tmp_path):
    (tmp_path / "c.h5").write_bytes(b"not hdf5")
    with pytest.raises(OutputError, match="not a readable checkpoint"):
        read_checkpoint(tmp_path / "c.h5")


def small(path):
    """A checkpoint of some numbers of each kind, and an array without any."""
    state = {
        "nodes/position": np.linspace(0.0, 1.0, 10).reshape(1, 5, 2),
        "a/0/touching": np.arange(3),
        "b/flags": np.array([True, False]),
        "c/none": np.zeros((1, 0, 3)),
    }
    kept = Checkpoint(state, {"time": 0.1}, np.zeros((5, 2)), "scene: text\n", "cpu")
    write_checkpoint(path, kept)
    return kept


def test_a_flipped_bit_is_told_or_changes_nothing(tmp_path):
    """A bit of each seventh byte: of arrays, texts, and what HDF5 writes around them."""
    kept = small(tmp_path / "c.h5")
    whole, told = (tmp_path / "c.h5").read_bytes(), 0
    for place in range(0, len(whole), 7):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << place % 8
        (tmp_path / "c.h5").write_bytes(damaged)
        try:
            read = read_checkpoint(tmp_path / "c.h5")
        except OutputError:
            told += 1
            continue
        assert (read.progress, read.scene, read.device) == (kept.progress, kept.scene, kept.device)
        assert read.state.keys() == kept.state.keys()
        for name, array in kept.state.items():
            np.testing.assert_array_equal(read.state[name], array)
    assert told > 100


def test_a_truncated_checkpoint_is_told_wherever_it_ends(tmp_path):
    small(tmp_path / "c.h5")
    whole = (tmp_path / "c.h5").read_bytes()
    for size in range(0, len(whole), 97):
        (tmp_path / "c.h5").write_bytes(whole[:size])
        with pytest.raises(OutputError, match="not a readable checkpoint") as told:
            read_checkpoint(tmp_path / "c.h5")
        assert "remove it" in told.value.hint


@pytest.mark.parametrize(
    ("there", "here", "differs"),
    [
        ({"a": 1, "b": {"c": 2, "d": 3}}, {"a": 1, "b": {"c": 2, "d": 4}}, "b.d"),
        ({"a": [1, 2]}, {"a": [1, 3]}, "a"),
        ({"loads": {"air": 1}}, {"loads": {"air": 1, "motor": 2}}, "loads.motor"),
        ({"loads": {"air": {"kind": "x"}}}, {"loads": {}}, "loads.air"),
        ({"b": {"c": 2, "d": 3}}, {"b": {"d": 3, "c": 2}}, "order of keys"),
    ],
)
def test_the_first_difference_of_two_scenes_is_told(there, here, differs):
    checkpoint = Checkpoint({}, {}, np.zeros((0, 2)), json.dumps(there), "cpu")
    assert checkpoint.differing_key(json.dumps(here)) == differs
    assert not checkpoint.differing_key(checkpoint.scene)


def test_a_changed_file_of_the_scene_is_named(tmp_path):
    (tmp_path / "s.yaml").write_text(SCENE_OF_FILES, encoding="utf-8")
    for name in ("m.inp", "ground.txt"):
        (tmp_path / name).write_text("1, 0, 0", encoding="utf-8")
    loaded = load_scene(tmp_path / "s.yaml")
    scene = loaded.scene.model_dump_json()
    checkpoint = Checkpoint({}, {}, np.zeros((0, 2)), scene, "cpu", loaded.file_digests())
    assert sorted(checkpoint.files) == ["ground.txt", "m.inp"]
    assert checkpoint.mismatch(loaded) == ""

    other = load_scene(tmp_path / "s.yaml", ["time.end=2 s"])
    assert checkpoint.mismatch(other) == "was computed with another time.end"
    (tmp_path / "m.inp").write_text("1, 0, 1", encoding="utf-8")
    assert checkpoint.mismatch(loaded) == "was computed before m.inp changed"
    (tmp_path / "ground.txt").unlink()
    with pytest.raises(SceneError, match=r"there is no file .*ground\.txt"):
        checkpoint.mismatch(loaded)
