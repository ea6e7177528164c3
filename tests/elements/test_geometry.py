"""Geometry of the formulations against shapes of known volume."""

import numpy as np
import pytest

from softsim.elements.geometry import Region, principal_values, simplex_gradients
from softsim.elements.hoop import Axisymmetric, RingSection
from softsim.elements.plane_elements import PlaneStrain
from softsim.elements.solid import Solid
from softsim.robots.block import block, box

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
# What presses on the strips from inside.
INSIDE = SECTION.facet_sets["bottom"]
EDGES = np.concatenate([INSIDE, INSIDE[:, ::-1] + len(SECTION.points)])


def turned(x, angle):
    """Points (n, 2) turned about the origin [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return x @ np.array([[c, s], [-s, c]])


def deformation(geometry, points, cells, x):
    """F of a region of these elements, of no material."""
    region = Region("body", None, 0, points, cells, np.arange(len(cells)), geometry, None)
    return region.deformation(x)


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


@pytest.mark.parametrize("found", ["volumes", "gradients"])
def test_a_section_of_more_cells_than_a_batch_is_the_same(monkeypatch, found):
    """Rings are known by their number among all cells, not among those of a batch."""
    whole = getattr(RINGS, found)(STRIPS, PAIRED)
    monkeypatch.setattr("softsim.mesh.mesh.BATCH", 7)
    np.testing.assert_array_equal(getattr(RINGS, found)(STRIPS, PAIRED), whole)


def test_ring_shares_are_the_integrals_of_the_shape_functions():
    """int N_a r dA of a triangle by its closed form, A (2 r_a + r_b + r_c) / 12."""
    points, cell = np.array([[0.0, 0.0], [2.0, 0.0], [0.5, 1.0]]), np.array([[0, 1, 2]])
    shares = Axisymmetric().mass_shares(points, cell)[0]
    r = points[:, 0]
    np.testing.assert_allclose(shares, (r + r.sum()) / 12.0 / (r.sum() / 3.0), rtol=1e-14)


def test_deformation_of_a_stretched_ring():
    """u_r = 0.2 r, u_y = -0.1 y: F = diag(1.2, 0.9, 1.2) in every element."""
    F = deformation(Axisymmetric(), RING, SECTION.cells, RING * [1.2, 0.9])
    np.testing.assert_allclose(F, np.broadcast_to(np.diag([1.2, 0.9, 1.2]), F.shape), atol=1e-13)


def test_deformation_of_a_ring_section():
    """Radii and lengths stretched, moved far across the axis: F_zz is 1.2 of rings, of others 1.
    Turned upside down, and by any angle, it stays so.
    """
    stretched = STRIPS * [0.9, 1.2] + [3e-3, -50e-3]
    expected = np.where(ROUND[:, None, None], np.diag([0.9, 1.2, 1.2]), np.diag([0.9, 1.2, 1.0]))
    for angle in (0.0, 0.8, np.pi):
        F = deformation(RINGS, STRIPS, PAIRED, turned(stretched, angle))
        R = np.eye(3)
        R[:2, :2] = turned(np.eye(2), angle).T
        np.testing.assert_allclose(F, R @ expected, atol=1e-12)


def test_a_single_part_may_lie_on_the_axis():
    """There a node is its own opposite: a diameter of no length, which is nobody's."""
    points, cells = np.array([[0.0, 0.0], [1e-3, 0.0], [0.0, 1e-3]]), np.array([[0, 1, 2]])
    fin = RingSection(DEPTH, SECTOR, np.array([0, 1, 2]), np.array([False]))
    assert fin.hoop.stretch(points, cells, 1.1 * points) == 1.0
    assert (fin.hoop.gradient(points, cells, points) == 0.0).all()
    assert (fin.hoop.curvature(points, cells) == 0.0).all()


def test_what_strains_a_ring_and_how_much():
    """Its nodes off their places at random: slopes of F_zz by central differences, off by a third
    derivative of 1/D^3, D >= 2 mm, times h^2 / 6 and by eps / h, both 1e-8 of 1/D. Nothing else
    moves it, and a ring that moves as a whole keeps it.
    """
    x = STRIPS + 0.2e-3 * np.random.default_rng(3).standard_normal(STRIPS.shape)
    F_zz = RINGS.hoop.stretch(STRIPS, PAIRED, x)
    movers, slopes = RINGS.hoop.stencil(PAIRED), RINGS.hoop.gradient(STRIPS, PAIRED, x)
    np.testing.assert_array_equal(movers[:, :3], PAIRED)
    np.testing.assert_allclose(slopes.sum(axis=1), 0.0, atol=1e-12 * np.abs(slopes).max())
    expected = np.zeros((len(PAIRED), *STRIPS.shape))
    np.add.at(expected, (np.arange(len(PAIRED))[:, None], movers), slopes * F_zz[:, None, None])
    h, found = 1e-7, np.zeros_like(expected)
    for a, i in np.ndindex(STRIPS.shape):
        step = np.zeros_like(x)
        step[a, i] = h
        ends = [RINGS.hoop.stretch(STRIPS, PAIRED, x + s * step) for s in (1.0, -1.0)]
        found[:, a, i] = (ends[0] - ends[1]) / (2.0 * h)
    np.testing.assert_allclose(found, expected, atol=1e-7 / 2e-3)
    moved = (expected != 0.0).any(axis=2)
    assert not moved[~ROUND].any() and moved[ROUND].sum() == 6 * ROUND.sum()


