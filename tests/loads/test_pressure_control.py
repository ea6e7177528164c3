"""The law of a pressure that follows events, alone: rows come every 2 ms, as a history's do."""

import json
import math
from dataclasses import asdict, replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softsim.loads.pressure_control import (
    ControlState,
    EventCycles,
    Phase,
    PressureControl,
    PressureRamp,
    Sensed,
    forward_speed,
)

ROW = 2e-3
STILL = (0.0, 0.0)
CYCLES = EventCycles(
    highest=10e3, lowest=2e3, inflation_rate=10e3, deflation_rate=5e3, start=0.0, hold=0.1,
    contact_rows=2, contact_force=1.0, contact_window=0.02, least_rows=1,
    motion_speed=20e-3, slip_speed=10e-3, motion_window=0.2, count=None,
)  # fmt: skip

UNASKED = replace(CYCLES, least_rows=0)  # contact is never lost


def pressure(command: PressureRamp, t: float) -> float:
    """What a command says, in the words of its definition."""
    low, high = sorted((command.pressure, command.target))
    return min(max(command.pressure + command.rate * (t - command.time), low), high)


def sensed(t, p, rows, force, place):
    return Sensed(t, p, rows, force, place, (1.0, 0.0, 0.0)[: len(place)])


def rows_of(control, command, felt, end, begin=0):
    """Rows (time, pressure, phase, cycle) up to `end` [s], with decisions; felt(t, p, phase) gives
    rows of spikes, force [N] and place; it faces along the first axis.
    """
    seen, decisions = [], []
    for k in range(begin, round(end / ROW) + 1):
        t = k * ROW
        p, phase = pressure(command, t), control.phase_at(t)
        seen.append((t, p, phase, control.cycle))
        decision = control.sense(sensed(t, p, *felt(t, p, phase)))
        if decision is not None:
            decisions.append((t, p, decision.reason))
            command = decision.ramp
    return seen, decisions


def course(settings_, felt, end):
    return rows_of(PressureControl(settings_), settings_.first_ramp(), felt, end)


def pipe(t, p, phase):
    """A wall that is touched above 4 kPa and presses back with 0.5 N/kPa above that."""
    return (3 if p > 4e3 else 0), 0.5e-3 * max(p - 4e3, 0.0), STILL


def test_inflation_ends_when_the_wall_presses_back():
    """1 N at 6 kPa; the mean of 20 ms comes 10 ms later, and a row: 0.1 to 0.12 kPa."""
    _, decisions = course(CYCLES, pipe, 0.7)
    ((t, p, reason),) = decisions
    assert reason == "contact is made"
    assert 6.09e3 < p < 6.13e3
    assert t == pytest.approx(p / 10e3)


def test_the_force_alone_is_no_contact():
    """Two rows are asked for, one touches."""
    _, decisions = course(CYCLES, lambda t, p, phase: (1, 9.0, STILL), 1.01)
    ((_, p, reason),) = decisions
    assert (p, reason) == (10e3, "the pressure is the highest")


def test_a_blow_is_no_contact():
    """5 N in one row of ten: 0.5 N on the mean."""

    def blows(t, p, phase):
        return 5, 5.0 if round(t / ROW) % 10 == 3 else 0.0, STILL

    _, decisions = course(CYCLES, blows, 1.01)
    assert [reason for *_, reason in decisions] == ["the pressure is the highest"]


def test_contact_below_the_lowest_pressure_does_not_count():
    _, decisions = course(CYCLES, lambda t, p, phase: (5, 9.0, STILL), 0.3)
    ((_, p, reason),) = decisions
    assert (reason, p) == ("contact is made", pytest.approx(2e3 + 10e3 * ROW))


def test_hold_then_fall_then_rise():
    """Contact at about 6.1 kPa; of a robot that stands still the next inflation begins at 2 kPa,
    0.1 s of hold and 0.82 s of fall later.
    """
    seen, decisions = course(UNASKED, pipe, 2.2)
    (turn, top, _), (bottom_time, bottom, reason), (again, *_) = decisions
    assert (bottom, reason) == (2e3, "the pressure is the lowest")
    assert bottom_time == pytest.approx(turn + 0.1 + (top - 2e3) / 5e3, abs=ROW)
    held = [p for _, p, phase, cycle in seen if (phase, cycle) == (Phase.HOLD, 1)]
    assert set(held) == {top}
    assert len(held) * ROW == pytest.approx(0.1, abs=2 * ROW)
    assert again == pytest.approx(bottom_time + (top - bottom) / 10e3, abs=ROW)
    assert [cycle for t, _, _, cycle in seen if t in (turn, bottom_time)] == [1, 1]
    assert seen[-1][3] == 2


