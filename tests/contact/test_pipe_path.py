"""The gap of a pipe along a path, against brute force and against what a distance must be."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from softsim.contact.pipe_layout import Bend, Straight, Taper, path_of_items
from softsim.contact.pipe_network import PipeNetwork
from tests.contact.pipe_layouts import RIGHT_ANGLE, layout, places_around

DEPTH = 2e-3  # in the wall: less than any wall is thick


def sampled_walls(path, spacing):
    """Points (n, d) [m] of all walls, on each piece no farther than `spacing` apart."""
    points = []
    for k, segment in enumerate(path.segments):
        slant = np.hypot(segment.length, np.diff(segment.radii)[0])
        if np.isfinite(segment.bend_radius):
            slant *= 1.0 + segment.radii[0] / segment.bend_radius
        s = np.linspace(0.0, segment.length, 2 + int(slant / spacing))
        points.append(circles(*segment.axis_place(s), segment.radius(s), spacing))
        if k:
            points.append(
                ring(path.joints[k], path.segments[k - 1].radii[1], segment.radii[0], spacing)
            )
    ends = (path.segments[0].radii[0], path.segments[-1].radii[1])
    for joint, closed, r in zip((path.joints[0], path.joints[-1]), path.closed, ends, strict=True):
        points.append(ring(joint, r, 0.0 if closed else 3.0 * r, spacing))
    return np.concatenate(points)


def ring(joint, inner, outer, spacing):
    r = np.linspace(inner, outer, 2 + int(abs(outer - inner) / spacing))
    place, tangent = (np.tile(v, (len(r), 1)) for v in (joint.point, joint.tangent))
    return circles(place, tangent, r, spacing)


def circles(places, tangents, radii, spacing):
    if places.shape[1] == 2:
        left = np.stack([-tangents[:, 1], tangents[:, 0]], axis=1) * radii[:, None]
        return np.concatenate([places + left, places - left])
    around = np.linspace(0.0, 2.0 * np.pi, 2 + int(2.0 * np.pi * radii.max() / spacing))
    points = []
    for place, tangent, r in zip(places, tangents, radii, strict=True):
        one, other = np.linalg.svd(tangent[None])[2][1:]
        circle = np.outer(np.cos(around), one) + np.outer(np.sin(around), other)
        points.append(place + r * circle)
    return np.concatenate(points)


@pytest.mark.parametrize("closed", [(False, True), (True, False)])
@pytest.mark.parametrize("dimension, spacing", [(2, 0.02e-3), (3, 0.5e-3)])
def test_distance_to_sampled_walls(dimension, spacing, closed):
    """D to the nearest sample: the gap g has g <= D, and D^2 <= g^2 + h^2 / 4 a direction along the
    wall (Pythagoras in its tangent plane; D^2 - g^2 grows by 1 + g / radius where it is curved: by
    less than 4 at a tenth of the gap's depth; the foot on a sampled arc is h^2 / 8 r off).
    """
    path = layout(dimension, closed)
    x = places_around(path, 4000, DEPTH, seed=1)
    gap = path.gap(x)
    distance, _ = cKDTree(sampled_walls(path, spacing)).query(x)
    assert (gap < 0.0).mean() > 0.05
    assert np.all(np.abs(gap) <= distance + 1e-12)
    sideways = (dimension - 1) * spacing**2 / 4.0
    assert np.all(distance**2 <= gap**2 + 4.0 * sideways)


@pytest.mark.parametrize("dimension", [2, 3])
def test_gradient_is_of_unit_length(dimension):
    """Almost everywhere, from central differences of 1e-7 m: relative 1e-8 / 1e-7 of round-off and
    (h / distance)^2 of curvature; where two walls are equally near it is less.
    """
    path = layout(dimension)
    x = places_around(path, 3000, DEPTH, seed=2)
    h = 1e-7
    steps = h * np.eye(dimension)
    gradient = np.stack([(path.gap(x + e) - path.gap(x - e)) / (2.0 * h) for e in steps], axis=1)
    length = np.linalg.norm(gradient, axis=1)
    assert np.all(length < 1.0 + 1e-6)
    assert np.mean(length > 1.0 - 1e-6) > 0.995


@pytest.mark.parametrize("dimension", [2, 3])
def test_gap_changes_no_faster_than_the_place(dimension):
    """So signed distances do, across walls and joints too: a jump anywhere would break it."""
    path = layout(dimension)
    x = places_around(path, 20_000, DEPTH, seed=3)
    step = 1e-4 * np.random.default_rng(4).standard_normal(x.shape)
    change = np.abs(path.gap(x + step) - path.gap(x))
    assert np.all(change <= np.linalg.norm(step, axis=1) + 1e-12)


def test_gap_is_continuous_where_a_joint_is_smooth():
    """Across the planes of straight, bend, straight: to round-off, on both sides of the wall."""
    items = [Straight(0.1), Bend(1.0, 0.03, 2.0), Straight(0.1)]
    path = path_of_items("p", items, 0.036, np.zeros(3), (False, False))
    assert [len(p) for p in path.pieces] == [1, 1, 0, 1, 1]  # the faces of the open ends
    rng = np.random.default_rng(5)
    for joint in path.joints[1:3]:
        x = joint.point + rng.uniform(-0.015, 0.015, (100, 3))
        x -= np.outer((x - joint.point) @ joint.tangent, joint.tangent)
        before, after = (path.gap(x + sign * 1e-12 * joint.tangent) for sign in (-1.0, 1.0))
        np.testing.assert_allclose(before, after, rtol=0.0, atol=3e-12)


def test_ends():
    """A closed end is a wall, solid behind; an open one lies in a flat face with free space before
    it, from where a corner is the nearest wall.
    """
    path = path_of_items("p", [Straight(0.1)], 0.02, np.zeros(2), (False, True))
    x = np.array([[-0.03, 0.0], [-0.03, 0.05], [0.01, 0.013], [0.004, 0.02], [0.098, 0.0],
                  [0.101, 0.002], [0.103, 0.014]])  # fmt: skip
    exact = [np.hypot(0.03, 0.01), 0.03, -0.003, -0.004, 0.002, -0.001, -0.005]
    np.testing.assert_allclose(path.gap(x), exact, rtol=0.0, atol=1e-14)


def test_coordinates_and_places_are_inverse():
    """Arc length there and back again, and the distance from the centre line."""
    path = layout(3)
    s = np.linspace(-4e-3, path.length + 4e-3, 500)
    place, tangent = path.axis_place(s)
    aside = np.cross(tangent, [0.3, -0.5, 0.8])
    aside *= 5e-3 / np.linalg.norm(aside, axis=1)[:, None]
    np.testing.assert_allclose(path.arc_length(place + aside), s, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(path.coordinates(place + aside)[2], 5e-3, rtol=0.0, atol=1e-12)
    for one in (-1.0, 0.0, 31e-3, path.length + 1.0):
        segment = path.segment_at(one)
        assert segment.start <= max(one, 0.0)
        assert one < segment.end or segment is path.segments[-1]


def test_a_place_behind_the_start_is_beside_what_lies_there():
    """A pipe that comes back behind its own start: the start does not claim places there."""
    items = [Straight(0.05), *[Bend(RIGHT_ANGLE, 0.05, 0.0)] * 3, Straight(0.2)]
    path = path_of_items("p", items, 0.02, np.zeros(2), (False, False))
    behind = path.axis_place(np.array([path.length - 0.1]))[0]
    assert path.arc_length(behind)[0] == pytest.approx(path.length - 0.1)
    assert path.gap(behind)[0] == pytest.approx(0.01)


def test_long_bend():
    """Of 300 deg: beside its first and its last quarter alike."""
    path = path_of_items(
        "p", [Bend(np.radians(300.0), 0.05, 0.0)], 0.02, np.zeros(2), (False, False)
    )
    angle = np.radians(np.array([5.0, 100.0, 181.0, 295.0]))
    x = 0.056 * np.stack([np.sin(angle), -np.cos(angle)], axis=1) + [0.0, 0.05]
    np.testing.assert_allclose(path.gap(x), 0.004, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(path.arc_length(x), 0.05 * angle, rtol=1e-12)


def test_drawn_wall():
    """Lines in the plane lie on the wall, to the sagitta of their chords, with the free side on
    their left; in space so do faces, towards the free side by the right-hand rule.
    """
    path = layout(2)
    lines = PipeNetwork.of_one(path).drawn()["wall_lines"]
    way = np.diff(lines, axis=1)[:, 0]
    middle, length = lines.mean(axis=1), np.linalg.norm(way, axis=1)
    sagitta = (30e-3 + 20e-3) * np.radians(3.0) ** 2 / 8.0
    assert np.abs(path.gap(middle)).max() < sagitta
    left = np.stack([-way[:, 1], way[:, 0]], axis=1) / length[:, None]
    assert np.all(path.gap(middle + 2.0 * sagitta * left) > 0.0)

    path = layout(3)
    faces = PipeNetwork.of_one(path).drawn()["wall_faces"]
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 3] - faces[:, 0])
    normal += np.cross(faces[:, 3] - faces[:, 2], faces[:, 1] - faces[:, 2])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    sagitta += 20e-3 * (2.0 * np.pi / 48) ** 2 / 8.0
    assert np.abs(path.gap(faces.mean(axis=1))).max() < sagitta
    assert np.all(path.gap(faces.mean(axis=1) + 2.0 * sagitta * normal) > 0.0)


def test_cone_is_exact():
    """From within a cone: the distance to its slanted line, not to the circle beside."""
    path = path_of_items("p", [Straight(0.1), Taper(0.03, 0.1), Straight(0.1)], 0.02, np.zeros(2),
                (False, False))  # fmt: skip
    angle = np.arctan2(0.04, 0.03)
    x = np.array([[0.115, 0.02]])
    exact = (0.01 + 0.015 * np.tan(angle) - 0.02) * np.cos(angle)
    np.testing.assert_allclose(path.gap(x), exact, rtol=1e-12)
