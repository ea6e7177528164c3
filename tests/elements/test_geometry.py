"""Geometry of the three formulations against shapes of known volume."""

import numpy as np
import pytest

from softsim.elements.geometry import Axisymmetric, PlaneStrain, Solid, shape_gradients
from softsim.elements.measures import largest_eigenvalue
from softsim.robots.block import block
from softsim.robots.box import box

SECTION = block(4e-3, 3e-3, 1e-3)
RING = SECTION.points + np.array([5e-3, 0.0])  # r from 3 to 7 mm
BOX = box(3e-3, 2e-3, 4e-3, 1e-3)


def test_volumes_add_up():
    plate = PlaneStrain(5e-3).volumes(SECTION.points, SECTION.cells)
    ring = Axisymmetric().volumes(RING, SECTION.cells)
    solid = Solid().volumes(BOX.points, BOX.cells)
    assert plate.sum() == pytest.approx(4e-3 * 3e-3 * 5e-3)
    assert ring.sum() == pytest.approx(np.pi * (7e-3**2 - 3e-3**2) * 3e-3)
    assert solid.sum() == pytest.approx(3e-3 * 2e-3 * 4e-3)


@pytest.mark.parametrize(
    ("geometry", "points", "cells"),
    [(PlaneStrain(1.0), SECTION.points, SECTION.cells), (Axisymmetric(), RING, SECTION.cells),
     (Solid(), BOX.points, BOX.cells)],
)  # fmt: skip
def test_mass_shares_are_positive_and_whole(geometry, points, cells):
    shares = geometry.mass_shares(points, cells)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, rtol=1e-14)
    assert shares.min() > 0.0
    # First moment along the axis: that of the body, whose middle is at rest in y.
    weight = geometry.volumes(points, cells)[:, None] * shares
    centre = (weight * points[cells][:, :, 1]).sum() / weight.sum()
    middle = 0.5 * (points[:, 1].min() + points[:, 1].max())
    assert centre == pytest.approx(middle, rel=1e-9)


def test_ring_shares_are_the_integrals_of_the_shape_functions():
    """int N_a r dA of a triangle by its closed form, A (2 r_a + r_b + r_c) / 12."""
    points, cell = np.array([[0.0, 0.0], [2.0, 0.0], [0.5, 1.0]]), np.array([[0, 1, 2]])
    shares = Axisymmetric().mass_shares(points, cell)[0]
    r = points[:, 0]
    np.testing.assert_allclose(shares, (r + r.sum()) / 12.0 / (r.sum() / 3.0), rtol=1e-14)


def test_deformation_of_a_stretched_ring():
    """u_r = 0.2 r, u_y = -0.1 y: F = diag(1.2, 0.9, 1.2) in every element."""
    F = Axisymmetric().deformation(RING, SECTION.cells, RING * [1.2, 0.9])
    np.testing.assert_allclose(F, np.broadcast_to(np.diag([1.2, 0.9, 1.2]), F.shape), atol=1e-13)


def test_gradients_reproduce_a_linear_field():
    slope = np.array([0.3, -2.0, 1.1])
    nodal = (BOX.points @ slope)[BOX.cells]
    found = np.einsum("ea,eai->ei", nodal, shape_gradients(BOX.points, BOX.cells))
    np.testing.assert_allclose(found, np.broadcast_to(slope, found.shape), rtol=1e-11)


def test_largest_eigenvalue_is_that_of_numpy():
    rng = np.random.default_rng(1)
    a = rng.standard_normal((200, 3, 3))
    symmetric = a + a.transpose(0, 2, 1)
    special = np.array(
        [np.eye(3), np.zeros((3, 3)), np.diag([2.0, 2.0, 1.0]), np.diag([1.0, 2, 2])]
    )
    tensors = np.concatenate([symmetric, special])
    expected = np.linalg.eigvalsh(tensors)[:, -1]
    found = largest_eigenvalue(tensors)
    np.testing.assert_allclose(found[:200], expected[:200], rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(found, expected, atol=3.0 * np.sqrt(np.finfo(float).eps))
