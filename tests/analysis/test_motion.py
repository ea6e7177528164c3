"""Walks whose begin and end are known by construction."""

import numpy as np
import pytest

from softsim.analysis.measures import controlled_cycles
from softsim.analysis.travel import forward_walk, walk_pressures
from softsim.loads.pressure_control import Phase
from softsim.loads.profile import Cycle

ROWS = np.linspace(0.0, 10.0, 5001)
FALL = Cycle(0.0, 10.0, 10.0)
PRESSURE = np.interp(ROWS, [0.0, 10.0], [23e3, 13e3])  # 1 kPa/s


def test_pressures_of_onset_and_end():
    """Drawn back by 2 mm until 4 s, forward by 40 mm until 8 s, then still: 5 % of that is at 4.2,
    95 % at 7.8 s. Rows are 2 ms apart, 2 Pa.
    """
    x = np.interp(ROWS, [0.0, 4.0, 8.0, 10.0], [0.0, -2e-3, 38e-3, 38e-3])
    onset, end = walk_pressures(FALL, ROWS, x, PRESSURE)
    assert onset == pytest.approx(23e3 - 4.2e3, abs=2.1)
    assert end == pytest.approx(23e3 - 7.8e3, abs=2.1)


def test_noise_does_not_move_them_by_more_than_itself():
    """A vibration of 0.1 mm on a walk at 10 mm/s: it lengthens the walk by 0.2 mm, of which 5 %
    count, and each share is reached 0.21 mm, or 0.021 s, away at most; a row more.
    """
    x = np.interp(ROWS, [0.0, 4.0, 8.0, 10.0], [0.0, -2e-3, 38e-3, 38e-3])
    x += 1e-4 * np.sin(2.0 * np.pi * 192.0 * ROWS)
    onset, end = walk_pressures(FALL, ROWS, x, PRESSURE)
    assert onset == pytest.approx(23e3 - 4.2e3, abs=23.0)
    assert end == pytest.approx(23e3 - 7.8e3, abs=23.0)


def test_what_lies_outside_the_fall_does_not_count():
    """Of a robot that walks at 1 mm/s all the time, only the way between 2 and 6 s."""
    onset, end = walk_pressures(Cycle(2.0, 6.0, 10.0), ROWS, 1e-3 * ROWS, PRESSURE)
    assert onset == pytest.approx(23e3 - 2.2e3, abs=2.1)
    assert end == pytest.approx(23e3 - 5.8e3, abs=2.1)


@pytest.mark.parametrize(
    "places",
    [
        [0.0, 0.0, 0.0, 0.0],  # stands
        [0.0, -2e-3, 0.9e-3, 0.0],  # drawn back, springs forward by hardly more
        [0.0, 0.4e-3, -0.4e-3, 0.5e-3],  # swings
        [0.0, -20e-3, -40e-3, -40e-3],  # slides back
    ],
)
def test_a_robot_that_does_not_walk(places):
    x = np.interp(ROWS, [0.0, 4.0, 8.0, 10.0], places)
    assert walk_pressures(FALL, ROWS, x, PRESSURE) == (None, None)


def test_sliding_back_after_a_walk_leaves_the_walk():
    """In a vertical pipe a robot climbs, loses the wall and drops below where it began."""
    x = np.interp(np.arange(9), [0.0, 2.0, 6.0, 8.0], [0.0, 0.0, 40e-3, -60e-3])
    walk = forward_walk(x)
    assert (walk.onset, walk.end) == (3, 6)


def test_a_fall_without_rows():
    assert forward_walk(np.zeros(0)) is None


def test_cycles_of_a_controlled_pressure():
    """Rows 1 s apart: rest, up, hold, down; up, no hold, down; up again."""
    rest, up, hold, down = Phase.REST, Phase.INFLATION, Phase.HOLD, Phase.DEFLATION
    history = {
        "time": np.arange(9.0),
        "cycle": np.array([1, 1, 1, 1, 1, 2, 2, 3, 3], dtype=float),
        "phase": np.array([rest, up, hold, down, down, up, down, up, hold], dtype=float),
    }
    first, second = Cycle(2.0, 4.0, 4.0), Cycle(5.0, 6.0, 6.0)
    assert controlled_cycles(history) == [first, second]
    unfinished = {name: column[:7] for name, column in history.items()}
    assert controlled_cycles(unfinished) == [first]
    over = {**history, "cycle": np.minimum(history["cycle"], 2.0)}
    over["phase"] = np.where(history["cycle"] == 3.0, rest, history["phase"])
    assert controlled_cycles(over) == [first, second]
