"""A rigid body that trails a tether: closed forms of friction with memory, weight and stiffness.

A scene needs a meshed body: a soft block far away, which does not limit the step. A spring in the
half-step scheme swings at omega' with sin(omega' dt / 2) = omega dt / 2, exactly.
"""

import io

import numpy as np
import pytest
from rich.console import Console

from softsim.compute import fields

MASS, INERTIA, DRAG, SPRING, TURNING = 10e-3, 1e-6, 20e-3, 200.0, 0.4e-3
G, WEIGHT, ARM = 9.81, 5e-3, 16e-3
OMEGA, PITCH = np.sqrt(SPRING / MASS), np.sqrt(TURNING / INERTIA)
DT, LOOKS = 0.01 / OMEGA, 1000

FAR = """
bodies:
  far: {mesh: {generator: block, length: 100 mm, height: 100 mm, element_size: 100 mm},
        formulation: plane_strain, thickness: 1 mm, material: soft, position: [1 m, 1 m]}
materials: {soft: {law: neo_hooke, C10: 10 Pa, density: 1000 kg/m^3}}
environment: {gravity: 0 m/s^2}
time: {end: 1 s}
"""
PLANE = (
    FAR
    + f"""
rigid_bodies: {{robot: {{mass: {MASS} kg, inertia: {INERTIA} kg*m^2}}}}
loads:
  walk: {{kind: rigid_force, acts_on: robot, force: [0 N, 0 N]}}
  tail: {{kind: tether, acts_on: robot, drag: {DRAG} N}}
"""
)
SPACE = (
    FAR.replace("generator: block", "generator: box, width: 100 mm").replace(
        "plane_strain, thickness: 1 mm", "solid"
    )
    + """
rigid_bodies: {robot: {mass: 10 g, inertia: [0.5 kg*mm^2, 1 kg*mm^2, 2 kg*mm^2]}}
loads:
  tail: {kind: tether, acts_on: robot, drag: 0 N, roll_stiffness: 0.1 N*mm/rad,
         yaw_stiffness: 0.3 N*mm/rad, pitch_stiffness: 0.8 N*mm/rad}
"""
)
SCENARIOS = {
    "held": [f"loads.walk.force=[{0.45 * DRAG} N, 0 N]"],
    "pulled": [f"loads.walk.force=[{-2.0 * DRAG} N, 0 N]"],
    "thrown": [],
    "shaken": [],
    "pitching": [f"loads.tail.pitch_stiffness={TURNING} N*m/rad"],
    "hanging": [f"environment.gravity={G} m/s^2", f"loads.tail.weight={WEIGHT} N",
                f"loads.tail.at=[{-ARM} m, 2 mm]"],
}  # fmt: skip
THROWN, SHAKEN, TURNED = 0.1, 0.3, 0.01  # m/s along and across, rad


def swing(omega, t):
    """1 - cos(omega' t)."""
    return 1.0 - np.cos(2.0 / DT * np.arcsin(0.5 * omega * DT) * t)


@pytest.fixture
def robots(build, fresh_taichi):
    """A solver of all scenarios, started with their velocities, and their numbers."""
    from softsim.solver.explicit import ExplicitSolver

    solver = ExplicitSolver([build(PLANE, *overrides) for overrides in SCENARIOS.values()])
    number = {name: s for s, name in enumerate(SCENARIOS)}
    memory = solver.state()
    memory["rigid_bodies/velocity"][number["thrown"]] = [[-THROWN, 0.0]]
    memory["rigid_bodies/velocity"][number["shaken"]] = [[0.0, SHAKEN]]
    spin = INERTIA * PITCH * TURNED
    memory["rigid_bodies/angular_momentum"][number["pitching"]] = [[0.0, 0.0, spin]]
    solver.restore(memory, 0.0, 0, DT)
    solver.begin(DT)
    return solver, number


