import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.errors import MeshError
from softsim.mesh.mesh import Mesh, signed_volumes
from softsim.mesh.quality import check, quality
from softsim.robots.pfr import pfr_section
from softsim.robots.spikes import (
    Fin,
    cross_lines,
    even,
    even_columns,
    finned_strip,
    grid_lines,
    spike,
    spike_patch,
    staggered,
    thickness,
    upright,
)
from softsim.scene.meshes import SpikePatchMesh

DIMENSIONS = {
    "height": 5e-3,
    "root_thickness": 3e-3,
    "tip_thickness": 1e-3,
    "lean": 2.5e-3,
    "front_radius": 5e-3,
    "rear_radius": 3.5e-3,
}


def test_edges_run_from_root_to_tip_on_their_radius():
    shape = spike(**DIMENSIONS)
    np.testing.assert_allclose(shape.front.at(0), [1.5e-3, 0], atol=1e-15)
    np.testing.assert_allclose(shape.front.at(1), [-2e-3, 5e-3], atol=1e-15)
    np.testing.assert_allclose(shape.rear.at(0), [-1.5e-3, 0], atol=1e-15)
    np.testing.assert_allclose(shape.rear.at(1), [-3e-3, 5e-3], atol=1e-15)
    for arc, radius in ((shape.front, 5e-3), (shape.rear, 3.5e-3)):
        assert np.linalg.norm(arc.at(0.3) - arc.center) == pytest.approx(radius)


def test_both_edges_bulge_forward():
    shape = spike(**DIMENSIONS)
    for arc in (shape.front, shape.rear):
        chord_middle = (arc.at(0) + arc.at(1)) / 2
        assert arc.at(0.5)[0] > chord_middle[0]
        assert arc.center[0] < chord_middle[0]


def test_arc_length_is_that_of_its_points():
    arc = spike(**DIMENSIONS).front
    points = np.array([arc.at(fraction) for fraction in np.linspace(0, 1, 1000)])
    walked = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert arc.length == pytest.approx(walked, rel=1e-6)


def test_thickness_at_root_and_tip():
    np.testing.assert_allclose(
        thickness(spike(**DIMENSIONS), np.array([0, 5e-3])), [3e-3, 1e-3], rtol=1e-9
    )


def test_a_sharp_tip_is_capped_down_to_its_corner():
    lines = cross_lines(spike(**DIMENSIONS), edge=0.5e-3, root_segments=6)
    assert len(lines[0]) == 7
    np.testing.assert_allclose(lines[-1], [[-3e-3, 5e-3]], atol=1e-15)


def test_a_blunt_tip_ends_with_its_face():
    blunt = {**DIMENSIONS, "lean": 0.0, "front_radius": 50e-3, "rear_radius": 50e-3}
    lines = cross_lines(spike(**blunt), edge=0.5e-3, root_segments=6)
    np.testing.assert_allclose(lines[-1][[0, -1]], [[-0.5e-3, 5e-3], [0.5e-3, 5e-3]], atol=1e-15)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"front_radius": 3e-3}, "front_radius is 3 mm; .* at least 3.725 mm"),
        ({"rear_radius": 2.6e-3}, "rear_radius is 2.6 mm; .* at least 3.06"),
        ({"lean": 50e-3, "front_radius": 1.0}, "lean: the spike's edge of rear_radius leans 84"),
    ],
)
def test_arcs_that_cannot_span_their_edge_are_refused(change, said):
    with pytest.raises(MeshError, match=said):
        spike(**{**DIMENSIONS, **change})


@pytest.mark.parametrize("radius", ["front_radius", "rear_radius"])
def test_the_smallest_radius_named_is_accepted(radius):
    with pytest.raises(MeshError) as refused:
        spike(**{**DIMENSIONS, radius: 1e-3})
    smallest = float(refused.value.message.split("at least ")[1].split(" mm")[0])
    spike(**{**DIMENSIONS, radius: smallest * 1.001e-3})


def test_lines_of_quadrilaterals_have_as_many_segments_up_to_the_cap():
    shape = spike(**DIMENSIONS)
    lines = grid_lines(shape, edge=1.25e-3, root_segments=3)
    assert [len(line) - 1 for line in lines] == [3] * (len(lines) - 3) + [2, 1, 0]
    np.testing.assert_allclose(lines[-1][0], shape.rear.at(1.0), atol=1e-15)
    np.testing.assert_allclose(lines[-4][-1], shape.front.at(1.0), atol=1e-15)
    for line in lines[:-3]:
        middle = line.mean(axis=0)
        np.testing.assert_allclose(line[0] + line[-1], 2 * middle, atol=1e-15)


# -------------------------------------------------------------------------------------------------
# Plane strips with spikes.


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