def walker(*points):
    """Stands at `points` [s, m] of the time since its first deflation began, pressed on firmly."""
    begun = []

    def felt(t, p, phase):
        if phase is Phase.DEFLATION:
            begun.append(t)
        since = t - begun[0] if begun else 0.0
        return 3, 0.5e-3 * max(p - 4e3, 0.0), (interpolated(since, points), 0.3)

    return felt


def interpolated(t, points):
    for (t0, x0), (t1, x1) in pairwise(points):
        if t <= t1:
            return x0 + (x1 - x0) * max(t - t0, 0.0) / (t1 - t0)
    return points[-1][1]


SLOW = replace(CYCLES, deflation_rate=1e3)


def test_deflation_ends_when_motion_has_stopped():
    """Still for 1 s, 40 mm/s for 1 s, then still. A straight line through a ramp that ends a share
    s of the window ago has the slope v (1 - s)^2 (1 + 2 s): half of v at s = 0.5, 0.1 s after.
    """
    seen, decisions = course(SLOW, walker((0.0, 0.0), (1.0, 0.0), (2.0, 0.04)), 3.2)
    t, p, reason = decisions[1]
    falling = next(t for t, _, phase, _ in seen if phase is Phase.DEFLATION)
    assert reason == "motion has stopped"
    assert t - falling == pytest.approx(2.1, abs=2 * ROW)
    assert p == pytest.approx(decisions[0][1] - 1e3 * 2.1, abs=4 * ROW * 1e3)


def test_deflation_ends_when_the_robot_turns_back():
    """40 mm/s up for 1 s, then down as fast: the mean over 0.2 s passes zero 0.1 s later."""
    _, decisions = course(SLOW, walker((0.0, 0.0), (1.0, 0.04), (2.0, 0.0)), 3.2)
    t, _, reason = decisions[1]
    assert reason == "motion has stopped"
    assert 1.05 < t - decisions[0][0] - CYCLES.hold < 1.1 + 2 * ROW


@pytest.mark.parametrize(
    "place",
    [
        lambda t: STILL,
        lambda t: (15e-3 * t, 0.0),  # creeps
        lambda t: (0.0, 1e-3 * math.sin(2.0 * math.pi * 192.0 * t)),  # is shaken
    ],
)
def test_a_robot_that_does_not_move_is_inflated_anew_at_the_lowest(place):
    """Nor does standing still at a high pressure end anything."""
    _, decisions = course(CYCLES, lambda t, p, phase: (3, 5e-4 * (p - 2e3), place(t)), 1.5)
    assert decisions[1][1:] == (2e3, "the pressure is the lowest")


def test_deflation_ends_when_contact_is_lost():
    """Below 4 kPa; all of 20 ms must be without: 0.1 kPa lower."""
    _, decisions = course(replace(CYCLES, least_rows=2), pipe, 1.2)
    _, p, reason = decisions[1]
    assert reason == "contact is lost"
    assert p == pytest.approx(4e3 - 0.1e3, abs=2 * ROW * 5e3)


def test_a_bounce_is_no_loss_of_contact():
    """Rows without contact for 14 ms now and then."""

    def bounces(t, p, phase):
        return 0 if round(t / ROW) % 8 else 3, 9.0, STILL

    _, decisions = course(CYCLES, bounces, 1.2)
    assert decisions[1][2] == "the pressure is the lowest"


def test_contact_that_never_was_is_not_lost():
    """In a wide pipe nothing is touched: up to the highest pressure, down to the lowest."""
    _, decisions = course(CYCLES, lambda t, p, phase: (0, 0.0, STILL), 2.8)
    assert [p for _, p, _ in decisions] == [10e3, 2e3]


def test_after_the_last_cycle_the_pressure_stays():
    seen, decisions = course(replace(UNASKED, count=2), pipe, 6.0)
    assert len(decisions) == 4
    last = decisions[-1][0]
    assert {(p, phase, cycle) for t, p, phase, cycle in seen if t > last} == {(2e3, Phase.REST, 2)}


def test_nothing_happens_before_the_start():
    seen, decisions = course(replace(CYCLES, start=0.3), pipe, 1.0)
    early = {(p, phase) for t, p, phase, _ in seen if t < 0.3 - 1e-9}
    assert early == {(0.0, Phase.REST)}
    assert decisions[0][0] == pytest.approx(0.3 + decisions[0][1] / 10e3)


