import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.mesh.mesh import Mesh, boundary_facets, signed_volumes
from softsim.mesh.quality import check
from softsim.robots.block import extruded_tetrahedra

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def stacked(section: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Points of the section at each height."""
    return np.column_stack([np.tile(section, (len(heights), 1)), np.repeat(heights, len(section))])


@given(order=st.permutations(range(4)), turns=st.integers(0, 2), layers=st.integers(1, 4))
def test_cells_fill_the_column_whatever_the_numbering(order, turns, layers):
    section, triangles = SQUARE[np.argsort(order)], np.roll(np.array(order)[HALVES], turns, axis=1)
    points = stacked(section, np.arange(layers + 1.0))
    cells = extruded_tetrahedra([triangles] * layers, np.arange(len(points)).reshape(-1, 4))
    check(Mesh(points, cells))
    np.testing.assert_allclose(signed_volumes(points, cells), 1 / 6)
    assert len(cells) == 6 * layers
    # Conforming: nothing but the column's outside is boundary.
    assert len(boundary_facets(cells, 3)) == 4 + 8 * layers


def test_layers_may_fill_different_parts_of_the_section():
    points = stacked(SQUARE, np.arange(3.0))
    cells = extruded_tetrahedra([HALVES, HALVES[:1]], np.arange(12).reshape(3, 4))
    assert signed_volumes(points, cells).sum() == pytest.approx(1.5)
    # Outside: two halves below, four sides, a half open half-way, three sides, a half on top.
    assert len(boundary_facets(cells, 3)) == 2 + 8 + 1 + 6 + 1


@pytest.mark.parametrize("layers", [4, 5])
def test_a_closed_sweep_has_no_ends(layers):
    section = SQUARE + np.array([1, 0])
    angles = 2 * np.pi * np.arange(layers) / layers
    radius, height = section.T
    # Seen against the sweep, from larger angles, (height, radius) is a right-handed pair.
    points = np.stack(
        [
            np.broadcast_to(height, (layers, 4)),
            radius * np.cos(angles)[:, None],
            radius * np.sin(angles)[:, None],
        ],
        axis=-1,
    ).reshape(-1, 3)
    node = np.arange(layers * 4).reshape(layers, 4)
    triangles = HALVES[:, ::-1]
    cells = extruded_tetrahedra([triangles] * layers, np.concatenate([node, node[:1]]))
    check(Mesh(points, cells))
    assert len(boundary_facets(cells, 3)) == 8 * layers
    polygon = layers / 2 * np.sin(2 * np.pi / layers) * (2**2 - 1**2)
    assert signed_volumes(points, cells).sum() == pytest.approx(polygon)


def test_neighbouring_layers_mirror_each_other():
    cells = extruded_tetrahedra([HALVES, HALVES], np.arange(12).reshape(3, 4))
    mirror = np.arange(12).reshape(3, 4)[::-1].ravel()
    lower, upper = (
        {frozenset(c) for c in part.tolist()} for part in (mirror[cells[:6]], cells[6:])
    )
    assert lower == upper
