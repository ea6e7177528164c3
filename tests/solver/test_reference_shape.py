"""How far a model is from the shape for which its stable step was estimated."""

import numpy as np
import pytest

from softsim.solver.stiffness_bound import ALLOWED_STRAIN, ReferenceRegion, ReferenceShape

SCENE = """
title: A block
bodies:
  block: {mesh: {generator: block, length: 10 mm, height: 2 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10}
time: {end: 1 ms}
"""


def strain_by_matrices(F):
    """Largest norm of the Green strain of F (m, 3, 3)."""
    strain = 0.5 * (F.transpose(0, 2, 1) @ F - np.eye(3))
    return np.sqrt((strain**2).sum(axis=(1, 2))).max()


@pytest.mark.parametrize("formulation", ["plane_strain", "axisymmetric", "solid"])
def test_the_strain_is_that_of_the_worst_element_since_the_reference(build, formulation):
    """A turned element is not strained; others as F now F^-1 then."""
    d, place = (3, "") if formulation == "solid" else (2, "position: [5 mm, 0 mm],")
    generator = "box, width: 2 mm" if d == 3 else "block"
    thickness = "thickness: 5 mm," if formulation == "plane_strain" else ""
    model = build(f"""
bodies:
  block: {{mesh: {{generator: {generator}, length: 4 mm, height: 2 mm, element_size: 1 mm}},
          formulation: {formulation}, {thickness} {place} material: dragon_skin_10}}
time: {{end: 1 ms}}
""")
    [region] = model.regions
    random = np.random.default_rng(3)
    then, now = (region.points + 1e-4 * random.standard_normal(region.points.shape) for _ in "tn")
    reference = ReferenceRegion(region, then)
    assert reference.largest_strain(then) < 1e-12
    if formulation != "axisymmetric":  # where a turn about the axis of a plane is none
        c, s = np.cos(0.7), np.sin(0.7)
        turn = np.eye(d)
        turn[:2, :2] = [[c, -s], [s, c]]
        assert reference.largest_strain(then @ turn.T) < 1e-12
    F = region.deformation(now) @ np.linalg.inv(region.deformation(then))
    assert reference.largest_strain(now) == pytest.approx(strain_by_matrices(F), rel=1e-9)


def test_a_body_that_moves_is_near_and_one_that_is_strained_is_not(block_model):
    x = block_model.points
    shape = ReferenceShape(block_model, x)
    assert shape.is_near(x + 0.04 * np.ptp(x, axis=0).max())
    assert not shape.is_near(x + 0.06 * np.ptp(x, axis=0).max())  # a wall may be within reach
    assert shape.is_near(x * [1.0 + 0.9 * ALLOWED_STRAIN, 1.0])
    assert not shape.is_near(x * [1.0 + 1.1 * ALLOWED_STRAIN, 1.0])
    assert not shape.is_near(np.full_like(x, np.nan))


@pytest.fixture
def block_model(write_scene):
    from softsim.builder import build_model
    from softsim.scene.loading import load_scene

    return build_model(load_scene(write_scene(SCENE)))
