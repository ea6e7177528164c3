"""How far a model is from the shape for which its stable step was estimated."""

import numpy as np
import pytest

from softsim.solver.stiffness_bound import ALLOWED_STRAIN, ReferenceShape, largest_strain

SCENE = """
title: A block
bodies:
  block: {mesh: {generator: block, length: 10 mm, height: 2 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10}
time: {end: 1 ms}
"""


def test_a_turned_element_is_not_strained():
    c, s = np.cos(0.7), np.sin(0.7)
    assert largest_strain(np.array([[[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]])) < 1e-15


def test_the_strain_is_that_of_the_worst_element():
    F = np.stack([np.eye(3), np.diag([1.1, 1.0, 1.0])])
    assert largest_strain(F) == pytest.approx(0.5 * (1.1**2 - 1.0))


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
