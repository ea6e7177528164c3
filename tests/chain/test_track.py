"""Tracks of two sides: how tightly they turn, and where to."""

import numpy as np
import pytest

from softsim.apps.chain.motion import Motion, track_measures
from softsim.apps.chain.running import build_chain
from softsim.apps.chain.scene import load_chain


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
