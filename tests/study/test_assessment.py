"""The study that `softsim assess --repeats` runs."""

from pathlib import Path

import pytest

from softsim.errors import SceneError
from softsim.scene.loading import load_layout
from softsim.study.cases import resolved
from softsim.study.loading import Spread, repeated_assessment

LAYOUT = Path(__file__).parents[2] / "scenes" / "layouts" / "elbow_90_36mm.yaml"


def study(*overrides, **spread):
    loaded = load_layout(LAYOUT, "pfr", overrides)
    return repeated_assessment(LAYOUT, "pfr", loaded, Spread(**{"count": 10} | spread), overrides)


def test_friction_start_and_phase_fill_their_ranges_and_a_seed_draws_the_same():
    cases = study().cases()
    scenes = [resolved(case).scene for case in cases]
    friction = [scene.contact.friction_coefficient for scene in scenes]
    nominal = load_layout(LAYOUT, "pfr", []).scene
    mu = nominal.contact.friction_coefficient
    assert len(friction) == 10 and min(friction) >= 0.9 * mu and max(friction) <= 1.1 * mu
    # One in each tenth of the range.
    assert sorted(int((f / mu - 0.9) / 0.02) for f in friction) == list(range(10))
    start = nominal.environment.walls["pipe"].start[0]
    starts = [scene.environment.walls["pipe"].start[0] - start for scene in scenes]
    assert -2e-3 <= min(starts) < -1.5e-3 and 1.5e-3 < max(starts) <= 2e-3
    phases = [scene.loads["motor"].phase for scene in scenes]
    assert max(phases) - min(phases) > 5.0  # [rad]
    assert {scene.expect.passes for scene in scenes} == {True}

    assert [case.overrides for case in study().cases()] == [case.overrides for case in cases]
    assert [case.overrides for case in study(seed=2).cases()] != [c.overrides for c in cases]


def test_what_is_overridden_varies_about_its_value():
    cases = study("contact.friction_coefficient=0.4", "time.end=7 s", friction=0.5).cases()
    scenes = [resolved(case).scene for case in cases]
    friction = [scene.contact.friction_coefficient for scene in scenes]
    assert 0.2 <= min(friction) < 0.25 and 0.55 < max(friction) <= 0.6
    assert {scene.time.end for scene in scenes} == {7.0}


def test_nothing_that_varies_is_refused():
    motor = "loads.motor={kind: nodal_force, nodes: skin.knots, force: [0 N, 0 N]}"
    with pytest.raises(SceneError, match="nothing varies"):
        study(motor, friction=0.0, start=0.0)
