"""Measures of motion on histories whose answers are known."""

import numpy as np
import pytest

from validation.motion import displacement_while_falling, falls, speed_after

RISE, HOLD, FALL = 0.5, 0.2, 10.0  # s
HIGHEST, LOWEST = 23e3, 13e3  # Pa: the pressure falls by 1 kPa/s
SPEED = 2e-3  # m/s


def history(begin: float, end: float, cycles: int = 1):
    """Cycles in which it moves at SPEED between two times [s] of the fall, sampled as cases are."""
    t = np.arange(0.0, cycles * (RISE + HOLD + FALL) + 1e-9, 2e-3)
    within = t % (RISE + HOLD + FALL)
    within[-1] = RISE + HOLD + FALL
    falling = within - RISE - HOLD
    pressure = np.where(
        within < RISE, HIGHEST * within / RISE, HIGHEST - 1e3 * np.clip(falling, 0.0, FALL)
    )
    moved = np.clip(falling - begin, 0.0, end - begin)
    done = np.floor_divide(np.arange(len(t)), round((RISE + HOLD + FALL) / 2e-3)) * (end - begin)
    done[-1] -= end - begin
    return {"time": t, "pressure": pressure, "frame_x": SPEED * (done + moved)}


def test_onset_and_end_are_where_it_moves():
    (fall,) = falls(history(4.0, 8.0))
    assert fall.displacement == pytest.approx(4.0 * SPEED)
    assert fall.before == pytest.approx(0.0, abs=1e-12)
    # 5 and 95 % of the 4 s way, 1 kPa/s, sampled every 2 ms.
    assert fall.onset_pressure == pytest.approx(HIGHEST - 4.2e3, abs=2.1)
    assert fall.end_pressure == pytest.approx(HIGHEST - 7.8e3, abs=2.1)
    assert fall.standstill == pytest.approx(0.05 * 4.0 * SPEED, abs=2.1e-3 * SPEED)
    assert fall.displacement_above(HIGHEST - 6e3) == pytest.approx(2.0 * SPEED, abs=2.1e-3 * SPEED)
    assert fall.displacement_above(LOWEST - 1e3) == fall.displacement
    # From 19 to 17 kPa it moves 4 mm, and 6 s of fall are over.
    down = fall.speed_above(HIGHEST - 6e3)
    assert down == pytest.approx(2.0 * SPEED / (RISE + HOLD + 6.0), rel=2e-3)
    assert fall.mean_speed == pytest.approx(4.0 * SPEED / (RISE + HOLD + FALL))


def test_without_motion_there_is_no_onset():
    (fall,) = falls(history(4.0, 4.4))  # 0.8 mm
    assert np.isnan([fall.onset_pressure, fall.end_pressure, fall.standstill]).all()


def test_recoil_is_no_motion():
    drawn_back = history(4.0, 8.0)
    drawn_back["frame_x"] = -0.2 * drawn_back["frame_x"]
    (fall,) = falls(drawn_back)
    assert np.isnan(fall.onset_pressure)
    sprung = history(4.0, 8.0)
    sprung["frame_x"] -= 0.01 * (np.arange(len(sprung["time"])) > 400)  # m; the fall begins at 350
    (fall,) = falls(sprung)
    assert np.isnan(fall.onset_pressure)  # 8 mm forward do not make up for 10 mm back


def test_each_cycle_is_one():
    found = falls(history(4.0, 8.0, cycles=2))
    assert len(found) == 2
    assert [fall.displacement for fall in found] == pytest.approx([4.0 * SPEED] * 2)
    assert displacement_while_falling(history(4.0, 8.0, cycles=2)) == pytest.approx(4.0 * SPEED)


def test_speed_of_the_second_half():
    t = np.linspace(0.0, 2.0, 1001)
    assert speed_after({"time": t, "frame_x": np.maximum(0.0, t - 1.0)}, 0.5) == pytest.approx(1.0)


def test_a_failed_run_has_no_numbers():
    assert falls({}) == []
    assert np.isnan(displacement_while_falling({})) and np.isnan(speed_after({}, 0.5))
