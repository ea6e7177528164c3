"""Tracks of two sides: how tightly they turn, and where to."""

import numpy as np
import pytest

from softsim.chain.building import build_chain
from softsim.chain.loading import load_chain
from softsim.chain.motion import Motion
from softsim.chain.track import centre_of_circle, curvature, track_measures


def circling(radius, turned, count=400):
    """Points of a circle about (0.3, -0.2) that begin below its centre, (rows, 2)."""
    angles = np.linspace(0.0, turned, count)
    return [0.3, -0.2] + radius * np.column_stack([np.sin(angles), -np.cos(angles)])


@pytest.mark.parametrize("turned", [0.2, -0.2, 3.0, 9.0, -9.0])
def test_a_circle_is_found(turned):
    path = circling(0.067, turned)
    assert curvature(path) == pytest.approx(np.sign(turned) / 0.067, rel=1e-6)
    assert curvature(path[::-1]) == pytest.approx(-np.sign(turned) / 0.067, rel=1e-6)
    assert centre_of_circle(path) == pytest.approx([0.3, -0.2], abs=1e-7)


def test_noise_does_not_bend_a_circle():
    """The fit by least squares of x^2 + y^2 alone finds it 1.6 times too tight here."""
    noise = np.random.default_rng(3).normal(0.0, 5e-4, (20000, 2))
    assert curvature(circling(0.067, 0.5, 20000) + noise) == pytest.approx(1.0 / 0.067, rel=0.02)


def test_a_straight_path_and_one_that_stands():
    path = np.outer(np.linspace(0.0, 0.1, 50), [0.8, 0.6])
    assert curvature(path) == pytest.approx(0.0, abs=1e-6)
    assert np.isnan(curvature(np.zeros((50, 2))))


def test_a_track_is_told_without_the_shaking_of_the_motor():
    """A robot on a circle of 67 mm at 0.1 m/s, whose right motor shakes it by 1 mm."""
    chain = build_chain(load_chain("leafbot_x5", ["sides.running=right"]))
    t = np.linspace(0.0, 2.0, 20001)
    yaw = 0.1 / 0.067 * t
    ahead = np.stack([np.cos(yaw), np.sin(yaw), 0.0 * yaw], -1)
    aside = np.stack([-np.sin(yaw), np.cos(yaw), 0.0 * yaw], -1)
    body = chain.at_rest()[0]
    body[:, 0] -= body[chain.heads[0], 0]
    shaking = 1e-3 * np.sin(2.0 * np.pi * 95.0 * t)[:, None] * ahead
    p = (0.067 * (np.array([0.0, 1.0, 0.0]) - aside) + shaking)[:, None]
    p = p + body[:, :1] * ahead[:, None] + body[:, 1:2] * aside[:, None]
    motion = Motion(chain, t, p, np.gradient(p, t, axis=0))
    told = track_measures(motion)
    assert told["curvature"] == pytest.approx(1.0 / 0.067, rel=1e-3)
    assert told["turning_rate"] == pytest.approx(0.1 / 0.067, rel=1e-9)
    assert told["sideways_displacement"] == pytest.approx(0.067 * (1.0 - np.cos(yaw[-1])), abs=1e-3)
    assert motion.speed == pytest.approx(0.1, rel=0.02)
    short = Motion(chain, t[:500], p[:500], motion.v[:500])
    assert np.isnan(track_measures(short)["curvature"])