# -------------------------------------------------------------------------------------------------
# Patches of spikes in space.


def patch(**change):
    """A patch as a scene asks for it that says nothing but `change`."""
    asked = SpikePatchMesh(generator="spike_patch").model_dump(exclude={"generator"})
    return spike_patch(**{**asked, **change})


DEFAULT = patch()


def spike_volume():
    """Return the volume [m^3] of one spike of the fine plane section, 2 mm wide."""
    fine = pfr_section(element_size=0.1e-3)
    return signed_volumes(fine.points, fine.cells[fine.cell_sets["spikes"]]).sum() / 10 * 2e-3


@pytest.mark.parametrize(("rows", "columns"), [(5, 3), (1, 1), (2, 4)])
def test_skin_and_spikes_fill_their_volumes(rows, columns):
    mesh = patch(rows=rows, columns=columns)
    skin, spikes = (
        signed_volumes(mesh.points, mesh.cells[mesh.cell_sets[name]]).sum()
        for name in ("skin", "spikes")
    )
    assert skin == pytest.approx(rows * 6e-3 * columns * 3.59e-3 * 1e-3, rel=1e-9)
    assert spikes == pytest.approx(rows * columns * spike_volume(), rel=0.03)


def test_the_samples_middle_is_the_origin_and_spikes_point_up_and_lean_back():
    low, high = DEFAULT.points.min(axis=0), DEFAULT.points.max(axis=0)
    np.testing.assert_allclose([low, high], [[-15e-3, 0, -5.385e-3], [15e-3, 6e-3, 5.385e-3]])
    tips = DEFAULT.points[DEFAULT.node_sets["tips"]]
    np.testing.assert_allclose(tips[:, 1], 6e-3)
    np.testing.assert_allclose(np.unique(np.round(tips[:, 2], 9)), np.ravel(
        [[z - 1e-3, z, z + 1e-3] for z in (-3.59e-3, 0, 3.59e-3)]
    ), atol=1e-12)  # fmt: skip
    front = DEFAULT.points[DEFAULT.node_sets["j1"], 0]
    assert front.min() == pytest.approx(12e-3 - 3e-3) and front.max() < 12e-3 + 1.5e-3


def test_all_spikes_are_alike():
    volumes = signed_volumes(DEFAULT.points, DEFAULT.cells)
    spikes = DEFAULT.cell_sets["spikes"]
    x, _, z = DEFAULT.points[DEFAULT.cells[spikes]].mean(axis=1).T
    column = np.round(z / 3.59e-3).astype(int) + 1
    row = np.floor((x + 15e-3 + 0.5e-3) / 6e-3).astype(int)
    np.testing.assert_allclose(
        np.bincount(3 * row + column, volumes[spikes]), volumes[spikes].sum() / 15
    )


@pytest.mark.parametrize("cells", ["quad", "simplex"])
def test_sides(cells):
    mesh = patch(cells=cells, columns=2)
    under = np.flatnonzero(mesh.points[:, 1] == 0)
    np.testing.assert_array_equal(np.sort(mesh.node_sets["underside"]), under)
    assert set(mesh.facet_sets) == {"underside", "outer", "spikes", "surface"}

    def area(name):
        corners = mesh.points[mesh.facet_sets[name]]
        return (np.cross(corners[:, -2] - corners[:, 0], corners[:, -1] - corners[:, 1]) / 2).sum(0)

    size = 30e-3 * 2 * 3.59e-3
    np.testing.assert_allclose(area("underside"), [0, -size, 0], atol=1e-15)
    np.testing.assert_allclose(area("outer"), [0, size - 10 * 6e-6, 0], atol=1e-15)
    np.testing.assert_allclose(area("surface"), 0, atol=1e-15)
    assert quality(mesh).worst_aspect_ratio < 6


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"rows": 0}, "rows is 0; it must be 1 or more"),
        ({"columns": 0}, "columns is 0; it must be 1 or more"),
        ({"skin_thickness": 0.0}, "skin_thickness is 0 mm; it must be positive"),
        ({"lean": -1e-3}, "lean is -1 mm"),
        ({"spike_pitch": 3e-3}, "spike_pitch is 3 mm and the spikes overlap; .* 3.7 mm"),
        ({"column_pitch": 2.5e-3}, "column_pitch is 2.5 mm and the columns overlap; .* 2.7 mm"),
        ({"front_radius": 3e-3}, "front_radius is 3 mm; .* at least 3.725 mm"),
        (
            {"cells": "simplex", "spike_layers": 2},
            "spike_layers is 2; for triangles and tetrahedra",
        ),
    ],
)
def test_parameters_out_of_range_are_named_with_their_limit(change, said):
    with pytest.raises(MeshError, match=said):
        patch(**change)
