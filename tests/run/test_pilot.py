"""The pilot of `check`: loads played faster, and what is counted from it."""

import json
from pathlib import Path

import numpy as np
import pytest
from batches import FALLING_STRIP

from softsim.compute.machine import choose
from softsim.loads.nodal import NodalForce
from softsim.loads.prescribed import PrescribedMotion
from softsim.run.pilot import Mark, extrapolated, predicted_duration, time_scaled
from softsim.scene.loading import load_scene

SCENES = Path(__file__).parents[2] / "scenes"

BLOCK = """
bodies:
  b: {mesh: {generator: block, length: 10 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10}
conditions:
  pull: {kind: prescribed, nodes: b.right, direction: x,
         displacement: {kind: ramp, value: 5 mm, duration: 40 ms}}
loads:
  air: {kind: follower_pressure, facets: [b.top], factor: 0.5,
        profile: {kind: constant, value: 1 kPa, ramp: 20 ms}}
  push: {kind: nodal_force, nodes: b.left, force: [-10 mN, 0 N], ramp: 10 ms}
time: {end: 50 ms}
output: {history_interval: 1 ms}
"""


def test_time_scaled_loads_are_the_same_at_an_earlier_time(build):
    model = build(BLOCK)
    fast = time_scaled(model, 10.0)
    assert fast.end_time == pytest.approx(5e-3)
    assert fast.chamber is fast.pressures[0]
    t = np.linspace(0.0, 50e-3, 23)
    pairs = [
        (model.pressures[0].source.profile, fast.pressures[0].source.profile),
        (model.pressures[0].source.facet_profile, fast.pressures[0].source.facet_profile),
        (model.of_kind(PrescribedMotion)[0].profile, fast.of_kind(PrescribedMotion)[0].profile),
        (model.of_kind(NodalForce)[0].share, fast.of_kind(NodalForce)[0].share),
    ]
    for slow, sooner in pairs:
        assert np.ptp(slow.at(t)) > 0.0
        np.testing.assert_allclose(sooner.at(t / 10.0), slow.at(t), rtol=1e-12)


def test_a_pilot_at_its_end_is_counted_as_it_was():
    """But for its first block, which took 7 s for 100 increments: 900 took 3 s."""
    marks = [Mark(90.0, 0.0, 0), Mark(97.0, 0.1, 100), Mark(99.0, 0.4, 300), Mark(100.0, 1.0, 1000)]
    assert extrapolated(marks, 1.0) == (pytest.approx(3.0 / 0.9), 1000, 1.0)


def test_a_pilot_of_one_block_is_taken_as_it_is():
    assert extrapolated([Mark(5.0, 0.0, 0), Mark(7.0, 1.0, 40)], 1.0) == (2.0, 40, 1.0)


def test_a_pilot_that_was_stopped_goes_on_at_its_last_pace():
    """It saw 0.4 s in all, and its last quarter of the wall time made 0.1 s of it: the 0.6 s left
    take six times that.
    """
    marks = [Mark(0.0, 0.0, 0), Mark(0.0, 0.0, 0), Mark(3.0, 0.3, 100), Mark(4.0, 0.4, 300)]
    wall, increments, covered = extrapolated(marks, 1.0)
    assert wall == pytest.approx(4.0 + 6.0 * 1.0)
    assert increments == pytest.approx(300 + 6.0 * 200)
    assert covered == pytest.approx(0.4)


def test_increments_of_a_short_run_are_foreseen(write_scene, tmp_path, kernel_cache, monkeypatch):
    """Shorter than a pilot: the pilot is the run, but for one increment done to compile."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.builder import build_model
    from softsim.run import run

    loaded = load_scene(write_scene(FALLING_STRIP))
    foreseen = predicted_duration(loaded, build_model(loaded), choose("cpu", 1))
    done = run(loaded, out=tmp_path / "out", device="cpu", threads=1).summary
    assert foreseen.increment_count == pytest.approx(done["increments"], abs=2)
    assert foreseen.covered == pytest.approx(1.0)
    assert foreseen.threads == done["threads"] == 1
    assert foreseen.stopped == ""


def test_a_guard_that_stops_the_pilot_is_told(write_scene, kernel_cache, monkeypatch):
    """An energy error that no run keeps, between two rows of the history; and what the gauges show
    then.
    """
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.builder import build_model

    air = "{kind: follower_pressure, facets: [strip.surface], profile: {kind: constant, value: %s}}"
    limit = [
        "solver.energy_error_limit=1e-9", "output.history_interval=1 ms",
        f"loads={{rear: {air % '20 Pa'}, front: {air % '10 Pa'}}}",
    ]  # fmt: skip
    loaded = load_scene(write_scene(FALLING_STRIP), limit)
    foreseen = predicted_duration(loaded, build_model(loaded), choose("cpu", 1))
    assert foreseen.covered < 1.0
    gauges = "with 'rear' at 0.02 kPa, 'front' at 0.01 kPa"
    assert f"was stopped {gauges}: the energy balance is off" in foreseen.stopped


@pytest.mark.physics
def test_load_steps_are_counted(write_scene, tmp_path, kernel_cache, monkeypatch):
    """The trial of a static scene takes the load steps of the run; its loads are not faster."""
    from softsim.builder import build_model
    from softsim.run import run

    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    static = ["time.procedure=static", "conditions={}", "bodies.b.fixed=[left]",
              "loads.push.nodes=b.right"]  # fmt: skip
    loaded = load_scene(write_scene(BLOCK), [*static, "output.history_interval=5 ms"])
    foreseen = predicted_duration(loaded, build_model(loaded), choose("cpu", 1))
    done = run(loaded, out=tmp_path / "out", device="cpu", threads=1).summary["load_steps"]
    assert foreseen.increment_count == pytest.approx(done, abs=1)  # loads of the start are one
    assert (foreseen.covered, foreseen.stopped) == (1.0, "")


@pytest.mark.slow
def test_the_step_of_a_ballooning_skin_is_foreseen(tmp_path):
    """The step shrinks tenfold: of the step at rest alone the guess would be five times too low.

    Within a tenth up to the loads' end; what the run then settles is not in (some 3 % here). The
    pilot gets the time to see it all, on a busy machine too.
    """
    from softsim.builder import build_model
    from softsim.run import run

    loaded = load_scene(SCENES / "skin_inflation.yaml", ["time.method=relaxation"])
    foreseen = predicted_duration(loaded, build_model(loaded), choose("cpu", 1), pilot_time=60.0)
    run(loaded, out=tmp_path / "out", device="cpu", threads=1)
    done = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert foreseen.increment_count == pytest.approx(done["increments"], rel=0.1)