def test_how_turning_a_diameter_stretches_its_ring():
    """d^2F_zz along random displacements by second differences, off by 1e-4 of it as above: it is
    not below zero, and not above what bounds it; it reaches that where nothing moves along a
    diameter.
    """
    rng, h = np.random.default_rng(4), 2e-6
    x = STRIPS + 0.2e-3 * rng.standard_normal(STRIPS.shape)
    F_zz = RINGS.hoop.stretch(STRIPS, PAIRED, x)
    bound = RINGS.hoop.curvature(x, PAIRED)
    across = x - x[OPPOSITE]
    across /= np.maximum(np.linalg.norm(across, axis=1), 1e-30)[:, None]
    random = rng.standard_normal(x.shape)
    turning = random - across * (across * random).sum(axis=1)[:, None]
    for u, reached in ((random, 0.0), (turning, 1.0)):
        ends = [RINGS.hoop.stretch(STRIPS, PAIRED, x + s * h * u) for s in (1.0, -1.0)]
        second = (ends[0] + ends[1] - 2.0 * F_zz) / h**2 / F_zz
        v = u[RINGS.hoop.stencil(PAIRED)]
        most = np.einsum("mai,mab,mbi->m", v, bound, v)
        error = 1e-4 * most.max()
        assert (second <= most + error).all()
        assert (second >= reached * most - error).all()


@pytest.mark.parametrize(("scatter", "angle"), [(0.0, 0.0), (0.0, 2.0), (0.2e-3, 0.7)])
def test_pressure_on_a_ring_is_the_gradient_of_its_volume(scatter, angle):
    """By central differences of about a cubic: off by a third derivative of 1 times h^2 / 6,
    1e-13 m^2, and as much of round-off, beside forces of 1e-6 m^2. No facet's forces move or turn
    the section.
    """
    x = STRIPS + scatter * np.random.default_rng(2).standard_normal(STRIPS.shape)
    x = turned(x, angle)
    facets = RINGS.pressed(EDGES + 7, 7) - 7  # of a body whose nodes begin at 7
    np.testing.assert_array_equal(facets[:, 2:], OPPOSITE[EDGES])
    if scatter == 0.0:
        assert RINGS.enclosed_volume(x, facets) == pytest.approx(SECTOR * 1e-3**2 * 4e-3)
    forces = RINGS.volume_gradient(x, facets)
    found = np.zeros_like(x)
    np.add.at(found, facets, forces)
    h = 1e-6
    for a in np.unique(facets):
        for i in range(2):
            step = np.zeros_like(x)
            step[a, i] = h
            ends = [RINGS.enclosed_volume(x + s * step, facets) for s in (1.0, -1.0)]
            assert found[a, i] == pytest.approx((ends[0] - ends[1]) / (2.0 * h), abs=1e-12)
    np.testing.assert_allclose(forces.sum(axis=1), 0.0, atol=1e-18)
    moments = x[facets][..., 0] * forces[..., 1] - x[facets][..., 1] * forces[..., 0]
    np.testing.assert_allclose(moments.sum(axis=1), 0.0, atol=1e-20)


def test_frusta_whose_ends_are_parallel():
    """Diameters along y, their middles anywhere: between them and over the sector there is
    sector/6 h (a^2 + a b + b^2) on each side, and F_zz is the ratio of the sums of the radii.
    """
    rng, half = np.random.default_rng(6), len(SECTION.points)
    radii = UPPER[:, 1] - 2e-3 + 0.2e-3 * rng.random(half)
    middles = np.stack([UPPER[:, 0] + 0.2e-3 * rng.random(half), 3e-3 * rng.random(half)], axis=1)
    x = np.concatenate([middles + np.outer(s * radii, [0.0, 1.0]) for s in (1.0, -1.0)])
    a, b = INSIDE.T
    # Lower facets run the other way about: the upper ones' mirror images.
    parts = (middles[b] - middles[a])[:, 0] * (radii[a] ** 2 + radii[a] * radii[b] + radii[b] ** 2)
    volume = RINGS.enclosed_volume(x, RINGS.pressed(EDGES, 0))
    assert volume == pytest.approx(2.0 * SECTOR / 6.0 * parts.sum(), rel=1e-12)
    at_rest = UPPER[:, 1] - 2e-3
    stretch = radii[SECTION.cells].sum(axis=1) / at_rest[SECTION.cells].sum(axis=1)
    expected = np.where(ROUND, np.tile(stretch, 2), 1.0)
    np.testing.assert_allclose(RINGS.hoop.stretch(STRIPS, PAIRED, x), expected, rtol=1e-12)


def test_gradients_reproduce_a_linear_field():
    slope = np.array([0.3, -2.0, 1.1])
    nodal = (BOX.points @ slope)[BOX.cells]
    found = np.einsum("ea,eai->ei", nodal, simplex_gradients(BOX.points, BOX.cells))
    np.testing.assert_allclose(found, np.broadcast_to(slope, found.shape), rtol=1e-11)


def test_principal_values_are_those_of_numpy():
    rng = np.random.default_rng(1)
    a = rng.standard_normal((200, 3, 3))
    symmetric = a + a.transpose(0, 2, 1)
    special = np.array(
        [np.eye(3), np.zeros((3, 3)), np.diag([2.0, 2.0, 1.0]), np.diag([1.0, 2, 2])]
    )
    tensors = np.concatenate([symmetric, special])
    expected = np.linalg.eigvalsh(tensors)[:, ::-1]
    found = principal_values(tensors)
    np.testing.assert_allclose(found[:200], expected[:200], rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(found, expected, atol=3.0 * np.sqrt(np.finfo(float).eps))