def test_the_robots(robots, record_verification):
    """One solver, 1.6 periods of the spring; then on from a checkpoint to the same bits."""
    from softsim.solver.energy import EnergyReader

    solver, number = robots
    reader, bodies = EnergyReader(solver), solver.terms.rigid_bodies
    start = {name: reader.read(s) for name, s in number.items()}

    # Weight at an arm (-16, 2) mm: force and torque at rest.
    hanging = number["hanging"]
    force, torque = (fields.read(f)[hanging, 0] for f in (bodies.force, bodies.torque))
    np.testing.assert_allclose(force, [0.0, -MASS * G - WEIGHT], rtol=1e-12)
    np.testing.assert_allclose(torque, [0.0, 0.0, ARM * WEIGHT], rtol=1e-12)

    places, turns = [], []
    for _ in range(LOOKS):
        solver.advance(1)
        places.append(fields.read(bodies.centre)[:, 0])
        turns.append(fields.read(bodies.orientation)[number["pitching"], 0, 3])
    kept, t = solver.state(), DT * np.arange(1, LOOKS + 1)
    way = dict(zip(SCENARIOS, np.moveaxis(places, 0, 1), strict=True))
    energies = {name: reader.read(s) for name, s in number.items()}

    # Below the drag: the spring alone, to round-off, and nothing dissipated.
    elastic = 0.45 * DRAG / SPRING * swing(OMEGA, t)
    np.testing.assert_allclose(way["held"][:, 0], elastic, rtol=1e-9, atol=1e-15)
    assert energies["held"].friction_dissipation == pytest.approx(0.0, abs=1e-18)
    exact = 0.45 * DRAG / SPRING
    record_verification("tether, held: displacement [m]", exact, 0.5 * way["held"][:, 0].max())

    # Above it: steady acceleration, to round-off of the second differences.
    acceleration = np.diff(way["pulled"][300:, 0], 2) / DT**2
    np.testing.assert_allclose(acceleration, -DRAG / MASS, rtol=1e-6)
    record_verification("tether, pulled: acceleration", -DRAG / MASS, acceleration.mean())
    slid = abs(way["pulled"][-1, 0]) - DRAG / SPRING
    dissipated = energies["pulled"].friction_dissipation
    assert dissipated == pytest.approx(DRAG * slid, rel=1e-4)
    assert energies["pulled"].internal == pytest.approx(0.5 * DRAG**2 / SPRING, rel=1e-12)

    # Thrown: it slides to a stop, then swings on the spring without loss.
    thrown = 0.5 * MASS * THROWN**2 - 0.5 * DRAG**2 / SPRING
    assert energies["thrown"].friction_dissipation == pytest.approx(thrown, rel=1e-4)
    record_verification(
        "tether, thrown: dissipated [J]", thrown, energies["thrown"].friction_dissipation
    )

    # Across the tether nothing holds it.
    np.testing.assert_allclose(way["shaken"][:, 1], SHAKEN * t, rtol=1e-12)
    assert energies["shaken"].friction_dissipation == 0.0
    assert energies["shaken"].kinetic == pytest.approx(start["shaken"].kinetic, rel=1e-12)

    # In pitch its spring does, K sin(angle).
    pitch = TURNED * np.sin(PITCH * t)
    np.testing.assert_allclose(2.0 * np.arcsin(turns), pitch, atol=1e-4 * TURNED)

    # The books of all: half a kick at either end, (f dt)^2 / 8 m of the largest force, is missed.
    for name in SCENARIOS:
        most = (2.0 * DRAG * DT) ** 2 / (8.0 * MASS)
        if name == "hanging":
            most = ((MASS * G + WEIGHT) * DT) ** 2 / MASS + (ARM * WEIGHT * DT) ** 2 / INERTIA
        error = energies[name].balance - start[name].balance
        assert abs(error) < max(most, 1e-5 * energies[name].reference_energy), name

    # Where the drag is the only force, its books are the integrator's own to round-off: kinetic
    # energy changes by the trapezoidal work and (f_n^2 - f_0^2) dt^2 / 8 m, as at t = 0 f is 0.
    force = fields.read(bodies.force)[number["thrown"], 0, 0]
    error = energies["thrown"].balance - start["thrown"].balance
    assert error == pytest.approx((force * DT) ** 2 / (8.0 * MASS), rel=1e-5)

    solver.advance(300)
    once = solver.state()
    solver.restore(kept, LOOKS * DT, LOOKS, DT)
    solver.advance(300)
    for name, array in solver.state().items():
        np.testing.assert_array_equal(once[name], array, err_msg=name)


