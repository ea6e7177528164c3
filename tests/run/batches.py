"""A strip that falls on a floor, and what runs of it have left behind."""

import json

import numpy as np
from rich.console import Console

from softsim.output.fields import read_frames

FALLING_STRIP = """
title: A strip falls on a floor
bodies:
  strip: {mesh: {generator: block, length: 10 mm, height: 2 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10,
          position: [0 mm, 1 mm]}
environment: {inclination: 10 deg, walls: {floor: {kind: plane}}}
time: {end: 60 ms}
output: {history_interval: 1 ms, frame_interval: 10 ms, checkpoint_interval: 5 ms}
"""


def finished(batch):
    """What a batch of one has found at its end."""
    [outcome] = batch.run(Console(quiet=True))
    if isinstance(outcome, Exception):
        raise outcome
    return outcome


def status(folder):
    return json.loads((folder / "summary.json").read_text())["status"]


def same_files(one, other):
    assert (one / "history.csv").read_bytes() == (other / "history.csv").read_bytes()
    a, b = read_frames(one / "results.vtkhdf"), read_frames(other / "results.vtkhdf")
    np.testing.assert_array_equal(a.times, b.times)
    for k in range(len(a)):
        np.testing.assert_array_equal(
            a.point_data["displacement"][k], b.point_data["displacement"][k]
        )
