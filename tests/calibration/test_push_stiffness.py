"""Stiffness from the force after a move."""

import numpy as np
import pytest

from softsim.apps.calibration.experiments import Move, stiffness

MOVE = Move("y", 1e-4, begin=1.0, end=1.1, until=1.5, rest=0.1)


def history(stiffness_value, swing=0.0):
    """A spring that already pushes with 2 N, then gives way to the move; it may swing after it."""
    time = np.linspace(0.0, 2.0, 2001)
    course = np.interp(time, [MOVE.begin, MOVE.end], [0.0, MOVE.distance])
    force = 2.0 - stiffness_value * course
    force[time > MOVE.end] += swing * np.sin(2.0 * np.pi * time[time > MOVE.end] / 0.05)
    return {"time": time, "wall_force_y": force}


def test_the_force_that_was_there_before_does_not_count():
    found = stiffness(history(300.0), MOVE)
    assert found.value == pytest.approx(300.0, rel=1e-9)
    assert found.unrest < 1e-9


def test_what_still_swings_is_told():
    found = stiffness(history(300.0, swing=0.003), MOVE)
    # Two whole periods of the swing lie in the rest, whose samples miss its mean by 1/100 of it.
    assert found.value == pytest.approx(300.0, rel=0.1 * 0.01)
    assert found.unrest == pytest.approx(0.1, rel=0.01)


def test_a_frame_that_nothing_holds_has_no_stiffness():
    found = stiffness(history(0.0), MOVE)
    assert found.value == 0.0
    assert found.unrest == np.inf
