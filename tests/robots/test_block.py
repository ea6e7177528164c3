import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.errors import MeshError
from softsim.mesh.quality import check, quality
from softsim.robots.block import block


@given(
    length=st.floats(1e-3, 0.1),
    height=st.floats(1e-3, 0.1),
    fineness=st.floats(1, 20),
)
def test_block_fills_its_rectangle_with_cells_of_the_wanted_size(length, height, fineness):
    size = max(length, height) / fineness
    mesh = block(length, height, size)
    check(mesh)
    assert quality(mesh).volume == pytest.approx(length * height)
    np.testing.assert_allclose(mesh.points.min(axis=0), [-length / 2, 0], atol=1e-15)
    np.testing.assert_allclose(mesh.points.max(axis=0), [length / 2, height])
    sides = np.linalg.norm(np.diff(mesh.points[mesh.facet_sets["surface"]], axis=1), axis=2)
    assert sides.max() <= size * (1 + 1e-6)


@pytest.mark.parametrize(
    ("side", "axis", "place", "normal"),
    [
        ("bottom", 1, 0.0, [0, -1]),
        ("top", 1, 2e-3, [0, 1]),
        ("left", 0, -1.5e-3, [-1, 0]),
        ("right", 0, 1.5e-3, [1, 0]),
    ],
)
def test_sides(side, axis, place, normal):
    mesh = block(3e-3, 2e-3, 0.5e-3)
    nodes = np.flatnonzero(np.isclose(mesh.points[:, axis], place))
    assert set(mesh.node_sets[side]) == set(nodes)
    start, end = mesh.points[mesh.facet_sets[side]].transpose(1, 0, 2)
    d = end - start
    np.testing.assert_allclose(
        np.column_stack([d[:, 1], -d[:, 0]]) / 0.5e-3, [normal] * len(d), atol=1e-9
    )


def test_a_whole_number_of_sizes_gives_that_many_columns():
    assert len(block(0.3, 0.1, 0.1).cells) == 6


def test_diagonals_alternate():
    mesh = block(2.0, 2.0, 1.0)
    centre = np.flatnonzero(np.isclose(mesh.points, [0, 1]).all(axis=1))
    assert np.count_nonzero(mesh.cells == centre) == 8


@pytest.mark.parametrize("name", ["length", "height", "element_size"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_dimensions_must_be_positive(name, value):
    sizes = {"length": 1.0, "height": 1.0, "element_size": 0.5, name: value}
    with pytest.raises(MeshError, match=f"block: {name} is"):
        block(**sizes)


def test_a_block_of_quadrilaterals_has_the_nodes_of_one_of_triangles():
    triangles, quadrilaterals = (block(0.4, 0.3, 0.1, kind) for kind in ("simplex", "quad"))
    check(quadrilaterals)
    assert quadrilaterals.cells.shape == (12, 4)
    assert quality(quadrilaterals).worst_aspect_ratio == pytest.approx(1.0)
    assert {*map(tuple, triangles.points)} == {*map(tuple, quadrilaterals.points)}
    for name, facets in triangles.facet_sets.items():
        assert len(quadrilaterals.facet_sets[name]) == len(facets)
