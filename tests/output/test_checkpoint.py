"""Checkpoints keep every bit, and say what is wrong with a file that is none."""

import numpy as np
import pytest

from softsim.errors import OutputError
from softsim.output.checkpoint import Checkpoint, read_checkpoint, write_checkpoint


def test_round_trip_to_the_bit(tmp_path):
    rng = np.random.default_rng(0)
    memory = {"nodes/position": rng.standard_normal((1, 5, 2)), "a/0/touching": np.arange(3)}
    progress = {"time": 0.1 + 0.2, "increments": 7}
    places = rng.standard_normal((5, 2))
    kept = Checkpoint(memory, progress, places, "scene: text\n", "cpu")
    write_checkpoint(tmp_path / "c.h5", kept)
    read = read_checkpoint(tmp_path / "c.h5")
    assert read.progress == progress
    np.testing.assert_array_equal(read.inspected, places)
    assert (read.scene, read.device) == ("scene: text\n", "cpu")
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
