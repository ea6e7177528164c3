import numpy as np
import pytest

from softsim.errors import MeshError
from softsim.robots.spikes import cross_lines, grid_lines, spike, thickness

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
