"""Scenarios side by side: each takes the course that it takes alone, whatever befalls another."""

import json
import weakref

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
def scene_file(write_scene, kernel_cache, monkeypatch):
    """The file of the scene."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    return write_scene(SCENE)


@pytest.fixture
def scenes(scene_file):
    """The cases' scenes, by name, with further settings."""
    from softsim.scene.loading import load_scene

    def load(*names, further=()):
        return [load_scene(scene_file, [*CASES[name], *further]) for name in names]

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


FROM_A_REUSED_SOLVER = {
    "rough": CASES["rough"],
    "thick": ["bodies.block.thickness=6 mm"],
    "soft": ["bodies.block.material=ecoflex_00_50"],
    "short": ["bodies.block.mesh.length=3.9 mm"],
    "held": ["bodies.block.fixed=[left]"],
    "weak contact": ["contact.penalty_stiffness=2 kN/m"],
    "low": ["environment.walls.floor.point=[0 mm, -1.01 mm]"],
}
FROM_A_NEW_SOLVER = {
    "fine": ["bodies.block.mesh.element_size=0.9 mm"],
    "walled": ["environment.walls.right={kind: plane, point: [2.1 mm, 0 mm], normal: [-1, 0]}"],
}


@pytest.fixture
def reused(monkeypatch):
    """A maker of solvers that counts those that it makes anew: `made`."""
    from softsim.run import batch

    class Counted(batch.ReusedSolver):
        made = 0

    maker, new_solver = Counted(), batch.new_solver

    def counted(models, choice):
        maker.made += 1
        return new_solver(models, choice)

    monkeypatch.setattr(batch, "new_solver", counted)
    return maker


def run_by(maker, path, overrides, folder):
    """The bytes of the history of a case whose solver this maker makes."""
    from softsim.run.record import FramelessFiles
    from softsim.run.scenes import run_case
    from softsim.scene.loading import load_scene

    run_case(load_scene(path, overrides), folder, "cpu", False, (), FramelessFiles, maker)
    assert not (folder / "results.vtkhdf").exists()
    assert not (folder / "checkpoint.h5").exists()  # nothing continues from its end
    return (folder / "history.csv").read_bytes()


@pytest.mark.physics
def test_a_reused_solver_gives_the_bytes_of_a_new_one(scene_file, reused, tmp_path):
    """After a case that was torn; another structure gets a new solver."""
    from softsim.run.batch import ReusedSolver

    with pytest.raises(StabilityError):
        run_by(reused, scene_file, CASES["torn"], tmp_path / "torn")
    assert len(read_frames(tmp_path / "torn" / "results.vtkhdf")) == 1  # shows why
    (tmp_path / "torn" / "results.vtkhdf").unlink()
    cases = FROM_A_REUSED_SOLVER | FROM_A_NEW_SOLVER
    histories = {
        name: run_by(reused, scene_file, overrides, tmp_path / name)
        for name, overrides in cases.items()
    }
    assert reused.made == 1 + len(FROM_A_NEW_SOLVER)
    assert len(set(histories.values())) == len(cases)
    for name, overrides in cases.items():
        anew = run_by(ReusedSolver(), scene_file, overrides, tmp_path / f"{name} anew")
        assert anew == histories[name], name


@pytest.mark.physics
def test_the_memory_of_a_solver_is_free_before_that_of_the_next_is_taken(
    scene_file, monkeypatch, tmp_path
):
    from softsim.run import batch

    new_solver, known = batch.new_solver, []

    def checked(models, choice):
        assert all(solver() is None for solver in known)
        solver, reader = new_solver(models, choice)
        known.append(weakref.ref(solver))
        return solver, reader

    monkeypatch.setattr(batch, "new_solver", checked)
    maker = batch.ReusedSolver()
    for name, overrides in FROM_A_NEW_SOLVER.items():
        run_by(maker, scene_file, overrides, tmp_path / name)
    assert len(known) == len(FROM_A_NEW_SOLVER) == 2
    assert known[-1]() is not None


@pytest.mark.physics
def test_static_cases_share_a_solver(scene_file, reused, tmp_path):
    """Check that static cases, by Newton's method and by relaxation, share a solver."""
    from softsim.run.batch import ReusedSolver

    static = ["environment.walls={}", "bodies.block.fixed=[left]", "time.procedure=static"]
    cases = {
        "stiff": static,
        "soft": [*static, "bodies.block.material=ecoflex_00_50"],
        "relaxed": [*static, "time.method=relaxation"],
        "again": static,
    }
    histories = {
        name: run_by(reused, scene_file, overrides, tmp_path / name)
        for name, overrides in cases.items()
    }
    assert reused.made == 1
    assert histories["again"] == histories["stiff"] != histories["soft"]
    for name in ("soft", "relaxed"):
        anew = run_by(ReusedSolver(), scene_file, cases[name], tmp_path / f"{name} anew")
        assert anew == histories[name], name
