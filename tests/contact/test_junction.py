"""The rounded edge of two pipes that meet, against the closed form and a finely sampled surface."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from softsim.contact.junction import Junction

RUN, BRANCH, FILLET = 18e-3, 15e-3, 2e-3


def junction(dimension: int, radii=(RUN, BRANCH), fillet=FILLET, faces_wall=True) -> Junction:
    """At the origin, the run along +x, the branch along +y."""
    axes = np.eye(dimension)
    return Junction(np.zeros(dimension), axes[0], axes[1], radii, fillet, faces_wall)


def places_between(one: Junction, count: int, seed: int) -> np.ndarray:
    """Places (n, d) in both enlarged bores, of `count` at random."""
    d = len(one.centre)
    x = np.random.default_rng(seed).uniform(-1.0, 1.0, (count, d)) * one.enlarged[0]
    return x[one.holds(x)]


def test_in_the_plane_the_edge_is_an_arc():
    """About (B, A): gaps on the arc, on both walls where it begins, inside, and on its way out."""
    one, (A, B) = junction(2), junction(2).enlarged
    diagonal = FILLET * np.sqrt(0.5)
    x = np.array([[B - diagonal, A - diagonal], [B - 1e-12, RUN], [BRANCH, A - 1e-12],
                  [1e-3 - B, A - 1e-12], [0.0, 1e-12]])  # fmt: skip
    np.testing.assert_allclose(one.gap(x), [0.0, 0.0, 0.0, -1e-3, RUN], rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("faces_wall", [True, False])
def test_in_the_plane_against_its_surface(faces_wall):
    """Sampled at most 5 um apart: no place is nearer to the samples than the gap says, nor farther
    by more than the half of that squared over the distance, or than half a sample.
    """
    one = junction(2, faces_wall=faces_wall)
    A, B = one.enlarged
    along, up = np.arange(B, 0.09, 5e-6), np.arange(A, 0.09, 5e-6)
    angle = np.linspace(np.pi, 1.5 * np.pi, 2000)
    corner = np.stack([B + FILLET * np.cos(angle), A + FILLET * np.sin(angle)], axis=1)
    quarter = np.concatenate(
        [corner, np.stack([along, 0.0 * along + RUN], 1), np.stack([0.0 * up + BRANCH, up], 1)]
    )
    half = np.concatenate([quarter, quarter * [-1.0, 1.0]])
    line = np.arange(-0.09, 0.09, 5e-6)
    opposite = np.stack([line, 0.0 * line - RUN], 1) if faces_wall else -half
    x = places_between(one, 4000, seed=1)
    distance, _ = cKDTree(np.concatenate([half, opposite])).query(x)
    np.testing.assert_allclose(np.abs(one.gap(x)), distance, rtol=0.0, atol=3e-6)


@pytest.mark.parametrize("radii", [(RUN, BRANCH), (RUN, RUN)])
@pytest.mark.physics
def test_in_space_against_a_surface(radii):
    """All centres of balls in the wall, sampled at most 0.15 mm apart: the gap is the distance to
    them less the fillet, and samples are farther by half a diagonal squared over twice the least
    distance, which is as large as the fillet where it counts.
    """
    one = junction(3, radii)
    A, B = one.enlarged
    angle = np.linspace(0.0, 2.0 * np.pi, 1001)
    along, around = (v.ravel() for v in np.meshgrid(np.arange(-3.0 * B, 3.0 * B, 0.1e-3), angle))
    run = np.stack([along, A * np.cos(around), A * np.sin(around)], axis=1)
    branch = np.stack([B * np.cos(around), along, B * np.sin(around)], axis=1)
    run = run[(np.hypot(run[:, 0], run[:, 2]) >= B) | (run[:, 1] < 0.0)]
    branch = branch[(np.hypot(branch[:, 1], branch[:, 2]) >= A) & (branch[:, 1] > 0.0)]
    fold = one.formulas.edge(np.linspace(0.0, 0.5 * np.pi, 4001), A, B).T
    edge = np.concatenate([fold * [i, 1.0, k] for i in (1.0, -1.0) for k in (1.0, -1.0)])
    x = places_between(one, 4000, seed=2)
    gap = one.gap(x)
    x, gap = x[gap > 0.5e-3 - FILLET], gap[gap > 0.5e-3 - FILLET]
    assert (gap < 0.0).sum() > 10
    farther = cKDTree(np.concatenate([run, branch, edge])).query(x)[0] - FILLET - gap
    assert farther.min() > -1e-12
    assert farther.max() < (0.075e-3 * np.sqrt(2.0)) ** 2 / (2.0 * 0.5e-3)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("radii", [(RUN, BRANCH), (RUN, RUN)])
def test_the_gradient_is_the_normal(dimension, radii):
    """A unit vector, by central differences to (h / fillet)^2 and round-off of 1e-15 / h, but where
    a side is as near as another.
    """
    one, h = junction(dimension, radii), 1e-7
    x = places_between(one, 20_000, seed=3)
    normal, steps = one.gradient(x), h * np.eye(dimension)
    slopes = np.stack([(one.gap(x + e) - one.gap(x - e)) / (2.0 * h) for e in steps], axis=1)
    off = np.linalg.norm(slopes - normal, axis=1)
    assert np.quantile(off, 0.999) < 1e-6
    in_wall = one.gap(x) < 0.0
    assert in_wall.sum() > 10
    assert off[in_wall].max() < 1e-5
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, rtol=1e-12)


def test_the_edge_vanishes_at_the_sides_of_alike_pipes():
    """There both walls are tangent to each other: the gap is that of either."""
    x = np.array([[0.0, 1e-9, RUN + 0.5e-3], [0.0, 1e-9, -RUN + 0.5e-3]])
    np.testing.assert_allclose(junction(3, (RUN, RUN)).gap(x), [-0.5e-3, 0.5e-3], atol=1e-12)
