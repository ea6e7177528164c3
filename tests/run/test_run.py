"""Whole runs: folder, steps, threads, guards, expectations."""

import json
import os
import re

import numpy as np
import pytest
from batches import FALLING_STRIP, same_files, status

from softsim.errors import DeviceError, ExpectationError, OutputError, SceneError, StabilityError
from softsim.output.fields import read_frames
from softsim.output.history import read_history


def test_the_run_folder(write_scene, tmp_path, run):
    results = run(write_scene(FALLING_STRIP), out=tmp_path / "out")
    names = {p.name for p in (tmp_path / "out").iterdir()}
    assert {
        "scene.resolved.yaml", "summary.json", "history.csv", "results.vtkhdf", "checkpoint.h5",
        "run.log",
    } <= names  # fmt: skip
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    for key in ("scene", "device", "precision", "node_count", "element_count", "time_increment",
                "increments", "simulated_time", "wall_time", "element_updates_per_second",
                "energy_error"):  # fmt: skip
        assert key in summary, key
    parts = summary["wall_times"]
    assert {"start", "kernel", "inspections", "rows", "frames", "checkpoints", "other"} == set(
        parts
    )
    assert sum(parts.values()) == pytest.approx(summary["wall_time"], rel=0.01)
    assert summary["status"] == "done"
    assert summary["simulated_time"] == pytest.approx(60e-3, rel=1e-9)
    history = read_history(tmp_path / "out" / "history.csv")
    assert history["time"][0] == 0.0
    assert history["time"][-1] == pytest.approx(60e-3, rel=1e-9)
    assert history["contact_count"].max() > 0
    frames = read_frames(tmp_path / "out" / "results.vtkhdf")
    assert len(frames) >= 6
    assert results.summary["energy_error"] < 0.05


def test_a_step_that_changed_by_a_fifth_is_told(write_scene, tmp_path, run):
    scene = write_scene("""
title: A strip is pulled
bodies:
  strip: {mesh: {generator: block, length: 10 mm, height: 2 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10}
environment: {gravity: 0 m/s^2}
conditions:
  hold: {kind: fixed, nodes: strip.left}
  pull: {kind: prescribed, nodes: strip.right, direction: x,
         displacement: {kind: ramp, value: 8 mm, duration: 20 ms}}
time: {end: 20 ms}
""")
    run(scene, out=tmp_path / "out")
    told = re.search(
        r"t = \S+ s: stable step \S+ us, limited by .+'strip'.+\(-2\d %\)",
        (tmp_path / "out" / "run.log").read_text(),
    )
    assert told


def test_a_profile_is_written_and_changes_nothing(write_scene, tmp_path, run):
    scene = write_scene(FALLING_STRIP)
    run(scene, "time.end=10 ms", out=tmp_path / "plain")
    summary = run(scene, "time.end=10 ms", out=tmp_path / "out", profile=True).summary
    same_files(tmp_path / "plain", tmp_path / "out")
    plain = json.loads((tmp_path / "plain" / "summary.json").read_text())
    assert "phases" not in plain
    written = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert written["phases"] == summary["phases"]
    assert sum(written["phases"].values()) == pytest.approx(1.0)
    assert {"elements", "integration", "contact"} <= set(written["phases"])
    assert {"phase", "name", "count", "seconds"} == set(written["profile"]["passes"][0])


def test_blocks_follow_the_size_of_the_model():
    """A million element updates lie between two, within 16 to 512 increments."""
    from softsim.solver.explicit import longest_block

    assert longest_block(40) == 1024
    assert longest_block(10_000) == 400
    assert longest_block(1_000_000) == 16


def test_the_first_inspection_comes_after_the_first_interval(
    write_scene, tmp_path, run, monkeypatch
):
    """The step at the start is known from taking it."""
    from softsim.run.callbacks import StableSteps
    from softsim.solver.stable_step import FIRST_INTERVAL

    done_at, inspect = [], StableSteps.inspect

    def watched(steps):
        done_at.append(steps.scenario.increment_count)
        inspect(steps)

    monkeypatch.setattr(StableSteps, "inspect", watched)
    run(write_scene(FALLING_STRIP), "time.end=1 ms", out=tmp_path / "out")
    assert done_at[0] == FIRST_INTERVAL


