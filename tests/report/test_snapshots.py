"""Pieces of the snapshots, and frames that are hard to draw."""

from pathlib import Path

import numpy as np
import pytest

from softsim.errors import OutputError
from softsim.output.fields import FieldWriter, read_frames
from softsim.report.moments import Moment
from softsim.report.snapshots import boundary_edges, draw_snapshots, outline_corners

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
TWO_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])
END = [Moment("end", 0.0)]


def drawn(folder: Path, displacement: np.ndarray, stretch: np.ndarray) -> Path:
    writer = FieldWriter(folder / "results.vtkhdf", SQUARE, TWO_TRIANGLES)
    writer.append(0.0, {"displacement": displacement}, {"stretch": stretch})
    frames = read_frames(folder / "results.vtkhdf")
    draw_snapshots(frames, END, np.zeros(1), None, "stretch", folder / "snapshots.png")
    return folder / "snapshots.png"


def test_the_diagonal_of_two_triangles_is_no_boundary() -> None:
    edges = {frozenset(edge) for edge in boundary_edges(TWO_TRIANGLES).tolist()}
    assert edges == {frozenset(e) for e in [(0, 1), (1, 2), (2, 3), (3, 0)]}


def test_an_outline_turns_about_the_body_and_keeps_its_own_centre() -> None:
    corners = outline_corners(np.array([[1.0, 0.0, 4.0, 2.0]]), np.array([[10.0, 5.0, np.pi / 2]]))
    np.testing.assert_allclose(corners[0], [[11, 4], [11, 8], [9, 8], [9, 4]], atol=1e-12)


def test_a_field_that_is_the_same_everywhere_is_drawn(tmp_path: Path) -> None:
    assert drawn(tmp_path, np.zeros((4, 2)), np.ones(2)).is_file()


def test_a_failed_frame_with_a_lost_node_is_drawn(tmp_path: Path) -> None:
    displacement = np.zeros((4, 2))
    displacement[3] = np.nan
    assert drawn(tmp_path, displacement, np.array([1.0, np.nan])).is_file()


def test_results_without_a_frame_say_so(tmp_path: Path) -> None:
    FieldWriter(tmp_path / "results.vtkhdf", SQUARE, TWO_TRIANGLES)
    frames = read_frames(tmp_path / "results.vtkhdf")
    with pytest.raises(OutputError, match="no frame to draw"):
        draw_snapshots(frames, END, np.zeros(1), None, "stretch", tmp_path / "snapshots.png")


def test_a_mesh_in_space_is_left_to_paraview(tmp_path: Path) -> None:
    points = np.vstack([np.zeros(3), np.eye(3)])
    FieldWriter(tmp_path / "results.vtkhdf", points, np.array([[0, 1, 2, 3]]))
    frames = read_frames(tmp_path / "results.vtkhdf")
    with pytest.raises(OutputError, match="plane meshes") as refused:
        draw_snapshots(frames, END, np.zeros(1), None, "stretch", tmp_path / "snapshots.png")
    assert "ParaView" in refused.value.hint
