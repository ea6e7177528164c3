"""Bodies in space: what the camera sees, how it is lit, what stands behind it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.mesh.mesh import boundary_facets
from softsim.output.fields import FieldWriter, read_frames
from softsim.output.folder import RESULTS
from softsim.report.body import (
    CAMERA,
    PIPE_FACES,
    Camera,
    Surface,
    corners_of_box,
    lit,
    rim,
    round_length,
    shadow,
    tangents,
    visible_side,
    wall_faces,
)
from softsim.robots.block import box

CUBE = corners_of_box(np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]]))
NO_WALLS, NO_PIPES = np.zeros((0, 6)), np.zeros((0, 7))


@given(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5))
def test_a_camera_sees_without_distortion_and_y_is_up(azimuth, elevation) -> None:
    camera = Camera.at(azimuth, elevation)
    axes = np.array([camera.right, camera.up, camera.towards])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    x, y = camera.project(np.array([0.0, 1.0, 0.0]))
    assert x == 0.0
    assert y > 0.0


def test_x_points_to_the_right_and_towards_the_reader() -> None:
    assert CAMERA.project(np.array([1.0, 0.0, 0.0]))[0] > 0.5
    assert CAMERA.towards[0] > 0.0


def test_back_faces_are_culled() -> None:
    """Of a cube the camera sees right, top and front, half of all facets, and each whole."""
    mesh = box(3.0, 3.0, 3.0, 1.0)
    facets = boundary_facets(mesh.cells, 3)
    corners = mesh.points[facets]
    shot = visible_side(corners, np.arange(len(facets)), CAMERA)
    assert len(shot.corners) == len(facets) / 2
    seen = corners[shot.values]
    assert ((seen == 3.0).all(axis=1)).any(axis=1).all()


def test_near_facets_come_last_and_values_go_along() -> None:
    near = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    stacked = near + np.array([0.0, 5.0, -5.0])[:, None, None] * CAMERA.towards
    shot = visible_side(stacked, np.array([10, 11, 12]), CAMERA)
    assert shot.values.tolist() == [12, 10, 11]


def test_lost_and_flat_facets_are_left_out() -> None:
    facing = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    lost, flat = facing.copy(), facing.copy()
    lost[1, 1] = np.nan
    flat[2] = [2.0, 0.0, 0.0]
    shot = visible_side(np.stack([lost, facing, flat, facing[::-1]]), np.arange(4), CAMERA)
    assert shot.values.tolist() == [1]


@given(st.lists(st.floats(0.0, 1.0), min_size=3, max_size=3), st.floats(0.0, 1.0))
def test_light_makes_brighter_and_keeps_the_order_of_channels(colour, light) -> None:
    colours = np.array([colour] * 2)
    dim, bright = lit(colours, np.array([0.0, light]))
    assert (bright >= dim - 1e-12).all()
    assert bright.min() >= 0.0
    assert bright.max() <= 1.0
    assert (np.diff(bright[np.argsort(colour)]) >= -1e-12).all()


def test_a_facet_has_the_value_of_the_cell_behind_it(tmp_path: Path) -> None:
    """Each tetrahedron of a brick with a value of its own: a facet shows that of the one whose
    fourth node is behind it."""
    mesh = box(1e-3, 1e-3, 1e-3, 1e-3)
    writer = FieldWriter(tmp_path / RESULTS, mesh.points, mesh.cells)
    still = np.zeros_like(mesh.points)
    writer.append(0.0, {"displacement": still}, {"stretch": np.arange(len(mesh.cells))})
    surface = Surface(read_frames(tmp_path / RESULTS), [0], "stretch")
    facets = boundary_facets(mesh.cells, 3)
    owner = [np.flatnonzero(np.isin(mesh.cells, f).sum(axis=1) == 3)[0] for f in facets]
    expected = visible_side(mesh.points[facets] * 1e3, np.array(owner), surface.camera)
    np.testing.assert_array_equal(surface.shots[0].values, expected.values)
    np.testing.assert_array_equal(surface.shots[0].corners, expected.corners)


def test_of_a_brick_of_hexahedra_the_camera_sees_three_sides(tmp_path: Path) -> None:
    mesh = box(3e-3, 2e-3, 1e-3, 1e-3, "quad")
    writer = FieldWriter(tmp_path / RESULTS, mesh.points, mesh.cells)
    still = np.zeros_like(mesh.points)
    writer.append(0.0, {"displacement": still}, {"stretch": np.arange(len(mesh.cells))})
    shot = Surface(read_frames(tmp_path / RESULTS), [0], "stretch").shots[0]
    assert shot.corners.shape == (3 * 2 + 3 * 1 + 2 * 1, 4, 2)
    # What faces the camera alike is lit alike.
    assert len(np.unique(shot.light.round(9))) == 3


def test_data_of_nodes_is_the_mean_of_a_facets_three(box_run: Path) -> None:
    """The box leans by 0.2 x in y: a facet's displacement is that of its middle."""
    frames = read_frames(box_run / RESULTS)
    middles = frames.points[boundary_facets(frames.cells, 3)].mean(axis=1)
    surface = Surface(frames, [-1], "displacement")
    np.testing.assert_allclose(surface.values, 0.2 * middles[:, 0] * 1e3, rtol=1e-12)


