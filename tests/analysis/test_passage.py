"""When a run along a pipe is over, on histories made up for it."""

import pytest
from passages import STEP, history, passage

from softsim.analysis.passage import (
    SEEN,
    PassageCondition,
    Verdict,
    after_history,
    has_fallen,
    last_rows,
)


def ended(asked, rows) -> tuple[Verdict, float | None]:
    """The verdict, and the time [s] at which it came."""
    condition = PassageCondition(asked)
    for row in zip(*(rows[name] for name in SEEN), strict=True):
        condition.see(*row)
        if condition.is_over:
            return condition.verdict, float(row[0])
    return condition.verdict, None


def test_it_passes_as_soon_as_it_is_at_the_goal():
    """100 mm/s from 30 mm to the goal at 270.7 mm."""
    goal = STEP + 16.5e-3
    verdict, at = ended(passage(), history([0.0, 4.0], [30.0, 430.0], period=100.0))
    assert verdict is Verdict.PASSED
    assert at == pytest.approx((goal - 0.03) / 0.1, abs=0.01)


def test_what_never_moves_is_stuck_after_as_many_cycles_as_the_user_is_patient():
    standing = history([0.0, 20.0], [30.0, 30.0])
    assert ended(passage(), standing) == (Verdict.STUCK, pytest.approx(4.0))
    assert ended(passage(patience=5), standing) == (Verdict.STUCK, pytest.approx(10.0))


def test_only_whole_cycles_without_progress_count():
    """It stands from 5 s on, within the third cycle: the fourth and fifth end at 10 s."""
    assert ended(passage(), history([0.0, 5.0, 20.0], [30.0, 100.0, 100.0])) == (
        Verdict.STUCK,
        pytest.approx(10.0),
    )


def test_recoil_is_no_progress():
    """It goes 4 mm forward and 4 mm back in each cycle."""
    times = [0.5 * k for k in range(41)]
    places = [30.0 + 4.0 * (k % 2) for k in range(41)]
    assert ended(passage(), history(times, places)) == (Verdict.STUCK, pytest.approx(4.0))


def test_slow_progress_is_progress():
    """3 mm a cycle are less than 5 mm, but not in two cycles."""
    assert ended(passage(), history([0.0, 20.0], [30.0, 60.0])) == (Verdict.UNFINISHED, None)
    assert ended(passage(least_progress=7e-3), history([0.0, 20.0], [30.0, 60.0])) == (
        Verdict.STUCK,
        pytest.approx(4.0),
    )


def test_without_cycles_time_counts():
    asked = passage(in_cycles=False)
    assert ended(asked, history([0.0, 1.0, 9.0], [30.0, 60.0, 60.0])) == (
        Verdict.STUCK,
        # 3 s after it last had 5 mm more: at 1 s, or up to 5 mm, a sixth of a second, before.
        pytest.approx(4.0 - 1 / 12, abs=1 / 12),
    )


def test_a_fall_ends_it_at_once():
    """It climbs to 100 mm, and falls at 1 m/s from 3 s on: by its own 33 mm within 33 ms."""
    rows = history([0.0, 3.0, 3.1], [30.0, 100.0, 0.0], period=100.0)
    assert ended(passage(), rows) == (Verdict.STUCK, pytest.approx(3.04, abs=0.011))
    assert has_fallen(passage(), 34e-3)
    assert not has_fallen(passage(), 32e-3)


def test_a_resumed_condition_decides_alike():
    rows = history([0.0, 5.0, 20.0], [30.0, 100.0, 100.0])
    shown = {name: column[:700] for name, column in rows.items()}
    condition = after_history(passage(), shown)
    assert not condition.is_over
    for k in range(700, len(rows["time"])):
        condition.see(*(float(rows[name][k]) for name in SEEN))
        if condition.is_over:
            break
    assert rows["time"][k] == pytest.approx(10.0)


def test_the_last_rows_are_those_of_the_last_whole_cycle():
    rows = history([0.0, 5.0], [30.0, 100.0])
    t = rows["time"]
    assert t[last_rows(passage(), rows)] == pytest.approx(t[(t >= 2.0 - 1e-6) & (t < 4.0 - 1e-6)])
    timed = last_rows(passage(in_cycles=False), rows)
    assert t[timed].min() == pytest.approx(2.0)
    assert last_rows(passage(), history([0.0, 1.0], [30.0, 30.0])).all()


def test_the_longest_standstill_and_the_patience_that_it_used():
    """100 mm/s, but from 1 to 5.2 s it stands at 130 mm, which takes in one whole cycle of 2 s."""
    rows = history([0.0, 1.0, 5.2, 6.2], [30.0, 130.0, 130.0, 230.0])
    condition = after_history(passage(), rows)
    longest = condition.longest_standstill
    assert longest.duration == pytest.approx(4.25, abs=0.06)  # until 5 mm more are gained
    assert longest.began == pytest.approx(1.0, abs=0.06)
    assert longest.arc_length == pytest.approx(0.13, abs=5e-3)
    assert (condition.idle_cycles, condition.patience_used) == (1, 0.5)
    assert condition.way_share == pytest.approx(0.2 / (STEP + 16.5e-3 - 0.03))

    timed = after_history(passage(in_cycles=False, patience_time=8.0), rows)
    assert timed.patience_used == pytest.approx(longest.duration / 8.0)


def test_what_moves_steadily_never_stands_and_what_is_stuck_has_used_its_patience():
    moving = after_history(passage(), history([0.0, 2.0], [30.0, 230.0]))
    assert moving.longest_standstill.duration <= 0.061 and moving.patience_used == 0.0
    stuck = after_history(passage(), history([0.0, 20.0], [30.0, 30.0]))
    assert stuck.patience_used == 1.0 and stuck.way_share == 0.0
    assert stuck.longest_standstill.duration == pytest.approx(4.0)