STIFF = "contact.penalty_stiffness=1000 kN/m"


def test_a_step_longer_than_advised_is_said_once(write_scene, tmp_path, run, build):
    """Contact asks for a shorter step than stability: a run goes on, and says it once."""
    from softsim.solver.stable_step import stable_step

    model = build(FALLING_STRIP, STIFF)
    found = stable_step(model, model.points)
    step = 0.5 * (found.value + found.stable)
    assert step > found.value
    run(
        write_scene(FALLING_STRIP), STIFF, f"time.increment={step} s", f"time.end={100 * step} s",
        out=tmp_path / "out",
    )  # fmt: skip
    log = (tmp_path / "out" / "run.log").read_text()
    assert log.count("longer than recommended") == 1
    assert "contact stiffness" in log


def test_threads_asked_for_are_threads_used(write_scene, tmp_path, run):
    from softsim.compute.machine import processor_count

    everything = processor_count()
    done = run(
        write_scene(FALLING_STRIP), "time.end=1 ms", out=tmp_path / "out", threads=everything
    )
    assert done.summary["threads"] == everything


def test_threads_that_do_not_fit_start_nothing(write_scene, tmp_path, run):
    with pytest.raises(DeviceError, match="--threads 0"):
        run(write_scene(FALLING_STRIP), out=tmp_path / "out", threads=0)
    assert not (tmp_path / "out").exists()


class TouchDown:
    """A stop condition that is met at the first contact."""

    name = "touch down"

    def __init__(self):
        self.rows, self.is_over = 0, False

    def see_row(self, row):
        self.rows += 1
        self.is_over = self.is_over or row["contact_count"] > 0


def test_a_stop_condition_ends_the_run_early(write_scene, tmp_path, run):
    condition = TouchDown()
    found = run(
        write_scene(FALLING_STRIP), out=tmp_path / "out", stop_conditions=[lambda _: condition]
    )
    assert (found.summary["status"], found.summary["ended_by"]) == ("done", "touch down")
    assert condition.rows == len(found.history["time"])
    np.testing.assert_array_equal(
        np.flatnonzero(found.history["contact_count"]), [condition.rows - 1]
    )
    assert found.summary["simulated_time"] == found.history["time"][-1] < 60e-3
    assert read_frames(tmp_path / "out" / "results.vtkhdf").times[-1] == found.history["time"][-1]


def test_a_stop_condition_of_a_resumed_run_has_seen_the_rows_before(write_scene, tmp_path, run):
    done = run(write_scene(FALLING_STRIP), "time.end=30 ms", out=tmp_path / "out")
    assert "ended_by" not in done.summary
    condition = TouchDown()
    run(
        write_scene(FALLING_STRIP),
        "time.end=30 ms",
        out=tmp_path / "out",
        resume=True,
        stop_conditions=[lambda _: condition],
    )
    assert condition.rows == len(done.history["time"])


def test_history_rows_keep_their_interval(write_scene, tmp_path, run):
    """A row at the last increment that does not end after each multiple of the interval."""
    history = run(write_scene(FALLING_STRIP), out=tmp_path / "out").history
    step = json.loads((tmp_path / "out" / "summary.json").read_text())["time_increment"]
    wanted = np.arange(len(history["time"])) * 1e-3
    assert len(wanted) == 61
    assert ((wanted - history["time"]) > -1e-12).all()
    assert ((wanted - history["time"]) < 1.3 * step).all()


def test_a_scene_in_which_nothing_happens_runs(write_scene, tmp_path, run):
    """Round-off is no energy error."""
    results = run(
        write_scene(FALLING_STRIP),
        "environment.gravity=0 m/s^2",
        "time.end=5 ms",
        out=tmp_path / "out",
    )
    assert results.summary["energy_error"] < 1e-3


