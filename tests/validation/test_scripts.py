"""Every script: its cases load, the quick ones are among them, and it copes with no outcome."""

import numpy as np
import pytest

from validation import air
from validation.__main__ import SCRIPTS
from validation.cases import SCENES, outcomes_by_name
from validation.constants import CONSTANTS
from validation.statements import STATEMENTS
from validation.verdicts import DISAGREES, MODELS, TRIAL, UNKNOWN


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.name)
@pytest.mark.physics
def test_script_without_outcomes(script, tmp_path):
    cases = script.cases()
    keys = {case.key for case in cases}
    assert len(keys) == len({case.name for case in cases}) == len(cases)
    assert {case.name for case in script.chosen(quick=True)} == set(script.quick or ())
    outcomes = outcomes_by_name(cases, {})
    points = {name: np.array([1.0]) for name in (*script.columns, "spread")}
    rows = list(script.rows(outcomes, points))
    assert {row.verdict for row in rows} == {UNKNOWN}
    assert {row.statement for row in rows} <= set(STATEMENTS)
    assert {row.model for row in rows} <= {"", TRIAL, *MODELS}
    assert len({row.claim for row in rows}) == len(rows)
    assert list(script.remarks(outcomes)) == []
    script.draw(outcomes, points, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 0
    assert DISAGREES not in {row.verdict for row in script.rows(outcomes, None)}


def test_names_are_unique():
    assert len({script.name for script in SCRIPTS}) == len(SCRIPTS)
    assert len({statement.text for statement in STATEMENTS}) == len(STATEMENTS) <= 60


@pytest.mark.parametrize(
    "overrides", [air.deflation(1.3, 11.0, 2), air.natural_deflation(4.2, 6.0, 2)]
)
def test_a_run_ends_with_its_last_cycle(overrides):
    """Not before the end of the last fall, and within 1 ms of it."""
    from softsim.loads.profile import built_profile
    from softsim.scene.loading import load_scene

    scene = load_scene(SCENES / "pfr_36mm.yaml", overrides).scene
    profile = built_profile(scene.loads["air"].profile, scene.time.end)
    assert 0.0 <= scene.time.end - profile.times[-1] < 1e-3
    assert profile.values.max() == pytest.approx(23e3)


@pytest.mark.parametrize("constant", CONSTANTS, ids=lambda constant: constant.name)
def test_constants_stand_in_the_scenes(constant):
    described = constant.described()
    assert described["value"] not in ("", "default") and ".yaml:" in described["where"]
