"""Cycles of a pressure profile, and walks whose begin and end are known by construction."""

import numpy as np
import pytest

from softsim.loads.profile import Profile, cycles, natural_deflation
from softsim.output.motion import Cycle, cycles_of, forward_walk, walk_pressures


def test_cycles_end_after_their_rest():
    """Rises of 1 and 0.5 s, holds of 2, falls of 5, rests of 3 s, after a second of nothing."""
    profile = cycles(10e3, 10e3, 2.0, 1e3, 5e3, 3.0, 2, 1.0)
    assert cycles_of(profile) == [Cycle(4.0, 9.0, 12.0), Cycle(14.5, 19.5, 22.5)]


def test_a_curved_fall_is_one_fall():
    profile = natural_deflation(10e3, 10e3, 1.0, 2.0, 10e3 / np.e, 2, 0.0)
    rise = 1.0 - 1.0 / np.e
    expected = [(2.0, 4.0, 4.0), (5.0 + rise, 7.0 + rise, 7.0 + rise)]
    found = [(c.fall_begin, c.fall_end, c.end) for c in cycles_of(profile)]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("values", [[0.0, 5e3, 5e3], [3e3, 3e3, 3e3], [0.0, 1e3, 2e3]])
def test_a_pressure_that_does_not_fall_has_no_cycle(values):
    assert cycles_of(Profile(np.arange(3.0), np.array(values))) == []


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