TWO_BODIES = """
bodies:
  a: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10}
rigid_bodies:
  plain: {mass: 1 g, inertia: 1 g*mm^2, tied: [a.left], center: [-2 mm, 1 mm]}
  boxed: {mass: 1 g, inertia: 1 g*mm^2, tied: [a.right], center: [4 mm, 1 mm],
          outline: {length: 4 mm, height: 2 mm}}
environment: {walls: {floor: {kind: plane}}}
time: {end: 2 ms}
output: {frame_interval: 1 ms}
"""


def test_two_rigid_bodies_of_which_one_has_an_outline(write_scene, tmp_path, run):
    """Runs, and the snapshot shows one outline, at its own body."""
    from softsim.report.figures import draw_all

    run(write_scene(TWO_BODIES), out=tmp_path / "out")
    assert tmp_path / "out" / "snapshots.png" in draw_all(tmp_path / "out", "stretch")
    frames = read_frames(tmp_path / "out" / "results.vtkhdf")
    assert frames.described["outline_bodies"].tolist() == [1]
    assert frames.extra["frame_pose"][0].shape == (2, 3)


def test_expectations(write_scene, tmp_path, run):
    scene = write_scene(FALLING_STRIP + "expect: {body_displacement: {min: 1 m}}\n")
    with pytest.raises(ExpectationError, match="body_displacement"):
        run(scene, "time.end=5 ms", out=tmp_path / "out")
    assert status(tmp_path / "out") == "done"


def test_a_crushed_element_stops_the_run(write_scene, tmp_path, run):
    """A pressure far beyond the material: named, with place and time, and the frame is kept."""
    text = FALLING_STRIP + (
        "loads: {p: {kind: follower_pressure, facets: [strip.surface], "
        "profile: {kind: constant, value: 10 MPa, ramp: 2 ms}}}\n"
    )
    with pytest.raises(StabilityError, match=r"element \d+ of body 'strip'.*at t = ") as caught:
        run(write_scene(text), "solver.energy_error_limit=1e9", out=tmp_path / "out")
    assert caught.value.hint
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["status"] == "aborted"
    number = summary["failed_element"]
    assert summary["failure"].startswith(f"element {number} of body 'strip'")
    frames = read_frames(tmp_path / "out" / "results.vtkhdf")
    assert frames.times[-1] == pytest.approx(summary["simulated_time"])
    assert 0 <= number < len(frames.cells)


def test_the_energy_guard(write_scene, tmp_path, run):
    with pytest.raises(StabilityError, match="energy balance"):
        run(write_scene(FALLING_STRIP), "solver.energy_error_limit=1e-9", out=tmp_path / "out")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_an_unwritable_folder_is_said_at_once(write_scene, tmp_path, run):
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o500)
    with pytest.raises(OutputError, match="cannot write"):
        run(write_scene(FALLING_STRIP), out=locked / "out")


def test_bad_input_starts_nothing(write_scene, tmp_path, run):
    with pytest.raises(SceneError):
        run(write_scene(FALLING_STRIP), "time.end=-1 s", out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_run_ends_exactly_with_its_cycle(write_scene, tmp_path, run):
    """Up for 6 ms, down for 3, up for 3, down for 3: the second cycle ends at 15 ms."""
    air = """
loads:
  air: {kind: follower_pressure, facets: [strip.top],
        profile: {kind: cycles, highest: 2 kPa, inflation_rate: 333.3333333333333 kPa/s,
                  deflation_rate: 333.3333333333333 kPa/s, lowest: 1 kPa, count: 3}}
"""
    found = run(write_scene(FALLING_STRIP + air), "time.cycles=2", out=tmp_path / "out")
    assert (found.summary["ended_by"], found.summary["cycles_done"]) == ("cycles", 2)
    assert found.history["time"][-1] == pytest.approx(15e-3, rel=1e-12)
