"""Layouts that were never run: reports of made-up ways, and what is claimed of them."""

import dataclasses

import numpy as np
import pytest

from softsim.analysis.passage import layout_report
from softsim.contact.pipe_layout import Straight, Taper, path_of_items
from softsim.contact.pipe_network import PipeNetwork
from tests.analysis.passages import LENGTH, history, passage
from validation import critical_zones
from validation.cases import NOT_IN_SUBSET, Outcome
from validation.critical_zones import CLAIMED, LARGE, NARROWING, SMALL, UPWARDS, WIDENING
from validation.verdicts import AGREES, DISAGREES, UNKNOWN

START, TAPER, END = 25.0, 60.0, 80.0  # mm: of the robot's centre, of the taper
GOAL = END + 0.5e3 * LENGTH
PIPE = passage(
    network=PipeNetwork.of_one(
        path_of_items(
            "pipe",
            [Straight(1e-3 * TAPER), Taper(1e-3 * (END - TAPER), 41e-3), Straight(80e-3)],
            30e-3, np.zeros(2), (False, False),
        )
    ),
    items=("straight 60 mm", "taper 20 mm, to 41 mm", "straight 80 mm"),
    start=1e-3 * START,
    goals=(1e-3 * GOAL,),
)  # fmt: skip


def outcome_of(times, places, **columns):
    way = history(times, places, **columns)
    summary = {"layout": layout_report(PIPE, way), "wall_time": 90.0}
    return Outcome("", None, summary, way)


def passing(speed):
    """After a second at rest on to the goal [mm/s]."""
    return outcome_of([0.0, 1.0, 1.0 + (GOAL + 1.0 - START) / speed], [START, START, GOAL + 1.0])


def stuck_at(place):
    """Comes there in two seconds and stays for three whole cycles of two seconds."""
    return outcome_of([0.0, 2.0, 9.0], [START, place, place], clearance=1.5e-3)


def moving():
    """Goes on when the time is up."""
    return outcome_of([0.0, 1.0], [START, START + 20.0])


def all_with(**others):
    """Every layout passed at 10 mm/s, but for the `others`."""
    names = critical_zones.layouts()
    assert set(others) | set(CLAIMED) <= set(names)
    made = {name: passing(10.0) for name in names} | others
    return {name: dataclasses.replace(outcome, name=name) for name, outcome in made.items()}


OF_THE_THESIS = {
    WIDENING: passing(40.0), NARROWING: passing(20.0), WIDENING + UPWARDS: passing(8.0),
    NARROWING + UPWARDS: stuck_at(65.0), SMALL: passing(20.0), LARGE: passing(5.0),
}  # fmt: skip


def verdicts_of(outcomes):
    return {row.claim: row for row in critical_zones.rows(outcomes, None)}


def test_a_robot_like_the_thesis(tmp_path):
    rows = verdicts_of(all_with(**OF_THE_THESIS))
    stuck = CLAIMED[NARROWING + UPWARDS][1]
    assert rows.pop(stuck).verdict == DISAGREES
    assert {row.verdict for row in rows.values()} == {AGREES}
    assert len(rows) == len(CLAIMED) - 1 + 5
    told = rows["more easily level than upwards; from 41 to 30 mm"].computed
    assert told == "passed at 20 mm/s against stuck"
    path = tmp_path / "figure.png"
    left_out = Outcome("s_bend", failure=NOT_IN_SUBSET)
    critical_zones.draw(all_with(**OF_THE_THESIS, s_bend=left_out), None, path)
    assert path.stat().st_size > 0


def test_a_robot_that_does_all_the_other_way_round():
    others = {
        WIDENING: stuck_at(62.0), NARROWING: passing(20.0), WIDENING + UPWARDS: passing(30.0),
        NARROWING + UPWARDS: passing(40.0), SMALL: passing(5.0), LARGE: passing(6.0),
        "slope_45": stuck_at(30.0), "c_bend": stuck_at(30.0),
    }  # fmt: skip
    rows = verdicts_of(all_with(**others))
    compared = [row for claim, row in rows.items() if "easily" in claim or "slower" in claim]
    assert len(compared) == 5 and {row.verdict for row in compared} == {DISAGREES}
    for name in ("c_bend", "slope_45", WIDENING):
        row = rows[CLAIMED[name][1]]
        assert row.verdict == DISAGREES and row.computed.startswith("stuck in segment")


def test_what_cannot_be_told():
    """The time was up; both stuck; stuck before the transition, which says nothing of it; an elbow
    that is not passed has no speed of its way.
    """
    others = {
        "c_bend": moving(), WIDENING: stuck_at(65.0), NARROWING: stuck_at(62.0),
        WIDENING + UPWARDS: passing(8.0), NARROWING + UPWARDS: stuck_at(30.0),
        SMALL: stuck_at(70.0),
    }  # fmt: skip
    rows = verdicts_of(all_with(**others))
    assert rows[CLAIMED["c_bend"][1]].verdict == UNKNOWN
    easier = {claim: row for claim, row in rows.items() if claim.startswith("from 30 to 41")}
    assert [row.verdict for row in easier.values()] == [UNKNOWN, UNKNOWN]
    assert easier.popitem()[1].computed.endswith("against stuck before it")
    assert rows["more easily level than upwards; from 30 to 41 mm"].verdict == DISAGREES
    (speed,) = (row for claim, row in rows.items() if "slower" in claim)
    assert speed.verdict == UNKNOWN and speed.computed.startswith("stuck against 8.")


def test_the_speed_through_a_transition_leaves_out_the_way_to_it():
    """The robot of 33 mm is at the taper while its centre is 16.5 mm before it or behind it; a
    sample each 10 ms.
    """
    slow = outcome_of([0.0, 10.0, 15.3, 15.4], [START, 43.5, 96.5, 96.6])
    assert critical_zones.front_at_taper(slow.summary["layout"]) == pytest.approx(43.5e-3)
    assert critical_zones.crossing_speed(slow) == pytest.approx(10.0, rel=0.01 / 5.3)
    # Nothing counts behind the goal, but for the time until the run is over.
    assert critical_zones.mean_speed(slow) == pytest.approx((96.5 - START) / 15.4)


def test_the_table_has_every_layout():
    outcomes = all_with(c_bend=stuck_at(65.0), s_bend=Outcome("s_bend", failure="too steep\nmore"))
    (listing,) = critical_zones.listings(outcomes)
    lines = {line[0]: dict(zip(listing.headings, line, strict=True)) for line in listing.rows}
    assert list(lines) == critical_zones.layouts()
    assert lines["s_bend"]["verdict"] == "too steep"
    stuck = lines["c_bend"]
    assert stuck["where"] == "segment 2 (taper 20 mm, to 41 mm) at 65 mm"
    assert (stuck["verdict"], stuck["blocked by"]) == ("stuck", "no thrust")
    assert (stuck["least clearance [mm]"], stuck["rows there"]) == ("1.5", "3")
    assert lines["slope_45"]["blocked by"] == "" and lines["slope_45"]["wall time [s]"] == "90"
    (remark,) = critical_zones.remarks(outcomes)
    assert remark.startswith("c_bend, no thrust: up to 3 rows of spikes touch")


def test_pictures_do_not_change_the_run():
    """The pressure follows rows of the history: these stay as `softsim assess` has them."""
    outputs = [case.loaded.scene.output for case in critical_zones.cases()]
    default = type(outputs[0])()
    assert {output.history_interval for output in outputs} == {default.history_interval}
    assert {output.frame_interval for output in outputs} == {0.1}
