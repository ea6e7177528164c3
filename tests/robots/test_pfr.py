import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from softsim.errors import MeshError
from softsim.mesh.mesh import signed_volumes
from softsim.mesh.quality import check, quality
from softsim.robots.pfr import pfr_meridian, pfr_section, pfr_solid

DEFAULT = pfr_section()


def area(mesh, cells) -> float:
    return float(signed_volumes(mesh.points, mesh.cells[cells]).sum())


def places(mesh, nodes) -> set[tuple[float, float]]:
    return {tuple(point) for point in np.round(mesh.points[nodes] * 1e3, 9) + 0.0}


def edge_position(root: np.ndarray, tip: np.ndarray, radius: float, y: float) -> float:
    """x at height y on the arc through root and tip that bulges towards +x."""
    middle, span = (root + tip) / 2, tip - root
    chord = np.hypot(*span)
    to_center = np.array([-span[1], span[0]]) / chord
    x, y_center = middle + to_center * np.sqrt(radius**2 - chord**2 / 4)
    return x + np.sqrt(radius**2 - (y - y_center) ** 2)


def spike_area() -> float:
    """Of the default spike, by integration over its height [m^2]."""
    front = np.array([1.5e-3, 0]), np.array([-2.0e-3, 5e-3]), 5e-3
    rear = np.array([-1.5e-3, 0]), np.array([-3.0e-3, 5e-3]), 3.5e-3
    return quad(lambda y: edge_position(*front, y) - edge_position(*rear, y), 0, 5e-3)[0]


def test_skin_area_is_exact():
    assert area(DEFAULT, DEFAULT.cell_sets["skin"]) == pytest.approx(2 * 30e-3 * 1e-3, rel=1e-12)


def test_spike_area_converges_to_the_arcs_with_second_order():
    exact = 10 * spike_area()
    errors = []
    for size in (0.35e-3, 0.175e-3):
        mesh = pfr_section(element_size=size)
        errors.append(abs(area(mesh, mesh.cell_sets["spikes"]) / exact - 1))
    assert errors[0] < 0.01
    assert errors[1] < errors[0] / 3


def test_size_and_shape_of_the_default():
    measured = quality(DEFAULT)
    assert 1500 < measured.cell_count < 1900
    assert measured.smallest_altitude > 0.27e-3
    assert np.degrees(measured.smallest_angle) > 28
    assert np.degrees(measured.largest_angle) < 100


def test_outer_dimensions():
    np.testing.assert_allclose(DEFAULT.points.min(axis=0), [-15e-3, -13.5e-3], rtol=1e-12)
    np.testing.assert_allclose(DEFAULT.points.max(axis=0), [15e-3, 13.5e-3], rtol=1e-12)
    assert np.abs(DEFAULT.points[:, 1]).min() == pytest.approx(7.5e-3)


@pytest.mark.parametrize("name", ["knots", "chamber", "j1", "j5", "tips"])
def test_the_strips_mirror_each_other(name):
    top, bottom = DEFAULT.node_sets[f"{name}_top"], DEFAULT.node_sets[f"{name}_bottom"]
    np.testing.assert_array_equal(DEFAULT.points[bottom], DEFAULT.points[top] * [1, -1])
    assert set(DEFAULT.node_sets[name]) == {*top, *bottom}


def test_cells_mirror_each_other():
    skin = [DEFAULT.cell_sets[f"skin_{side}"] for side in ("top", "bottom")]
    top, bottom = (signed_volumes(DEFAULT.points, DEFAULT.cells[cells]) for cells in skin)
    np.testing.assert_allclose(top, bottom, rtol=1e-12)


def test_knots_are_the_end_faces():
    ends = {
        (x, side * y)
        for side in (1, -1)
        for x in (15.0,)
        for y in np.round(np.linspace(7.5, 8.5, 4), 9)
    }
    assert places(DEFAULT, DEFAULT.node_sets["knot_front"]) == ends
    rear = {(-x, y) for x, y in ends}
    assert places(DEFAULT, DEFAULT.node_sets["knot_rear"]) == rear
    assert places(DEFAULT, DEFAULT.node_sets["knots"]) == ends | rear


