"""Cases: what their key depends on, that a stored one is not run again, and what a failure is."""

import io
import json

import pytest
from rich.console import Console

from softsim.errors import ExpectationError, StabilityError
from softsim.study import cases
from softsim.study.cases import DONE, Source
from softsim.study.cases import Case as StudyCase
from softsim.sweep.job import Job, write_outcome
from softsim.sweep.job import Outcome as Stored
from validation import cases as cases_module
from validation.cases import (
    NOT_IN_SUBSET,
    Case,
    LayoutCase,
    Outcome,
    outcomes_by_name,
    run_cases,
    simulate_and_draw,
)

BLOCK = """
bodies:
  block:
    mesh: {generator: block, length: 4 mm, height: 4 mm, element_size: 2 mm}
    formulation: plane_strain
    thickness: 10 mm
    material: dragon_skin_30
time:
  end: 2 ms
output: {history_interval: 0.5 ms}
"""

PIPE = """
environment:
  walls:
    pipe: {kind: pipe_path, diameter: 36 mm, start: [-25 mm, 0 mm], pipe: [{straight: 200 mm}]}
"""


@pytest.fixture
def block(tmp_path, monkeypatch):
    """A folder of scenes with a falling block."""
    (tmp_path / "block.yaml").write_text(BLOCK)
    monkeypatch.setattr(cases_module, "SCENES", tmp_path)
    return "block.yaml"


def quiet() -> Console:
    return Console(file=io.StringIO())


def test_key_is_that_of_what_is_run(block, monkeypatch):
    case = Case("a", block, ("time.end=3 ms",))
    assert case.key == Case("b", block, ("time.end=0.003 s",)).key
    assert case.key != Case("a", block, ("time.end=4 ms",)).key
    monkeypatch.setattr(cases, "source_digest", lambda: "other sources")
    assert case.key == case.key and Case("a", block, ("time.end=3 ms",)).key != case.key


def test_a_layout_gets_its_robot_and_what_is_asked(tmp_path, monkeypatch):
    (tmp_path / "pipe.yaml").write_text(PIPE)
    monkeypatch.setattr(cases_module, "SCENES", tmp_path)
    case = LayoutCase("a", "pipe.yaml", ("output.frame_interval=0.05 s",))
    scene = case.loaded.scene
    assert scene.expect.passes and "frame" in scene.rigid_bodies and scene.layout is not None
    assert scene.output.frame_interval == 0.05 and case.simulated_time == scene.time.end
    assert case.key == LayoutCase("b", "pipe.yaml", ("output.frame_interval=50 ms",)).key
    assert case.key != LayoutCase("a", "pipe.yaml").key


def test_a_layout_that_is_done_is_drawn_whether_or_not_it_is_passed(block, tmp_path, monkeypatch):
    faults = [
        None,
        ExpectationError("verdict passed, found stuck"),
        StabilityError("unstable"),
        None,
    ]
    sources = [Source(tmp_path / "pipe.yaml", "pfr")] * 3 + [Source(tmp_path / block)]
    jobs = [
        Job(StudyCase(i, source), f"key{i}", tmp_path / f"key{i}")
        for i, source in enumerate(sources)
    ]
    for job in jobs:
        job.folder.mkdir()
        (job.folder / "summary.json").write_text(json.dumps({"snapshot_field": "stretch"}))
    drawn = []
    monkeypatch.setattr(cases_module, "simulate", lambda jobs: faults)
    monkeypatch.setattr(cases_module, "draw_all", lambda folder, field: drawn.append(folder.name))
    assert simulate_and_draw(jobs) == faults
    assert drawn == ["key0", "key1"]


def test_a_stored_case_is_not_run_again(block, tmp_path, monkeypatch):
    case = Case("a", block)
    folder = tmp_path / "out" / "cases" / case.key
    folder.mkdir(parents=True)
    (folder / "summary.json").write_text(json.dumps({"status": "done", "mean_speed": None}))
    (folder / "history.csv").write_text("time,frame_x\ns,m\n0.0,1.0\n")
    missed = "it is done, outside what its scene expects"
    write_outcome(Job(StudyCase(0, case.source), case.key, folder), Stored(case.key, DONE, missed))
    monkeypatch.setattr(cases_module, "completed", lambda *_, **__: pytest.fail("it ran"))
    found = run_cases([case], tmp_path / "out", 1, quiet())[case.key]
    assert found.history["frame_x"].tolist() == [1.0] and not found.failure
    assert found.number("mean_speed") != found.number("mean_speed")  # NaN


def test_outcomes_are_named_and_what_was_not_run_says_so(block):
    run, left_out = Case("mine", block), Case("other", block, ("time.end=5 ms",))
    found = outcomes_by_name([run, left_out], {run.key: Outcome("another script's name")})
    assert found["mine"].name == "mine" and not found["mine"].failure
    assert found["other"].failure == NOT_IN_SUBSET
    assert found["other"].numbers("displacement_per_cycle").tolist() == []


@pytest.mark.slow
def test_cases_run_and_fail_on_their_own(block, tmp_path, kernel_cache, monkeypatch):
    """In real processes: one runs to its end, one is stopped by a guard; the block falls freely."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    fine = Case("fine", str(tmp_path / block))
    unstable = Case("unstable", str(tmp_path / block), ("time.increment=1 ms",))
    assert fine.key != unstable.key
    console = quiet()
    found = run_cases([fine, unstable, fine], tmp_path / "out", 2, console)
    assert len(found) == 2
    assert "time step" in found[unstable.key].failure
    outcome = found[fine.key]
    assert outcome.failure == "" and outcome.summary["threads"] == 1
    fallen = outcome.history["body_y"][-1] - outcome.history["body_y"][0]
    # Central differences fall g t (t - dt) / 2 from rest at a half step: below 1 % off here.
    assert fallen == pytest.approx(-0.5 * 9.81 * 2e-3**2, rel=0.05)
    assert "2 of 2 cases" in console.file.getvalue()
    again = run_cases([fine], tmp_path / "out", 2, quiet())[fine.key]
    assert again.summary["wall_time"] == outcome.summary["wall_time"]
