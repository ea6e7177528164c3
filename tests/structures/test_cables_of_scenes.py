"""Cables of a scene: what is made of them, and what cannot be is refused where it is written."""

import numpy as np
import pytest

from softsim.errors import SceneError

SCENE = """
bodies:
  b: {mesh: {generator: block, length: 1 mm, height: 1 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10}
rigid_bodies: {robot: {total_mass: 1 g, inertia: 1 g*mm^2, tied: [b.surface, tail.start_segment]}}
cables:
  tail: {points: POINTS, segment_length: 2 mm, diameter: 2 mm, mass_per_length: 3 g/m,
         stretching_stiffness: 60 N, bending_stiffness: 20 N*mm^2, GIVEN}
environment: {walls: {WALLS}}
time: {end: 1 s}
"""
STRAIGHT = SCENE.replace("POINTS", "[[10 mm, 0 mm], [0 mm, 0 mm], [0 mm, -6 mm]]")
FLOOR = "floor: {kind: plane, point: [0 mm, -7 mm], normal: [0, 1]}"
PIPE = "p: {kind: pipe_path, diameter: 10 mm, pipe: [straight: 100 mm]}"


def built(build, points=None, given="end_drag: 0 N", walls=FLOOR, *overrides):
    text = STRAIGHT if points is None else SCENE.replace("POINTS", points)
    return build(text.replace("GIVEN", given).replace("WALLS", walls), *overrides)


def test_what_a_cable_is(build):
    model = built(build, None, "end_drag: 4 mN", FLOOR)
    (cable,), (body,) = model.structures, model.rigid_bodies
    np.testing.assert_array_equal(cable.nodes, 4 + np.arange(9))
    np.testing.assert_allclose(cable.lengths, 2e-3)
    np.testing.assert_allclose(cable.joint_lengths, [1e-3, *[2e-3] * 6])  # the clamped one half
    assert model.mass[cable.nodes].sum() == pytest.approx(16e-3 * 3e-3)
    assert cable.gauge == 1
    np.testing.assert_array_equal(np.intersect1d(body.tied, cable.nodes), [4, 5])
    assert body.mass == pytest.approx(1e-3 - model.bodies[0].mass)  # a cable is no part of it
    np.testing.assert_array_equal(cable.wall_contact.nodes, cable.nodes[2:])
    np.testing.assert_allclose(cable.wall_contact.penalty.k_n, 60.0 / 2e-3)
    (drag,) = model.loads
    assert (drag.before, drag.end, drag.drag) == (11, 12, 4e-3)
    np.testing.assert_allclose(drag.axis, [0.0, -1.0])


def test_friction_is_the_scene_s_or_the_cable_s_own(build):
    """Cables that differ in nothing else share a solver."""
    models = [
        built(build, None, given, FLOOR, "contact.friction_coefficient=0.4")
        for given in ("end_drag: 0 N", "friction_coefficient: 0.6")
    ]
    assert [m.structures[0].wall_contact.friction_coefficient for m in models] == [0.4, 0.6]
    assert models[0].can_share(models[1])


@pytest.mark.parametrize(
    "points, given, walls, said, line",
    [
        ("[[6 mm, 0 mm], [0 mm, 0 mm]]", "", FLOOR, "has 3 segments", 7),
        ("[[9 mm, 0 mm], [9 mm, 0 mm]]", "", FLOOR, "two successive points at", 7),
        ("[[9 mm, 0 mm]]", "", FLOOR, "at least 2", 7),
        ("[[9 mm, 0 mm], [0 mm, -6.5 mm]]", "", FLOOR, "0.5 mm inside the wall 'floor'", 7),
        (
            "[[9 mm, 0 mm], [-9 mm, 0 mm]]",
            "",
            PIPE,
            "5 of the 10 nodes of 'tail' lie outside the pipe 'p'",
            7,
        ),
        ("[[9 mm, 0 mm], [0 mm, 0 mm]]", "bending_stifness: 1 N*mm^2", FLOOR, "unknown key", 8),
        ("[[9 mm, 0 mm], [0 mm, 0 mm]]", "end_drag: -1 N", FLOOR, "not be less than 0", 8),
    ],
)
def test_what_is_no_cable_is_refused(build, points, given, walls, said, line):
    with pytest.raises(SceneError) as caught:
        built(build, points, given or "end_drag: 0 N", walls)
    assert said in str(caught.value)
    assert f"scene.yaml:{line}:" in str(caught.value)


def test_an_unknown_set_of_a_cable_is_refused(build):
    with pytest.raises(SceneError, match=r"there is no node set 'tail\.tip'"):
        build(
            STRAIGHT.replace("start_segment", "tip")
            .replace("GIVEN", "end_drag: 0 N")
            .replace("WALLS", FLOOR)
        )
