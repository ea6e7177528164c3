"""Points of rigid outlines that meet walls: corners, and what lies between where walls bulge."""

import numpy as np

from softsim.solver.stable_step import stable_step

BLOCK = "{mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 2 mm}, "
BOX = BLOCK.replace("block", "box").replace("height", "width: 2 mm, height")
SCENE = """\
bodies:
  b: BODY material: dragon_skin_10, position: [-50 mm, 0 mm]}
rigid_bodies:
  frame: {mass: 8 g, inertia: 1 kg*mm^2, center: [2 mm, 1 mm],
          outline: {length: 33 mm, height: 15 mm}}
time: {end: 1 s}
environment: {walls: {pipe: WALL}}
"""
STRAIGHT = "{kind: pipe, diameter: 36 mm}"
PATH = "{kind: pipe_path, diameter: 36 mm, start: [-60 mm, 0 mm], pipe: [{straight: 90 mm}]}"


def outline(build, body, wall):
    model = build(SCENE.replace("BODY", body).replace("WALL", wall))
    (frame,) = model.rigid_bodies
    assert np.all(model.mass[frame.tied] == 0.0)
    return model, model.points[frame.tied] - frame.centre


def test_corners_in_a_straight_pipe(build):
    _, arms = outline(build, BLOCK + "formulation: plane_strain, thickness: 5 mm,", STRAIGHT)
    np.testing.assert_allclose(np.abs(arms), np.tile([16.5e-3, 7.5e-3], (4, 1)))
    _, arms = outline(build, BOX + "formulation: solid,", STRAIGHT)
    assert len(arms) == 48


def test_sides_in_a_path(build):
    """Every point lies on the rectangle, and the next is no farther than a 32nd of its length."""
    _, arms = outline(build, BLOCK + "formulation: plane_strain, thickness: 5 mm,", PATH)
    outside = np.abs(arms) - [16.5e-3, 7.5e-3]
    np.testing.assert_allclose(outside.max(axis=1), 0.0, atol=1e-15)
    steps = np.linalg.norm(np.diff(np.concatenate([arms, arms[:1]]), axis=0), axis=1)
    assert steps.max() < 33e-3 / 32 + 1e-12
    assert len(np.unique(np.round(arms, 9), axis=0)) == len(arms) == 2 * (32 + 15)


def test_rings_in_a_path_in_space(build):
    _, arms = outline(build, BOX + "formulation: solid,", PATH)
    np.testing.assert_allclose(np.hypot(arms[:, 1], arms[:, 2]), 7.5e-3)
    assert len(np.unique(np.round(arms[:, 0], 9))) == 13
    assert len(arms) == 13 * 24


def test_points_do_not_shorten_the_step(build):
    """All of them count as touching at once, against a frame of 8 g that is held by k / M of each:
    it is heavy enough to be slower than elements as fine as those of the robot's skin.
    """
    fine = BLOCK.replace("element_size: 2 mm", "element_size: 0.5 mm")
    body = fine + "formulation: plane_strain, thickness: 7 mm,"
    straight, path = (outline(build, body, wall)[0] for wall in (STRAIGHT, PATH))
    steps = [stable_step(model, model.points).value for model in (straight, path)]
    assert steps[1] == steps[0]
