"""What the player gets: places and colours survive the packing, and too many frames are thinned."""

import shutil
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from softsim.errors import OutputError
from softsim.output.fields import FieldWriter, read_frames
from softsim.output.folder import RESULTS
from softsim.report.page.animation import MOST_FRAMES, ROOM, animation, chosen_frames
from softsim.report.page.packing import LOST, SHADES, STEPS, packed, shades, steps

places = arrays(float, (5, 2), elements=st.floats(-40.0, 40.0, width=32))


def unpacked(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(b64decode(text), dtype=kind)


def shown_places(shown: dict) -> np.ndarray:
    """Places (f, n, d) [mm] as the player computes them."""
    d = shown["origins"].shape[1]
    local = unpacked(shown["places"], "<i2").reshape(-1, shown["node_count"], d) * shown["step"]
    return local + shown["origins"][:, None]


@settings(max_examples=40)
@given(places)
def test_places_come_back_within_half_a_step(given_places: np.ndarray) -> None:
    back = unpacked(packed(steps(given_places, 40.0), np.int16), "<i2").reshape(5, 2)
    assert np.abs(back * 40.0 / STEPS - given_places).max() <= 0.5001 * 40.0 / STEPS


@settings(max_examples=40)
@given(arrays(float, 6, elements=st.floats(-5.0, 5.0)))
def test_shades_rise_with_the_value_and_stay_in_the_palette(values: np.ndarray) -> None:
    found = shades(np.sort(values), -1.0, 1.0)
    assert np.all(np.diff(found) >= 0) and found.min() >= 0 and found.max() < SHADES


def test_what_is_not_finite_is_marked_as_lost() -> None:
    assert steps(np.array([np.nan, 1.0]), 1.0).tolist() == [LOST, STEPS]
    assert shades(np.array([np.nan, 1.0]), 1.0, 1.0).tolist() == [SHADES, 0]


@settings(max_examples=40)
@given(st.integers(1, 5000), st.integers(6, 400_000), st.integers(1, 400_000))
def test_frames_fit_in_the_room_and_keep_both_ends(count, coordinates, faces) -> None:
    chosen = chosen_frames(count, coordinates, faces)
    assert chosen[0] == 0 and chosen[-1] == count - 1
    assert np.all(np.diff(chosen) > 0) and len(chosen) <= min(count, MOST_FRAMES)
    assert len(chosen) <= 2 or len(chosen) * (2 * coordinates + faces) <= ROOM


@pytest.mark.parametrize("run", ["strip_run", "ring_run", "box_run"])
def test_places_are_those_of_the_results(run: str, request: pytest.FixtureRequest) -> None:
    frames = read_frames(request.getfixturevalue(run) / RESULTS)
    shown, d = animation(frames, "stretch"), frames.points.shape[1]
    at_end = (frames.points + frames.point_data["displacement"][-1][:, :d]) * 1e3
    faces = unpacked(shown["faces"], "<i4").reshape(-1, shown["corners"])
    found = shown_places(shown)[-1]
    assert shown["times"].tolist() == frames.times.tolist()
    # Every painted corner is where a node is; in space there are nodes inside that none shows.
    away = np.linalg.norm(found[faces.ravel()][:, None] - at_end[None], axis=2).min(axis=1)
    assert away.max() < 1e-3
    assert np.ptp(found, axis=0) == pytest.approx(np.ptp(at_end, axis=0), abs=1e-3)


def test_cells_of_a_plane_run_keep_their_order_and_colour(strip_run: Path) -> None:
    frames = read_frames(strip_run / RESULTS)
    shown = animation(frames, "stretch")
    assert unpacked(shown["faces"], "<i4").reshape(-1, 4).tolist() == frames.cells.tolist()
    stretch = np.concatenate([frames.cell_data["stretch"][k] for k in range(len(frames))])
    found, (low, high) = unpacked(shown["shades"], "u1"), shown["limits"]
    inside = (stretch > low) & (stretch < high)
    back = low + found / (SHADES - 1) * (high - low)
    assert np.abs(back - stretch)[inside].max() <= 0.51 * (high - low) / (SHADES - 1)


def test_walls_and_frame_are_there(strip_run: Path, ring_run: Path, box_run: Path) -> None:
    strip, ring, box = (
        animation(read_frames(run / RESULTS), "stretch") for run in (strip_run, ring_run, box_run)
    )
    assert sorted(s["face"][0][1] for s in strip["scenery"]["solids"]) == [-15.0, 15.0]
    travel = strip["outlines"][-1].mean(axis=(0, 1)) - strip["outlines"][0].mean(axis=(0, 1))
    assert travel == pytest.approx([8.0, 0.0])
    assert sorted(s["side"] for s in ring["scenery"]["solids"]) == [-1.0, 1.0]
    assert ring["mirrored"] and ring["near"][0][0] < -12.0 and ring["near"][1][0] > 12.0
    assert box["scenery"]["faces"].shape == (73, 4, 3)  # the floor and the pipe


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
    assert (unpacked(shown["places"], "<i2").reshape(2, 3, 2)[1, 2] == LOST).all()


def test_a_run_that_lost_everything_says_so(tmp_path: Path) -> None:
    write_frames(tmp_path / RESULTS, [np.full((3, 2), np.nan)])
    with pytest.raises(OutputError, match="no frame in which a node still has a place"):
        animation(read_frames(tmp_path / RESULTS), "stretch")


def test_a_field_that_is_not_there_is_refused(strip_run: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(strip_run, tmp_path / "run")
    with pytest.raises(OutputError, match="von_mises"):
        animation(read_frames(folder / RESULTS), "von_mises")
