"""How far a model is from the shape for which its stable step was estimated."""

import numpy as np
import pytest

from softsim.solver.stiffness_bound import (
    ALLOWED_STRAIN,
    ModelStiffness,
    ReferenceRegion,
    ReferenceShape,
)

SCENE = """
title: A block
bodies:
  block: {mesh: {generator: block, length: 10 mm, height: 2 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10}
time: {end: 1 ms}
"""
TOUCHING = """
contact: {self_contact: [block]}
environment: {walls: {floor: {kind: plane, point: [0 m, -20 mm]}}}
"""
FIBRE = """
fibres:
  t: {body: block, points: [[-4 mm, 0 m], [4 mm, 0 m]], spacing: 1 mm, diameter: 0.2 mm,
      youngs_modulus: 50 MPa, density: 1440 kg/m^3}
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


def test_a_body_that_moves_is_near_and_one_that_is_strained_is_not(build):
    model = build(SCENE)
    x = model.points
    shape = ReferenceShape(ModelStiffness(model), x)
    assert shape.is_near(x + 10.0 * np.ptp(x, axis=0).max())
    assert shape.is_near(x * [1.0 + 0.9 * ALLOWED_STRAIN, 1.0])
    assert not shape.is_near(x * [1.0 + 1.1 * ALLOWED_STRAIN, 1.0])
    assert not shape.is_near(np.full_like(x, np.nan))


def test_a_surface_may_slide_along_a_wall_but_not_come_near_it(build):
    """Nodes that touch other bodies touch a wall as well once it is within reach."""
    model = build(SCENE + TOUCHING)
    x, size = model.points, np.ptp(model.points, axis=0).max()
    shape = ReferenceShape(ModelStiffness(model), x)
    gap = x[:, 1].min() + 20e-3
    along, down = np.array([[10.0 * size, 0.0], [0.0, -1.0]])
    assert shape.is_near(x + along)
    assert shape.is_near(x + (gap - 0.06 * size) * down)
    assert not shape.is_near(x + (gap - 0.04 * size) * down)


def test_a_body_with_structures_must_not_move_far(build):
    """The lines of structures may lead to bodies that do not move along."""
    model = build(SCENE + FIBRE)
    x, size = model.points, np.ptp(model.points, axis=0).max()
    shape = ReferenceShape(ModelStiffness(model), x)
    assert shape.is_near(x + 0.04 * size)
    assert not shape.is_near(x + 0.06 * size)