@pytest.mark.parametrize(("side", "inward"), [("top", -1), ("bottom", 1)])
def test_chamber_runs_from_knot_to_knot_and_faces_the_axis(side, inward):
    facets = DEFAULT.facet_sets[f"chamber_{side}"]
    start, end = DEFAULT.points[facets].transpose(1, 0, 2)
    np.testing.assert_allclose(np.abs([start[:, 1], end[:, 1]]), 7.5e-3)
    dx = end[:, 0] - start[:, 0]
    assert (np.sign(-dx) == inward).all()  # outward normal (dy, -dx)
    assert np.abs(dx).sum() == pytest.approx(30e-3)
    middles = (start + end)[:, 0]
    assert (np.diff(middles) > 0).all()
    np.testing.assert_array_equal(np.sort(DEFAULT.node_sets[f"chamber_{side}"]), np.unique(facets))


def test_spike_rows_count_from_the_front_and_leave_out_their_roots():
    for row, center in enumerate((12e-3, 6e-3, 0, -6e-3, -12e-3), start=1):
        spike = DEFAULT.points[DEFAULT.node_sets[f"j{row}_top"]]
        assert spike[:, 1].min() > 8.5e-3 + 0.1e-3
        assert spike[:, 0].min() == pytest.approx(center - 3e-3)
        assert center + 1.4e-3 < spike[:, 0].max() < center + 1.51e-3
    assert "j6" not in DEFAULT.node_sets


def test_tips_are_the_tip_faces():
    tips = {
        (6.0 * i - x, side * 13.5) for i in range(-2, 3) for x in (2.0, 3.0) for side in (1, -1)
    }
    assert places(DEFAULT, DEFAULT.node_sets["tips"]) == tips


def test_skin_and_spikes_are_all_cells():
    both = np.concatenate([DEFAULT.cell_sets["skin"], DEFAULT.cell_sets["spikes"]])
    np.testing.assert_array_equal(np.sort(both), np.arange(len(DEFAULT.cells)))


def test_neighbours_have_close_numbers():
    assert np.ptp(DEFAULT.cells, axis=1).max() < 40


def is_triangle(mesh) -> np.ndarray:
    """Which of the quadrilaterals have their last corner twice."""
    return mesh.cells[:, 2] == mesh.cells[:, 3]


def test_quadrilaterals_have_the_sets_of_the_triangles():
    mesh = pfr_section(cells="quad")
    assert mesh.cells.shape[1] == 4
    assert mesh.node_sets.keys() == DEFAULT.node_sets.keys()
    assert mesh.facet_sets.keys() == DEFAULT.facet_sets.keys()
    assert mesh.cell_sets.keys() == DEFAULT.cell_sets.keys()
    assert area(mesh, mesh.cell_sets["skin"]) == pytest.approx(2 * 30e-3 * 1e-3, rel=1e-12)
    assert area(mesh, mesh.cell_sets["spikes"]) == pytest.approx(10 * spike_area(), rel=0.01)
    assert places(mesh, mesh.node_sets["tips"]) >= places(DEFAULT, DEFAULT.node_sets["tips"])
    # Triangles cap the sharp tips; all else is quadrilaterals.
    triangles = np.flatnonzero(is_triangle(mesh))
    assert np.isin(triangles, mesh.cell_sets["spikes"]).all()
    centres = np.abs(mesh.points[mesh.cells[triangles, :3]].mean(axis=1)[:, 1])
    assert centres.min() > 8.5e-3 + 4e-3


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (1, 2), (3, 3)])
def test_quadrilaterals_through_the_skin_and_across_a_spike_are_given(rows, columns):
    mesh = pfr_section(cells="quad", element_size=1e-3, skin_rows=rows, spike_columns=columns)
    assert len(mesh.node_sets["knot_front_top"]) == rows + 1
    assert len(mesh.node_sets["tips_top"]) == 5 * (columns + 1)
    # As many columns from the roots on: a cap of n rows has n triangles.
    assert is_triangle(mesh).sum() == 10 * columns
    largest = np.degrees(quality(mesh).largest_angle)
    assert largest < 130


