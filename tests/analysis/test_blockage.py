"""What blocks a stuck body: each rule on a history made for it, and beside it one made against."""

import numpy as np
import pytest
from passages import history, passage

from softsim.analysis.passage import blockage_indicators, blocked_by, contact_description

STANDING = ([0.0, 4.0], [100.0, 100.0])


def found(times_and_places=STANDING, **columns) -> str:
    return blocked_by(blockage_indicators(passage(), history(*times_and_places, **columns)))


def test_wedged_is_clamped_from_two_sides():
    clamped = {"clearance": -1e-6, "frame_wall_force": 2.0, "frame_pinch": 1.0}
    assert found(**clamped) == "frame wedged"
    assert found(**clamped | {"frame_pinch": 0.2}) == "no thrust"  # lies on one side


def test_wedged_is_held_back_by_the_frame():
    held = {"clearance": -1e-6, "frame_wall_force": 2.0, "drag": 1.0, "frame_drag": 0.8}
    assert found(**held) == "frame wedged"
    assert found(**held | {"frame_drag": 0.2}) == "no thrust"


def test_a_frame_that_rattles_is_not_wedged():
    rows = history(*STANDING, frame_wall_force=2.0, frame_pinch=1.0)
    rows["clearance"] = np.where(np.arange(len(rows["time"])) % 3 == 0, -1e-6, 1e-3)
    assert blocked_by(blockage_indicators(passage(), rows)) == "no thrust"


def test_only_the_last_whole_cycle_counts():
    """Clamped in the first cycle of two, free in the second."""
    rows = history(*STANDING)
    early = rows["time"] < 2.0 - 1e-6
    rows["clearance"] = np.where(early, -1e-6, 1e-3)
    rows["frame_wall_force"], rows["frame_pinch"] = 2.0 * early, 1.0 * early
    assert blocked_by(blockage_indicators(passage(), rows)) == "no thrust"


def test_a_fall_is_more_than_its_own_length():
    assert found(([0.0, 3.0, 4.0], [30.0, 100.0, 66.0])) == "lost grip and fell"
    assert found(([0.0, 3.0, 4.0], [30.0, 100.0, 68.0])) == "no thrust"


def test_caught_is_held_back_where_the_pipe_narrows():
    assert found(drag=1.0, narrowing_drag=0.6) == "spikes caught on a step"
    assert found(drag=1.0, narrowing_drag=0.4) == "no thrust"


def test_the_remark_tells_what_the_spikes_did():
    free = blockage_indicators(passage(), history(*STANDING, rows_in_contact=0.0))
    assert contact_description(free) == "no row of spikes touches the wall"
    rows = history([0.0, 1.0, 2.0, 4.0], [100.0, 103.0, 101.0, 101.0], period=10.0)
    walking = blockage_indicators(passage(), rows)
    assert (walking.way_forward, walking.way_back) == pytest.approx((3e-3, 2e-3))
    assert contact_description(walking) == (
        "up to 3 rows of spikes touch the wall; in the last phase "
        "3.0 mm forward and 2.0 mm backward"
    )
