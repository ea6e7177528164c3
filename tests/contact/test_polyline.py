"""Signed distances from polylines."""

from itertools import pairwise

import numpy as np
import pytest

from softsim.contact.polyline import Polyline
from softsim.contact.terrain import checked_polyline

# A ground with a step up, an overhang and a notch.
GROUND = np.array([[0, 0], [10, 0], [9, 4], [16, 4], [17, 1], [18, 4], [30, 6]]) * 1e-3
SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def even_odd(points, x):
    """Whether places are inside a closed polygon: how often a ray towards +x crosses it."""
    a, b = points, np.roll(points, -1, axis=0)
    x0, y0 = x[:, :1], x[:, 1:]
    straddles = (a[:, 1] > y0) != (b[:, 1] > y0)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = a[:, 0] + (y0 - a[:, 1]) * (b - a)[:, 0] / (b - a)[:, 1]
    return (straddles & (x0 < at)).sum(axis=1) % 2 == 1


def test_distance_and_sign_against_brute_force():
    """The distance to every edge by the foot on its line or its ends; the sign by counting
    crossings: the free side is above the ground, on the left.
    """
    line = checked_polyline(GROUND, False)
    x = np.random.default_rng(2).uniform([-5e-3, -5e-3], [35e-3, 12e-3], (3000, 2))
    far = line.prolonged(1.0).points
    exact = np.full(len(x), np.inf)
    for a, b in pairwise(far):
        beside = ((x - a) @ (b - a) > 0.0) & ((x - b) @ (b - a) < 0.0)
        normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a)
        across = np.abs((x - a) @ normal)
        ends = np.minimum(np.linalg.norm(x - a, axis=1), np.linalg.norm(x - b, axis=1))
        exact = np.minimum(exact, np.where(beside, across, ends))
    found = line.gaps(x)
    np.testing.assert_allclose(np.abs(found), exact, atol=1e-15)
    below = np.vstack([far, [[1.0, -1.0], [-1.0, -1.0]]])
    assert np.array_equal(found < 0.0, even_odd(below, x))
    assert (found < 0.0).any() and (found > 0.0).any()


@pytest.mark.parametrize("points, free_inside", [(SQUARE, True), (SQUARE[::-1], False)])
def test_a_closed_one_is_free_on_its_left(points, free_inside):
    line = checked_polyline(points, True)
    places = np.array([[0.5, 0.4], [2.0, 0.5], [1.3, 1.4]])
    expected = np.array([0.4, -1.0, -0.5]) * (1.0 if free_inside else -1.0)
    np.testing.assert_allclose(line.gaps(places), expected, atol=1e-15)


def test_that_a_closed_one_repeats_its_first_point_is_allowed():
    line = checked_polyline(np.vstack([SQUARE, SQUARE[:1]]), True)
    assert len(line.points) == 4


def test_ends_go_on_straight():
    points, outwards, normals = checked_polyline(GROUND, False).ends
    np.testing.assert_allclose(points, GROUND[[0, -1]])
    np.testing.assert_allclose(outwards[0], [-1.0, 0.0])
    np.testing.assert_allclose(outwards[1], np.array([6.0, 1.0]) / np.sqrt(37.0))
    np.testing.assert_allclose(normals[1], np.array([-1.0, 6.0]) / np.sqrt(37.0))
    assert [len(part) for part in Polyline(SQUARE, True).ends] == [0, 0, 0]


def test_turns_tell_convex_corners_from_concave_ones():
    """To the left where the free side is narrower: a foot, a notch."""
    turns = checked_polyline(GROUND, False).turns
    assert np.array_equal(np.sign(turns), [0, 1, -1, -1, 1, -1])
    square = checked_polyline(SQUARE, True)
    np.testing.assert_allclose(square.turns, 0.5 * np.pi)
