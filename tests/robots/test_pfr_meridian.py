import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softsim.errors import MeshError
from softsim.mesh.mesh import signed_volumes
from softsim.mesh.quality import check, quality
from softsim.robots.pfr import pfr_meridian

PLAIN = pfr_meridian()
RINGED = pfr_meridian(ring_rows=5)


def coordinates(mesh, name) -> tuple[np.ndarray, np.ndarray]:
    """r and z [mm] of a node set."""
    return tuple(1e3 * mesh.points[mesh.node_sets[name]].T)


def lengths(mesh, name) -> np.ndarray:
    """Outward normals [m], as long as their facets."""
    start, end = mesh.points[mesh.facet_sets[name]].transpose(1, 0, 2)
    dr, dz = (end - start).T
    return np.column_stack([dz, -dr])


def test_area_is_exact():
    assert quality(PLAIN).volume == pytest.approx(30e-6, rel=1e-12)
    assert quality(RINGED).volume == pytest.approx(30e-6 + 5 * 15e-6, rel=1e-12)
    rings = RINGED.cells[RINGED.cell_sets["rings"]]
    assert signed_volumes(RINGED.points, rings).sum() == pytest.approx(75e-6, rel=1e-12)
    skin = RINGED.cells[RINGED.cell_sets["skin"]]
    assert signed_volumes(RINGED.points, skin).sum() == pytest.approx(30e-6, rel=1e-12)


def test_volume_of_revolution_is_exact():
    """Pappus: each triangle times the way of its centroid."""
    areas = signed_volumes(PLAIN.points, PLAIN.cells)
    radii = PLAIN.points[PLAIN.cells, 0].mean(axis=1)
    exact = np.pi * (8.5e-3**2 - 7.5e-3**2) * 30e-3
    assert 2 * np.pi * (areas * radii).sum() == pytest.approx(exact, rel=1e-12)


def test_outer_dimensions():
    np.testing.assert_allclose(PLAIN.points.min(axis=0), [7.5e-3, -15e-3], rtol=1e-12)
    np.testing.assert_allclose(PLAIN.points.max(axis=0), [8.5e-3, 15e-3], rtol=1e-12)
    np.testing.assert_allclose(RINGED.points.max(axis=0), [13.5e-3, 15e-3], rtol=1e-12)


@pytest.mark.parametrize("size", [0.25e-3, 0.9e-3])
def test_four_rows_of_cells_through_the_skin(size):
    mesh = pfr_meridian(element_size=size)
    assert len(mesh.node_sets["end_low"]) == 5


@pytest.mark.parametrize("rows", [0, 4, 5])
def test_the_mesh_mirrors_itself_about_its_equator(rows):
    mesh = pfr_meridian(ring_rows=rows)

    def centroids(side: int) -> np.ndarray:
        middle = mesh.points[mesh.cells].mean(axis=1) * [1, side]
        return np.round(middle[np.lexsort(np.round(middle, 9).T)], 12)

    np.testing.assert_allclose(centroids(1), centroids(-1), atol=2e-12)


def test_ends():
    for name, z in (("end_low", -15), ("end_high", 15)):
        r, height = coordinates(PLAIN, name)
        np.testing.assert_allclose(np.sort(r), np.linspace(7.5, 8.5, 5))
        np.testing.assert_allclose(height, z)
    both = np.concatenate([PLAIN.node_sets["end_low"], PLAIN.node_sets["end_high"]])
    assert set(PLAIN.node_sets["ends"]) == set(both)


@pytest.mark.parametrize("mesh", [PLAIN, RINGED], ids=["plain", "ringed"])
@pytest.mark.parametrize(("name", "radius"), [("chamber", 7.5), ("outer", 8.5)])
def test_sides_of_the_skin(mesh, name, radius):
    r, z = coordinates(mesh, name)
    np.testing.assert_allclose(r, radius)
    assert (z.min(), z.max()) == pytest.approx((-15, 15))
    everywhere = np.isclose(mesh.points[:, 0], 1e-3 * radius)
    np.testing.assert_array_equal(np.sort(mesh.node_sets[name]), np.flatnonzero(everywhere))


