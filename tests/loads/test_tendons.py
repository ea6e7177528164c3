"""Tendons that cannot hold anything are refused where they are written."""

import numpy as np
import pytest

from softsim.errors import SceneError

SCENE = """
bodies:
  b: {mesh: {generator: block, length: 1 mm, height: 1 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10}
rigid_bodies: {robot: {mass: 1 g, inertia: 1 g*mm^2, free: [y]}}
loads: {gauge: {kind: tendon, acts_on: robot, DIRECTION}}
time: {end: 1 s}
"""


def test_the_direction_becomes_a_unit_vector(build):
    model = build(SCENE.replace("DIRECTION", "direction: [3, 4], slack: 2 mm"))
    (tendon,) = model.loads
    np.testing.assert_allclose(tendon.direction, [0.6, 0.8], rtol=1e-15)
    assert (tendon.body, tendon.stiffness, tendon.slack) == (0, 2000.0, 2e-3)


@pytest.mark.parametrize(
    "direction, said",
    [
        ("direction: [-1, 0]", "cannot move along"),
        ("direction: [0, 1, 0]", "has 3 components"),
        ("direction: [0, 0]", "must not be"),
        ("stiffness: 0 N/m", "must be greater than 0"),
        ("slack: -1 mm", "must not be less than 0"),
    ],
)
def test_what_cannot_hold_is_refused(build, direction, said):
    with pytest.raises(SceneError, match=said) as caught:
        build(SCENE.replace("DIRECTION", direction))
    assert "scene.yaml:6:" in str(caught.value)


def test_an_unknown_body_is_named(build):
    with pytest.raises(SceneError, match="there is no rigid body 'frame'"):
        build(
            SCENE.replace("DIRECTION", "direction: [0, 1]").replace(
                "acts_on: robot", "acts_on: frame"
            )
        )
