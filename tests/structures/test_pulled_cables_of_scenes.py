"""Pulled cables of scenes: where their eyelets are held, and what is refused and where."""

import numpy as np
import pytest

from softsim.errors import SceneError

SCENE = """\
bodies:
  a: {mesh: {generator: block, length: 8 mm, height: 4 mm, element_size: 2 mm, cells: quad},
      formulation: plane_strain, thickness: 3 mm, material: dragon_skin_10}
  b: {mesh: {generator: block, length: 8 mm, height: 4 mm, element_size: 2 mm, cells: quad},
      formulation: plane_strain, thickness: 3 mm, material: dragon_skin_10, position: [20 mm, 0 mm]}
loads:
  tendon:
    kind: pulled_cable
    eyelets: [[-3 mm, 1 mm], [3 mm, 1 mm], [17 mm, 4.05 mm]]
    pulled_from: [-10 mm, 1 mm]
    pull: 4 mm
    stiffness: 2 N/mm
time: {end: 1 s}
"""


def test_eyelets_lie_in_bodies_or_in_space(build):
    """The last is moved onto the second body, within the tolerance."""
    model = build(SCENE)
    (cable,) = model.loads
    expected = [[-10e-3, 1e-3], [-3e-3, 1e-3], [3e-3, 1e-3], [17e-3, 4e-3]]
    np.testing.assert_allclose(cable.places(model.points), expected, atol=1e-12)
    second = model.bodies[1]
    assert (cable.corners[3][cable.weights[3] > 0.0] >= second.first_node).all()
    assert cable.rest_length == pytest.approx(13e-3 + np.hypot(14e-3, 3e-3), rel=1e-9)
    assert cable.stiffness == 2000.0
    assert cable.pull.values[-1] == 4e-3 and not cable.tension.values.any()
    moved = model.points.copy()
    moved[: second.first_node] += [0.0, 1e-3]
    went = cable.places(moved) - cable.places(model.points)
    np.testing.assert_allclose(went[:, 1], [0.0, 1e-3, 1e-3, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    ("written", "instead", "line", "said"),
    [
        ("[3 mm, 1 mm]", "[3 mm, 6 mm]", 9, r"\(3.00, 6.00\) mm is outside all bodies: 2 mm"),
        ("[3 mm, 1 mm]", "[-3 mm, 1 mm]", 9, "two successive points of"),
        (", [3 mm, 1 mm], [17 mm, 4.05 mm]", "", 9, "at least 2"),
        ("    pull: 4 mm\n", "", 8, "either a pull or a tension"),
        ("    stiffness: 2 N/mm\n", "    stiffness: 2 N/mm\n    tension: 1 N\n", 8, "give one"),
        ("    stiffness: 2 N/mm\n", "", 8, "needs a stiffness"),
        ("pull: 4 mm", "pull: -4 mm", 11, "must be greater than 0"),
        ("pull: 4 mm\n    stiffness: 2 N/mm", "tension: -1 N", 11, "must be greater than 0"),
        ("[-10 mm, 1 mm]", "[-3 mm, 1 mm]", 10, "two successive points of"),
        ("stiffness: 2 N/mm", "stiffness: 2 N/mm\n    profile: {kind: sine, frequency: 2 Hz}", 13,
         "can only pull"),
        ("[-10 mm, 1 mm]", "[-10 mm, 1 mm, 0 mm]", 10, "has 3 components"),
    ],
)  # fmt: skip
def test_what_is_no_pulled_cable_is_refused(build, written, instead, line, said):
    with pytest.raises(SceneError, match=said) as caught:
        build(SCENE.replace(written, instead))
    assert f"scene.yaml:{line}:" in str(caught.value)


def test_none_where_bodies_go_all_around(build):
    around = SCENE.replace("plane_strain, thickness: 3 mm", "axisymmetric, position: [5 mm, 0 mm]")
    with pytest.raises(SceneError, match="would be a closed sheet around the axis"):
        build(
            around.replace("10, position: [5 mm", "10, position: [20 mm").replace(
                "axisymmetric, position: [5 mm, 0 mm], material: dragon_skin_10, position",
                "axisymmetric, material: dragon_skin_10, position",
            )
        )
