"""Moments of a run, with vibration that must not be taken for motion."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from softsim.report.snapshots import Moment, moments, onset_of_motion

TIME = np.linspace(0.0, 6.0, 6001)
PRESSURE = np.interp(TIME, [0.0, 1.0, 1.5, 6.0], [0.0, 5e3, 5e3, 1e3])
AIR = {"air pressure": PRESSURE}


def names(found) -> list[str]:
    return [moment.name for moment in found]


@given(
    moves_at=st.floats(2.0, 4.5),
    swing=st.floats(0.0, 5e-4),
    frequency=st.floats(30.0, 200.0),
    direction=st.sampled_from([1.0, -1.0]),
)
def test_onset_is_found_under_any_vibration(moves_at, swing, frequency, direction) -> None:
    travel = direction * 3e-3 * np.maximum(TIME - moves_at, 0.0)
    found = moments(TIME, AIR, travel + swing * np.sin(2 * np.pi * frequency * TIME))
    assert names(found) == ["start", "full inflation", "onset of motion", "end"]
    assert found[1].time == pytest.approx(1.0, abs=0.01)
    assert found[2].time == pytest.approx(moves_at, abs=0.3)


@example(frequency=30.375, swing=0.0009871119184075286)  # ends at a peak of either side
@given(frequency=st.floats(30.0, 200.0), swing=st.floats(1e-6, 1e-3))
def test_vibration_in_place_has_no_onset(frequency, swing) -> None:
    found = moments(TIME, AIR, swing * np.sin(2 * np.pi * frequency * TIME))
    assert names(found) == ["start", "full inflation", "end"]


def test_motion_while_inflating_is_no_onset() -> None:
    recoil = -2e-4 * np.minimum(TIME, 1.0)
    assert names(moments(TIME, AIR, recoil)) == ["start", "full inflation", "end"]


def test_a_trace_of_motion_is_no_onset() -> None:
    fall = 1e-4 * np.minimum(TIME, 1.0)
    creep = 1e-6 * np.maximum(TIME - 3.0, 0.0) / 3.0
    assert names(moments(TIME, AIR, fall + creep)) == ["start", "full inflation", "end"]


def test_onset_of_a_second_cycle_is_not_taken_for_the_first() -> None:
    cycles = np.interp(TIME, [0, 1, 2.9, 3.5, 6.0], [0, 5e3, 1e3, 5e3, 1e3])
    found = moments(TIME, {"air pressure": cycles}, 3e-3 * np.maximum(TIME - 4.5, 0.0))
    assert names(found) == ["start", "full inflation", "end"]


def test_a_run_that_stops_while_inflating_ends_there() -> None:
    found = moments(TIME[:500], {"air pressure": PRESSURE[:500]}, np.zeros(500))
    assert names(found) == ["start", "full inflation", "end"]


@pytest.mark.parametrize("pressure", [np.zeros(6001), np.full(6001, np.nan)])
def test_without_pressure_the_quarters(pressure: np.ndarray) -> None:
    found = moments(TIME, {"air pressure": pressure}, TIME)
    assert names(found) == ["start", "quarter", "half", "end"]
    assert [moment.time for moment in found] == [0.0, 1.5, 3.0, 6.0]


def test_a_body_of_unknown_place_has_no_onset() -> None:
    assert onset_of_motion(np.full(100, np.nan)) is None


def test_each_of_several_chambers_has_its_inflation() -> None:
    time = np.linspace(0.0, 1.0, 5)
    rear, front = np.array([0.0, 1.0, 1.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 2.0, 1.0])
    unused = 0.0 * time
    found = moments(time, {"front": front, "rear": rear, "unused": unused}, unused)
    assert found == [
        Moment("start", 0.0), Moment("rear inflated", 0.25), Moment("front inflated", 0.75),
        Moment("end", 1.0),
    ]  # fmt: skip
    sucked = moments(time, {"front": -front, "rear": -rear}, unused)
    assert names(sucked) == ["start", "quarter", "half", "end"]
