import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.mesh.mesh import Mesh, signed_volumes
from softsim.mesh.quality import check
from softsim.robots.spikes import Fin, even, even_columns, finned_strip, staggered, upright


@pytest.mark.parametrize(
    ("count", "expected"), [(0.1, 2), (2.9, 2), (3.1, 4), (4.0, 4), (5.1, 6), (1e3, 1000)]
)
def test_even_is_the_nearest_even_number(count, expected):
    assert even(count) == expected


@given(st.lists(st.floats(0.1, 3.0), min_size=1, max_size=6), st.floats(0.05, 2.0))
def test_columns_hold_the_stations_and_their_middles(pieces, size):
    stations = np.cumsum([0.0, *pieces])
    x, ends = even_columns(stations, size)
    np.testing.assert_allclose(x[ends], stations)
    np.testing.assert_allclose(x[(ends[:-1] + ends[1:]) // 2], (stations[:-1] + stations[1:]) / 2)
    assert (np.diff(x) > 0).all()
    assert np.diff(x).max() <= 2 * size or np.diff(x).max() <= max(pieces) / 2 * (1 + 1e-9)


def test_staggered_lines_keep_their_ends():
    first, second, third = staggered(np.array([0.0, 1.0, 2.0, 3.0]), 3)
    np.testing.assert_array_equal(second, [0.0, 1.5, 3.0])
    np.testing.assert_array_equal(first, third)


@pytest.mark.parametrize("kind", ["simplex", "quad"])
def test_strip_with_a_rectangular_fin(kind):
    x, ends = even_columns(np.array([-3.0, -1.0, 1.0, 3.0]), 0.5)
    start, end = ends[1], ends[2]
    fin = Fin(start, end, upright(x[start : end + 1], 1.0, 3.0, rows=4, kind=kind))
    strip = finned_strip(x, thickness=1.0, rows=2, fins=[fin], kind=kind)
    check(Mesh(strip.points, strip.cells))
    assert signed_volumes(strip.points, strip.skin_cells).sum() == pytest.approx(6.0)
    assert signed_volumes(strip.points, strip.fin_cells).sum() == pytest.approx(4.0)
    inner, middle, outer = strip.skin_lines
    for line, y in ((inner, 0.0), (middle, 0.5), (outer, 1.0)):
        np.testing.assert_array_equal(strip.points[line, 1], y)
    np.testing.assert_allclose(strip.points[strip.at_middle(inner)], [[0, 0]], atol=1e-15)
    assert strip.points[strip.fins[0], 1].min() == 1.5
