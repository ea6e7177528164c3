"""Gravity of a scene: one acceleration, inclined and rolled, or a vector; over a profile."""

import numpy as np
import pytest

from softsim.errors import SceneError

PLANE = """
bodies:
  b: {mesh: {generator: block, length: 1 mm, height: 1 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10}
time: {end: 1 s}
environment: {GIVEN}
"""
SPACE = PLANE.replace("generator: block", "generator: box, width: 1 mm").replace(
    "plane_strain, thickness: 1 mm", "solid"
)
ROUND = PLANE.replace("plane_strain, thickness: 1 mm", "axisymmetric, position: [1 mm, 0 mm]")


def test_a_vector_is_what_an_inclined_acceleration_is(build):
    inclined = build(SPACE.replace("GIVEN", "inclination: 20 deg, roll: 30 deg")).gravity
    components = ", ".join(f"{c!r} m/s^2" for c in inclined.tolist())
    vector = build(SPACE.replace("GIVEN", f"gravity: [{components}]"))
    np.testing.assert_array_equal(vector.gravity, inclined)
    assert vector.loads == ()


def test_two_components_in_space(build):
    gravity = build(SPACE.replace("GIVEN", "gravity: [1 m/s^2, -2 m/s^2]")).gravity
    np.testing.assert_array_equal(gravity, [1.0, -2.0, 0.0])


def test_a_profile_rises_from_nothing_to_all(build):
    for kind, middle in (("ramp", 0.25), ("smooth_step", 0.15625)):
        given = f"gravity_profile: {{kind: {kind}, duration: 40 ms}}"
        profile = build(PLANE.replace("GIVEN", given)).loads[0].share
        assert profile.at(10e-3) == pytest.approx(middle, rel=1e-4)
        np.testing.assert_array_equal(profile.at(np.array([-1.0, 0.0, 40e-3, 1.0])), [0, 0, 1, 1])


@pytest.mark.parametrize(
    "text, given, said",
    [
        (PLANE, "gravity: [0 m/s^2, -9.81 m/s^2], inclination: 5 deg", "already has a direction"),
        (PLANE, "gravity: [0 m/s^2, -9.81 m/s^2], roll: 5 deg", "already has a direction"),
        (PLANE, "gravity: [0 m/s^2, -9.81 m/s^2, 0 m/s^2]", "has 3 components"),
        (PLANE, "gravity: [-9.81 m/s^2]", "2 or 3 components, not 1"),
        (PLANE, "gravity: [0 m/s^2, -9.81 m]", "an acceleration"),
        (PLANE, "gravity: -9.81 m/s^2", "must not be less than 0"),
        (ROUND, "gravity: [1 m/s^2, 0 m/s^2]", "along the axis only"),
        (PLANE, "gravity_profile: {kind: ramp}", "'duration' is missing"),
        (PLANE, "gravity_profile: {kind: saw, duration: 1 s}", "smooth_step"),
    ],
)
def test_what_is_no_gravity_is_refused(build, text, given, said):
    with pytest.raises(SceneError) as caught:
        build(text.replace("GIVEN", given))
    assert said in str(caught.value)
    assert "scene.yaml:6:" in str(caught.value)
