"""A rigid body on a tendon to a force gauge: closed forms of a mass on a spring that only pulls.

A scene needs a meshed body: a soft block far away, which does not limit the step.
"""

import io

import numpy as np
import pytest
from rich.console import Console

from softsim.compute import fields

MASS, STIFFNESS, FORCE, SLACK, SPEED = 10e-3, 2e3, 0.5, 3e-3, 0.4
OMEGA = np.sqrt(STIFFNESS / MASS)

FAR = """
bodies:
  far: {mesh: {generator: block, length: 100 mm, height: 100 mm, element_size: 100 mm},
        formulation: plane_strain, thickness: 1 mm, material: soft, position: [1 m, 1 m]}
materials: {soft: {law: neo_hooke, C10: 10 Pa, density: 1000 kg/m^3}}
environment: {gravity: 0 m/s^2}
time: {end: 1 s}
"""
PULLED = (
    FAR
    + f"""
rigid_bodies: {{robot: {{mass: {MASS} kg, inertia: 1 kg*mm^2}}}}
loads:
  walk: {{kind: rigid_force, acts_on: robot, force: [{FORCE} N, 0 N]}}
  gauge: {{kind: tendon, acts_on: robot, stiffness: {STIFFNESS} N/m}}
"""
)
THROWN = (
    FAR
    + f"""
rigid_bodies:
  robot: {{mass: {MASS} kg, inertia: 1 kg*mm^2,
          initial_velocity: [{0.6 * SPEED} m/s, {0.8 * SPEED} m/s]}}
loads:
  gauge: {{kind: tendon, acts_on: robot, stiffness: {STIFFNESS} N/m, slack: {SLACK} m,
          direction: [-3, -4]}}
"""
)


def displacement(solver):
    """Of the robot's centre (2,) [m]."""
    bodies = solver.terms.rigid_bodies
    return fields.read(bodies.centre)[0, 0] - bodies.rest_centre[0]


def test_the_gauge_shows_the_force(build, start, record_verification):
    """At rest k e = F, by dynamic relaxation: local damping takes 0.8 of each swing's way away, so
    that thousands of increments leave round-off.
    """
    solver = start(build(PULLED, "time.procedure=static"))
    solver.advance(4000)
    found = STIFFNESS * displacement(solver)[0]
    record_verification("robot on a tendon at rest: tension [N]", FORCE, found)
    assert found == pytest.approx(FORCE, rel=1e-9)


