"""Rows that touch, from a frame: which nodes lie behind a wall."""

import numpy as np

from softsim.output.fields import FieldWriter
from softsim.output.folder import RESULTS
from validation.cases import Outcome
from validation.touch import ROWS, rows_touching

DIAMETER = 30e-3  # m
POINTS = np.array([[-6e-3 * k, 13e-3] for k in range(5)] + [[0.0, -13e-3]])
"""A tip a row, above; the last node is one of the first row, below."""


def written(folder, displacement):
    writer = FieldWriter(folder / RESULTS, POINTS, np.array([[0, 1, 5], [2, 3, 4]]))
    nodes = {f"skin.{name}": np.array([k]) for k, name in enumerate(ROWS)}
    nodes["skin.j1"] = np.array([0, 5])
    half = DIAMETER / 2
    walls = np.array([[0.0, half, 0.0, -1.0], [0.0, -half, 0.0, 1.0]])
    writer.describe(walls=walls, sets=nodes)
    for time, y in displacement.items():
        moved = np.column_stack([np.zeros(len(y)), y])
        writer.append(time, {"displacement": moved}, {"stretch": np.ones(2)})
    return Outcome("a", folder)


def test_rows_behind_a_wall_touch_at_that_time(tmp_path):
    outwards = [1.9e-3, 2.001e-3, 0.0, 2.01e-3, -3e-3]
    outcome = written(tmp_path, {0.0: [0.0] * 6, 0.6: [*outwards, -2.001e-3], 1.2: [0.0] * 6})
    # The first row touches below, the second and fourth above.
    assert rows_touching(outcome, 0.62).tolist() == [True, True, False, True, False]
    assert not rows_touching(outcome, 0.1).any()


def test_a_failed_run_cannot_be_told(tmp_path):
    assert rows_touching(Outcome("a", tmp_path, failure="it broke"), 0.6) is None
    assert rows_touching(Outcome("a", failure="not run"), 0.6) is None
