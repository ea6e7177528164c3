"""The values that trials get."""

from itertools import islice

import pytest

from softsim.study.factors import Interval
from softsim.study.measures import MeasureColumn
from softsim.sweep.trials import START, Trials

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
