"""Tethers of a scene: defaults, and what cannot act is refused where it is written."""

import numpy as np
import pytest

from softsim.errors import SceneError

SCENE = """
bodies:
  b: {mesh: {generator: block, length: 1 mm, height: 1 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10}
rigid_bodies: {robot: {mass: 1 g, inertia: 1 g*mm^2, center: [3 mm, 1 mm], FREE}}
loads: {tail: {kind: tether, acts_on: robot, GIVEN}}
time: {end: 1 s}
"""
PLANE = SCENE.replace("FREE", "free: [x, rotation]")


def test_what_a_tether_is(build):
    given = "drag: 20 mN, weight: 4 mN, at: [-16 mm, 0 mm], pitch_stiffness: 0.5 N*mm/rad"
    model = build(PLANE.replace("GIVEN", given), "environment.inclination=30 deg")
    (tether,) = model.loads
    assert (tether.body, tether.drag) == (0, 20e-3)
    assert tether.stiffness == pytest.approx(200.0)  # 0.1 mm at the limit
    np.testing.assert_allclose(tether.point, [-13e-3, 1e-3])
    np.testing.assert_allclose(tether.turning_stiffness, [0.0, 0.0, 0.5e-3])
    weight = np.array([-np.sin(np.pi / 6), -np.cos(np.pi / 6)]) * 4e-3
    np.testing.assert_allclose(tether.carried_mass * model.gravity, weight)


def test_a_section_on_its_side_feels_no_weight(build):
    model = build(PLANE.replace("GIVEN", "drag: 0 N, weight: 4 mN"), "environment.roll=90 deg")
    (tether,) = model.loads
    np.testing.assert_allclose(tether.carried_mass * model.gravity, 0.0, atol=1e-18)
    assert tether.stiffness == 0.0


def test_no_gravity_no_weight(build):
    model = build(PLANE.replace("GIVEN", "drag: 1 N, weight: 4 mN"), "environment.gravity=0 m/s^2")
    assert model.loads[0].carried_mass == 0.0


@pytest.mark.parametrize(
    "free, given, said",
    [
        ("free: [y]", "drag: 1 mN", "cannot move along x"),
        ("free: [x]", "drag: -1 mN", "must not be less than 0"),
        ("free: [x]", "weight: 1 mN", "'drag' is missing"),
        ("free: [x]", "drag: 1 mN, stiffness: 0 N/m", "must be greater than 0"),
        ("free: [x]", "drag: 1 mN, yaw_stiffness: 1 N*mm/rad", "a plane section has no yaw"),
        ("free: [x]", "drag: 1 mN, roll_stiffness: 1 N*mm/rad", "a plane section has no roll"),
        ("free: [x]", "drag: 1 mN, pitch_stiffness: 1 N*mm", "a turning stiffness"),
        ("free: [x]", "drag: 1 mN, at: [0 mm, 0 mm, 1 mm]", "has 3 components"),
    ],
)
def test_what_cannot_act_is_refused(build, free, given, said):
    with pytest.raises(SceneError) as caught:
        build(SCENE.replace("FREE", free).replace("GIVEN", given))
    assert said in str(caught.value)
    assert "scene.yaml:6:" in str(caught.value)


def test_an_unknown_body_is_named(build):
    with pytest.raises(SceneError, match="there is no rigid body 'frame'"):
        build(PLANE.replace("GIVEN", "drag: 1 mN").replace("acts_on: robot", "acts_on: frame"))
