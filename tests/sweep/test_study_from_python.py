"""`softsim.Study`: the same study from a file and from values, run, optimised, reported."""

import sys
from contextlib import nullcontext
from types import ModuleType

import numpy as np
import pytest
from falling_block import BLOCK
from trial_stand_ins import PoolHere

import softsim
from softsim.errors import ClusterError, SceneError
from softsim.study.cases import DONE
from softsim.sweep.study import refuse_unguarded_script

KEYS = {
    "scene": "block.yaml",
    "factors": {"time": {"key": "time.end", "range": ["2 ms", "12 ms"], "count": 6}},
    "measures": {"energy": {"of": "energy_error"}},
}
FALL = {
    "scene": "block.yaml",
    "set": {"time.end": "0.5 ms"},
    "factors": {"gravity": {"key": "environment.gravity", "values": ["1 m/s^2", "10 m/s^2"]}},
    "measures": {"way": {"of": "body_displacement_x", "unit": "nm"}},
    "design": {"kind": "grid"},
    "optimize": {"maximize": "way", "trials": 3},
}


@pytest.fixture
def here(tmp_path, write_scene, monkeypatch):
    """In a folder with the block's scene; who is asked for workers gets this thread."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("softsim.sweep.study.pool_for", lambda *asked: nullcontext(PoolHere()))
    return write_scene(BLOCK + "environment: {inclination: 30 deg}", "block.yaml").parent


def test_values_make_the_study_that_a_file_makes(here, study_file):
    from_file, from_values = softsim.Study(study_file), softsim.Study(**KEYS)
    assert [c.overrides for c in from_values.cases] == [c.overrides for c in from_file.cases]
    assert [c.values["time"] for c in from_values.cases] == [2, 4, 6, 8, 10, 12]
    longer = softsim.Study(study_file, ["solver.safety_factor=0.5"])
    assert "solver.safety_factor=0.5" in longer.cases[0].overrides


def test_a_place_is_named_by_its_keys(here):
    factors = {"count": {"key": "bodies.block.thickness", "values": [np.float64(3.0)]}}
    with pytest.raises(SceneError) as caught:
        softsim.Study(**{**KEYS, "factors": factors})
    assert str(caught.value.location) == "factors.count.values[0]"


@pytest.mark.parametrize(
    ("arguments", "keys"), [([], {}), (["a.yaml"], KEYS), ([None, ["a=b"]], KEYS)]
)
def test_a_study_comes_from_one_place(arguments, keys):
    with pytest.raises(TypeError, match="either a study file with overrides, or keys"):
        softsim.Study(*arguments, **keys)


def test_run_optimize_report(here, kernel_cache, monkeypatch):
    """A slope of 30 deg: half of gravity points back along it."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    study = softsim.Study(**FALL)
    table = study.run(device="cpu")
    assert table["status"].to_list() == [DONE, DONE]
    assert table["way [nm]"].to_list() == pytest.approx([-62.5, -625.0], rel=0.02)
    trials = study.optimize(device="cpu")
    assert len(trials) == 3 and set(trials["key"]) <= set(table["key"])
    assert set(trials["way [nm]"]) <= set(table["way [nm]"])
    page = study.report("runs/study_optimum")
    assert page.is_file() and (here / "runs" / "study_optimum" / "progress.png").is_file()


def test_a_script_without_a_guard_starts_nothing(here, monkeypatch):
    script, main = here / "script.py", ModuleType("__main__")
    main.__file__ = str(script)
    monkeypatch.setitem(sys.modules, "__main__", main)
    script.write_text("run()")
    with pytest.raises(ClusterError, match="in each of its worker processes") as caught:
        softsim.Study(**KEYS).run()
    assert "__main__" in caught.value.hint
    script.write_text('if __name__ == "__main__":\n    run()')
    refuse_unguarded_script()
