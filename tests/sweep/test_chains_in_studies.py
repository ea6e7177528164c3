"""Chains as cases of a study: swept and fitted as scenes are."""

from contextlib import nullcontext
from pathlib import Path

import pytest
from trial_stand_ins import PoolHere

import softsim
from softsim.apps.chain.running import run_chain
from softsim.apps.chain.scene import load_chain
from softsim.errors import SceneError

CHAIN = Path(__file__).parents[2] / "scenes/chains/leafbot5_table.yaml"
KEYS = {
    "model": "chain",
    "scene": str(CHAIN),
    "set": {"time.end": "0.15 s"},
    "factors": {"stiffness": {"key": "limbs.stiffness", "values": ["200 N/m", "250 N/m"]}},
    "measures": {
        "speed": {"of": "speed", "unit": "mm/s"},
        "fast": {"of": "further_speeds.fast", "unit": "mm/s"},
        "head": {"of": "contact_shares", "take": "first"},
    },
    "design": {"kind": "grid"},
}


@pytest.fixture
def here(tmp_path, monkeypatch):
    """In an empty folder; who is asked for workers gets this thread."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("softsim.sweep.study.pool_for", lambda *asked: nullcontext(PoolHere()))
    return tmp_path


@pytest.mark.physics
def test_a_sweep_finds_what_runs_find(here):
    table = softsim.Study(**KEYS).run("swept")
    alone = run_chain(load_chain(CHAIN, ["time.end=0.15 s"]), here / "alone").summary
    fast = ["time.end=0.15 s", "motor.frequency=186 Hz", "motor.further={}"]
    at_186 = run_chain(load_chain(CHAIN, fast), here / "fast").summary
    assert table["status"].to_list() == ["done", "done"]
    assert table["speed [mm/s]"][1] == pytest.approx(1e3 * alone["speed"], rel=1e-12)
    assert table["fast [mm/s]"][1] == pytest.approx(1e3 * at_186["speed"], rel=1e-12)
    assert table["head"][1] == pytest.approx(alone["contact_shares"][0], rel=1e-12)
    assert table["speed [mm/s]"][0] != table["speed [mm/s]"][1]


@pytest.mark.physics
def test_constants_are_fitted(here):
    """Trials of a known answer: the nearest of them is the best."""
    sought = {"match": {"speed": "38 mm/s", "fast": "49 mm/s"}, "trials": 3}
    factors = {"mass": {"key": "motor.eccentric_mass", "range": ["0.05 g", "0.12 g"]}}
    study = softsim.Study(**{**KEYS, "factors": factors, "optimize": sought, "design": None})
    table = study.optimize("fitted").sort("mismatch")
    assert table["status"].to_list() == ["done"] * 3
    best = table.row(0, named=True)
    parts = [(best["speed [mm/s]"] - 38.0) / 38.0, (best["fast [mm/s]"] - 49.0) / 49.0]
    assert best["mismatch"] == pytest.approx(sum(part**2 for part in parts))


@pytest.mark.physics
def test_two_sides_are_swept_and_scattered(here):
    """The left motor turns the robot to the right; sides that are drawn differ from run to run."""
    keys = {
        **KEYS,
        "scene": str(CHAIN.with_name("leafbot_x5_drag.yaml")),
        "set": {"time.end": "0.3 s"},
        "factors": {"running": {"key": "sides.running", "values": ["left", "right"]}},
        "measures": {"curvature": {"of": "curvature", "unit": "1/mm"}},
        "repeats": {"count": 2, "perturb": {"sides.left.motor_share": "5 %"}},
    }
    table = softsim.Study(**keys).run("swept")
    found = table["curvature [1/mm]"].to_list()
    signs = [value > 0.0 for value in found]
    assert signs == [running == "right" for running in table["running"]]
    assert len(set(found)) == 3  # the left motor's share means nothing where the right one runs


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"robot": "pfr"}, "a chain already is a robot"),
        (
            {"measures": {"way": {"of": "frame_displacement"}}},
            "no run of this scene has the result",
        ),
        ({"measures": {"head": {"of": "contact_shares"}}}, "has one number per node"),
        ({"set": {"time.cycles": 3}}, "there is no 'time.cycles'"),
        ({"optimize": {"maximize": "speed", "trials": 2, "prune": {}}}, "cannot be stopped early"),
    ],
)
def test_what_chains_have_not_is_refused(changes, message):
    with pytest.raises(SceneError) as caught:
        softsim.Study(**{**KEYS, **changes})
    assert message in str(caught.value)