@pytest.mark.parametrize("mesh", [PLAIN, RINGED], ids=["plain", "ringed"])
@pytest.mark.parametrize(("name", "radius"), [("equator_inner", 7.5), ("equator_outer", 8.5)])
def test_one_node_on_each_side_lies_at_the_equator(mesh, name, radius):
    r, z = coordinates(mesh, name)
    np.testing.assert_allclose(r, [radius])
    np.testing.assert_allclose(z, [0], atol=1e-12)


def test_facets_face_away_from_the_body():
    chamber = lengths(RINGED, "chamber")
    np.testing.assert_allclose(chamber.sum(axis=0), [-30e-3, 0], atol=1e-15)
    assert (chamber[:, 0] < 0).all()
    assert (np.diff(RINGED.points[RINGED.facet_sets["chamber"][:, 0], 1]) < 0).all()
    outer = lengths(RINGED, "outer")
    assert (outer[:, 0] > 0).all()
    assert outer[:, 0].sum() == pytest.approx(15e-3)
    rings = lengths(RINGED, "rings")
    assert rings[rings[:, 0] > 1e-9, 0].sum() == pytest.approx(5 * 3e-3)
    assert np.abs(rings[:, 1]).sum() == pytest.approx(2 * 5 * 5e-3)


def test_rows_of_tips_count_upward():
    for row, middle in enumerate((-12, -6, 0, 6, 12), start=1):
        r, z = coordinates(RINGED, f"j{row}")
        np.testing.assert_allclose(r, 13.5)
        assert (z.min(), z.max()) == pytest.approx((middle - 1.5, middle + 1.5))
    assert "j6" not in RINGED.node_sets


def test_a_bare_skin_has_no_ring_sets():
    assert "j1" not in PLAIN.node_sets
    assert "rings" not in PLAIN.facet_sets
    assert "rings" not in PLAIN.cell_sets


@settings(max_examples=30)
@given(
    skin=st.floats(0.3e-3, 3e-3),
    ring_rows=st.integers(0, 5),
    ring_height=st.floats(0.5e-3, 7e-3),
    ring_thickness=st.floats(0.5e-3, 4e-3),
    element_size=st.floats(0.2e-3, 0.6e-3),
    cells=st.sampled_from(["simplex", "quad"]),
)
def test_any_sensible_section_is_sound(skin, **dimensions):
    mesh = pfr_meridian(outer_diameter=15e-3 + 2 * skin, **dimensions)
    check(mesh)
    rings = dimensions["ring_rows"] * dimensions["ring_height"] * dimensions["ring_thickness"]
    assert quality(mesh).volume == pytest.approx(30e-3 * skin + rings)


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_rows_of_quadrilaterals_through_the_skin_are_given(rows):
    mesh = pfr_meridian(cells="quad", element_size=1e-3, ring_rows=5, skin_rows=rows)
    assert mesh.cells.shape[1] == 4
    assert quality(mesh).largest_angle == pytest.approx(np.pi / 2)
    assert len(mesh.node_sets["end_low"]) == rows + 1
    for name in ("equator_inner", "equator_outer"):
        r, z = coordinates(mesh, name)
        assert len(r) == 1
        np.testing.assert_allclose(z, [0], atol=1e-12)
    for sets in ("node_sets", "facet_sets", "cell_sets"):
        assert getattr(mesh, sets).keys() == getattr(RINGED, sets).keys()
    np.testing.assert_allclose(lengths(mesh, "chamber").sum(axis=0), [-30e-3, 0], atol=1e-15)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"inner_diameter": 0.0}, "inner_diameter is 0 mm; it must be positive"),
        ({"free_length": -1e-3}, "free_length is -1 mm; it must be positive"),
        ({"ring_height": float("nan")}, "ring_height is nan mm"),
        ({"outer_diameter": 14e-3}, "outer_diameter is 14 mm; more than inner_diameter, 15 mm"),
        ({"ring_rows": -1}, "the number of ring rows is -1"),
        ({"ring_rows": 2, "ring_pitch": 3e-3}, "ring_pitch is 3 mm and the rings overlap; .*3.25"),
        ({"ring_rows": 6}, "free_length is 30 mm; 6 rows of rings, .* at least 33.5 mm"),
    ],
)
def test_parameters_out_of_range_are_named_with_their_limit(change, said):
    with pytest.raises(MeshError, match=said):
        pfr_meridian(**change)