def test_frequencies_of_turning(build, fresh_taichi, record_verification):
    """sqrt(K/I) about each axis in space."""
    from softsim.solver.explicit import ExplicitSolver

    inertia = np.array([0.5e-6, 1e-6, 2e-6])
    exact = np.sqrt([0.1e-3, 0.3e-3, 0.8e-3] / inertia)
    solver, dt = ExplicitSolver([build(SPACE)] * 3), 1e-3
    memory = solver.state()
    memory["rigid_bodies/angular_momentum"] = TURNED * np.diag(inertia * exact)[:, None]
    solver.restore(memory, 0.0, 0, dt)
    solver.begin(dt)
    turns = []
    for _ in range(2000):
        solver.advance(1)
        turns.append(
            2.0 * np.diagonal(fields.read(solver.terms.rigid_bodies.orientation)[:, 0, 1:])
        )
    turns = np.array(turns)
    for axis, name in enumerate(("roll", "yaw", "pitch")):
        turn = turns[:, axis]
        k = np.flatnonzero((turn[:-1] < 0.0) & (turn[1:] >= 0.0))
        crossing = k - turn[k] / np.diff(turn)[k]
        found = 2.0 * np.pi / (np.diff(crossing).mean() * dt)
        # A period is longer by the share angle^2 / 16, shorter by (omega dt)^2 / 24: 2e-5 at most.
        assert found == pytest.approx(exact[axis], rel=5e-5), name
        assert np.abs(turn).max() == pytest.approx(TURNED, rel=1e-3)
        record_verification(f"tether: {name} [rad/s]", exact[axis], found)


def test_the_torque_is_the_gradient_of_the_energy(build, start):
    """At some turned orientation, by central differences of turns about fixed axes."""
    from softsim.rigid import in_space
    from softsim.solver.energy import EnergyReader

    solver = start(build(SPACE))
    reader, memory, h = EnergyReader(solver), solver.state(), 1e-4
    q = np.array([0.7, 0.4, -0.5, 0.3])
    q /= np.linalg.norm(q)

    def at(turn):
        w, v = 1.0, 0.5 * in_space(np.asarray(turn))
        turned = np.array([w * q[0] - v @ q[1:], *(w * q[1:] + q[0] * v + np.cross(v, q[1:]))])
        memory["rigid_bodies/orientation"][0, 0] = turned / np.linalg.norm(turned)
        solver.restore(memory, 0.0, 0, solver.time_increment)
        solver.find_forces(solver.time_increment)
        return reader.read().internal, fields.read(solver.terms.rigid_bodies.torque)[0, 0]

    gradient = [(at(h * side)[0] - at(-h * side)[0]) / (2.0 * h) for side in np.eye(3)]
    np.testing.assert_allclose(at(np.zeros(3))[1], -np.array(gradient), rtol=1e-6)


def test_the_stable_step_knows_it(build):
    """A tether far stiffer than all else: omega^2 = k/M + (k r^2 + K)/I, of 3/4 of M and I."""
    from softsim.solver.stable_step import stable_step

    model = build(
        PLANE, "loads.tail.stiffness=10 kN/mm", f"loads.tail.at=[{-ARM} m, 0 m]",
        "loads.tail.pitch_stiffness=300 N*m/rad",
    )  # fmt: skip
    limit = stable_step(model, model.points)
    assert limit.limit == "tether of a rigid body"
    omega = 1e7 / MASS + (1e7 * ARM**2 + 300.0) / INERTIA
    assert limit.value == pytest.approx(2.0 / np.sqrt(omega / 0.75), rel=1e-3)


def test_the_history_shows_the_drag(write_scene, tmp_path, kernel_cache, monkeypatch):
    """Pulled back with twice the drag it slides: from then on each row's mean is the drag."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run

    settings = [*SCENARIOS["pulled"], "time={end: 50 ms, increment: 50 us}"]
    results = run(
        write_scene(PLANE), settings, tmp_path / "out", "cpu", console=Console(file=io.StringIO())
    )
    drag = results.history["tether_drag"]
    assert drag[0] == 0.0
    np.testing.assert_allclose(drag[results.history["time"] > 20e-3], -DRAG, rtol=1e-12)
    assert results.summary["energy_error"] < 1e-3
