"""A motor in space, about an axis that is none of x, y, z: its force at any time, either way."""

import numpy as np
import pytest

from softsim.compute import fields

SCENE = """
bodies:
  b: {mesh: {generator: box, length: 1 mm, height: 1 mm, width: 1 mm, element_size: 1 mm},
      formulation: solid, material: dragon_skin_10}
rigid_bodies:
  frame: {mass: 10 g, inertia: 1 kg*mm^2, tied: [b.surface]}
environment: {gravity: 0 m/s^2}
loads:
  motor: {kind: eccentric_mass, acts_on: frame, eccentric_mass: 0.572 g, radius: 1.72 mm,
          frequency: 192 Hz, rotation_axis: [0, 3, 4], phase: 30 deg, spin_up: 20 ms}
time: {end: 1 s}
"""
AMPLITUDE = 0.572e-3 * 1.72e-3 * (2.0 * np.pi * 192.0) ** 2


def test_the_force_at_t_is_its_closed_form_either_way(build, start):
    """From x (which follows z, the nearest) towards n x x, the other way for the sense -1; at
    t > spin-up the angle is phase + omega (t - spin_up / 2).
    """
    solver = start(build(SCENE), build(SCENE, "loads.motor.sense=-1"))
    a, n = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.6, 0.8])
    while solver.time < 30e-3:
        solver.advance(100)
        shown = fields.read(solver.terms.rigid_bodies.applied_force)[:, 0]
        if solver.time > 20e-3:
            angle = np.pi / 6.0 + 2.0 * np.pi * 192.0 * (solver.time - 10e-3)
            for force, sense in zip(shown, (1.0, -1.0), strict=True):
                expected = np.cos(angle) * a + sense * np.sin(angle) * np.cross(n, a)
                np.testing.assert_allclose(force, AMPLITUDE * expected, atol=1e-9 * AMPLITUDE)


def test_the_axis_goes_with_the_body(build, start):
    """Spun about z by a quarter turn, a motor about x turns about y."""
    spun = "rigid_bodies.frame.initial_angular_velocity=100 rad/s"
    solver = start(build(SCENE, "loads.motor.rotation_axis=x", spun))
    while solver.time < 40e-3:
        solver.advance(100)
        bodies = solver.terms.rigid_bodies
        axis = fields.read(bodies.rotation)[0, 0] @ [1.0, 0.0, 0.0]
        force = fields.read(bodies.applied_force)[0, 0]
        assert abs(force @ axis) < 1e-12
        assert axis[0] == pytest.approx(np.cos(100.0 * solver.time), abs=1e-6)


def test_an_axis_or_a_sense_that_is_none_is_refused(build):
    from softsim.errors import SceneError

    for key, value, problem in (
        ("rotation_axis", "q", "'q' is not an axis"),
        ("rotation_axis", "[0, 0, 0]", "must not be"),
        ("sense", "2", "the number 2 is not one of: 1, -1"),
    ):
        with pytest.raises(SceneError, match=problem):
            build(SCENE, f"loads.motor.{key}={value}")