@given(
    size=st.floats(0.3e-3, 1.5e-3),
    rows=st.integers(1, 4),
    columns=st.integers(1, 5),
    spikes=st.integers(0, 3),
)
@settings(deadline=None, max_examples=15)
def test_quadrilaterals_of_any_size_make_a_sound_mesh(size, rows, columns, spikes):
    mesh = pfr_section(
        cells="quad",
        element_size=size,
        skin_rows=rows,
        spike_columns=columns,
        spikes_per_strip=spikes,
    )
    check(mesh)


def test_a_bare_skin_has_no_spike_sets():
    mesh = pfr_section(spikes_per_strip=0)
    assert quality(mesh).volume == pytest.approx(60e-6)
    assert {"j1", "tips"}.isdisjoint(mesh.node_sets)
    assert "spikes" not in mesh.cell_sets


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"skin_rows": 1}, "skin_rows is 1; for triangles and tetrahedra it follows from"),
        ({"cells": "quad", "spike_columns": 0}, "spike_columns is 0; it must be 1 or more"),
        ({"inner_diameter": -1e-3}, "inner_diameter is -1 mm; it must be positive"),
        ({"spike_height": 0.0}, "spike_height is 0 mm; it must be positive"),
        ({"element_size": float("nan")}, "element_size is nan mm"),
        ({"outer_diameter": 15e-3}, "outer_diameter is 15 mm; more than inner_diameter, 15 mm"),
        ({"lean": -1e-3}, "lean is -1 mm"),
        ({"spikes_per_strip": -1}, "number of spike rows is -1"),
        ({"spike_pitch": 3e-3}, "spike_pitch is 3 mm and the spikes overlap; .* 3.35 mm"),
        ({"free_length": 27e-3}, "free_length is 27 mm; 5 rows of spikes.* at least 27.7 mm"),
        ({"front_radius": 3e-3}, "front_radius is 3 mm; .* at least 3.725 mm"),
        ({"rear_radius": 2e-3}, "rear_radius is 2 mm; .* at least 3.06"),
        ({"tip_thickness": 0.2e-3}, "the spike is 0.2 mm thick 5 mm from its root"),
    ],
)
def test_parameters_out_of_range_are_named_with_their_limit(change, said):
    with pytest.raises(MeshError, match=said):
        pfr_section(**change)


@settings(max_examples=60)
@given(
    skin=st.floats(0.5e-3, 2e-3),
    count=st.integers(1, 6),
    spike_height=st.floats(3e-3, 7e-3),
    front_radius=st.floats(4e-3, 20e-3),
    rear_radius=st.floats(3e-3, 20e-3),
    root_thickness=st.floats(2e-3, 4e-3),
    tip_thickness=st.floats(0.6e-3, 2e-3),
    lean=st.floats(0, 3.5e-3),
    element_size=st.floats(0.2e-3, 0.5e-3),
)
# The front edge runs flatly into the tip's face while the rear corner is blunt.
@example(
    skin=2e-3,
    count=1,
    spike_height=5.86e-3,
    front_radius=4e-3,
    rear_radius=15.6e-3,
    root_thickness=3.9e-3,
    tip_thickness=1.95e-3,
    lean=2.26e-3,
    element_size=0.26e-3,
)
@pytest.mark.physics
def test_any_sensible_section_has_sound_cells(skin, count, **dimensions):
    try:
        mesh = pfr_section(
            outer_diameter=15e-3 + 2 * skin,
            spikes_per_strip=count,
            free_length=count * 6e-3 + 2e-3,
            **dimensions,
        )
    except MeshError as refused:
        assert "_radius is" in refused.message or "the spike is" in refused.message
        assume(False)
    check(mesh)
    # 15 degrees is the sharpest tip allowed; where the edges' lengths differ most it falls to 14.
    assert np.degrees(quality(mesh).smallest_angle) > 12


# -------------------------------------------------------------------------------------------------
# The half section of the skin.

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


def test_outer_dimensions_of_the_half_section():
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
def test_parameters_of_the_half_section_out_of_range_are_named(change, said):
    with pytest.raises(MeshError, match=said):
        pfr_meridian(**change)


