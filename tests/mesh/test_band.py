import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from softsim.mesh.mesh import signed_volumes
from softsim.mesh.surface import quadrilateral_band, stacked_bands, triangle_band


def two_lines(below: int, above: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A unit square with `below` segments at its bottom and `above` at its top."""
    bottom = np.column_stack([np.linspace(0, 1, below + 1), np.zeros(below + 1)])
    top = np.column_stack([np.linspace(0, 1, above + 1), np.ones(above + 1)])
    lower, upper = np.arange(below + 1), below + 1 + np.arange(above + 1)
    return np.vstack([bottom, top]), lower, upper


@given(below=st.integers(1, 20), above=st.integers(1, 20))
def test_band_fills_the_space_once(below, above):
    points, lower, upper = two_lines(below, above)
    areas = signed_volumes(points, triangle_band(points, lower, upper))
    assert len(areas) == below + above
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(1)


def test_a_single_node_closes_the_band_to_a_fan():
    points = np.array([[0, 0], [1, 0], [2, 0], [1, 1.0]])
    cells = triangle_band(points, np.array([0, 1, 2]), np.array([3]))
    assert cells.tolist() == [[0, 1, 3], [1, 2, 3]]


def test_quads_are_cut_along_their_shorter_diagonal():
    lower, upper = np.array([0, 1]), np.array([2, 3])
    for slant, diagonal in ((0.3, {1, 2}), (-0.3, {0, 3})):
        points = np.array([[0, 0], [1, 0], [slant, 1], [1 + slant, 1]])
        first, second = triangle_band(points, lower, upper).tolist()
        assert set(first) & set(second) == diagonal


def test_stacked_bands_share_their_lines():
    points, lower, upper = two_lines(3, 2)
    peak = np.array([len(points)])
    points = np.vstack([points, [0.5, 2]])
    areas = signed_volumes(points, stacked_bands(points, [lower, upper, peak], triangle_band))
    assert areas.sum() == pytest.approx(1.5)


@given(below=st.integers(0, 20), above=st.integers(0, 20))
def test_a_band_of_quadrilaterals_ends_with_triangles(below, above):
    assume(below + above > 0)
    points, lower, upper = two_lines(below, above)
    cells = quadrilateral_band(points, lower, upper)
    areas = signed_volumes(points, cells)
    assert len(areas) == max(below, above)
    assert (cells[:, 2] == cells[:, 3]).sum() == abs(below - above)
    assert (areas > 0).all()
    if below and above:
        assert areas.sum() == pytest.approx(1)
