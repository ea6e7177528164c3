"""Joints, steps and narrow places of a pipe along a path."""

import numpy as np
import pytest

from softsim.contact.pipe_layout import Bend, DiameterStep, Straight, Taper, path_of_items
from softsim.contact.pipe_path import FeaturePosition, features, narrowings, nearest_feature

QUARTER = 0.5 * np.pi
ITEMS = [
    Straight(0.12),
    Bend(QUARTER, 0.06, 0.0),
    Straight(0.05),
    Taper(0.03, 41e-3),
    Straight(0.04),
    DiameterStep(30e-3),
    Straight(0.1),
]


def path(items=ITEMS, diameter=30e-3):
    return path_of_items("pipe", items, diameter, np.zeros(2), (False, False))


def test_features_are_where_something_changes():
    arc = 0.06 * QUARTER
    found = [(f.place, f.item, f.edge) for f in features(path())]
    assert found == [
        (pytest.approx(0.12), 1, FeaturePosition.BEGINNING),
        (pytest.approx(0.12 + arc), 1, FeaturePosition.END),
        (pytest.approx(0.17 + arc), 3, FeaturePosition.BEGINNING),
        (pytest.approx(0.20 + arc), 3, FeaturePosition.END),
        (pytest.approx(0.24 + arc), 5, FeaturePosition.STEP),
    ]


def test_a_pipe_that_goes_on_has_no_feature():
    two_straights = path([Straight(0.1), Straight(0.1)])
    bend_in_two = path([Bend(0.3, 0.1, 0.0), Bend(0.3, 0.1, 0.0)])
    assert features(two_straights) == features(bend_in_two) == []
    assert nearest_feature(two_straights, 0.1) is None


def test_a_bend_the_other_way_is_another_bend():
    s_bend = path([Bend(QUARTER, 0.06, 0.0), Bend(QUARTER, 0.06, np.pi)])
    assert [(f.item, f.edge) for f in features(s_bend)] == [(1, FeaturePosition.BEGINNING)]


def test_the_nearest_feature_may_lie_behind():
    arc = 0.06 * QUARTER
    assert nearest_feature(path(), 0.12 + arc + 0.02).edge is FeaturePosition.END
    assert nearest_feature(path(), 0.12 + arc + 0.03).item == 3


def test_a_pipe_narrows_at_steps_down_and_along_tapers_down():
    items = (Straight(0.1), Taper(0.03, 30e-3), DiameterStep(36e-3), Straight(0.1))
    down = path([*items, DiameterStep(33e-3), Straight(0.1)], 41e-3)
    assert narrowings(down) == pytest.approx(np.array([[0.1, 0.13], [0.23, 0.23]]))
    assert narrowings(path()) == pytest.approx(np.array([[0.334248, 0.334248]]), abs=1e-6)
    assert narrowings(path([Straight(0.1)])).shape == (0, 2)
