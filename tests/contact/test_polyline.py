"""Signed distances from polylines, and what is no wall."""

from itertools import pairwise

import numpy as np
import pytest

from softsim.contact.polyline import Polyline, checked_polyline
from softsim.errors import MeshError

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


REFUSED = {
    "one point": ([[0, 0]], False, "1 different points: at least 2"),
    "a closed line": ([[0, 0], [1, 0], [0, 0]], True, "2 different points: at least 3"),
    "twice the same": ([[0, 0], [1, 0], [1, 0], [2, 0]], False, "points 1 and 2 .* are the same"),
    "crossing": (
        [[0, 0], [10, 0], [10, 10], [4, -5]], False,
        r"edges 0 and 2 .*counted from 0, at \(6000, 0\) mm",
    ),
    "touching": ([[0, 0], [10, 0], [10, 5], [5, 0], [5, 9]], False, "edges 0 and 2"),
    "folding back": ([[0, 0], [10, 0], [5, 0]], False, "edges 0 and 1"),
    "along itself": ([[0, 0], [10, 0], [10, 1], [4, 1], [4, 0], [6, 0]], False, "edges 0 and [34]"),
    "a bow": ([[0, 0], [1, 1], [1, 0], [0, 1]], True, "edges 0 and 2,"),
    "ends that cross": ([[0, 1], [1, 1.5], [1, 0], [0, 0.1]], False, "extended straight"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_wall(case):
    points, closed, message = REFUSED[case]
    with pytest.raises(MeshError, match=message):
        checked_polyline(np.array(points, dtype=float), closed)


def test_crossings_are_found_among_many_edges():
    """A closed star of 3,000 edges has none; with two of its corners exchanged it has one there."""
    turn = 2.0 * np.pi * np.arange(3000)[:, None] / 3000
    star = (5.0 + np.sin(70.0 * turn)) * np.hstack([np.cos(turn), np.sin(turn)])
    assert len(checked_polyline(star, True).points) == 3000
    star[[1500, 1501]] = star[[1501, 1500]]
    with pytest.raises(MeshError, match="edges 1499 and 1501,"):
        checked_polyline(star, True)


def test_turns_tell_convex_corners_from_concave_ones():
    """To the left where the free side is narrower: a foot, a notch."""
    turns = checked_polyline(GROUND, False).turns
    assert np.array_equal(np.sign(turns), [0, 1, -1, -1, 1, -1])
    square = checked_polyline(SQUARE, True)
    np.testing.assert_allclose(square.turns, 0.5 * np.pi)
