"""Scenarios side by side: each takes the course that it takes alone, whatever befalls another."""

import json

import numpy as np
import pytest

from softsim.errors import ExpectationError, OutputError, StabilityError
from softsim.output.fields import read_frames
from softsim.output.history import read_history

SCENE = """
bodies:
  block: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10}
loads: {pull: {kind: nodal_force, nodes: block.right, force: [20 mN, 0 mN]}}
environment: {inclination: 10 deg, walls: {floor: {kind: plane}}}
contact: {friction_coefficient: 0.4}
time: {end: 12 ms}
output: {history_interval: 1 ms, frame_interval: 5 ms}
"""
CASES = {
    "smooth": ["contact.friction_coefficient=0.1", "expect.body_displacement={min: 1 m}"],
    "torn": ["loads.pull.force=[100 N, 0 N]"],
    "rough": [
        "contact.friction_coefficient=0.8",
        "time.end=7.3 ms",
        "output.history_interval=2 ms",
    ],
}


@pytest.fixture
def scenes(write_scene, kernel_cache, monkeypatch):
    """The cases' scenes, by name, with further settings."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.scene.loading import load_scene

    path = write_scene(SCENE)

    def load(*names, further=()):
        return [load_scene(path, [*CASES[name], *further]) for name in names]

    return load


def alone(scene, folder):
    from softsim.run import run_batch

    return run_batch([scene], [folder], "cpu", 1)[0]


@pytest.mark.parametrize("further", [(), ("time.increment=8 us",)], ids=["own steps", "one step"])
def test_a_scenario_does_not_feel_the_others(scenes, tmp_path, further):
    """Other friction, end and rows; one ends outside of what it expects; one is torn."""
    from softsim.run import run_batch

    loaded = scenes(*CASES, further=further)
    folders = [tmp_path / name for name in CASES]
    smooth, torn, rough = run_batch(loaded, folders, "cpu", 1)
    assert isinstance(smooth, ExpectationError)
    assert isinstance(torn, StabilityError)
    assert rough.summary["simulated_time"] == pytest.approx(7.3e-3, rel=1e-12)
    np.testing.assert_allclose(rough.history["time"][:-1], [0, 2e-3, 4e-3, 6e-3], atol=2e-5)
    for name, scene in zip(CASES, loaded, strict=True):
        alone(scene, tmp_path / f"{name} alone")
        same_course(tmp_path / name, tmp_path / f"{name} alone")


def same_course(one, other):
    """To the bit where the same kernel did it; each number of scenarios has its own."""
    statuses = [json.loads((f / "summary.json").read_text())["status"] for f in (one, other)]
    assert statuses[0] == statuses[1]
    a, b = read_history(one / "history.csv"), read_history(other / "history.csv")
    for name, column in a.items():
        size = np.abs(column).max(initial=0.0)
        np.testing.assert_allclose(column, b[name], rtol=0.0, atol=1e-8 * size, err_msg=name)
    times = [read_frames(folder / "results.vtkhdf").times for folder in (one, other)]
    np.testing.assert_allclose(*times, rtol=1e-9)


def test_two_into_one_folder_are_one_and_a_refusal(scenes, tmp_path):
    from softsim.run import run_batch

    loaded = scenes("rough", "rough")
    first, second = run_batch(loaded, [tmp_path / "out", tmp_path / "out"], "cpu", 1)
    assert first.summary["status"] == "done"
    assert isinstance(second, OutputError) and "is using the folder" in second.message


@pytest.mark.physics
def test_a_reused_solver_gives_the_bytes_of_a_new_one(scenes, tmp_path):
    """After a case that was torn; another structure gets a new solver."""
    from softsim.run.batch import ReusedSolver, new_solver
    from softsim.run.record import FramelessFiles
    from softsim.run.scenes import run_case

    reused, solvers = ReusedSolver(), []

    def make(models, choice):
        made = reused(models, choice)
        solvers.append(made[0])
        return made

    def run(scene, name, maker):
        return run_case(scene, tmp_path / name, "cpu", False, (), FramelessFiles, maker)

    torn, rough = scenes("torn", "rough")
    [thick] = scenes("rough", further=["bodies.block.thickness=6 mm"])
    with pytest.raises(StabilityError):
        run(torn, "torn", make)
    assert len(read_frames(tmp_path / "torn" / "results.vtkhdf")) == 1  # shows why
    for name, scene in {"rough": rough, "thick": thick}.items():
        run(scene, name, make)
    assert solvers[0] is solvers[1] and solvers[1] is not solvers[2]
    for name, scene in {"rough": rough, "thick": thick}.items():
        run(scene, f"{name} anew", new_solver)
        one, other = (tmp_path / folder / "history.csv" for folder in (name, f"{name} anew"))
        assert one.read_bytes() == other.read_bytes()
        assert not (tmp_path / name / "results.vtkhdf").exists()
