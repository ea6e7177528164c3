"""What the summary says of a passage, on histories made up for it."""

import json

import numpy as np
import pytest
from passages import ARC, STEP, history, passage

from softsim.analysis.passage import layout_report, where
from softsim.contact.pipe_layout import Fork, Straight, network_of_items


def test_passed():
    """50 mm/s from 30 mm on, until the row at which the goal, 270.7 mm, is reached."""
    rows = history([0.0, 4.82], [30.0, 271.0], period=100.0)
    rows["rows_in_contact"] = np.where(rows["arc_length"] < 0.12, 3.0, 4.0)
    rows["clearance"] = np.where(rows["arc_length"] < STEP, 2e-3, 1e-3)
    report = layout_report(passage(), rows)
    assert report["verdict"] == "passed"
    assert (
        report["sentence"]
        == "passed: the centre of the robot moved 241 mm from start to goal in 4.8 s"
    )
    assert "blocked_by" not in report
    straight, bend, second, last = report["segments"]
    assert (straight["segment"], bend["segment"], second["segment"], last["segment"]) == (
        1,
        2,
        3,
        5,
    )
    # Rows are 10 ms and 0.5 mm apart.
    assert straight["entered"] == 0.0
    assert straight["left"] == bend["entered"] == pytest.approx(1.8, abs=0.011)
    assert bend["left"] == pytest.approx(1.8 + ARC / 0.05, abs=0.011)
    assert last["left"] is None
    for segment in report["segments"]:
        assert segment["mean_speed"] == pytest.approx(0.05, rel=1e-3)
    assert (straight["rows_in_contact"], bend["rows_in_contact"]) == (3.0, 4.0)
    assert (bend["least_clearance"], last["least_clearance"]) == (2e-3, 1e-3)
    assert report["at_end"] == {"rows_in_contact": 4.0, "clearance": 1e-3}
    json.dumps(report, allow_nan=False)


def test_stuck():
    """It comes to 151 mm in 4 s, then stands for two cycles, 1 mm behind."""
    rows = history([0.0, 4.0, 5.0, 8.0], [30.0, 151.0, 150.0, 150.0], clearance=-1e-5,
                   frame_wall_force=1.0, frame_pinch=0.4)  # fmt: skip
    report = layout_report(passage(), rows)
    assert report["sentence"] == (
        "stuck in segment 2 (bend 90 deg, radius 60 mm) at 151 mm: frame wedged"
    )
    assert report["final_arc_length"] == pytest.approx(0.15)
    assert report["evidence"]["pinch_share"] == pytest.approx(0.4)
    assert report["thresholds"]["fell_back"] == 33e-3
    second = report["segments"][2]
    assert second["entered"] is second["mean_speed"] is second["least_clearance"] is None
    json.dumps(report, allow_nan=False)


def test_unfinished():
    report = layout_report(passage(), history([0.0, 3.0], [30.0, 90.0]))
    assert report["sentence"] == (
        "unfinished: the centre of the robot moved 60 of 241 mm from start to goal in 3.0 s; "
        "it is in segment 1 "
        "(straight 120 mm) at 90 mm"
    )


def test_margin_and_assumptions():
    """It stands in the bend from 1 to 2.6 s, within a cycle, and goes on."""
    rows = history([0.0, 1.0, 2.6, 3.6], [30.0, 150.0, 150.0, 250.0], period=5.0)
    report = layout_report(passage(), rows, ("friction: coefficient 0.7",))
    longest = report["longest_standstill"]
    assert longest["where"]["what"] == "bend 90 deg, radius 60 mm"
    assert longest["duration"] == pytest.approx(1.65, abs=0.06)
    assert (report["idle_cycles"], report["patience_used"]) == (0, 0.0)
    assert report["assumptions"] == ["friction: coefficient 0.7"]
    assert report["margin"] == (
        "longest standstill: 1.7 s with less than 5 mm of progress, from t = 1.0 s, in segment "
        "2 (bend 90 deg, radius 60 mm) at 150 mm; closest to the verdict stuck: 0 of 2 "
        "complete pressure cycles "
        "without progress"
    )
    timed = layout_report(passage(in_cycles=False), rows)
    assert timed["margin"].endswith("; closest to the verdict stuck: 1.7 of 3 s without progress")
    json.dumps(report, allow_nan=False)


def test_a_body_beyond_an_open_end_is_clear_of_all_walls():
    report = layout_report(passage(), history([0.0, 1.0], [30.0, 30.0], clearance=np.inf))
    assert report["at_end"]["clearance"] is report["segments"][0]["least_clearance"] is None
    json.dumps(report, allow_nan=False)


@pytest.mark.parametrize(
    ("place", "segment", "name", "distance"),
    [
        (0.1, 1, "beginning of bend 90 deg, radius 60 mm", 0.02),
        (0.12 + ARC - 0.01, 2, "end of bend 90 deg, radius 60 mm", 0.01),
        (STEP + 0.03, 5, "step 30 mm", -0.03),
    ],
)
def test_where(place, segment, name, distance):
    found = where(passage(), 0, place)
    assert (found["segment"], found["nearest_feature"]["name"]) == (segment, name)
    assert found["nearest_feature"]["distance"] == pytest.approx(distance)


def test_the_exit_by_which_it_left():
    """A pipe of 100 mm with a branch in its middle, of 90 mm from there: the robot turns into it at
    2 s. The tee is left where the way leaves it.
    """
    fork = Fork(80e-3, {"left": 0.0}, 36e-3, True, 2e-3)
    network = network_of_items(
        "pipe", [Straight(10e-3), fork, Straight(10e-3)], {"left": [Straight(50e-3)]}, 36e-3,
        np.zeros(2), (),
    )  # fmt: skip
    items = ("straight 10 mm", "tee 80 mm", "straight 10 mm", "straight 50 mm")
    asked = passage(network=network, items=items, start=5e-3, goals=(90e-3, 120e-3))
    rows = history([0.0, 4.0], [5.0, 125.0])
    rows["branch"] = np.where(rows["arc_length"] > 0.05, 1.0, 0.0)
    report = layout_report(asked, rows)
    assert (report["verdict"], report["exit"], report["goal"]) == ("passed", "left", 120e-3)
    assert report["sentence"].startswith(
        "passed through the exit 'left': the centre of the robot moved 115 mm"
    )
    assert report["where"]["branch"] == "left"
    first, tee, ahead, half, arm = report["segments"]
    assert tee["segment"] == half["segment"] == 2
    assert (first["left"], tee["left"]) == pytest.approx((1.0 / 6.0, 1.5), abs=0.011)
    assert (ahead["entered"], ahead["left"]) == (None, None)
    assert (half["entered"], arm["entered"]) == pytest.approx((1.5, 85.0 / 30.0), abs=0.011)
    assert arm["left"] is None
    straight_on = layout_report(asked, rows | {"branch": np.zeros(len(rows["time"]))})
    assert (straight_on["exit"], straight_on["goal"]) == ("end", 90e-3)
