import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softsim.errors import MeshError
from softsim.mesh.mesh import Mesh, boundary_facets, signed_volumes
from softsim.mesh.quality import check, quality
from softsim.robots.block import block, box, extruded_tetrahedra


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


# -------------------------------------------------------------------------------------------------
# Sections swept through space.

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


# -------------------------------------------------------------------------------------------------
# A block in space.

SIDES = {
    "left": (0, 0.0),
    "right": (0, 3e-3),
    "bottom": (1, 0.0),
    "top": (1, 2e-3),
    "back": (2, 0.0),
    "front": (2, 1e-3),
}


def small(cells="simplex"):
    return box(length=3e-3, width=1e-3, height=2e-3, element_size=0.5e-3, cells=cells)


@settings(deadline=None, max_examples=25)
@given(
    length=st.floats(1e-3, 0.1),
    width=st.floats(1e-3, 0.1),
    height=st.floats(1e-3, 0.1),
    fineness=st.floats(1, 8),
)
def test_box_fills_its_space_with_cells_of_the_wanted_size(length, width, height, fineness):
    size = max(length, width, height) / fineness
    mesh = box(length, width, height, size)
    check(mesh)
    assert quality(mesh).volume == pytest.approx(length * width * height)
    np.testing.assert_array_equal(mesh.points.min(axis=0), 0)
    np.testing.assert_allclose(mesh.points.max(axis=0), [length, height, width])
    edges = mesh.points[mesh.cells][:, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]]
    assert np.abs(np.diff(edges, axis=2)).max() <= size * (1 + 1e-6)


@pytest.mark.parametrize("kind", ["simplex", "quad"])
@pytest.mark.parametrize("name", SIDES)
def test_sides_are_planes_that_face_outward(name, kind):
    mesh = small(kind)
    axis, place = SIDES[name]
    nodes = np.flatnonzero(np.isclose(mesh.points[:, axis], place, atol=1e-12))
    np.testing.assert_array_equal(np.sort(mesh.node_sets[name]), nodes)
    np.testing.assert_array_equal(np.unique(mesh.facet_sets[name]), nodes)
    corners = mesh.points[mesh.facet_sets[name]]
    areas = np.cross(corners[:, -2] - corners[:, 0], corners[:, -1] - corners[:, 1]) / 2
    total = areas.sum(axis=0)
    expected = np.zeros(3)
    expected[axis] = 6e-9 / [3e-3, 2e-3, 1e-3][axis] * (1 if place else -1)
    np.testing.assert_allclose(total, expected, atol=1e-18)


def test_the_sides_are_the_whole_surface():
    mesh = small()
    together = np.concatenate([mesh.facet_sets[name] for name in SIDES])
    assert {frozenset(f) for f in together.tolist()} == {
        frozenset(f) for f in mesh.facet_sets["surface"].tolist()
    }
    assert len(together) == len(mesh.facet_sets["surface"])


def test_each_brick_is_six_equally_good_tetrahedra():
    mesh = small()
    assert len(mesh.cells) == 6 * 6 * 4 * 2
    assert quality(mesh).smallest_altitude > 0.5e-3 / np.sqrt(3) * (1 - 1e-9)


@pytest.mark.parametrize("name", ["length", "width", "height", "element_size"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_dimensions_of_a_box_must_be_positive(name, value):
    sizes = {"length": 1.0, "width": 1.0, "height": 1.0, "element_size": 0.5, name: value}
    with pytest.raises(MeshError, match=f"{name} is .* must be positive"):
        box(**sizes)


def test_too_many_bricks_are_refused_before_they_are_made():
    with pytest.raises(MeshError, match=r"element_size is 0\.1 mm and cuts the box into 1e\+09"):
        box(0.1, 0.1, 0.1, 1e-4)


def test_a_box_of_hexahedra_is_made_of_cubes():
    mesh = small("quad")
    assert mesh.cells.shape == (6 * 4 * 2, 8)
    found = quality(mesh)
    assert found.worst_aspect_ratio == pytest.approx(1.0)
    assert found.volume == pytest.approx(6e-9)
    assert {*map(tuple, mesh.points)} == {*map(tuple, small().points)}