def test_deflation_ends_when_the_robot_slips_back_without_having_moved():
    """Still for 1 s, then 20 mm/s down: half of it is reached half a window later."""
    _, decisions = course(SLOW, walker((0.0, 0.0), (1.0, 0.0), (2.0, -0.02)), 3.2)
    t, _, reason = decisions[1]
    assert reason == "it slips back"
    assert t - decisions[0][0] - CYCLES.hold == pytest.approx(1.1, abs=2 * ROW)


def test_the_speed_of_a_line_is_its_own_along_the_axis():
    felt = [
        Sensed(t, 0.0, 0, 0.0, (3.0 * t, 1.0, -4.0 * t), (0.6, 0.0, 0.8))
        for t in (0.0, 0.1, 0.15, 0.4)
    ]
    assert forward_speed(felt) == pytest.approx(3.0 * 0.6 - 4.0 * 0.8, rel=1e-12)


def test_time_scaled_cycles_have_the_same_course_sooner():
    fast = CYCLES.time_scaled(10.0)
    command, soon = CYCLES.first_ramp(), fast.first_ramp()
    assert pressure(soon, 0.05) == pytest.approx(pressure(command, 0.5))
    assert fast.hold == pytest.approx(0.01)
    assert (fast.highest, fast.motion_speed) == (CYCLES.highest, CYCLES.motion_speed)


FEELINGS = st.lists(
    st.tuples(
        st.integers(1, 60),
        st.integers(0, 5),
        # Kernels let the processor take subnormal numbers, 1e-308 N and less, for zero.
        st.floats(0.0, 4.0, allow_subnormal=False),
        st.floats(-1.0, 1.0, allow_subnormal=False),
    ),
    min_size=1,
    max_size=40,
)


def moody(feelings):
    """A robot that feels each for so many rows: rows in contact, force [N], velocity [m/s]."""
    rows = [(n, f, v) for count, n, f, v in feelings for _ in range(count)]
    x = [0.0]
    for *_, v in rows:
        x.append(x[-1] + ROW * v)

    def felt(t, p, phase):
        k = min(round(t / ROW), len(rows) - 1)
        return rows[k][0], rows[k][1], (x[k],)

    return felt


@settings(max_examples=30, deadline=None)
@given(FEELINGS)
def test_whatever_is_felt_the_pressure_keeps_to_its_limits(feelings):
    """Between 0 and the highest; never below the lowest once above it; never faster than asked."""
    seen, _ = course(CYCLES, moody(feelings), 4.0)
    was_above = False
    for (_, p, *_), (_, after, *_) in pairwise(seen):
        was_above |= p >= CYCLES.lowest
        assert (CYCLES.lowest if was_above else 0.0) <= after <= CYCLES.highest
        assert -5e3 * ROW * (1 + 1e-9) <= after - p <= 10e3 * ROW * (1 + 1e-9)
    numbers = [cycle for *_, cycle in seen]
    assert numbers == sorted(numbers)
    assert seen[-1][3] >= 2  # 1 s up, 0.1 s of hold, 1.6 s down: no feeling stops the cycles


@settings(max_examples=15, deadline=None)
@given(FEELINGS, st.integers(1, 1990))
def test_a_control_goes_on_from_what_was_written_of_it(feelings, cut):
    """Stopped after any row, written as JSON and read again: the same to the last bit."""
    felt = moody(feelings)
    whole, decisions = course(CYCLES, felt, 4.0)
    control, command = PressureControl(CYCLES), CYCLES.first_ramp()
    first, early = rows_of(control, command, felt, cut * ROW)
    if early:
        command = command_after(felt, cut)
    text = json.dumps(asdict(control.state))
    resumed = PressureControl(CYCLES, ControlState.written(json.loads(text)))
    assert resumed.state == control.state
    second, late = rows_of(resumed, command, felt, 4.0, begin=cut + 1)
    assert first + second == whole
    assert early + late == decisions


def command_after(felt, cut):
    """The command in force after row number `cut`."""
    control, command = PressureControl(CYCLES), CYCLES.first_ramp()
    for k in range(cut + 1):
        t = k * ROW
        p = pressure(command, t)
        decision = control.sense(sensed(t, p, *felt(t, p, control.phase_at(t))))
        command = command if decision is None else decision.ramp
    return command
