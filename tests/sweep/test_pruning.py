"""Which trials are stopped early, with rows made up by the way of a block."""

import pickle
from functools import partial

import pytest
from falling_block import BLOCK

from softsim.builder import build_model
from softsim.scene.loading import load_scene
from softsim.study.factors import Interval
from softsim.study.measures import MeasureColumn
from softsim.study.schema import Prune
from softsim.sweep.trials import PruningCondition, Trials

END = 10e-3
COLUMN = MeasureColumn("way", "mm", of="body_displacement", size=1e-3)
SPEED = MeasureColumn("speed", "mm/s", of="mean_speed", size=1e-3)  # a block has no frame


@pytest.fixture
def trials(tmp_path):
    """Of one factor; the way should be long."""
    return Trials(tmp_path, {"rate": Interval(1.0, 2.0)}, COLUMN, "maximize", seed=1)


@pytest.fixture
def condition_of(tmp_path, write_scene):
    """The condition of a trial, as a worker makes it for the model of its run."""

    def make(number, column=COLUMN, scene=BLOCK, **prune):
        settings = Prune(**{"after_trials": 2, "after_share": 0.4, **prune})
        given = partial(PruningCondition, tmp_path, number, column, settings)
        model = build_model(load_scene(write_scene(scene)))
        return pickle.loads(pickle.dumps(given))(model)

    return make


def seen(condition, speed, rows=100):
    """Show the rows of a block that goes at `speed` [m/s] until the condition ends the run; the
    share of it that was seen.
    """
    for k in range(rows + 1):
        share = k / rows
        condition.see_row({
            "time": END * share, "body_x": speed * END * share, "rows_in_contact": 0.0,
            "slip_share": 0.0, "wall_force_normal": 0.0, "cycles_done": 0.0, "contact_area": 0.0,
        })  # fmt: skip
        if condition.is_over:
            break
    return share


def finished(trials, condition_of, *speeds):
    """Trials that ran to their end."""
    for trial, speed in zip(trials.to_run(len(speeds)), speeds, strict=True):
        assert seen(condition_of(trial.number), speed) == 1.0
        trials.tell(trial.number, 1e3 * speed * END)


def test_a_trial_worse_than_the_median_is_stopped(trials, condition_of):
    """After two finished ones, of 1 and 3 m/s, and not before 40 % of its run."""
    finished(trials, condition_of, 1.0, 3.0)
    worse, better = trials.to_run(4)
    assert seen(condition_of(worse.number), 1.9) == pytest.approx(0.4)
    assert seen(condition_of(better.number), 2.1) == 1.0
    reported = trials.study.trials[better.number - 1].intermediate_values
    assert list(reported) == list(range(10, 100, 10))
    assert reported[50] == pytest.approx(1e3 * 2.1 * 0.5 * END)


def test_the_first_trials_are_not_stopped(trials, condition_of):
    finished(trials, condition_of, 3.0, 1.0)


def test_a_measure_that_is_not_there_yet_stops_nothing(trials, condition_of):
    finished(trials, condition_of, 1.0, 3.0)
    (trial,) = trials.to_run(3)
    assert seen(condition_of(trial.number, SPEED), 0.0) == 1.0
    assert trials.study.trials[trial.number - 1].intermediate_values == {}


def test_a_run_that_goes_on_shows_its_rows_again(trials, condition_of, recwarn):
    finished(trials, condition_of, 1.0, 3.0)
    (trial,) = trials.to_run(3)
    assert seen(condition_of(trial.number), 1.9) == pytest.approx(0.4)
    assert seen(condition_of(trial.number), 1.9) == pytest.approx(0.5)
    assert not [w for w in recwarn if "already reported" in str(w.message)]


def test_tenths_are_those_of_the_cycles(condition_of):
    """Half of two cycles is done while the time that they may take has hardly begun."""
    air = """
loads:
  air: {kind: follower_pressure, facets: [block.top],
        profile: {kind: table, points: [[0 s, 0 Pa], [1 ms, 2 Pa], [2 ms, 1 Pa], [3 ms, 2 Pa],
                                        [9 ms, 1 Pa]]}}
"""
    condition = condition_of(1, scene=BLOCK.replace("10 ms}", "10 ms, cycles: 2}") + air)
    assert condition.share({"time": 3e-3, "cycles_done": 1.0}) == 0.5
    assert condition.share({"time": 6e-3, "cycles_done": 1.0}) == pytest.approx(6.0 / 9.0)


def test_pruned_trials_are_told(trials):
    (trial,) = trials.to_run(1)
    trials.tell(trial.number, None, pruned=True)
    assert trials.study.trials[0].state.name == "PRUNED"
    assert [one.number for one in trials.ended()] == [1] and next(trials.ended()) == trial
