"""What the calibration does when a body breaks or does not press hard enough; nothing is run."""

import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from softsim.apps.calibration import running as experiments
from softsim.apps.calibration.experiments import section_specimen
from softsim.apps.calibration.running import FARTHEST, Laboratory, Settings
from softsim.errors import StabilityError
from softsim.output.history import History
from softsim.scene.loading import load_scene

SCENES = Path(__file__).parents[3] / "scenes"
COLUMNS = {
    "time": "s", "pressure": "Pa", "wall_force_normal": "N", "rows_in_contact": "1",
    "internal_energy": "J", "kinetic_energy": "J",
}  # fmt: skip
FORCE_PER_PRESSURE = 1e-4


@pytest.fixture
def laboratory(tmp_path):
    settings = Settings(10e3, 0.1, None, 14, tmp_path, "cpu", "1")
    return Laboratory(settings, Console(file=io.StringIO()))


@pytest.fixture
def section():
    return section_specimen(load_scene(SCENES / "pfr_36mm.yaml"))


@pytest.fixture
def pressing(monkeypatch):
    """`run` as a wall that feels FORCE_PER_PRESSURE p, of a body that breaks at a pressure."""
    ends = []

    def start(breaks_at):
        def run(scene, out, **_):
            (load,) = scene.scene.loads.values()
            highest = load.profile.points[-1][1]
            ends.append(highest)
            out.mkdir(parents=True, exist_ok=True)
            history = History(out / "history.csv", COLUMNS)
            for p in np.linspace(0.0, min(highest, breaks_at), 50):
                row = [p, p, FORCE_PER_PRESSURE * p, 1.0, 1.0, 0.0]
                history.append(dict(zip(COLUMNS, row, strict=True)))
            history.close()
            if highest > breaks_at:
                raise StabilityError("element 7 is crushed")
            return type("Results", (), {"history": {}})

        monkeypatch.setattr(experiments, "run", run)
        monkeypatch.setattr(experiments, "draw_all", lambda *_: [])
        return ends

    return start


def test_a_section_is_inflated_until_it_presses_hard_enough(laboratory, section, pressing):
    ends = pressing(breaks_at=np.inf)
    curve = laboratory.section_pressed(section, due=FORCE_PER_PRESSURE * 35e3)
    assert ends == pytest.approx([10e3, 20e3, 40e3])
    assert curve.force.max() >= FORCE_PER_PRESSURE * 35e3
    assert laboratory.remarks == []


def test_a_section_that_breaks_counts_up_to_there_and_it_is_told(laboratory, section, pressing):
    ends = pressing(breaks_at=15e3)
    curve = laboratory.section_pressed(section, due=FORCE_PER_PRESSURE * 35e3)
    assert ends == pytest.approx([10e3, 20e3])
    assert curve.highest == pytest.approx(15e3, rel=1.0 / 49.0)  # the last of 49 intervals
    (remark,) = laboratory.remarks
    assert "the section failed at" in remark and "element 7 is crushed" in remark


def test_a_section_that_never_presses_hard_enough_ends(laboratory, section, pressing):
    ends = pressing(breaks_at=np.inf)
    laboratory.section_pressed(section, due=1e6)
    assert ends[-1] == pytest.approx(FARTHEST * 10e3)
    (remark,) = laboratory.remarks
    assert "less than the 1e+06 N required" in remark
