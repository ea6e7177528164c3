"""Forces of walls on a robot, sorted by what they do to its way along a pipe."""

import numpy as np
import pytest
from passages import ARC, PATH, STEP

from softsim.analysis.passage import forces_along, frame_forces, path_samples
from softsim.contact.pipe_network import PipeNetwork

NETWORK = PipeNetwork.of_one(PATH)
NONE = np.zeros(1, dtype=bool)


def test_forces_that_clamp_cancel_out():
    assert frame_forces(np.array([[0.0, 2.0], [0.0, -2.0]])) == {
        "frame_wall_force": 4.0,
        "frame_pinch": 2.0,
    }
    lying = frame_forces(np.array([[0.0, 2.0], [0.0, 1.0]]))
    assert (lying["frame_wall_force"], lying["frame_pinch"]) == (3.0, 0.0)
    # In a bend: from the inner side in the middle, from the outer side at both ends.
    three = frame_forces(np.array([[0.0, 2.0], [0.0, -1.0], [0.0, -1.0]]))
    assert three["frame_pinch"] == 2.0
    assert frame_forces(np.zeros((0, 2))) == {"frame_wall_force": 0.0, "frame_pinch": 0.0}


def test_thrust_and_drag_follow_the_bend():
    """Behind a left turn of 90 deg the way is +y: a force along +x does nothing to it."""
    behind = PATH.axis_place(np.array([0.12 + ARC + 0.02]))[0]
    found = forces_along(NETWORK, behind, np.array([[3.0, -2.0]]), NONE)
    assert (found["thrust"], found["drag"]) == pytest.approx((0.0, 2.0))
    before = forces_along(NETWORK, np.array([[0.05, 0.01]]), np.array([[3.0, -2.0]]), NONE)
    assert (before["thrust"], before["drag"]) == pytest.approx((3.0, 0.0))


def test_thrust_does_not_make_up_for_drag():
    places = np.array([[0.05, 0.01], [0.06, 0.01]])
    found = forces_along(
        NETWORK, places, np.array([[3.0, 0.0], [-2.0, 0.0]]), np.array([False, True])
    )
    assert (found["thrust"], found["drag"], found["frame_drag"]) == pytest.approx((3.0, 2.0, 2.0))


@pytest.mark.parametrize("ahead, caught", [(-0.003, 0.0), (-0.001, 1.0), (0.0, 1.0), (0.003, 0.0)])
def test_drag_near_a_step_down(ahead, caught):
    place = PATH.axis_place(np.array([STEP + ahead]))[0]
    found = forces_along(NETWORK, place, np.array([[0.0, -1.0]]), NONE)
    assert (found["drag"], found["narrowing_drag"]) == pytest.approx((1.0, caught))


def test_samples_of_a_path():
    """Arc length, point, tangent, radius."""
    samples = path_samples(NETWORK)["path"]
    s, points, tangents, radius = samples[:, 0], samples[:, 1:3], samples[:, 3:5], samples[:, 5]
    assert (s[0], s[-1]) == (0.0, pytest.approx(PATH.length))
    assert points == pytest.approx(PATH.axis_place(s)[0], abs=1e-12)
    assert np.linalg.norm(tangents, axis=1) == pytest.approx(1.0)
    at_step = np.isclose(s, STEP)
    assert radius[at_step] == pytest.approx([18e-3, 15e-3])
