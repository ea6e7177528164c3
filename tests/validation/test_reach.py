"""Pulls out of made-up trials."""

import math

import numpy as np
import pytest

from validation import reach
from validation.cases import Outcome
from validation.verdicts import AGREES, DISAGREES, UNKNOWN

LIMIT = 1e-3  # m, the recoil


def trial(name, way):
    """A cycle of 5 s that brings the robot `way` [m] forward."""
    pressure = np.array([0.0, 1.0, 1.0, 0.5, 1.0, 1.0, 0.4])
    x = way * np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0])
    history = {"pressure": pressure, "frame_x": x, "time": 5.0 / 3.0 * np.arange(7)}
    return Outcome(name, history=history)


def outcomes(slopes):
    """Ways that fall linearly from 5 mm without a drag to the recoil at a robot's pull [mN]; pipe
    and heading -> pull.
    """
    found = {case.name: Outcome(case.name, failure="not run") for case in reach.cases()}
    for (pipe, heading), pull in slopes.items():
        for drag in reach.DRAGS[heading]:
            name = reach.label(pipe, heading, drag)
            found[name] = trial(name, 5e-3 + (LIMIT - 5e-3) * drag / pull)
    return found


def test_a_pull_is_where_the_way_passes_the_recoil():
    found = reach.pull(outcomes({(30, reach.UPRIGHT): 12.0}), 30, reach.UPRIGHT)
    assert (found.low, found.high) == pytest.approx((10e-3, 15e-3))
    assert found.estimate == pytest.approx(12e-3)
    strong = reach.pull(outcomes({(30, reach.UPRIGHT): 1e3}), 30, reach.UPRIGHT)
    assert strong.low == pytest.approx(25e-3)
    assert math.isinf(strong.high)
    assert math.isnan(reach.pull(outcomes({}), 30, reach.UPRIGHT).low)


def verdicts(found, words):
    return [row.verdict for row in reach.rows(found, None) if words in row.claim]


def test_proportions_and_speeds():
    pulls = {(30, reach.UPRIGHT): 12.0, (36, reach.UPRIGHT): 12.1, (41, reach.UPRIGHT): 6.5}
    found = outcomes(pulls)
    assert verdicts(found, "over 30 mm") == [AGREES, AGREES]
    assert verdicts(found, "slower the more") == 3 * [AGREES]
    assert verdicts(found, "carries up") == 3 * [DISAGREES]
    assert verdicts(found, "level distance") == 3 * [UNKNOWN]
    apart = outcomes({**pulls, (36, reach.UPRIGHT): 4.0})
    assert verdicts(apart, "36 mm over 30 mm") == [DISAGREES]


def test_a_robot_that_does_not_climb_by_itself_pulls_nothing():
    found = outcomes({(30, reach.UPRIGHT): -1.0, (36, reach.UPRIGHT): 12.0})
    for drag in reach.DRAGS[reach.UPRIGHT]:
        name = reach.label(30, reach.UPRIGHT, drag)
        found[name] = trial(name, 0.5e-3)
    assert reach.pull(found, 30, reach.UPRIGHT) == reach.Pull(0.0, 0.0, 0.0)
    assert verdicts(found, "36 mm over 30 mm") == [DISAGREES]
    assert verdicts(found, "slower the more")[0] == UNKNOWN


@pytest.mark.parametrize(("pull", "verdict"), [(450.0, DISAGREES), (100.0, AGREES)])
def test_level_distance(pull, verdict):
    """300 to 600 mN are 13.6 m and more, 0 to 300 mN up to 20 m."""
    found = outcomes({(36, reach.LEVEL): pull})
    assert verdicts(found, "level distance, by the pull against friction; 36 mm") == [verdict]
