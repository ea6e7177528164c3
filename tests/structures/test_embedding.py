"""Places in elements: shape functions that give them back, whatever the elements."""

import numpy as np
import pytest

from softsim.mesh.mesh import boundary_facets, simplexes
from softsim.structures.fibre import embedded, holding_cells

# A cube of two wedges, as hexahedra with corners that fall together, and a cube beside it.
CORNERS = np.array(
    [[x, y, z] for z in (0.0, 1.0) for x, y in ((0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1))]
)
WEDGES = np.array(
    [[0, 1, 4, 4, 6, 7, 10, 10], [0, 4, 3, 3, 6, 10, 9, 9], [1, 2, 5, 4, 7, 8, 11, 10]]
)


def lattice(dimension, seed=2):
    """Quadrilaterals or hexahedra of 4 cells a side, their nodes moved by up to a fifth of one."""
    axes = np.meshgrid(*[np.arange(5.0)] * dimension, indexing="ij")
    points = np.stack([axis.ravel() for axis in axes], axis=1)
    number = np.arange(len(points)).reshape([5] * dimension)
    first = number[(slice(0, 4),) * dimension].ravel()
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    offsets = square if dimension == 2 else [(*s, z) for z in (0, 1) for s in square]
    cells = np.stack([first + number[offset] for offset in offsets], axis=1)
    shift = np.random.default_rng(seed).uniform(-0.2, 0.2, points.shape)
    return points + shift, cells


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("cut", [False, True])
def test_shape_functions_give_places_back(dimension, cut):
    points, cells = lattice(dimension)
    if cut:
        cells = simplexes(cells, dimension)
    rng = np.random.default_rng(4)
    places = rng.uniform(0.3, 3.7, (200, dimension))
    cell, weights = holding_cells(places, points, cells)
    assert (cell >= 0).all()
    assert weights.min() > -1e-8
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=0.0, atol=1e-12)
    held = np.einsum("kc,kcd->kd", weights, points[cells[cell]])
    np.testing.assert_allclose(held, places, rtol=0.0, atol=1e-12)


def test_places_in_wedges():
    rng = np.random.default_rng(5)
    places = np.concatenate([rng.uniform(0.0, 1.0, (100, 3)) * [2, 1, 1], CORNERS])
    cell, weights = holding_cells(places, CORNERS, WEDGES)
    held = np.einsum("kc,kcd->kd", weights, CORNERS[WEDGES[cell]])
    np.testing.assert_allclose(held, places, rtol=0.0, atol=1e-8)
    in_first = (places[:, 0] < 1.0) & (places[:, 1] < places[:, 0])
    np.testing.assert_array_equal(cell[in_first], 0)


@pytest.mark.parametrize("dimension", [2, 3])
def test_places_outside_go_to_the_surface(dimension):
    """And tell how far; on a node or a facet that cells share they stay."""
    points, cells = lattice(dimension)
    points = np.round(points)  # a block again
    surface = boundary_facets(cells, dimension)
    outside, edge, node = np.full((3, dimension), 1.25)
    outside[0], edge[0], node[:] = -0.5, 2.0, 3.0
    nodes, weights, moved = embedded(np.array([outside, edge, node]), points, cells, surface)
    held = np.einsum("kc,kcd->kd", weights, points[nodes])
    np.testing.assert_allclose(held[0], [0.0, *outside[1:]], atol=1e-12)
    np.testing.assert_allclose(held[1:], [edge, node], atol=1e-12)
    np.testing.assert_allclose(moved, [0.5, 0.0, 0.0], atol=1e-12)
