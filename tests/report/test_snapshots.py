"""Which frames are shown and how each kind of mesh is; frames that are hard to draw."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from softsim.errors import OutputError
from softsim.output.fields import FieldWriter, read_frames
from softsim.output.folder import RESULTS
from softsim.report.body import HalfSection, Section, Surface
from softsim.report.snapshots import Moment, draw_snapshots, frames_at, pictures

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
TWO_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])
CORNER, ONE_TETRAHEDRON = np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 1, 2, 3]])
MESHES = [(SQUARE, TWO_TRIANGLES), (CORNER, ONE_TETRAHEDRON)]
END = [Moment("end", 0.0)]


def drawn(
    folder: Path, mesh, displacement: np.ndarray, stretch: np.ndarray, **described: str
) -> Path:
    writer = FieldWriter(folder / RESULTS, *mesh)
    writer.describe(**described)
    writer.append(0.0, {"displacement": displacement}, {"stretch": stretch})
    frames = read_frames(folder / RESULTS)
    draw_snapshots(frames, END, np.zeros(1), None, "stretch", folder / "snapshots.png")
    return folder / "snapshots.png"


@pytest.mark.parametrize(
    ("run", "kind"), [("strip_run", Section), ("ring_run", HalfSection), ("box_run", Surface)]
)
def test_each_kind_of_mesh_is_shown_in_its_way(run: str, kind: type, request) -> None:
    frames = read_frames(request.getfixturevalue(run) / RESULTS)
    assert type(pictures(frames, [0, -1], "stretch")) is kind


def test_a_moment_has_the_nearest_frame() -> None:
    moments = [Moment("start", 0.0), Moment("full inflation", 1.04), Moment("end", 4.0)]
    shown = frames_at(moments, np.linspace(0.0, 4.0, 41))
    assert shown == {0: ["start"], 10: ["full inflation"], 40: ["end"]}


def test_moments_at_the_same_time_share_a_frame() -> None:
    moments = [Moment("start", 0.0), Moment("full inflation", 3.95), Moment("end", 4.0)]
    assert frames_at(moments, np.array([0.0, 4.0])) == {0: ["start"], 1: ["full inflation", "end"]}


def test_a_moment_is_not_shown_by_a_frame_of_another_one() -> None:
    moments = [Moment("start", 0.0), Moment("full inflation", 1.0), Moment("end", 4.0)]
    assert frames_at(moments, np.array([0.0, 4.0])) == {0: ["start"], 1: ["end"]}


@pytest.mark.parametrize("mesh", MESHES)
def test_a_field_that_is_the_same_everywhere_is_drawn(mesh, tmp_path: Path) -> None:
    points, cells = mesh
    path = drawn(tmp_path, mesh, np.zeros(points.shape), np.ones(len(cells)))
    assert imread(path)[..., :3].std() > 0.02


@pytest.mark.parametrize("mesh", MESHES)
def test_a_failed_frame_with_a_lost_node_is_drawn(mesh, tmp_path: Path) -> None:
    points, cells = mesh
    displacement = np.zeros(points.shape)
    displacement[-1] = np.nan
    stretch = np.ones(len(cells))
    if len(cells) > 1:
        stretch[-1] = np.nan
    assert drawn(tmp_path, mesh, displacement, stretch).is_file()


@pytest.mark.parametrize("mesh", MESHES)
def test_a_field_without_a_number_is_drawn(mesh, tmp_path: Path) -> None:
    points, cells = mesh
    assert drawn(tmp_path, mesh, np.zeros(points.shape), np.full(len(cells), np.nan)).is_file()


def test_a_frame_that_lost_every_node_is_not_drawn(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="still has a place"):
        drawn(tmp_path, MESHES[0], np.full((4, 2), np.nan), np.ones(2))


def test_a_half_section_with_a_lost_node_is_drawn(tmp_path: Path) -> None:
    displacement = np.zeros((4, 2))
    displacement[3] = np.nan
    stretch, word = np.array([1.0, np.nan]), "axisymmetric"
    assert drawn(tmp_path, MESHES[0], displacement, stretch, formulation=word).is_file()


def test_results_without_a_frame_say_so(tmp_path: Path) -> None:
    FieldWriter(tmp_path / RESULTS, SQUARE, TWO_TRIANGLES)
    frames = read_frames(tmp_path / RESULTS)
    with pytest.raises(OutputError, match="no frame to draw"):
        draw_snapshots(frames, END, np.zeros(1), None, "stretch", tmp_path / "snapshots.png")