# -------------------------------------------------------------------------------------------------
# The robot in space.

SOLID = pfr_solid()
TUBE = pfr_solid(rows=0)


def radii(mesh, nodes) -> np.ndarray:
    return np.hypot(*mesh.points[nodes, 1:].T)


def areas(mesh, name) -> np.ndarray:
    """Outward normals (k, 3) [m^2] of a facet set, as long as the facets are large."""
    corners = mesh.points[mesh.facet_sets[name]]
    return np.cross(corners[:, -2] - corners[:, 0], corners[:, -1] - corners[:, 1]) / 2


def directions(mesh) -> np.ndarray:
    """Angles [rad] of the columns of nodes around the chamber."""
    y, z = mesh.points[mesh.node_sets["chamber"], 1:].T
    return np.unique(np.round(np.arctan2(z, y) % (2 * np.pi), 9) % round(2 * np.pi, 9))


def polygon(mesh) -> tuple[float, float]:
    """Area and perimeter over radius squared and radius of the polygon of those columns."""
    around = directions(mesh)
    steps = np.diff([*around, around[0] + 2 * np.pi])
    return float(np.sin(steps).sum() / 2), float(2 * np.sin(steps / 2).sum())


def test_the_tube_is_an_exact_prism_of_its_polygon():
    factor, _ = polygon(TUBE)
    assert factor == pytest.approx(np.pi, rel=4e-3)
    exact = factor * (8.5e-3**2 - 7.5e-3**2) * 30e-3
    assert quality(TUBE).volume == pytest.approx(exact, rel=1e-8)


@pytest.mark.physics
def test_the_tube_tends_to_the_round_one_with_second_order():
    exact = np.pi * (8.5e-3**2 - 7.5e-3**2) * 30e-3
    errors = [
        abs(quality(pfr_solid(rows=0, element_size=size)).volume / exact - 1)
        for size in (0.7e-3, 0.35e-3)
    ]
    assert errors[0] < 4e-3
    assert errors[1] < errors[0] / 3


@pytest.mark.parametrize(("name", "radius"), [("chamber", 7.5e-3), ("outer", 8.5e-3)])
def test_sides_of_the_tube(name, radius):
    _, perimeter = polygon(TUBE)
    total = np.linalg.norm(areas(TUBE, name), axis=1).sum()
    assert total == pytest.approx(perimeter * radius * 30e-3, rel=1e-8)
    np.testing.assert_allclose(radii(TUBE, TUBE.node_sets[name]), radius)


def test_the_tube_has_no_boundary_but_its_sides_and_ends():
    factor, perimeter = polygon(TUBE)
    total = np.linalg.norm(areas(TUBE, "surface"), axis=1).sum()
    ends = 2 * factor * (8.5e-3**2 - 7.5e-3**2)
    assert total == pytest.approx(perimeter * 16e-3 * 30e-3 + ends, rel=1e-8)


@pytest.mark.parametrize("mesh", [SOLID, TUBE], ids=["spiked", "tube"])
def test_the_surface_is_closed(mesh):
    facets = mesh.facet_sets["surface"]
    edges = np.concatenate([facets[:, [i, (i + 1) % 3]] for i in range(3)])
    forward, count = np.unique(edges, axis=0, return_counts=True)
    assert (count == 1).all()
    np.testing.assert_array_equal(forward, np.unique(edges[:, ::-1], axis=0))
    np.testing.assert_allclose(areas(mesh, "surface").sum(axis=0), 0, atol=1e-15)


def test_size_and_shape_of_the_default_in_space():
    measured = quality(SOLID)
    assert 30_000 < measured.cell_count < 60_000
    assert measured.smallest_altitude > 0.3e-3
    assert measured.worst_aspect_ratio < 4


def test_outer_dimensions_in_space():
    assert (
        SOLID.points[:, 0].min(),
        SOLID.points[:, 0].max(),
    ) == pytest.approx((-15e-3, 15e-3))
    everything = np.arange(len(SOLID.points))
    assert radii(SOLID, everything).min() == pytest.approx(7.5e-3)
    assert radii(SOLID, everything).max() == pytest.approx(13.5e-3)


