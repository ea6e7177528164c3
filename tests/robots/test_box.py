import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softsim.errors import MeshError
from softsim.mesh.quality import check, quality
from softsim.robots.block import box

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
def test_dimensions_must_be_positive(name, value):
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