def test_frequency_while_taut(build, fresh_taichi, record_verification):
    """A sudden force F swings the robot as F/k (1 - cos omega t), always taut. The half-step scheme
    shortens the period by the share (omega dt)^2 / 24, of second order.
    """
    from softsim.solver.explicit import ExplicitSolver

    solver = ExplicitSolver([build(PULLED)])
    memory, periods, errors = solver.state(), [], []
    for steps in (40, 80):  # a period
        dt = 2.0 * np.pi / OMEGA / steps
        solver.restore(memory, 0.0, 0, dt)
        solver.begin(dt)
        x = []
        for _ in range(10 * steps + steps // 2):
            solver.advance(1)
            x.append(displacement(solver)[0] - FORCE / STIFFNESS)
        # A straight line between two samples crosses zero where the swing does, to (omega dt)^3.
        k = np.flatnonzero((np.array(x[:-1]) < 0.0) & (np.array(x[1:]) >= 0.0))
        crossing = k - np.array(x)[k] / np.diff(x)[k]
        periods.append(np.diff(crossing).mean() * dt)
        errors.append(periods[-1] * OMEGA / (2.0 * np.pi) - 1.0)
        share = (2.0 * np.pi / steps) ** 2 / 24.0
        assert errors[-1] == pytest.approx(-share, rel=0.05)
    order = np.log2(errors[0] / errors[1])
    found = 1.0 / periods[1]
    record_verification("robot on a tendon: frequency [Hz]", OMEGA / (2 * np.pi), found, order)
    assert order == pytest.approx(2.0, abs=0.1)


def test_thrown_into_a_slack_tendon(build, fresh_taichi, record_verification):
    """It flies 3 mm until the tendon is taut, turns round within half a period at a tension of
    v sqrt(k m), and flies back as fast as it came: while slack, nothing pulls.

    The time on the tendon is off by a step at most, the tension by (omega dt)^2 / 8 where its
    peak lies between two steps; a hit within a step is off by (omega dt)^2 of the energy.
    """
    from softsim.solver.energy import EnergyReader
    from softsim.solver.explicit import ExplicitSolver

    model = build(THROWN)
    solver, angle = ExplicitSolver([model]), 0.01
    reader = EnergyReader(solver)
    dt = angle / OMEGA
    solver.begin(dt)
    before = reader.read()
    assert before.kinetic == pytest.approx(0.5 * MASS * SPEED**2, rel=1e-12)
    tension, way = [], []
    while solver.time < 2.0 * SLACK / SPEED + np.pi / OMEGA + 1e-3:
        solver.advance(1)
        way.append(displacement(solver) @ [0.6, 0.8])
        stored = reader.read().internal
        tension.append(np.sqrt(2.0 * STIFFNESS * max(stored, 0.0)))
    taut = np.array(tension) > 1e-9
    np.testing.assert_array_equal(taut, np.array(way) > SLACK)
    assert taut.sum() * dt == pytest.approx(np.pi / OMEGA, abs=dt)
    exact = SPEED * np.sqrt(STIFFNESS * MASS)
    assert max(tension) == pytest.approx(exact, rel=angle**2)
    after = reader.read()
    assert after.kinetic == pytest.approx(before.kinetic, rel=angle**2)
    assert after.external_work == 0.0
    back = (way[-1] - way[-2]) / dt
    assert back == pytest.approx(-SPEED, rel=angle**2)
    impulse = fields.read(solver.terms.loads[0].impulse)[0]
    assert impulse == pytest.approx(2.0 * MASS * SPEED, rel=angle**2)
    record_verification("thrown into a tendon: peak tension [N]", exact, max(tension))


def test_the_force_is_the_gradient_of_the_energy(build, start):
    """Central differences of k e^2/2, exact for a parabola but for eps E / h, about 1e-11 N here;
    beside the kink, where the tendon is slack, both are zero.
    """
    from softsim.solver.energy import EnergyReader

    solver = start(build(THROWN))
    reader, memory, h = EnergyReader(solver), solver.state(), 1e-6
    step, rest = solver.time_increment, memory["rigid_bodies/centre"].copy()

    def at(u):
        memory["rigid_bodies/centre"] = rest + u
        solver.restore(memory, 0.0, 0, step)
        solver.find_forces(step)
        return reader.read().internal, fields.read(solver.terms.rigid_bodies.force)[0, 0]

    for u, is_taut in (([4e-3, 5e-3], True), ([9e-3, -1e-3], True), ([-5e-3, 2e-3], False)):
        gradient = [(at(u + h * side)[0] - at(u - h * side)[0]) / (2.0 * h) for side in np.eye(2)]
        force = at(u)[1]
        assert bool(np.linalg.norm(force) > 1.0) is is_taut
        np.testing.assert_allclose(force, -np.array(gradient), atol=1e-9)


STIFF = """
bodies:
  b: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 0.5 mm},
      formulation: plane_strain, thickness: 5 mm, material: rubber, fixed: [left]}
rigid_bodies:
  plate: {mass: 1 mg, inertia: 1e-6 kg*mm^2, center: [2.2 mm, 1 mm], tied: [b.right]}
loads: {gauge: {kind: tendon, acts_on: plate, stiffness: 100 kN/mm, slack: 10 um}}
materials: {rubber: {law: yeoh, C10: 36 kPa, density: 1000 kg/m^3}}
environment: {gravity: 0 m/s^2}
solver: {bulk_viscosity: 0}
time: {end: 1 s}
"""


def test_a_stiff_tendon_on_a_light_body(build, start):
    """A plate of a milligram, lighter than the nodes tied to it, thrown again and again into a
    tendon far stiffer than the rubber behind it: at 0.95 of the step no energy comes in.
    """
    from softsim.solver.energy import EnergyReader
    from softsim.solver.stable_step import stable_step

    model = build(STIFF)
    limit = stable_step(model, model.points)
    assert limit.limit == "stiffness of a tendon"
    # The tied nodes may take a quarter of the milligram.
    assert limit.value == pytest.approx(np.sqrt(2.0 * 0.75e-6 / 100e6), rel=1e-9)
    assert limit.value < limit.stable
    solver = start(model, share=0.95)
    memory, reader = solver.state(), EnergyReader(solver)
    noise = np.random.default_rng(1).standard_normal(model.points.shape)
    memory["nodes/velocity"] = (1e-2 * noise * model.is_free)[None]
    memory["rigid_bodies/velocity"] = np.array([[[0.5, 0.0]]])
    step = solver.time_increment
    solver.restore(memory, 0.0, 0, step)
    solver.begin(step)
    before = reader.read().kinetic
    solver.advance(20_000)
    assert fields.read(solver.terms.loads[0].impulse)[0] > 0.0
    energies = reader.read()
    assert 0.0 < energies.kinetic + energies.internal < 1.05 * before


def test_goes_on_to_the_same_bits(build, fresh_taichi):
    """From a checkpoint in the middle of an interval, while taut."""
    from softsim.solver.explicit import ExplicitSolver

    model = build(THROWN)
    first, second = ExplicitSolver([model]), ExplicitSolver([model])
    dt = 0.01 / OMEGA
    first.begin(dt)
    first.advance(900)
    kept = first.state()
    assert kept["loads/0/impulse"][0] > 0.0
    second.restore(kept, first.time, first.increment_count, dt)
    for solver in (first, second):
        solver.advance(150)
    for name, array in first.state().items():
        np.testing.assert_array_equal(second.state()[name], array, err_msg=name)


def test_the_history_shows_the_mean_pull(write_scene, tmp_path, kernel_cache, monkeypatch):
    """The mean over ten whole periods of F (1 - cos omega t) is F; the swing's part that the last
    increment cuts off is an increment of these ten periods at most.
    """
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run

    end = 10 * 2.0 * np.pi / OMEGA
    overrides = [f"time.end={end} s", "time.increment=20 us"]
    results = run(
        write_scene(PULLED), overrides, tmp_path / "out", "cpu", console=Console(file=io.StringIO())
    )
    t, pull = results.history["time"], results.history["pull"]
    assert pull[0] == 0.0
    mean = (np.diff(t) * pull[1:]).sum() / t[-1]
    assert mean == pytest.approx(FORCE, rel=20e-6 / end)
    assert pull.max() == pytest.approx(2.0 * FORCE, rel=0.1)
