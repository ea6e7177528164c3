"""A simulation in steps: the run's bits, commands, and back again."""

from dataclasses import replace

import numpy as np
import pytest
from batches import PRESSED_BLOCK, SLIDING_BLOCK

from softsim.errors import SceneError, SimulationError, StabilityError


@pytest.fixture
def simulate(write_scene, kernel_cache, monkeypatch):
    """A simulation of the scene on one thread."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim import Simulation

    return lambda *overrides: Simulation(write_scene(PRESSED_BLOCK), overrides, "cpu", 1)


def same(one, other):
    """The same rows, to the bit."""
    assert one.keys() == other.keys()
    for name, column in one.items():
        np.testing.assert_array_equal(column, other[name], err_msg=name)


def test_steps_of_any_length_are_the_run(simulate, run, write_scene, tmp_path):
    results = run(write_scene(PRESSED_BLOCK), out=tmp_path / "whole", threads=1)
    simulation = simulate()
    for duration in (1e-3, 0.3e-3, 0.123456789e-3, 5e-6, 2e-3):
        simulation.step(duration)
    middle = simulation.save()
    while not simulation.finished:
        simulation.step(min(0.7e-3, 20e-3 - simulation.time))
    same(simulation.history, results.history)
    assert simulation.time == results.summary["simulated_time"]
    assert simulation.record.summary["increments"] == results.summary["increments"]
    simulation.restore(middle)  # within a block of increments
    assert simulation.time < 4e-3
    simulation.step(20e-3 - simulation.time)
    same(simulation.history, results.history)
    simulation.reset()
    assert simulation.time == 0.0 and len(simulation.history["time"]) == 1
    simulation.step(20e-3)
    same(simulation.history, results.history)
    with pytest.raises(SimulationError, match=r"has ended at t = 0\.02 s"):
        simulation.step(1e-3)


@pytest.mark.starts(1)
def test_what_is_left_of_the_time_leads_to_the_end(simulate):
    """An overshoot of the step before does not leave an increment at the end."""
    simulation = simulate("time.end=2.03 ms")  # a short last block
    for part in np.linspace(0.3e-3, 1.7e-3, 11):
        simulation.reset()
        simulation.step(part)
        simulation.step(simulation.end_time - simulation.time)
        assert simulation.finished and simulation.time == simulation.end_time


@pytest.mark.starts(1)
def test_commands(simulate):
    simulation = simulate()
    scenario = simulation._scenario
    air = scenario.term_of(simulation.model.chamber)
    simulation.step(2e-3)
    assert simulation.time == pytest.approx(2e-3, abs=scenario.time_increment)
    middle = simulation.save()
    simulation.set_load("air", 1.6e3, within=1e-3)
    simulation.set_motor(frequency=200.0)
    simulation.step(0.5e-3)
    # From 0.8 kPa of the profile half the way; the section feels 0.5 kPa less.
    assert scenario.read(air.pressure) == pytest.approx(0.7e3, rel=1e-2)
    simulation.step(5e-3)
    assert scenario.read(air.pressure) == pytest.approx(1.1e3, rel=1e-12)
    assert simulation.history["pressure"][-1] == pytest.approx(1.6e3, rel=1e-12)
    simulation.set_load("air", 0.9e3)
    simulation.step(1e-3)
    assert scenario.read(air.pressure) == pytest.approx(0.4e3, rel=1e-12)
    first = simulation.history
    simulation.restore(middle)  # and once more
    simulation.set_load("air", 1.6e3, within=1e-3)
    simulation.set_motor(frequency=200.0)
    simulation.step(0.5e-3)
    simulation.step(5e-3)
    simulation.set_load("air", 0.9e3)
    simulation.step(1e-3)
    same(simulation.history, first)

    state = simulation.state()
    assert state.positions["b"].shape == state.velocities["b"].shape == (15, 2)
    assert state.contact_forces["b"][:, 1].min() >= 0.0
    assert state.contact_forces["b"][:, 1].sum() > 0.0
    assert state.poses["frame"].centre == pytest.approx([-40e-3, 5.1e-3], abs=1e-3)

    simulation.reset(seed=1)
    simulation.step(4e-3)
    drawn = simulation.history
    simulation.reset(seed=1)
    simulation.step(4e-3)
    same(simulation.history, drawn)
    simulation.reset(seed=2)
    simulation.step(4e-3)
    assert simulation.history["frame_y"][-1] != drawn["frame_y"][-1]

    rows = len(simulation.history["time"])
    foreign = replace(middle, model=replace(simulation.model))
    for refused, ask in (
        ("no chamber 'ari'", lambda: simulation.set_load("ari", 1.0)),
        ("no chamber 'motor'", lambda: simulation.set_load("motor", 1.0)),
        ("cannot change to nan", lambda: simulation.set_load("air", float("nan"))),
        ("no motor 'air'", lambda: simulation.set_motor(10.0, "air")),
        ("cannot be -1", lambda: simulation.set_motor(-1.0)),
        ("a step of -1", lambda: simulation.step(-1.0)),
        ("a step of 0", lambda: simulation.step(0.0)),
        ("the scene ends at 0.02 s", lambda: simulation.step(1.0)),
        ("duration of a step must be a number, not 'x'", lambda: simulation.step("x")),
        ("value of 'air' must be a number, not None", lambda: simulation.set_load("air", None)),
        ("no chamber 'None'", lambda: simulation.set_load(None, 1.0)),
        ("frequency of a motor must be a number", lambda: simulation.set_motor([1.0, 2.0])),
        (r"reset\(-1\): the seed must be a whole number", lambda: simulation.reset(-1)),
        (r"reset\('x'\)", lambda: simulation.reset("x")),
        ("of the same simulation", lambda: simulation.restore(None)),
        ("of the same simulation", lambda: simulation.restore(foreign)),
    ):
        with pytest.raises(SimulationError, match=refused):
            ask()
    assert len(simulation.history["time"]) == rows  # nothing was dropped before a refusal
    simulation.step(np.float32(1e-3))


def test_a_guard_stops_a_simulation_as_a_run(simulate, run, write_scene, tmp_path):
    limit = "solver.energy_error_limit=2e-5"
    with pytest.raises(StabilityError) as of_run:
        run(write_scene(PRESSED_BLOCK), limit, out=tmp_path / "out", threads=1)
    simulation = simulate(limit)
    with pytest.raises(StabilityError) as in_steps:
        while True:
            simulation.step(1e-3)
    assert str(in_steps.value) == str(of_run.value)
    assert simulation.finished
    simulation.reset()
    simulation.step(1e-3)
    simulate()  # another one
    with pytest.raises(SimulationError, match="another simulation") as ended:
        simulation.reset()
    assert "make a new Simulation" in str(ended.value)


def test_members_of_a_batch_with_self_contact(write_scene, kernel_cache, monkeypatch, short_lists):
    """Check that a restored member, one reset after a full list, and the other one run as alone."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim import Simulation, SimulationBatch

    scene = write_scene(SLIDING_BLOCK)
    batch = SimulationBatch(scene, 2, (), "cpu", 1)
    first, second = batch.simulations
    first.set_load("air", 2e3, within=2e-3)
    batch.step(2e-3)
    saved = first.save()
    batch.step(4e-3)
    assert "too many facets" in str(first.failure) and second.failure is None
    first.restore(saved)
    first.set_load("air", -4e3, within=1e-3)  # pulled back, so that it does not reach the stop
    batch.step([3e-3, 0.0])
    restored = first.history
    first.reset()
    first.set_load("air", 0.1e3)
    batch.step([5e-3, 1e-3])
    reset, other = first.history, second.history
    assert second.time > 6e-3 and first.failure is None is second.failure
    for history in (restored, reset, other):  # bodies touch to the end
        assert (np.diff(history["friction_dissipation"])[-3:] > 0.0).all()

    alone = Simulation(scene, (), "cpu", 1)  # which ends the batch
    alone.set_load("air", 2e3, within=2e-3)
    alone.step(2e-3)
    alone.set_load("air", -4e3, within=1e-3)
    alone.step(3e-3)
    same(alone.history, restored)
    alone.reset()
    alone.set_load("air", 0.1e3)
    alone.step(5e-3)
    same(alone.history, reset)
    alone.reset()
    alone.step(7e-3)
    same(alone.history, other)


def test_what_is_no_scene_is_refused():
    from softsim import Simulation

    with pytest.raises(SimulationError, match="a NoneType is not a scene"):
        Simulation(None)


def test_a_scene_said_in_python(write_scene):
    """A mapping, and the schema's object, are the scene that a file says."""
    import yaml

    from softsim import load_scene
    from softsim.scene.loading import scene_of, scene_said
    from softsim.scene.schema import Scene

    loaded = load_scene(write_scene(PRESSED_BLOCK), ["time.end=30 ms"])
    said = yaml.safe_load(PRESSED_BLOCK)
    from_dict = scene_said(said, ["time.end=30 ms"])
    assert from_dict.scene == loaded.scene
    assert (
        scene_of(Scene.model_validate(said)).scene == load_scene(write_scene(PRESSED_BLOCK)).scene
    )
    robot = scene_said({"include": "robot:pfr/section", "time": {"end": "1 ms"}})
    assert "skin" in robot.scene.bodies
    del said["bodies"]["b"]["material"]
    with pytest.raises(SceneError, match=r"the scene given in Python: .*material"):
        scene_said(said)
