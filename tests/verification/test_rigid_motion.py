"""A rigid body that is driven: a slider that stretches a spring.

Moved by u it is pulled back with k u: the drive's force is k u, its work k u^2 / 2.
"""

import numpy as np
import pytest

from softsim.errors import SceneError

STIFFNESS, WAY = 100.0, 6e-3
SCENE = """
bodies:
  far: {mesh: {generator: block, length: 1 mm, height: 1 mm, element_size: 1 mm},
        formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10, fixed: [surface]}
rigid_bodies: {slider: {mass: 1 g, inertia: 1 g*mm^2, free: [x, rotation]}}
conditions:
  pull: {kind: rigid_motion, body: slider, direction: x,
         displacement: {kind: smooth_step, value: 6 mm, duration: 20 ms}}
loads: {spring: {kind: tendon, acts_on: slider, stiffness: 100 N/m, direction: [-1, 0]}}
environment: {gravity: 9.81 m/s^2, inclination: 90 deg}
time: {end: 1 s}
"""
WEIGHT = 1e-3 * 9.81  # along -x: upright


def test_place_force_and_work(build, start, record_verification):
    """The slider is where the profile says; the tendon's force adds to its weight."""
    from softsim.output.observation import Observer
    from softsim.solver.energy import EnergyBalance, EnergyReader

    model = build(SCENE)
    solver = start(model)
    reader = EnergyReader(solver)
    balance = EnergyBalance.starting(reader.read(), model)
    while solver.time < 25e-3:
        solver.advance(100)
    solver.clear_impulses(0)
    began = solver.time
    solver.advance(100)
    reader.update()
    seen = Observer(solver.scenario(0), reader, balance).observe(solver.time - began)
    assert seen.row["frame_x"] == pytest.approx(WAY, rel=1e-12)
    force = STIFFNESS * WAY + WEIGHT
    record_verification("force that drives a slider [N]", force, seen.row["drive_force"])
    assert seen.row["drive_force"] == pytest.approx(force, rel=1e-9)
    assert seen.energies.internal == pytest.approx(0.5 * STIFFNESS * WAY**2, rel=1e-9)
    assert seen.row["energy_error"] < 1e-5


def test_goes_on_to_the_same_bits(build, fresh_taichi):
    from softsim.solver.explicit import ExplicitSolver

    model = build(SCENE)
    first, second = ExplicitSolver([model]), ExplicitSolver([model])
    first.begin(2e-6)
    first.advance(3000)
    second.restore(first.state(), first.time, first.increment_count, 2e-6)
    for solver in (first, second):
        solver.advance(500)
    for name, array in first.state().items():
        np.testing.assert_array_equal(second.state()[name], array, err_msg=name)


@pytest.mark.parametrize(
    "old, new, said",
    [
        ("body: slider", "body: far", "no rigid body 'far'"),
        ("direction: x", "direction: z", "no direction z"),
        ("direction: x", "direction: y", "already held or moved along y"),
        ("value: 6 mm", "value: 6 N", "a length"),
        (
            "kind: smooth_step, value: 6 mm, duration: 20 ms",
            "kind: table, points: [[0 s, 1 mm], [1 s, 2 mm]]",
            "must start with",
        ),
    ],
)
def test_what_cannot_be_driven_is_refused(build, old, new, said):
    with pytest.raises(SceneError, match=said):
        build(SCENE.replace(old, new))