def test_the_floor_is_seen_and_a_ceiling_or_a_far_wall_is_not() -> None:
    floor, ceiling = [0.0, -1.5, 0.0, 0.0, 1.0, 0.0], [0.0, 1.5, 0.0, 0.0, -1.0, 0.0]
    far = [-30.0, 0.0, 0.0, 1.0, 0.0, 0.0]
    faces = wall_faces(np.array([floor, ceiling, far]), NO_PIPES, CUBE)
    assert len(faces) == 2
    shot = visible_side(faces, np.array([0, 1]), CAMERA)
    assert shot.values.tolist() == [0]
    assert (faces[0, :, 1] == -1.5).all()
    assert (faces[0, :, [0, 2]].min(), faces[0, :, [0, 2]].max()) == pytest.approx((-1.2, 1.2))


def test_of_a_pipe_the_far_half_is_seen_from_inside() -> None:
    pipe = [5.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.6]
    faces = wall_faces(NO_WALLS, np.array([pipe]), CUBE)
    assert len(faces) == PIPE_FACES
    np.testing.assert_allclose(np.linalg.norm(faces[..., 1:], axis=-1), 1.6)
    assert (faces[..., 0].min(), faces[..., 0].max()) == pytest.approx((-1.2, 1.2))
    seen = faces[visible_side(faces, np.arange(len(faces)), CAMERA).values]
    assert len(seen) == pytest.approx(PIPE_FACES / 2, abs=1)
    assert (
        seen.mean(axis=1) @ CAMERA.towards < seen.mean(axis=(0, 1)) @ CAMERA.towards + 1.6
    ).all()
    across = CAMERA.towards * [0.0, 1.0, 1.0]
    assert (seen.mean(axis=1) @ across <= 1e-9).all()


def test_a_shadow_lies_on_the_wall_where_the_body_touches_it() -> None:
    normal = np.array([0.6, 0.8, 0.0])
    wall = np.array([1.0, 2.0, 3.0, *normal])
    foot = wall[:3] + np.array([[0.8, -0.6, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    lost = np.full((3, 3), np.nan)
    found = shadow(np.stack([foot, foot + 0.5 * normal, lost]), wall)
    np.testing.assert_allclose(found, [foot, foot], atol=1e-12)


def test_walls_have_edges_where_they_end() -> None:
    floor, pipe = [0.0, -1.5, 0.0, 0.0, 1.0, 0.0], [5.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.6]
    assert rim(wall_faces(np.array([floor]), NO_PIPES, CUBE)).shape == (4, 2, 3)
    rings = rim(wall_faces(NO_WALLS, np.array([pipe]), CUBE))
    assert len(rings) == 2 * PIPE_FACES and (rings[:, 0, 0] == rings[:, 1, 0]).all()
    assert rim(np.zeros((0, 4, 3))).shape == (0, 2, 3)


def test_a_wide_pipe_is_left_out() -> None:
    pipe = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 9.0]
    assert len(wall_faces(NO_WALLS, np.array([pipe]), CUBE)) == 0


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda n: np.linalg.norm(n) > 0.1))
def test_tangents_lie_in_the_plane(normal) -> None:
    normal = np.array(normal) / np.linalg.norm(normal)
    one, other = tangents(normal)
    frame = np.array([one, other, normal])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1.0)


@given(st.floats(1e-3, 1e4))
def test_a_round_length_fits_and_is_not_much_shorter(longest: float) -> None:
    length = round_length(longest)
    assert longest / 2.5 < length <= longest
    assert f"{length:e}"[0] in "125"


def test_a_curved_wall_is_drawn_where_it_faces_the_camera(box_run: Path) -> None:
    """The picture reaches a quarter of the body's size around it, however far the wall leads."""
    frames = read_frames(box_run / RESULTS)
    seen = CAMERA.towards
    one, other = tangents(seen)
    square = np.array([-one - other, one - other, one + other, other - one]) - 2.0 * seen
    lines = {"wall_faces": np.array([square, square[::-1], square + 1e3 * one])}
    alone = Surface(frames, [0], "stretch")
    walled = Surface(replace(frames, described=frames.described | lines), [0], "stretch")
    assert len(walled.walls[0][1].light) == 2
    assert (walled.view[1] - walled.view[0]) < 2.0 * (alone.view[1] - alone.view[0])