def test_the_first_spikes_keep_their_width_and_the_section_of_the_plane_model():
    spikes = SOLID.cells[SOLID.cell_sets["spikes"]]
    x, y, z = SOLID.points[spikes].mean(axis=1).T
    upper = spikes[(y > 8e-3) & (np.abs(z) < 1e-3) & (np.abs(x) < 3e-3)]
    np.testing.assert_allclose(np.abs(SOLID.points[upper, 2]).max(), 1e-3)
    section = pfr_section(element_size=0.1e-3)
    both = signed_volumes(section.points, section.cells[section.cell_sets["spikes"]]).sum()
    volume = signed_volumes(SOLID.points, upper).sum()
    assert volume == pytest.approx(both / 10 * 2e-3, rel=0.02)
    flank = np.unique(upper)[np.isclose(SOLID.points[np.unique(upper), 2], 1e-3)]
    assert len(flank) > 20


@pytest.mark.parametrize(("rows", "columns", "layers"), [(1, 2, 2), (1, 2, 3), (2, 4, 1)])
def test_hexahedra_through_the_skin_and_across_a_spike_are_given(rows, columns, layers):
    mesh = pfr_solid(
        cells="quad",
        element_size=1.25e-3,
        skin_rows=rows,
        spike_columns=columns,
        spike_layers=layers,
    )
    assert mesh.cells.shape[1] == 8
    for sets in ("node_sets", "facet_sets", "cell_sets"):
        assert getattr(mesh, sets).keys() == getattr(SOLID, sets).keys()
    around = len(mesh.node_sets["equator_inner"])
    assert len(mesh.node_sets["knot_front"]) == around * (rows + 1)
    assert around % 14 == 0
    assert len(mesh.node_sets["tips"]) == 70 * (columns + 1) * (layers + 1)
    spikes = mesh.cells[mesh.cell_sets["spikes"]]
    wedges = (spikes[:, 2] == spikes[:, 3]) & (spikes[:, 6] == spikes[:, 7])
    assert wedges.sum() == 70 * columns * layers
    cap = 70 * layers * columns * (columns + 1) // 2
    assert (len(spikes) - cap) % (70 * columns * layers) == 0
    volume = signed_volumes(mesh.points, spikes).sum()
    fine = pfr_section(element_size=0.1e-3)
    both = signed_volumes(fine.points, fine.cells[fine.cell_sets["spikes"]]).sum()
    # A spike's root lies on the polygon of the skin, whose chords run below the circle.
    assert volume == pytest.approx(7 * both * 2e-3, rel=0.05)
    names = ("chamber", "outer", "spikes", "surface")
    counts = {name: len(mesh.facet_sets[name]) for name in names}
    ends = 2 * around * rows
    assert counts["chamber"] + counts["outer"] + counts["spikes"] + ends == counts["surface"]
    np.testing.assert_allclose(areas(mesh, "surface").sum(axis=0), 0, atol=1e-15)
    factor, _ = polygon(mesh)
    # The chamber with flat ends encloses the prism of its polygon.
    centres = mesh.points[mesh.facet_sets["chamber"]].mean(axis=1)
    flux = -(areas(mesh, "chamber") * centres)[:, 1:].sum() / 2
    assert flux == pytest.approx(factor * 7.5e-3**2 * 30e-3, rel=1e-6)


def test_without_nodes_in_the_middle_there_is_no_equator():
    mesh = pfr_solid(cells="quad", element_size=1.25e-3, spike_columns=1, spike_layers=1)
    assert {name for name in SOLID.node_sets if name not in mesh.node_sets} == {
        "equator_inner", "equator_outer",
    }  # fmt: skip
    spikes = mesh.cells[mesh.cell_sets["spikes"]]
    assert (spikes[:, 2] == spikes[:, 3]).sum() == 70


