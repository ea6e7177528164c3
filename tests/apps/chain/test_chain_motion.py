"""Measures of a motion, and the folder of a run."""

import json

import numpy as np
import pytest

from softsim.apps.chain.motion import Motion, measures, simulate, track_measures
from softsim.apps.chain.running import build_chain, run_chain
from softsim.apps.chain.scene import load_chain
from softsim.errors import StabilityError
from softsim.output.history import read_history, read_units


def made_up(speed, end=2.0):
    """The head comes to its speed with a time constant of 0.1 s, and hops at 71 Hz."""
    chain = build_chain(load_chain("leafbot5"))
    t = np.linspace(0.0, end, 10001)
    x = speed * (t - 0.1 * (1.0 - np.exp(-t / 0.1)))
    hop = 1e-4 * np.sin(2.0 * np.pi * 71.0 * t)
    p = np.column_stack([x, hop + 0.5e-4])[:, None] + chain.at_rest()[0]
    return Motion(chain, t, p, np.gradient(p, t, axis=0))


def test_measures_of_a_motion():
    found = measures(made_up(0.2))
    assert found["speed"] == pytest.approx(0.2, rel=1e-4)
    assert found["settling_time"] == pytest.approx(0.1 * np.log(10.0), abs=4e-3)
    assert found["dominant_frequencies"] == pytest.approx(71.0, abs=0.3)
    assert found["contact_shares"] == pytest.approx(1.0 / 3.0, abs=2e-3)
    assert found["head_height"] == pytest.approx(1.5e-4, rel=1e-3)
    assert found["motor_force"] == pytest.approx(0.2219, rel=1e-3)


def test_a_short_motion_tells_no_speed():
    found = measures(made_up(0.2, end=5e-3))
    assert np.isnan(found["speed"]) and np.isnan(found["dominant_frequencies"])


def test_the_folder_of_a_run(tmp_path):
    loaded = load_chain("leafbot5", ["time.end=0.2 s", "time.row_interval=0.4 ms"])
    results = run_chain(loaded, tmp_path / "run")
    told = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert told["status"] == "done" and told["speed"] == results.summary["speed"]
    history = read_history(tmp_path / "run" / "history.csv")
    assert history["time"][1] == pytest.approx(0.4e-3)
    assert history["x1"][-1] == results.motion.p[-1, 0, 0]
    units = read_units(tmp_path / "run" / "history.csv")
    assert units["z4"] == "m" and units["friction_work"] == "J"
    assert (tmp_path / "run" / "scene.resolved.yaml").is_file()


@pytest.mark.parametrize(("frequency", "speed"), [(132, 40.0), (142, 42.0), (186, 53.0)])
@pytest.mark.physics
def test_as_printed_it_goes_as_an_independent_program_does(frequency, speed):
    """Semi-implicit Euler with steps of 25 to 50 us found 40, 42, 53 mm/s, a fifth of the thesis's
    200, 220, 300 mm/s (docs/how_to/chain.md).
    """
    overrides = [f"motor.frequency={frequency} Hz", "motor.weight=added", "time.end=0.8 s"]
    loaded = load_chain("leafbot5", overrides)
    found = simulate(build_chain(loaded), loaded.scene.time).speed
    assert 1e3 * found == pytest.approx(speed, rel=0.02)


def test_a_motion_beyond_all_numbers_is_told():
    loaded = load_chain("leafbot5", ["motor.eccentricity=1e39 m", "time.end=0.1 s"])
    with pytest.raises(StabilityError, match="became infinite at"):
        simulate(build_chain(loaded), loaded.scene.time)


# -------------------------------------------------------------------------------------------------
# Tracks of two sides: how tightly they turn, and where to.


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
