"""When the elements are looked at again."""

import pytest

from softsim.solver.stable_step import (
    ALLOWED_CHANGE,
    FIRST_INTERVAL,
    FRACTION_TO_GROW,
    GROWTH,
    INCREMENTS_TO_GROW,
    LEAST_LOOKS,
    LONGEST_INTERVAL,
    LOOK_INTERVAL,
    SHORTEST_INTERVAL,
    StableStepSchedule,
    next_interval,
)

LONG = 1e9


def test_nothing_changes_so_the_interval_doubles_to_its_longest():
    interval, seen = FIRST_INTERVAL, []
    for _ in range(12):
        interval = next_interval(interval, 5e-6, 5e-6, LONG)
        seen.append(interval)
    assert seen[:3] == [2 * FIRST_INTERVAL, 4 * FIRST_INTERVAL, 8 * FIRST_INTERVAL]
    assert seen[-1] == LONGEST_INTERVAL


def test_a_fall_beyond_what_is_allowed_shortens_it():
    assert next_interval(1000, 5e-6, 5e-6 * (1.0 - 10.0 * ALLOWED_CHANGE), LONG) == pytest.approx(
        1000 / 10.0, rel=0.1
    )


def test_a_stable_step_that_grows_needs_no_haste():
    assert next_interval(100, 5e-6, 7e-6, LONG) == 200
    assert next_interval(LONGEST_INTERVAL, 5e-6, 7e-6, LONG) == LONGEST_INTERVAL


def test_a_short_run_is_looked_at_often_enough_and_its_step_may_grow():
    plan = StableStepSchedule(5e-6, interval=2000)
    plan.plan_next(5e-6, 100, 3200.0)
    assert (plan.look_due, plan.estimate_due) == (100 + 3200 // LEAST_LOOKS, 100 + 4000)
    plan.plan_look(200, 32.0)
    assert plan.look_due == 200 + SHORTEST_INTERVAL
    assert next_interval(2000, 5e-6, 6e-6, 3200.0) == 0.5 * FRACTION_TO_GROW * 3200


def test_the_plan_starts_from_the_step_found_at_the_start():
    plan = StableStepSchedule(5e-6)
    assert plan.look_due == plan.estimate_due == FIRST_INTERVAL
    plan.plan_next(5e-6, FIRST_INTERVAL, LONG)
    assert plan.look_due == plan.estimate_due == FIRST_INTERVAL + 2 * FIRST_INTERVAL


def test_the_plan_keeps_the_lowest_step_until_it_has_grown():
    plan, count = StableStepSchedule(5e-6), 0
    grown = [5e-6, 6e-6] * 8
    each = INCREMENTS_TO_GROW // (len(grown) - 1) + 1
    swinging = [*grown[:-1], 4.1e-6, *grown[:-1], 3.9e-6]
    for now in (4e-6, *swinging, *grown[:-1]):
        count += each
        plan.plan_next(now, count, LONG)
        assert plan.lowest == min(4e-6, now) or plan.lowest == 3.9e-6
    plan.plan_next(5.5e-6, count + each, LONG)
    assert plan.lowest == 5e-6
    plan.plan_next(0.99 * GROWTH * 5e-6, count + 2 * each, LONG)
    assert plan.lowest == 5e-6


def test_the_step_grows_by_the_last_estimate_within_the_time_to_grow():
    plan, count, made = StableStepSchedule(4e-6, interval=LONGEST_INTERVAL), 0, 0
    while plan.lowest == 4e-6:
        count, made = plan.estimate_due if made else 0, made + 1
        plan.plan_next(5e-6, count, LONG)
    assert (plan.lowest, count, made) == (5e-6, INCREMENTS_TO_GROW, 3)


def test_looks_lie_closer_together_than_estimates():
    plan, count, looks = StableStepSchedule(5e-6, interval=LONGEST_INTERVAL), 0, []
    plan.plan_next(5e-6, count, LONG)
    while count < plan.estimate_due:
        count = plan.look_due
        looks.append(count)
        plan.plan_look(count, LONG)
    assert looks == [*range(LOOK_INTERVAL, LONGEST_INTERVAL + 1, LOOK_INTERVAL)]