def test_all_spikes_are_alike():
    volumes = signed_volumes(SOLID.points, SOLID.cells)
    spikes = SOLID.cell_sets["spikes"]
    assert len(spikes) % (5 * 14) == 0
    _, y, z = SOLID.points[SOLID.cells[spikes]].mean(axis=1).T
    which = np.round(np.arctan2(z, y) / (2 * np.pi / 14)).astype(int) % 14
    np.testing.assert_allclose(np.bincount(which, volumes[spikes]), volumes[spikes].sum() / 14)


def test_a_spike_mirrors_itself():
    # Two cells across, and diagonals to and fro: no direction around is favoured.
    middle = SOLID.points[SOLID.cells].mean(axis=1)
    near = middle[(middle[:, 1] > 0) & (np.abs(middle[:, 2]) < 1.5e-3)] * 1e3
    mirrored = near * [1, 1, -1]
    for a in (near, mirrored):
        a[:] = a[np.lexsort(np.round(a, 6).T)]
    np.testing.assert_allclose(near, mirrored, atol=1e-9)


def test_knots_in_space_are_the_end_faces():
    for name, x in (("knot_front", 15e-3), ("knot_rear", -15e-3)):
        ends = np.flatnonzero(np.isclose(SOLID.points[:, 0], x) & (_skin(SOLID)))
        np.testing.assert_array_equal(np.sort(SOLID.node_sets[name]), ends)
    both = {*SOLID.node_sets["knot_front"], *SOLID.node_sets["knot_rear"]}
    assert set(SOLID.node_sets["knots"]) == both


def _skin(mesh) -> np.ndarray:
    return np.isin(np.arange(len(mesh.points)), mesh.cells[mesh.cell_sets["skin"]])


def test_chamber_faces_the_axis():
    nodes = SOLID.node_sets["chamber"]
    np.testing.assert_allclose(radii(SOLID, nodes), 7.5e-3)
    np.testing.assert_array_equal(np.unique(SOLID.facet_sets["chamber"]), np.sort(nodes))
    centers = SOLID.points[SOLID.facet_sets["chamber"]].mean(axis=1)
    assert ((areas(SOLID, "chamber") * centers)[:, 1:].sum(axis=1) < 0).all()


def test_outer_and_spikes_and_chamber_and_ends_are_the_surface():
    names = ("chamber", "outer", "spikes")
    ends = np.isin(SOLID.facet_sets["surface"], SOLID.node_sets["knot_front"]).all(axis=1) | (
        np.isin(SOLID.facet_sets["surface"], SOLID.node_sets["knot_rear"]).all(axis=1)
    )
    parts = [SOLID.facet_sets[name] for name in names] + [SOLID.facet_sets["surface"][ends]]
    together = np.sort(np.concatenate(parts), axis=1)
    assert len(np.unique(together, axis=0)) == len(together)
    assert len(together) == len(SOLID.facet_sets["surface"])
    _, perimeter = polygon(SOLID)
    roots = 5 * 14 * 3e-3 * 2e-3
    outer = np.linalg.norm(areas(SOLID, "outer"), axis=1).sum()
    assert outer == pytest.approx(perimeter * 8.5e-3 * 30e-3 - roots, rel=2e-3)
    centers = SOLID.points[SOLID.facet_sets["outer"]].mean(axis=1)
    assert ((areas(SOLID, "outer") * centers)[:, 1:].sum(axis=1) > 0).all()


def test_rows_count_from_the_front_and_leave_out_their_roots():
    for row, center in enumerate((12e-3, 6e-3, 0, -6e-3, -12e-3), start=1):
        nodes = SOLID.node_sets[f"j{row}"]
        assert radii(SOLID, nodes).min() > 8.5e-3 + 0.1e-3
        x = SOLID.points[nodes, 0]
        assert x.min() == pytest.approx(center - 3e-3)
        assert center + 1.4e-3 < x.max() < center + 1.51e-3
        assert len(nodes) % 14 == 0
    assert "j6" not in SOLID.node_sets


def test_tips_are_the_outer_ends():
    tips = SOLID.node_sets["tips"]
    assert len(tips) == 5 * 14 * 3 * 2
    np.testing.assert_allclose(radii(SOLID, tips), 13.5e-3)


