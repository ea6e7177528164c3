"""Pieces of plane sections, and the two halves of a body of revolution."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from softsim.output.fields import Frames, read_frames
from softsim.output.folder import RESULTS
from softsim.report.body import (
    HalfSection,
    Section,
    behind,
    chains,
    ends,
    outline_corners,
    outlines_at,
    right_of_axis,
    rigid_faces_at,
    solid_behind,
    view_of,
    walls_at,
)


def frames_of(run: Path) -> Frames:
    return read_frames(run / RESULTS)


def test_an_outline_turns_about_the_body_and_keeps_its_own_centre() -> None:
    corners = outline_corners(np.array([[1.0, 0.0, 4.0, 2.0]]), np.array([[10.0, 5.0, np.pi / 2]]))
    np.testing.assert_allclose(corners[0], [[11, 4], [11, 8], [9, 8], [9, 4]], atol=1e-12)


def test_a_plane_section_is_drawn_where_it_is(ring_run: Path) -> None:
    """The same mesh without the word axisymmetric: radius 6 to 8 mm at the start, no mirror."""
    section = Section(frames_of(ring_run), [0], "stretch")
    assert drawn_cells(section)[..., 0].min() > 5.99
    assert section.view[0] > 0.0


def test_a_half_section_has_a_mirror_image(ring_run: Path) -> None:
    frames = frames_of(ring_run)
    cells = drawn_cells(HalfSection(frames, [0], "stretch"))
    count = len(frames.cells)
    assert len(cells) == 2 * count
    assert cells[:count, :, 0].min() > 5.99
    np.testing.assert_array_equal(cells[count:], cells[:count] * [-1.0, 1.0])


def test_lines_of_walls_are_cut_off_at_the_axis_and_mirrored(ring_run: Path) -> None:
    """The free side stays on the left: above a floor, towards the axis of a wall that rises."""
    beyond, floor, wall = [[-9, 0], [-4, 0]], [[-4, 0], [2, 3]], [[2, 3], [2, 9]]
    lines = np.array([beyond, floor, wall], dtype=float)
    np.testing.assert_allclose(right_of_axis(lines), [[[0, 2], [2, 3]], wall])
    section = HalfSection(frames_of(ring_run), [0], "stretch")
    both = section.seen_lines(lines)
    np.testing.assert_allclose(both[2:], [[[-2, 9], [-2, 3]], [[-2, 3], [0, 2]]])


def test_the_mirror_image_is_paler(ring_run: Path) -> None:
    section = HalfSection(frames_of(ring_run), [-1], "stretch")
    body, mirror = drawn(section)[0].collections[0], drawn(section)[0].collections[2]
    assert (mirror.get_facecolor()[:, :3] >= body.get_facecolor()[:, :3]).all()
    assert mirror.get_facecolor()[:, :3].min() > 0.5


def test_both_halves_are_seen_with_the_axis_between_them(ring_run: Path) -> None:
    section = HalfSection(frames_of(ring_run), [0, -1], "stretch")
    assert section.view[0] == -section.view[1]
    axes, _ = drawn(section)
    across = [line for line in axes.lines if set(line.get_xdata()) == {0.0}]
    assert len(across) == 1
    assert across[0].get_linestyle() != "-"


def test_a_wall_is_mirrored_and_each_stays_on_its_side(ring_run: Path) -> None:
    section = HalfSection(frames_of(ring_run), [0], "stretch")
    assert [(wall[0], wall[2]) for wall in section.walls[0]] == [(12.0, -1.0), (-12.0, 1.0)]
    axes, _ = drawn(section)
    for patch, side in zip(axes.patches, (1.0, -1.0), strict=True):
        assert (side * patch.get_xy()[:, 0] > -1e-9).all()


def test_a_wall_across_the_axis_ends_there(ring_run: Path) -> None:
    """Of a cone the solid behind the wall, and its face, at positive x alone."""
    section = HalfSection(frames_of(ring_run), [0], "stretch")
    section.walls = [np.array([[0.0, -5.0, -0.6, 0.8], [0.0, -5.0, 0.6, 0.8]])]
    right, left = section.flat_solids(section.view, 0)
    assert right.outline[:, 0].min() == 0.0 and right.face[:, 0].min() == 0.0
    np.testing.assert_array_equal(left.outline, right.outline * [-1.0, 1.0])


def test_the_ends_of_a_tube_are_lines_across_its_bore() -> None:
    rim = np.array([[[3.0, 0.0], [4.0, 0.0]], [[4.0, 0.0], [4.0, 9.0]], [[4.0, 9.0], [2.0, 9.0]]])
    lost = np.full((1, 2, 2), np.nan)
    np.testing.assert_array_equal(
        ends(np.concatenate([rim, lost])), [[[-3, 0], [3, 0]], [[-2, 9], [2, 9]]]
    )


def test_a_near_wall_is_in_the_view_and_a_far_one_is_not() -> None:
    places = np.array([[0.0, 0.0], [10.0, 4.0]])
    near, far = [0.0, -2.0, 0.0, 1.0], [40.0, 0.0, -1.0, 0.0]
    view = view_of(places, np.array([near, far]), np.zeros((0, 2)))
    assert view[2] < -2.0
    assert view[1] < 20.0


def test_a_curved_wall_is_in_the_view_where_it_is_near() -> None:
    places = np.array([[0.0, 0.0], [10.0, 4.0]])
    view = view_of(places, np.zeros((0, 4)), np.array([[5.0, 6.0], [40.0, 6.0]]))
    assert view[3] > 6.0
    assert view[1] < 20.0


def test_lines_that_follow_each_other_are_one_chain() -> None:
    corner = [[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [1.0, 1.0]]]
    away = [[[5.0, 5.0], [6.0, 5.0]]]
    found = chains(np.array(corner + away))
    np.testing.assert_array_equal(found[0], [[0, 0], [1, 0], [1, 1]])
    np.testing.assert_array_equal(found[1], [[5, 5], [6, 5]])
    assert chains(np.zeros((0, 2, 2))) == []


def test_the_solid_lies_right_of_a_curved_wall_as_thick_everywhere() -> None:
    """Around a corner to the left: mitred, so that both strips keep their thickness."""
    chain = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]])
    np.testing.assert_allclose(behind(chain, 0.5), [[0.0, -0.5], [2.5, -0.5], [2.5, 2.0]])


def test_the_solid_behind_a_wall_reaches_beyond_the_view() -> None:
    solid = solid_behind(np.array([0.0, -2.0, 0.0, 1.0]), np.array([-1.0, 1.0, -3.0, 3.0]))
    assert (solid.face[:, 1] == -2.0).all()
    assert sorted(np.abs(solid.face[:, 0])) > [1.0, 1.0]
    assert solid.outline[:, 1].min() < -3.0


def drawn(section: Section):
    """Axes and figure with the first frame of the section."""
    figure = Figure()
    axes = figure.add_subplot()
    axes.set(xlim=section.view[:2], ylim=section.view[2:], aspect="equal")
    section.draw(axes, 0, ScalarMappable(cmap="viridis"))
    return axes, figure


def drawn_cells(section: Section) -> np.ndarray:
    """Corners (m, 3, 2) [mm] of all cells that are drawn."""
    axes, _ = drawn(section)
    paths = [
        path for part in axes.collections if isinstance(part, PolyCollection)
        for path in part.get_paths()
    ]  # fmt: skip
    return np.array([path.vertices[:3] for path in paths])


def test_walls_are_drawn_where_they_have_moved_to():
    """Of two planes and a line the second plane and the line moved after the first frame."""
    frames = SimpleNamespace(
        described={
            "walls": np.array([[0.0, 0.0, 0.0, 1.0], [0.0, 2.0, 0.0, -1.0]]),
            "walls_owner": np.array([0, 1]),
            "wall_lines": np.array([[[5.0, 0.0], [5.0, 1.0]]]),
            "wall_lines_owner": np.array([2]),
        },
        extra={"wall_offset": [np.zeros((3, 2)), np.array([[0.0, 0.0], [0.0, -0.5], [1.0, 0.0]])]},
    )
    for index, height, x in ((0, 2.0, 5.0), (1, 1.5, 6.0)):
        walls = walls_at(frames, "walls", index, np.zeros((0, 4)))
        np.testing.assert_array_equal(walls[:, 1], [0.0, height])
        np.testing.assert_array_equal(walls[:, 3], [1.0, -1.0])
        lines = walls_at(frames, "wall_lines", index, np.zeros((0, 2, 2)))
        np.testing.assert_array_equal(lines[0, :, 0], [x, x])


def test_a_rigid_surface_moves_with_its_body():
    """In a section it is a closed outline, in space triangles: turned by 90 deg and moved."""
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * 1e-3
    described = {
        "rigid_vertices": square,
        "rigid_vertex_bodies": np.ones(4),
        "rigid_faces": np.array([[0, 1], [1, 2], [2, 3], [3, 0]]),
    }
    poses = np.array([[[0.0, 0.0, 0.0], [5e-3, 2e-3, np.pi / 2]]])
    frames = SimpleNamespace(
        points=np.zeros((3, 2)), described=described, extra={"frame_pose": poses}, titles={}
    )
    (outline,) = outlines_at(frames, 0)
    np.testing.assert_allclose(outline, [[6, 1], [6, 3], [4, 3], [4, 1], [6, 1]])
    half = np.sqrt(0.5)
    poses = np.array([[[0.0] * 7, [5e-3, 2e-3, 0.0, half, 0.0, 0.0, half]]])  # about z
    in_space = {**described, "rigid_vertices": np.pad(square, ((0, 0), (0, 1)))}
    in_space["rigid_faces"] = np.array([[0, 1, 2], [0, 2, 3]])
    frames = SimpleNamespace(
        points=np.zeros((3, 3)), described=in_space, extra={"frame_pose": poses}
    )
    vertices, faces = rigid_faces_at(frames, 0)
    np.testing.assert_allclose(vertices[:, :2], [[6, 1], [6, 3], [4, 3], [4, 1]])
    assert faces.dtype.kind == "i"
