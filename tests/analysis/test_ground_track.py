"""The track of a robot in space over the ground."""

import numpy as np
import pytest

from softsim.analysis.travel import track_report

SPEED, RADIUS = 0.1, 0.067  # m/s, m
TURN = 1.0 / 95.0
"""Period [s] of the motor."""


def circling(t, sense):
    """A robot on a circle to the left (sense 1), seen from above x forward and -z to the left,
    shaken by 1 mm along its way.
    """
    yaw = sense * SPEED / RADIUS * t
    shaking = 1e-3 * np.sin(2.0 * np.pi * 95.0 * t)
    turn = (yaw + 2.0 * np.pi) % (4.0 * np.pi) - 2.0 * np.pi  # what a quaternion tells of it
    return {
        "time": t,
        "top_x": RADIUS * np.sin(np.abs(yaw)) + shaking * np.cos(yaw),
        "top_z": -sense * RADIUS * (1.0 - np.cos(yaw)) - shaking * np.sin(yaw),
        "frame_rotation_y": turn,
    }


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("end", [1.0, 9.0])
def test_a_circle_is_told_without_the_shaking_of_the_motor(sense, end):
    told = track_report(circling(np.arange(0.0, end, 2.5e-4), sense), "top", TURN)
    assert told["curvature"] == pytest.approx(sense / RADIUS, rel=2e-3)
    assert told["turning_rate"] == pytest.approx(sense * SPEED / RADIUS, rel=1e-9)
    assert told["speed"] == pytest.approx(SPEED, rel=0.02)


def test_displacements_are_forward_and_to_the_left():
    t = np.linspace(0.0, 1.0, 2001)
    history = {"time": t, "top_x": -2e-3 * t, "top_z": 3e-3 * t, "frame_rotation_y": 0.0 * t}
    told = track_report(history, "top", TURN)
    assert told["forward_displacement"] == pytest.approx(-2e-3)
    assert told["sideways_displacement"] == pytest.approx(-3e-3)
    assert told["speed"] == pytest.approx(-2e-3)
    assert told["curvature"] == pytest.approx(0.0, abs=1e-6)


def test_nothing_is_told_of_a_run_of_few_turns():
    told = track_report(circling(np.linspace(0.0, 0.2, 500), 1.0), "top", TURN)
    assert told["curvature"] is told["turning_rate"] is told["speed"] is None
    assert told["forward_displacement"] > 0.0
