"""Derivatives at equilibrium against central differences of whole static runs."""

import pytest

from softsim.errors import Option, SceneError, SimulationError

RUBBER = "{law: yeoh, C10: 36 kPa, C20: 0.25 kPa, C30: 0.023 kPa, density: 1070 kg/m^3}"

SKIN = f"""
bodies:
  skin: {{mesh: {{generator: pfr_meridian, outer_diameter: 17.2 mm, free_length: 30.5 mm,
                 element_size: 0.9 mm}},
         formulation: axisymmetric, material: rubber, fixed: [ends]}}
materials: {{rubber: {RUBBER}}}
environment: {{gravity: 0 m/s^2}}
loads:
  air: {{kind: added_volume, facets: [skin.chamber],
        profile: {{kind: smooth_step, value: 5 ml, duration: 0.3 s}}}}
time: {{end: 0.3 s, procedure: static}}
solver: {{equilibrium_tolerance: 1e-10}}
output:
  history_interval: 25 ms
  frame_interval: 1 s
  probes: {{outer: {{kind: radius, nodes: skin.equator_outer}}}}
"""

BEAM = f"""
bodies:
  beam: {{mesh: {{generator: block, length: 30.4 mm, height: 8.4 mm, element_size: 1 mm}},
         formulation: plane_strain, thickness: 12 mm, material: rubber, fixed: [left]}}
materials: {{rubber: {RUBBER}}}
rigid_bodies:
  weight: {{mass: 4 g, inertia: 100 g*mm^2, center: [18 mm, 5 mm], tied: [beam.right]}}
contact: {{friction_coefficient: 0, damping_ratio: 0}}
environment:
  gravity: 9.81 m/s^2
  gravity_profile: {{kind: ramp, duration: 0.2 s}}
  walls: {{floor: {{kind: plane, point: [0 mm, -2 mm]}}}}
time: {{end: 0.2 s, procedure: static}}
solver: {{equilibrium_tolerance: 1e-9}}
output:
  history_interval: 40 ms  # small load steps, none of which is halved
  frame_interval: 1 s
  probes:
    tip: {{kind: displacement, nodes: beam.right}}
    root: {{kind: reaction, nodes: beam.left}}
"""

CASES = {
    "chamber in a skin": (
        SKIN,
        ["materials.rubber.C10", "materials.rubber.C20", "bodies.skin.mesh.outer_diameter",
         "bodies.skin.mesh.free_length", "loads.air.profile.value"],
        ["outer", "pressure", "internal_energy"],
    ),
    "beam with a weight on a wall": (
        BEAM,
        ["materials.rubber.C10", "bodies.beam.mesh.height", "bodies.beam.thickness",
         "rigid_bodies.weight.mass", "environment.walls.floor.point[1]"],
        ["tip_x", "tip_y", "wall_force_y", "root_y"],
    ),
}  # fmt: skip


@pytest.fixture
def solve(kernel_cache, monkeypatch, write_scene):
    """Function that runs a static scene to its end and returns the run."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.compute.machine import choose
    from softsim.run.batch import Batch, ReusedSolver
    from softsim.run.record import MemoryRecord
    from softsim.run.scenes import ready_model
    from softsim.scene.loading import load_scene

    choice, maker = choose("cpu", 1), ReusedSolver()

    def solved(text, *overrides):
        loaded = load_scene(write_scene(text), overrides)
        record = MemoryRecord(loaded, ready_model(loaded, choice))
        batch = Batch([record], choice, [()], make_solver=maker)
        [run] = batch.runs
        batch.act()
        while batch.running:
            batch.do_blocks()
        assert not isinstance(run.outcome, Exception), run.outcome
        return run

    return solved


@pytest.mark.physics
@pytest.mark.parametrize("text, paths, columns", CASES.values(), ids=CASES)
def test_differences_of_whole_runs(solve, text, paths, columns):
    from softsim.run.callbacks import Rows
    from softsim.run.statics import Parameter, derivatives

    run = solve(text)
    parameters = [Parameter.at(run.files.loaded, path, Option(path)) for path in paths]
    found = derivatives(run.stepping, run.callback(Rows).observer, parameters)
    for p in parameters:

        def difference(share, p=p):
            step = share * abs(p.value)
            rows = [
                solve(text, f"{p.path}={p.value + sign * step!r} {p.unit}").files.history.last
                for sign in (-1.0, 1.0)
            ]
            return {name: (rows[1][name] - rows[0][name]) / (2.0 * step) for name in columns}

        near, far = difference(2e-4), difference(4e-4)
        for name in columns:
            expected = (4.0 * near[name] - far[name]) / 3.0
            assert found[p.path][name] == pytest.approx(expected, rel=1e-6, abs=0.0), (p.path, name)


@pytest.mark.physics
def test_a_gradient_leaves_no_trace(write_scene, kernel_cache, monkeypatch):
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim import Simulation

    histories = []
    for is_asked in (False, True):
        simulation = Simulation(write_scene(SKIN))
        simulation.step(0.1)
        if is_asked:
            simulation.gradient("pressure", ["materials.rubber.C10"])
        simulation.step(0.2)
        histories.append(simulation.history)
    for name, values in histories[0].items():
        assert histories[1][name].tolist() == pytest.approx(values.tolist(), rel=0.0), name


@pytest.mark.physics
def test_refusals(write_scene, kernel_cache, monkeypatch):
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim import Simulation

    simulation = Simulation(write_scene(BEAM), ["contact.friction_coefficient=3"])
    with pytest.raises(SimulationError, match="no equilibrium has been found yet"):
        simulation.gradient("tip_y", ["materials.rubber.C10"])
    simulation.step(simulation.end_time)
    with pytest.raises(SimulationError, match="the history has no column 'tip_z'"):
        simulation.gradient("tip_z", [])
    with pytest.raises(SimulationError, match="'external_work' has no derivative"):
        simulation.gradient("external_work", [])
    for path in ("bodies.beam.fixed", "environment.walls.floor.point[0]"):
        with pytest.raises(SceneError, match="a derivative needs a number"):
            simulation.gradient("tip_y", [path])
            pytest.fail(path)
    with pytest.raises(SimulationError, match="depends on the path of the loads"):
        simulation.gradient("tip_y", ["materials.rubber.C10"])
