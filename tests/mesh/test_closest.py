"""The closest point of a surface against a search on a fine grid of each facet."""

import numpy as np
import pytest

from softsim.mesh.surface import at, closest_on_facets

# A sheet of two warped quadrilaterals and a triangle, which has its last corner twice.
POINTS = np.array(
    [[0.0, 0.0, 0.0], [1.0, 0.1, 0.2], [2.0, 0.0, 0.0], [0.0, 1.0, 0.1], [1.1, 1.2, 0.0],
     [2.0, 1.0, 0.3], [1.0, 2.0, 0.1]]
)  # fmt: skip
SHEET = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 6, 6]])


def grid(facet, steps=200):
    """Points of a facet, a triangle as a quadrilateral with a side of no length."""
    a, b = (s.ravel()[:, None] for s in np.meshgrid(*[np.linspace(0.0, 1.0, steps)] * 2))
    c = POINTS[facet]
    return (1 - b) * ((1 - a) * c[0] + a * c[1]) + b * ((1 - a) * c[3] + a * c[2])


@pytest.mark.parametrize("beside", [0.0, 0.1, 1.0])
def test_no_point_of_the_sheet_is_closer(beside):
    """On the sheet, beside it, and beyond its sides."""
    rng = np.random.default_rng(1)
    places = rng.uniform([-0.3, -0.3, beside], [2.3, 2.3, beside + 0.2], (60, 3))
    facet, weights = closest_on_facets(places, POINTS, SHEET)
    found = at(weights, POINTS[SHEET[facet]])
    assert (weights >= 0.0).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-14)
    searched = np.concatenate([grid(f) for f in SHEET])
    nearest = np.array([np.linalg.norm(searched - p, axis=1).min() for p in places])
    distance = np.linalg.norm(found - places, axis=1)
    assert (distance < nearest + 1e-9).all()
    assert (distance > nearest - 0.01).all()


def test_edges_in_the_plane():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 3.0]])
    places = np.array([[0.25, 0.5], [-1.0, -1.0], [0.7, 2.0], [1.1, -0.1]])
    facet, weights = closest_on_facets(places, points, np.array([[0, 1], [1, 2]]))
    np.testing.assert_array_equal(facet, [0, 0, 1, 0])
    np.testing.assert_allclose(weights, [[0.75, 0.25], [1, 0], [1 / 3, 2 / 3], [0, 1]], atol=1e-15)


def test_a_corner_belongs_to_the_first_of_its_facets():
    facet, weights = closest_on_facets(POINTS[[4]], POINTS, SHEET)
    assert facet[0] == 0
    np.testing.assert_allclose(weights[0], [0, 0, 1, 0], atol=1e-12)
