import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from softsim.errors import MeshError
from softsim.mesh.mesh import signed_volumes
from softsim.mesh.quality import check, quality
from softsim.robots.pfr import pfr_section

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
