"""What the player gets: places and values survive the packing, and too many frames are thinned."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from softsim.errors import OutputError
from softsim.output.fields import FieldWriter, read_frames
from softsim.output.folder import RESULTS
from softsim.report.body import skin_of
from softsim.report.page.robot import (
    FINENESS,
    LEVELS,
    MOST_FRAMES,
    ROOM,
    animation,
    aspect,
    chosen_frames,
    in_steps,
    most_deformed,
)
from softsim.robots.block import box


def whole(numbers: dict) -> np.ndarray:
    """Numbers as the player computes them, a row a frame."""
    changes = np.array(numbers["changes"], dtype=float)
    sums = np.nancumsum(changes, axis=0)
    return numbers["low"] + numbers["step"] * np.where(np.isnan(changes), np.nan, sums)


@settings(max_examples=40)
@given(arrays(float, (4, 3), elements=st.floats(-40.0, 40.0, width=32) | st.just(np.nan)))
def test_numbers_come_back_within_half_a_step(given_numbers: np.ndarray) -> None:
    numbers = in_steps(given_numbers, 0.01)
    np.testing.assert_allclose(whole(numbers), given_numbers, atol=0.00501)
    assert all(isinstance(change, int | None) for row in numbers["changes"] for change in row)


@settings(max_examples=40)
@given(st.integers(1, 5000), st.integers(6, 400_000), st.integers(1, 400_000))
def test_frames_fit_in_the_room_and_keep_both_ends(count, coordinates, faces) -> None:
    chosen = chosen_frames(count, coordinates, faces)
    assert chosen[0] == 0 and chosen[-1] == count - 1
    assert np.all(np.diff(chosen) > 0) and len(chosen) <= min(count, MOST_FRAMES)
    assert len(chosen) <= 2 or len(chosen) * (2 * coordinates + faces) <= ROOM


def test_the_surface_of_hexahedra_is_shown_in_triangles(tmp_path: Path) -> None:
    """Each has the value of the cell behind it."""
    mesh = box(3e-3, 2e-3, 1e-3, 1e-3, "quad")
    writer = FieldWriter(tmp_path / RESULTS, mesh.points, mesh.cells)
    still = np.zeros_like(mesh.points)
    writer.append(0.0, {"displacement": still}, {"stretch": np.arange(len(mesh.cells))})
    skin = skin_of(read_frames(tmp_path / RESULTS)).in_triangles()
    assert skin.faces.shape == (2 * 2 * (3 * 2 + 3 * 1 + 2 * 1), 3)
    for face, owner in zip(skin.faces, skin.owners, strict=True):
        assert np.isin(face, mesh.cells[owner]).all()


@pytest.mark.parametrize("run", ["strip_run", "ring_run", "box_run"])
def test_places_are_those_of_the_results(run: str, request: pytest.FixtureRequest) -> None:
    frames = read_frames(request.getfixturevalue(run) / RESULTS)
    shown, d = animation(frames, "stretch"), frames.points.shape[1]
    at_end = (frames.points + frames.point_data["displacement"][-1][:, :d]) * 1e3
    places = whole(shown["places"]).reshape(len(frames), -1, d)[-1]
    assert shown["times"].tolist() == frames.times.tolist()
    # Every node that is shown is where one is; in space there are nodes inside that none shows.
    away = np.linalg.norm(places[:, None] - at_end[None], axis=2).min(axis=1)
    step = np.ptp(frames.points, axis=0).max() * 1e3 / FINENESS
    assert away.max() < step  # half of it in each direction
    assert np.ptp(places, axis=0) == pytest.approx(np.ptp(at_end, axis=0), abs=1.01 * step)


def test_cells_of_a_plane_run_keep_their_order_and_value(strip_run: Path) -> None:
    frames = read_frames(strip_run / RESULTS)
    shown = animation(frames, "stretch")
    assert shown["faces"].tolist() == frames.cells.tolist()
    stretch = np.concatenate([frames.cell_data["stretch"][k] for k in range(len(frames))])
    low, high = shown["scale"]
    found = whole(shown["values"]).ravel()
    np.testing.assert_allclose(found, stretch.clip(low, high), atol=0.51 * (high - low) / LEVELS)
    bar = shown["figure"]["layout"]["coloraxis"]
    assert (bar["cmin"], bar["cmax"]) == (low, high)
    assert bar["colorbar"]["title"]["text"] == "largest principal stretch [-]"


def test_walls_and_frame_are_there(strip_run: Path, ring_run: Path, box_run: Path) -> None:
    strip, ring, box = (
        animation(read_frames(run / RESULTS), "stretch") for run in (strip_run, ring_run, box_run)
    )
    faces = strip["figure"]["data"][1]["y"]
    assert set(faces[np.isfinite(faces)]) == {-15.0, 15.0}
    (outlines,) = strip["moving"].values()
    travel = [np.nanmean(outlines[-1][axis]) - np.nanmean(outlines[0][axis]) for axis in "xy"]
    assert travel == pytest.approx([8.0, 0.0])
    across = ring["figure"]["data"][1]["x"]
    assert set(across[np.isfinite(across)]) == {-12.0, 12.0}
    assert ring["signs"] == [1, -1]
    assert ring["near"][0][0] < -12.0 and ring["near"][1][0] > 12.0
    walls = box["figure"]["data"][0]
    assert len(walls["i"]) == 2 * 73  # triangles of the floor and the pipe
    assert (len(box["times"]), len(box["faces"])) == whole(box["values"]).shape
    assert box["near"][0][1] < -3.0  # the floor is below the body, whose middle is at 2 mm


def test_fibres_layers_and_rigid_bodies_are_drawn_in_front_of_a_body(tmp_path: Path) -> None:
    mesh = box(2e-3, 1e-3, 1e-3, 1e-3, "quad")
    below = np.flatnonzero(mesh.points[:, 1] == 0.0)
    a, b, c, d = below[np.lexsort(mesh.points[below][:, [2, 0]].T)][[0, 2, 5, 3]]
    writer = FieldWriter(tmp_path / RESULTS, mesh.points, mesh.cells)
    writer.describe(
        layers=np.array([[a, b, c], [a, c, d]]), fibre_starts=np.array([0]),
        walls=np.array([[0.0, -5e-4, 0.0, 0.0, 1.0, 0.0], [0.0, 9.0, 0.0, 0.0, -1.0, 0.0]]),
    )  # fmt: skip
    for time in (0.0, 1.0):
        shift = np.array([0.0, 1e-3 * time, 0.0])
        turn = [np.cos(0.25 * np.pi * time), 0.0, 0.0, np.sin(0.25 * np.pi * time)]
        writer.append(
            time,
            {"displacement": np.tile(shift, (len(mesh.points), 1))},
            {"stretch": np.ones(len(mesh.cells))},
            extra={"fibres": np.eye(3) * 1e-3 + shift, "frame_pose": np.array([[*shift, *turn]])},
        )
    shown = animation(read_frames(tmp_path / RESULTS), "stretch")
    layers, fibres, crosses = (shown["moving"][k] for k in shown["in_front"])
    assert [fibre["y"][1:-1].tolist() for fibre in fibres] == [[0.0, 1.0, 0.0], [1.0, 2.0, 1.0]]
    edges = np.array([layers[1][name] for name in "xyz"])
    assert np.isnan(edges).all(axis=0).sum() == 4 + 1  # the border, and not the diagonal
    assert set(edges[1][np.isfinite(edges[1])]) == {1.0}
    arm = 0.08 * 2.0
    lines = np.array([crosses[1][name] for name in "xyz"]).T
    ends = lines[np.isfinite(lines).all(axis=1)].reshape(3, 2, 3)
    along = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # a quarter turn about z
    np.testing.assert_allclose((ends[:, 1] - ends[:, 0]) / (2.0 * arm), along, atol=4e-3)
    np.testing.assert_allclose(ends.mean(axis=1), [[0.0, 1.0, 0.0]] * 3, atol=1e-3)
    assert shown["walls"].tolist() == [[0.0, -0.5, 0.0, 0.0, 1.0, 0.0]]  # the other one is far away


def test_a_page_opens_with_the_last_of_the_most_deformed_frames() -> None:
    assert most_deformed(np.array([[1.0, 1.0], [1.0, 3.0], [2.0, 2.0], [1.0, 1.5]])) == 2
    assert most_deformed(np.array([[0.0, 0.0], [-3.0, np.nan], [1.0, 1.0]])) == 1


def test_the_picture_is_as_tall_as_what_it_shows_within_limits() -> None:
    assert aspect(np.array([[0.0, 0.0], [3.0, 2.0]])) == 1.5
    assert aspect(np.array([[-1.0, 0.0], [1.0, 90.0]])) == 0.7
    assert aspect(np.array([[0.0, 0.0], [90.0, 1.0]])) == pytest.approx(16 / 9, abs=1e-3)
    assert aspect(np.array([[0.0, 0.0, 0.0], [1.0, 9.0, 1.0]])) == 1.0


def write_frames(path: Path, displacements: list[np.ndarray]) -> None:
    writer = FieldWriter(path, np.eye(3)[:, :2] * 1e-3, np.array([[0, 1, 2]]))
    for time, displacement in enumerate(displacements):
        writer.append(time, {"displacement": displacement}, {"stretch": np.ones(1)})


def test_frames_in_which_all_is_lost_are_left_out(tmp_path: Path) -> None:
    still, torn = np.zeros((3, 2)), np.zeros((3, 2))
    torn[2] = np.nan
    write_frames(tmp_path / RESULTS, [still, torn, np.full((3, 2), np.nan)])
    shown = animation(read_frames(tmp_path / RESULTS), "stretch")
    assert shown["times"].tolist() == [0.0, 1.0] and shown["frame_count"] == 3
    places = whole(shown["places"]).reshape(2, 3, 2)
    assert np.isnan(places[1, 2]).all() and np.isfinite(places[0]).all()


def test_a_ring_is_about_the_element_that_failed_where_it_was_last(tmp_path: Path) -> None:
    shifted, torn = np.full((3, 2), 1e-3), np.zeros((3, 2))
    torn[2] = np.nan
    write_frames(tmp_path / RESULTS, [np.zeros((3, 2)), shifted, torn])
    shown = animation(read_frames(tmp_path / RESULTS), "stretch", failed=0)
    third = 1.0 / 3.0
    expected = [[third, third], [1.0 + third, 1.0 + third], [1.0 + third, 1.0 + third]]
    number = len(shown["figure"]["data"]) - 1
    middles = [[place["x"][0], place["y"][0]] for place in shown["moving"][number]]
    np.testing.assert_allclose(middles, expected, atol=1e-3)
    assert shown["figure"]["data"][number]["marker"]["symbol"] == "circle-open"
    assert number not in animation(read_frames(tmp_path / RESULTS), "stretch")["moving"]


@pytest.mark.parametrize("element", [0, -1])
def test_in_space_the_eye_is_on_the_side_of_what_failed(box_run: Path, element: int) -> None:
    frames = read_frames(box_run / RESULTS)
    number = element % len(frames.cells)
    shown = animation(frames, "stretch", failed=number)
    eye = shown["figure"]["layout"]["scene"]["camera"]["eye"]
    middle = frames.points[frames.cells[number]].mean(axis=0) - frames.points.mean(axis=0)
    assert sum(eye[name] * c for name, c in zip("xyz", middle, strict=True)) > 0.0
    assert np.hypot(eye["x"], eye["z"]) > 0.5


def test_cables_move_with_the_body(tmp_path: Path) -> None:
    writer = FieldWriter(tmp_path / RESULTS, np.eye(3)[:, :2] * 1e-3, np.array([[0, 1, 2]]))
    writer.describe(cable_starts=np.array([0, 2]))
    cables = 1e-3 * np.arange(10.0).reshape(5, 2)
    for time in (0.0, 1.0):
        writer.append(
            time, {"displacement": np.zeros((3, 2))}, {"stretch": np.ones(1)},
            extra={"cables": cables + 1e-3 * time},
        )  # fmt: skip
    shown = animation(read_frames(tmp_path / RESULTS), "stretch")
    x = next(places[1]["x"] for places in shown["moving"].values() if len(places[1]["x"]) > 6)
    np.testing.assert_allclose(x, [np.nan, 1.0, 3.0, np.nan, 5.0, 7.0, 9.0, np.nan])


def test_a_run_that_lost_everything_says_so(tmp_path: Path) -> None:
    write_frames(tmp_path / RESULTS, [np.full((3, 2), np.nan)])
    with pytest.raises(OutputError, match="no frame with valid node positions"):
        animation(read_frames(tmp_path / RESULTS), "stretch")


def test_a_field_that_is_not_there_is_refused(strip_run: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(strip_run, tmp_path / "run")
    with pytest.raises(OutputError, match="von_mises"):
        animation(read_frames(folder / RESULTS), "von_mises")