def test_equator_lies_between_the_spikes():
    inner, outer = (SOLID.node_sets[f"equator_{side}"] for side in ("inner", "outer"))
    np.testing.assert_allclose(SOLID.points[[*inner, *outer], 0], 0, atol=1e-15)
    np.testing.assert_allclose(radii(SOLID, inner), 7.5e-3)
    np.testing.assert_allclose(radii(SOLID, outer), 8.5e-3)
    assert len(inner) == len(directions(SOLID))
    y, z = SOLID.points[outer, 1:].T
    gaps = np.sort(np.arctan2(z, y) % (2 * np.pi)) / (2 * np.pi / 14)
    np.testing.assert_allclose(gaps, np.arange(14) + 0.5)
    assert len(TUBE.node_sets["equator_outer"]) == len(directions(TUBE))


def test_a_plain_tube_has_no_spike_sets():
    assert {"j1", "tips"}.isdisjoint(TUBE.node_sets)
    assert "spikes" not in TUBE.facet_sets
    assert "spikes" not in TUBE.cell_sets


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"inner_diameter": -1e-3}, "inner_diameter is -1 mm; it must be positive"),
        ({"spike_width": 0.0}, "spike_width is 0 mm; it must be positive"),
        ({"element_size": float("nan")}, "element_size is nan mm"),
        ({"outer_diameter": 15e-3}, "outer_diameter is 15 mm; more than inner_diameter, 15 mm"),
        ({"lean": -1e-3}, "lean is -1 mm"),
        ({"rows": -1}, "the number of spike rows is -1"),
        ({"spikes_around": 0}, "spikes_around is 0; it must be 1 or more"),
        (
            {"spikes_around": 20},
            "spike_width is 2 mm and the spikes overlap; 20 around.* leave 1.966 mm",
        ),
        ({"spikes_around": 100}, "spike_width is 2 mm and the spikes overlap; .* leave 0 mm"),
        ({"spike_width": 0.5e-3}, "spike_width is 0.5 mm; at least element_size, 0.7 mm"),
        ({"spike_pitch": 3.5e-3}, "spike_pitch is 3.5 mm and the spikes overlap; .* 3.7 mm"),
        ({"rows": 6}, "free_length is 30 mm; 6 rows of spikes, .* at least 34.4 mm"),
        ({"front_radius": 3e-3}, "front_radius is 3 mm; .* at least 3.725 mm"),
        ({"tip_thickness": 0.2e-3}, "the spike is 0.2 mm thick 5 mm from its root"),
    ],
)
def test_parameters_in_space_out_of_range_are_named_with_their_limit(change, said):
    with pytest.raises(MeshError, match=said):
        pfr_solid(**change)


@settings(deadline=None, max_examples=15)
@given(
    skin=st.floats(0.6e-3, 2e-3),
    rows=st.integers(0, 2),
    spikes_around=st.integers(1, 14),
    spike_height=st.floats(3e-3, 7e-3),
    root_thickness=st.floats(2e-3, 4e-3),
    tip_thickness=st.floats(0.9e-3, 2e-3),
    lean=st.floats(0, 3e-3),
    spike_width=st.floats(1e-3, 2.5e-3),
    element_size=st.floats(0.6e-3, 0.9e-3),
)
@pytest.mark.physics
def test_any_sensible_body_has_sound_cells(skin, rows, **dimensions):
    try:
        mesh = pfr_solid(
            outer_diameter=15e-3 + 2 * skin,
            rows=rows,
            free_length=(rows + 1) * 6e-3,
            **dimensions,
        )
    except MeshError as refused:
        assert "_radius is" in refused.message or "the spike" in refused.message
        assume(False)
    check(mesh)
    assert quality(mesh).worst_aspect_ratio < 10


@pytest.mark.parametrize("cells", ["simplex", "quad"])
@pytest.mark.parametrize("size", [1e-12, 1e-7, 1e-6])
def test_more_elements_than_memory_holds_are_refused_before_they_are_made(cells, size):
    with pytest.raises(MeshError, match="fit in a reasonable memory"):
        pfr_solid(element_size=size, cells=cells)
