"""Leafbot's trials before terrain: which are run, how they are judged, what Eq 5.26 says."""

import numpy as np
import pytest

from softsim.builder import build_model
from validation import leafbot_terrain as script
from validation.cases import Outcome
from validation.verdicts import AGREES, DISAGREES, UNKNOWN

RAMP = script.RAMPS[0]  # 30 deg, 10 mm


def robots(*passed):
    return [Outcome("a", summary={"crossing": {"passed": float(p)}}) for p in passed]


def test_trials_differ_and_have_the_same_draws_in_all_cells():
    found = script.cases()
    assert len(found) == len({case.name for case in found}) == 3 * (7 * script.TRIALS + 6)
    assert np.abs(script.draws()).max() <= 1.0
    assert len({script.foot_of(n) for n in range(script.TRIALS)}) == script.TRIALS


@pytest.mark.parametrize("terrain", [script.RAMPS[-1], script.SEMICIRCLES[0]])
def test_a_case_is_a_model_that_knows_its_goal(terrain):
    model = build_model(script.case(terrain, 9, 0).loaded)
    width = {"ramp": 0.0, "semi": 20e-3}[terrain.name[:4]]
    assert model.crossing.goal == pytest.approx(1e-3 * script.foot_of(0) + width, abs=1e-6)


def test_a_share_has_wilson_s_interval():
    """Of 8 of 10 from 0.4901 to 0.9433 (Wilson 1927)."""
    assert script.interval(8, 10) == pytest.approx((0.4901, 0.9433), abs=1e-4)
    assert script.share_in_words(8, 10) == "8 of 10, 0.49 to 0.94"
    assert np.isnan(script.interval(0, 0)).all()


@pytest.mark.parametrize(
    ("passed", "claimed", "verdict"),
    [
        ((1, 1, 1, 1, 0), 1.0, AGREES), ((1, 1, 1, 0, 0), 1.0, DISAGREES),
        ((0, 0, 0, 0, 0), 0.1, AGREES),
    ],
)  # fmt: skip
def test_a_cell_agrees_within_three_tenths(passed, claimed, verdict):
    assert script.near(robots(*passed), claimed).verdict == verdict
    unfinished = [*robots(*passed[1:]), Outcome("b", failure="it broke")]
    assert script.near(unfinished, claimed).verdict == UNKNOWN


def held(front, touching):
    """What 5.26 says of a robot with five rows that goes at a steady speed, its front at `front`
    [mm], with these rows (5,) touching all the time.
    """
    t = np.linspace(0.0, 1.0, 101)
    history = {"time": t, "frame_x": 1e-3 * (front - 11.0 + 0.1 * t), "frame_y": 0.0 * t}
    history["front_x"] = history["frame_x"] + 11e-3
    for k, force in enumerate(touching):
        history[f"row_force_body.limb{k + 1}"] = np.full(101, force)
    return script.kept_grip(Outcome("a", history=history), RAMP, 5, 0, 0.0)


def test_the_condition_for_no_slip():
    """mu g (1.5 g) of three rows against (2.6 g) g (sin 30 deg - mu) cos 30 deg: with friction 0.7
    the head's own grip is enough; in the air its weight needs two of the three rows, or more.
    """
    assert held(50.0, (1, 0, 0, 0, 0)) == 1.0
    assert held(50.0, (0, 0, 0, 0, 0)) == 0.0
    mu = script.friction_of(0)
    enough = mu * 1.0 >= 2.6 * 0.5 * np.cos(np.radians(30.0))
    assert held(50.0, (0, 0, 1, 1, 0)) == float(enough)
    assert np.isnan(held(20.0, (1, 1, 1, 1, 1)))  # not at the ramp
