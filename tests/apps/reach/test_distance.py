"""How far a robot of known pulls gets."""

import math

import numpy as np
import pytest

from softsim.apps.reach.distance import (
    Distance,
    TetherProperties,
    Way,
    distance,
    load_of,
    needed,
    straight_distance,
    ways,
)
from softsim.apps.reach.trials import Bracket, Heading, TrialPipe
from softsim.contact import pipe_layout
from softsim.contact.pipe_layout import Bend, Straight, Taper

WEIGHT, FRICTION = 0.03, (0.5, 0.75)
DOWN = np.array([0.0, -1.0, 0.0])
UPRIGHT_PIPE = np.array([-1.0, 0.0, 0.0])  # +x is up
LEVEL, UPRIGHT = (TrialPipe(36e-3, heading) for heading in (Heading.level, Heading.upright))
PULLS = {LEVEL: Bracket(0.15, 0.18), UPRIGHT: Bracket(0.06, 0.07)}


def way_of(*items: pipe_layout.Item) -> Way:
    [way] = ways(pipe_layout.network_of_items("pipe", items, {}, 36e-3, np.zeros(3), ()))
    return way


def found(*items: pipe_layout.Item, down: np.ndarray = DOWN) -> Distance:
    way = way_of(*items)
    least, most = (load_of(way, TetherProperties(WEIGHT, friction), down) for friction in FRICTION)
    return distance(way, (least, most), PULLS)


def test_straight_pipes_as_algebra_has_it() -> None:
    """P / (mu w) level, P / w upright: the ends of both bands are combined for the worst."""
    level = found(Straight(100.0))
    assert level.least == pytest.approx(0.15 / (0.75 * WEIGHT))
    assert level.most == pytest.approx(0.18 / (0.5 * WEIGHT))
    assert straight_distance(LEVEL, PULLS[LEVEL], WEIGHT, FRICTION) == pytest.approx(
        (level.least, level.most)
    )
    up = found(Straight(100.0), down=UPRIGHT_PIPE)
    assert (up.least, up.most) == pytest.approx((0.06 / WEIGHT, 0.07 / WEIGHT))
    assert straight_distance(UPRIGHT, PULLS[UPRIGHT], WEIGHT, FRICTION) == pytest.approx(
        (up.least, up.most)
    )


def test_an_open_bracket_and_a_tether_that_does_not_rub() -> None:
    assert straight_distance(LEVEL, Bracket(0.3, math.inf), WEIGHT, (0.0, 0.5)) == pytest.approx(
        (0.3 / (0.5 * WEIGHT), math.inf)
    )
    assert straight_distance(LEVEL, Bracket(0.0, 0.0), WEIGHT, (0.0, 0.0)) == (0.0, 0.0)


def test_a_pull_without_end_up_to_a_bend() -> None:
    """Level it pulls whatever is asked, upright next to nothing: it gets to the riser."""
    way = way_of(Straight(2.0), Bend(math.pi / 2, 60e-3, 0.0), Straight(5.0))
    loads = tuple(load_of(way, TetherProperties(WEIGHT, friction), DOWN) for friction in FRICTION)
    pulls = {LEVEL: Bracket(1.69, math.inf), UPRIGHT: Bracket(0.0, 0.012)}
    answer = distance(way, loads, pulls)
    assert 2.0 < answer.least <= answer.most < 2.1


def test_the_worse_of_both_frictions_counts() -> None:
    """With little friction most of the tether hangs, and the lower pull counts."""
    down = np.array([-math.sin(math.pi / 3), -math.cos(math.pi / 3), 0.0])
    way = way_of(Straight(100.0))
    loads = tuple(
        load_of(way, TetherProperties(WEIGHT, friction), down) for friction in (0.05, 0.3)
    )
    answer = distance(way, loads, {LEVEL: Bracket(0.55, 0.6), UPRIGHT: Bracket(0.05, 0.06)})
    assert answer.least < answer.most


def test_a_short_layout_is_passed() -> None:
    short = found(Straight(1.0))
    assert short.least == short.most == short.length == 1.0
    assert "all the way" in short.sentence


def test_a_bend_on_the_way_shortens_it() -> None:
    """Level all along: the bend multiplies the tension by more than exp(mu theta) would allow to
    forget.
    """
    level = np.array([0.0, 0.0, 1.0])
    bent = found(Straight(4.0), Bend(1.0, 0.06, 0.0), Straight(100.0), down=level)
    left = 0.15 - 4.0 * 0.75 * WEIGHT * math.exp(0.75)  # the tether's weight in the bend is small
    assert bent.least == pytest.approx(4.06 + max(left, 0.0) / (0.75 * WEIGHT), abs=0.1)
    assert bent.least < found(Straight(100.0), down=level).least


def test_only_trials_that_decide_are_needed() -> None:
    """Of a level pipe one, of one straight up one, of a bend between them both; each diameter."""
    tethers = [TetherProperties(WEIGHT, friction) for friction in FRICTION]

    def of(way: Way, down: np.ndarray) -> set[TrialPipe]:
        return needed(way, [load_of(way, tether, down) for tether in tethers])

    assert of(way_of(Straight(2.0)), DOWN) == {LEVEL}
    assert of(way_of(Straight(2.0)), UPRIGHT_PIPE) == {UPRIGHT}
    assert of(way_of(Straight(2.0), Bend(1.5, 0.06, 0.0), Straight(1.0)), DOWN) == {LEVEL, UPRIGHT}
    narrow = TrialPipe(30e-3, Heading.level)
    assert of(way_of(Straight(1.0), Taper(0.02, 30e-3)), DOWN) == {LEVEL, narrow}


def test_what_hangs_behind_a_robot_pulls_on_it_at_rest() -> None:
    """After a long rise a level pipe is no longer that of friction alone."""
    way = way_of(Straight(5.0), Bend(1.5, 0.06, math.pi), Straight(0.5))
    load = load_of(way, TetherProperties(WEIGHT, 0.1), np.array([-1.0, 0.0, 0.0]))
    assert load.uprightness[0] == 1.0
    assert 0.6 < load.uprightness[-1] < 0.9
