"""The values that trials get, and which of them are stopped early."""

import pickle
from functools import partial
from itertools import islice

import optuna
import pytest
from falling_block import BLOCK

from softsim.builder import build_model
from softsim.errors import OutputError
from softsim.scene.loading import load_scene
from softsim.study.factors import Interval
from softsim.study.measures import MeasureColumn
from softsim.study.schema import Prune
from softsim.sweep.trials import START, PruningCondition, Trials

SPACE = {
    "rate": Interval(1.0, 100.0, logarithmic=True),
    "count": Interval(1, 4, is_whole=True),
    "level": (8.0, 2.0, 4.0, 6.0),
    "pipe": ("30 mm", "36 mm"),
}


@pytest.fixture
def trials(tmp_path):
    """Of four factors of different kinds."""
    return Trials(tmp_path, SPACE, MeasureColumn("speed", of="speed"), "maximize", seed=1)


def test_the_first_trials_lie_evenly(trials):
    """Of eight points a half each in each half of every factor."""
    found = [trial.values for trial in trials.to_run(START)]
    assert sum(values["rate"] < 10.0 for values in found) == START // 2
    assert sum(values["count"] <= 2 for values in found) == START // 2
    assert sorted(values["level"] for values in found) == [2, 2, 4, 4, 6, 6, 8, 8]
    assert sum(values["pipe"] == "30 mm" for values in found) == START // 2


def test_later_trials_go_where_good_ones_were(trials):
    """Good is what is in the 36 mm pipe at high levels."""
    for trial in trials.to_run(40):
        good = trial.values["level"] * (1.0 + (trial.values["pipe"] == "36 mm"))
        trials.tell(trial.number, good)
    late = [trial.values for trial in trials.ended()][-20:]
    assert sum(values["pipe"] == "36 mm" for values in late) > 15
    assert sum(values["level"] for values in late) / 20 > 6.0
    assert all(type(values["count"]) is int and 1 <= values["rate"] <= 100 for values in late)


def test_trials_in_flight_are_taken_up(trials, tmp_path):
    """As they were: the journal has their values."""
    begun = list(islice(trials.to_run(5), 3))
    again = Trials(tmp_path, SPACE, MeasureColumn("speed", of="speed"), "maximize", seed=1)
    assert list(again.to_run(3)) == begun and again.is_open(3)
    for trial in begun:
        again.tell(trial.number, None)
    assert not again.is_open(3) and list(again.ended()) == begun


def test_another_major_version_of_optuna_is_refused(trials, tmp_path, monkeypatch):
    assert trials.study.user_attrs["optuna"] == optuna.__version__
    monkeypatch.setattr(optuna, "__version__", "99.0.0")
    with pytest.raises(OutputError, match=r"started with optuna .* this is optuna 99\.0\.0"):
        Trials(tmp_path, SPACE, MeasureColumn("speed", of="speed"), "maximize", seed=1)


END = 10e-3
COLUMN = MeasureColumn("way", "mm", of="body_displacement", size=1e-3)
SPEED = MeasureColumn("speed", "mm/s", of="mean_speed", size=1e-3)  # a block has no frame


@pytest.fixture
def runs(tmp_path):
    """Of one factor, the way of a block, made up; it should be long."""
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


def finished(runs, condition_of, *speeds):
    """Trials that ran to their end."""
    for trial, speed in zip(runs.to_run(len(speeds)), speeds, strict=True):
        assert seen(condition_of(trial.number), speed) == 1.0
        runs.tell(trial.number, 1e3 * speed * END)


def test_a_trial_worse_than_the_median_is_stopped(runs, condition_of):
    """After two finished ones, of 1 and 3 m/s, and not before 40 % of its run."""
    finished(runs, condition_of, 1.0, 3.0)
    worse, better = runs.to_run(4)
    assert seen(condition_of(worse.number), 1.9) == pytest.approx(0.4)
    assert seen(condition_of(better.number), 2.1) == 1.0
    reported = runs.study.trials[better.number - 1].intermediate_values
    assert list(reported) == list(range(10, 100, 10))
    assert reported[50] == pytest.approx(1e3 * 2.1 * 0.5 * END)


def test_the_first_trials_are_not_stopped(runs, condition_of):
    finished(runs, condition_of, 3.0, 1.0)


def test_a_measure_that_is_not_there_yet_stops_nothing(runs, condition_of):
    finished(runs, condition_of, 1.0, 3.0)
    (trial,) = runs.to_run(3)
    assert seen(condition_of(trial.number, SPEED), 0.0) == 1.0
    assert runs.study.trials[trial.number - 1].intermediate_values == {}


def test_a_run_that_goes_on_shows_its_rows_again(runs, condition_of, recwarn):
    finished(runs, condition_of, 1.0, 3.0)
    (trial,) = runs.to_run(3)
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


def test_pruned_trials_are_told(runs):
    (trial,) = runs.to_run(1)
    runs.tell(trial.number, None, pruned=True)
    assert runs.study.trials[0].state.name == "PRUNED"
    assert [one.number for one in runs.ended()] == [1] and next(runs.ended()) == trial
