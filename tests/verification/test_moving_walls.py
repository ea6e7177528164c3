"""Walls that move: a plate that hits a particle, a belt that carries it along.

A plate of speed V throws a particle m at rest, that it hits without loss, off with 2 V: its force
does the work 2 m V^2. A belt of speed V takes a particle along with the friction mu m g until, at
t = V / (mu g), they are alike: half of the belt's work m V^2 is then motion, half heat.
"""

import numpy as np
import pytest

from softsim.compute import fields
from softsim.errors import SceneError

MASS, SPEED, MU, G = 1e-3, 0.1, 0.4, 9.81
FAR = """
bodies:
  far: {mesh: {generator: block, length: 10 mm, height: 10 mm, element_size: 10 mm},
        formulation: plane_strain, thickness: 10 mm, material: rubber, position: [1 m, 0 m],
        fixed: [surface]}
materials:
  rubber: {law: neo_hooke, C10: 1 kPa, density: 1000 kg/m^3}
rigid_bodies:
  particle: {mass: 1 g, inertia: 1 g*mm^2, outline: {radius: 1e-7 mm}, center: [0 mm, 1e-7 mm],
             free: [x, y]}
time: {end: 1 s}
"""
PLATE = (
    FAR
    + """
environment:
  gravity: 0 m/s^2
  walls: {plate: {kind: plane, normal: [1, 0], point: [-1 mm, 0 mm]},
          side: {kind: plane, point: [0 mm, -1 mm]}}
contact: {friction_coefficient: 0, penalty_stiffness: 1 kN/m, damping_ratio: 0}
conditions:
  hit: {kind: wall_motion, wall: plate, direction: x,
        displacement: {kind: table, points: [[0 s, 0 mm], [1 s, 100 mm]]}}
"""
)
BELT = (
    FAR
    + """
environment:
  walls: {belt: {kind: plane}}
contact: {friction_coefficient: 0.4, friction_memory: 0 s, penalty_stiffness: 1 kN/m}
conditions:
  run: {kind: wall_motion, wall: belt, direction: x,
        displacement: {kind: table, points: [[0 s, 0 mm], [1 s, 100 mm]]}}
"""
)


def observed(solver, until, clear_at=0.0):
    """The last row of the history at `until` [s], over the time since `clear_at` [s]."""
    from softsim.output.observation import Observer
    from softsim.solver.energy import EnergyBalance, EnergyReader

    scenario, reader = solver.scenario(0), EnergyReader(solver)
    balance = EnergyBalance.starting(reader.read(), solver.models[0])
    while solver.time < clear_at:
        solver.advance(10)
    solver.clear_impulses(0)
    began = solver.time
    while solver.time < until:
        solver.advance(10)
    reader.update()
    return Observer(scenario, reader, balance).observe(solver.time - began)


def test_a_plate_throws_a_particle(build, start, record_verification):
    model = build(PLATE)
    assert len(model.walls) == 2
    solver = start(model, share=0.1)
    seen = observed(solver, 30e-3)
    speed = float(fields.read(solver.terms.rigid_bodies.velocity)[0, 0, 0])
    record_verification("speed of a particle that a plate hit [m/s]", 2.0 * SPEED, speed)
    assert speed == pytest.approx(2.0 * SPEED, rel=2e-3)
    assert seen.energies.external_work == pytest.approx(2.0 * MASS * SPEED**2, rel=2e-3)
    mean_force = 2.0 * MASS * SPEED / solver.time
    assert seen.row["plate_drive_force"] == pytest.approx(mean_force, rel=2e-3)
    assert seen.row["energy_error"] < 1e-3  # 36 steps of the hit


def test_a_belt_carries_a_particle(build, start_settled, record_verification):
    """It slips up to 25 ms; velocities are half a step ahead."""
    solver = start_settled(build(BELT))
    while solver.time < 15e-3:
        solver.advance(10)
    speed = float(fields.read(solver.terms.rigid_bodies.velocity)[0, 0, 0])
    exact = MU * G * (solver.time + 0.5 * solver.time_increment)
    record_verification("speed on a belt [m/s]", exact, speed)
    assert speed == pytest.approx(exact, rel=1e-3)
    seen = observed(solver, 60e-3)
    assert seen.energies.external_work == pytest.approx(MASS * SPEED**2, rel=5e-3)
    assert seen.energies.friction_dissipation == pytest.approx(0.5 * MASS * SPEED**2, rel=5e-3)
    assert seen.row["energy_error"] < 1e-6


def test_goes_on_to_the_same_bits(build, fresh_taichi):
    from softsim.solver.explicit import ExplicitSolver

    model = build(PLATE)
    first, second = ExplicitSolver([model]), ExplicitSolver([model])
    first.begin(1e-5)
    first.advance(1100)
    second.restore(first.state(), first.time, first.increment_count, 1e-5)
    for solver in (first, second):
        solver.advance(500)
    for name, array in first.state().items():
        np.testing.assert_array_equal(second.state()[name], array, err_msg=name)


BALL = PLATE.replace(",\n             free: [x, y]", "").replace(
    "kind: plane, normal: [1, 0], point: [-1 mm, 0 mm]",
    "kind: sphere, center: [0 mm, 50 mm], diameter: 5 mm",
)


@pytest.mark.parametrize(
    "scene, old, new, said",
    [
        (PLATE, "wall: plate", "wall: plaet", "there is no wall 'plaet'"),
        (PLATE, "direction: x", "direction: z", "no direction z"),
        (
            PLATE,
            "conditions:\n",
            "conditions:\n  twice: {kind: wall_motion, wall: plate, direction: y, displacement: "
            "{kind: ramp, value: 1 mm, duration: 1 s}}\n",
            "is already moved by conditions.twice",
        ),
        (BALL, "plane_strain, thickness: 10 mm", "axisymmetric", "would leave the axis"),
    ],
)
def test_what_cannot_move_is_refused(build, scene, old, new, said):
    assert old in scene
    scene = scene.replace(old, new)
    with pytest.raises(SceneError, match=said):
        build(scene)
