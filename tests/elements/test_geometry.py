"""Geometry of the formulations against shapes of known volume."""

import numpy as np
import pytest

from softsim.elements.geometry import (
    Axisymmetric,
    PlaneStrain,
    RingSection,
    Solid,
    shape_gradients,
)
from softsim.elements.measures import largest_eigenvalue
from softsim.robots.block import block
from softsim.robots.box import box

SECTION = block(4e-3, 3e-3, 1e-3)
RING = SECTION.points + np.array([5e-3, 0.0])  # r from 3 to 7 mm
# Two strips about y = 2 mm, radius 1 to 4 mm; cells with x > 0 stand singly.
UPPER = SECTION.points + np.array([0.0, 3e-3])
STRIPS = np.concatenate([UPPER, UPPER * [1.0, -1.0] + [0.0, 4e-3]])
PAIRED = np.concatenate([SECTION.cells, SECTION.cells[:, ::-1] + len(SECTION.points)])
OPPOSITE = np.roll(np.arange(len(STRIPS)), len(SECTION.points))
ROUND = STRIPS[PAIRED][:, :, 0].mean(axis=1) < 0.0
SECTOR, DEPTH = 1.2, 5e-3
RINGS = RingSection(DEPTH, SECTOR, OPPOSITE, ROUND)
BOX = box(3e-3, 2e-3, 4e-3, 1e-3)


def test_volumes_add_up():
    plate = PlaneStrain(5e-3).volumes(SECTION.points, SECTION.cells)
    ring = Axisymmetric().volumes(RING, SECTION.cells)
    rings = RINGS.volumes(STRIPS, PAIRED)
    solid = Solid().volumes(BOX.points, BOX.cells)
    assert plate.sum() == pytest.approx(4e-3 * 3e-3 * 5e-3)
    assert ring.sum() == pytest.approx(np.pi * (7e-3**2 - 3e-3**2) * 3e-3)
    # Half of each strip, 2 mm long: a sector of a tube, and a plate.
    assert rings[ROUND].sum() == pytest.approx(SECTOR * (4e-3**2 - 1e-3**2) * 2e-3)
    assert rings[~ROUND].sum() == pytest.approx(2.0 * 2e-3 * 3e-3 * DEPTH)
    assert solid.sum() == pytest.approx(3e-3 * 2e-3 * 4e-3)


@pytest.mark.parametrize(
    ("geometry", "points", "cells"),
    [(PlaneStrain(1.0), SECTION.points, SECTION.cells), (Axisymmetric(), RING, SECTION.cells),
     (RINGS, STRIPS, PAIRED), (Solid(), BOX.points, BOX.cells)],
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


def test_deformation_of_a_ring_section():
    """Radii and lengths stretched, moved far across the axis: F_zz is 1.2 of rings, of others 1."""
    x = STRIPS * [0.9, 1.2] + [3e-3, -50e-3]
    F = RINGS.deformation(STRIPS, PAIRED, x)
    expected = np.where(ROUND[:, None, None], np.diag([0.9, 1.2, 1.2]), np.diag([0.9, 1.2, 1.0]))
    np.testing.assert_allclose(F, expected, atol=1e-12)


def test_what_strains_a_ring_and_how_much():
    """F_zz is linear in the nodes' y: its slopes by differences of any size. Nothing else moves it,
    and a ring that moves as a whole keeps it.
    """
    movers, slopes = RINGS.strained_by(PAIRED), RINGS.hoop_slopes(STRIPS, PAIRED)
    np.testing.assert_array_equal(movers[:, :3], PAIRED)
    np.testing.assert_allclose(slopes.sum(axis=1), 0.0, atol=1e-12 * np.abs(slopes).max())
    expected = np.zeros((len(PAIRED), len(STRIPS)))
    np.add.at(expected, (np.arange(len(PAIRED))[:, None], movers), slopes)
    moves = 0.1e-3 * np.eye(len(STRIPS))
    found = [RINGS.hoop_stretch(STRIPS, PAIRED, STRIPS + np.outer(m, [0.0, 1.0])) for m in moves]
    np.testing.assert_allclose((np.array(found).T - 1.0) / 0.1e-3, expected, atol=1e-9)
    assert (expected[~ROUND] == 0.0).all() and (expected[ROUND] != 0.0).sum() == 6 * ROUND.sum()


@pytest.mark.parametrize("scatter", [0.0, 0.2e-3])
def test_pressure_on_a_ring_is_the_gradient_of_its_volume(scatter):
    """By central differences of a cubic: off by a third derivative of 1 times h^2 / 6, 1e-13 m^2,
    and as much of round-off, beside forces of 1e-6 m^2.
    """
    x = STRIPS + scatter * np.random.default_rng(2).standard_normal(STRIPS.shape)
    upper = SECTION.facet_sets["bottom"]
    edges = np.concatenate([upper, upper[:, ::-1] + len(SECTION.points)])
    facets = RINGS.pressed(edges + 7, 7) - 7  # of a body whose nodes begin at 7
    np.testing.assert_array_equal(facets[:, 2:], OPPOSITE[edges])
    if scatter == 0.0:
        assert RINGS.enclosed_volume(x, facets) == pytest.approx(SECTOR * 1e-3**2 * 4e-3)
    found = np.zeros_like(x)
    np.add.at(found, facets, RINGS.volume_gradient(x, facets))
    h = 1e-6
    for a in np.unique(facets):
        for i in range(2):
            step = np.zeros_like(x)
            step[a, i] = h
            ends = [RINGS.enclosed_volume(x + s * step, facets) for s in (1.0, -1.0)]
            assert found[a, i] == pytest.approx((ends[0] - ends[1]) / (2.0 * h), abs=1e-12)
    np.testing.assert_allclose(found.sum(axis=0), 0.0, atol=1e-18)


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
