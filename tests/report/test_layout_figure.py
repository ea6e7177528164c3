"""The picture of a robot in a layout: what it is made of, and that it is drawn."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from layout_runs import ITEMS, write_layout_run
from matplotlib.image import imread

from softsim.analysis.passage import path_samples
from softsim.contact.pipe_layout import Bend, Straight, path_of_items
from softsim.contact.pipe_network import PipeNetwork
from softsim.errors import OutputError
from softsim.output.fields import read_frames
from softsim.output.folder import HISTORY, RESULTS, read_summary
from softsim.output.history import read_history
from softsim.report.along_pipe import Pipe, draw_layout, pipes_described, places, robots, stripes_of
from softsim.report.diagram import Stripe
from softsim.report.figures import draw_all
from softsim.report.png import draw_stripes
from softsim.report.style import drawing
from softsim.robots.block import block, box

QUARTER = 0.5 * np.pi


def pipe(items=ITEMS, dimension: int = 2) -> Pipe:
    path = path_of_items("pipe", items, 36e-3, np.zeros(dimension), (False, False))
    (one,) = pipes_described(path_samples(PipeNetwork.of_one(path)))
    return one


def strip(length: float = 30e-3):
    mesh = block(length, 8e-3, 4e-3)
    return type(mesh)(mesh.points - [0.5 * length, 4e-3], mesh.cells)


def test_walls_are_a_radius_away_on_both_sides():
    left, right = pipe().side(1.0), pipe().side(-1.0)
    assert np.linalg.norm(left - right, axis=1) == pytest.approx(2.0 * pipe().radius)
    assert left[0] == pytest.approx([0.0, 18.0])
    # The first bend turns left about (100, 60) mm: its inner wall is 42 mm from there.
    bend = (pipe().s > 101.0) & (pipe().s < 194.0)
    assert np.linalg.norm(left[bend] - [100.0, 60.0], axis=1) == pytest.approx(42.0)


def test_a_step_is_two_samples_at_one_place():
    repeated = np.flatnonzero(np.diff(pipe().s) == 0.0)
    assert set(np.round(np.diff(pipe().radius)[repeated], 9)) == {0.0, -2.5}


def test_texts_stand_outside_of_a_bend():
    bend = pipe()
    assert bend.outer_side(150.0) == -1.0  # it turns left there
    assert bend.outer_side(370.0) == 1.0  # and right there
    at, outward = bend.beside(0.0, 1.0, 5.0)
    assert at == pytest.approx([0.0, 23.0])
    assert outward == pytest.approx([0.0, 1.0])


@pytest.mark.parametrize("turned", [0.0, 0.5, QUARTER, np.pi])
def test_in_space_the_picture_lies_in_the_plane_of_the_path(turned):
    """An elbow looks the same whichever way it is turned about its first direction."""

    def elbow(angle: float) -> list:
        return [Straight(0.1), Bend(QUARTER, 0.06, angle), Straight(0.1)]

    found = pipe(elbow(turned), 3).centre
    assert found == pytest.approx(pipe(elbow(0.0)).centre, abs=1e-9)


def test_places_are_apart_and_cover_the_way():
    found = places(25.0, 400.0, [50.0, 150.0, 250.0, 270.0, 370.0], 40.0)
    assert found[0] == 25.0
    assert len(found) >= 4
    assert np.diff([*found, 400.0]).min() >= 30.0
    assert places(25.0, 26.0, [50.0, 150.0], 40.0) == [25.0]


def test_texts_of_short_segments_do_not_overlap(tmp_path: Path):
    tops = [9.5, 10.5, 11.5, 12.5, 67.5, 100.0]
    stripes = [Stripe(a, b, f"{a:g}", shaded=False) for a, b in pairwise([0.0, *tops])]
    with drawing(tmp_path / "stripes.png", height=3.0) as figure:
        axes = figure.subplots()
        draw_stripes(axes, stripes)
        figure.draw_without_rendering()
        boxes = [text.get_window_extent() for text in axes.texts]
    assert all(lower.y1 <= upper.y0 for lower, upper in pairwise(boxes))


def test_segments_end_where_the_next_begins_and_the_last_one_goes_on():
    segments = [
        {"segment": k, "what": "straight", "start": 0.1 * k, "end": 0.1 * k + 0.1} for k in range(3)
    ]
    found = list(stripes_of(segments, 50.0, 420.0))
    assert [(s.low, s.high) for s in found] == [(50.0, 100.0), (100.0, 200.0), (200.0, 420.0)]
    assert [s.shaded for s in found] == [True, False, True]
    assert found[1].name == "1  straight"
    assert [s.name[0] for s in stripes_of(segments, 120.0, 150.0)] == ["1"]


def test_the_robot_at_its_end_is_always_there(tmp_path: Path):
    write_layout_run(tmp_path, strip(), 0.151, wedged=True)
    shown = robots(
        [pipe()], read_history(tmp_path / HISTORY), read_frames(tmp_path / RESULTS),
        read_summary(tmp_path)["layout"],
    )  # fmt: skip
    assert shown[0].label == "24.0 s"
    assert shown[0].place == pytest.approx(151.0, abs=0.2)
    assert shown[1].place == pytest.approx(25.0, abs=0.2)
    distances = [abs(a.place - b.place) for a in shown for b in shown if a is not b]
    assert min(distances) > 30.0


@pytest.mark.parametrize("mesh", [strip(), box(30e-3, 8e-3, 8e-3, 4e-3)])
@pytest.mark.physics
def test_it_is_drawn(tmp_path: Path, mesh):
    write_layout_run(tmp_path, mesh, 0.3, wedged=False)
    drawn = draw_all(tmp_path, "stretch")
    assert drawn[-1] == tmp_path / "layout.png"
    picture = imread(drawn[-1])
    assert picture.shape[1] > 1400
    assert picture[..., :3].std() > 0.02


def test_a_run_from_before_branches_is_refused(tmp_path: Path):
    write_layout_run(tmp_path, strip(), 0.3, wedged=False)
    history = read_history(tmp_path / HISTORY)
    del history["branch"]
    frames = read_frames(tmp_path / RESULTS)
    with pytest.raises(OutputError, match="without branched pipes"):
        draw_layout(history, frames, {}, tmp_path / "layout.png")


def test_without_a_question_there_is_no_picture(tmp_path: Path):
    write_layout_run(tmp_path, strip(), 0.3, wedged=False)
    (tmp_path / "summary.json").unlink()
    (tmp_path / "layout.png").write_bytes(b"of an earlier run")
    assert tmp_path / "layout.png" not in draw_all(tmp_path, "stretch")
    assert not (tmp_path / "layout.png").exists()
