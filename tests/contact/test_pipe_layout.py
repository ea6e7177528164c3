"""Where a pipe leads that is given item by item, and whether it runs into itself."""

import numpy as np
import pytest

from softsim.contact.pipe_layout import Bend, DiameterStep, Straight, Taper, crossing, path_of_items
from softsim.contact.pipe_network import PipeNetwork
from tests.contact.pipe_layouts import RIGHT_ANGLE, layout

OPEN = (False, False)
LEFT, RIGHT = 0.0, np.pi


def ends(path):
    """Place and direction at the end of a path."""
    last = path.joints[-1]
    return np.concatenate([last.point, last.tangent])


def test_bends_in_the_plane():
    """To the left and to the right; radii and diameters as given, arc lengths added up."""
    items = [Straight(0.1), Bend(RIGHT_ANGLE, 0.05, LEFT), DiameterStep(0.03),
             Bend(RIGHT_ANGLE, 0.04, RIGHT), Taper(0.02, 0.05), Straight(0.1)]  # fmt: skip
    path = path_of_items("p", items, 0.02, np.array([0.01, 0.02]), OPEN)
    np.testing.assert_allclose(ends(path), [0.32, 0.11, 1.0, 0.0], atol=1e-15)
    assert path.length == pytest.approx(0.22 + 0.09 * RIGHT_ANGLE)
    assert [s.item for s in path.segments] == [0, 1, 3, 4, 5]
    assert [s.radii for s in path.segments] == [
        (0.01, 0.01), (0.01, 0.01), (0.015, 0.015), (0.015, 0.025), (0.025, 0.025)
    ]  # fmt: skip
    after = path.segments[1:]
    np.testing.assert_allclose([s.start for s in after], [s.end for s in path.segments[:-1]])


def test_bends_in_space():
    """Left, then up: turned by 90 deg about the direction of travel; a frame that is carried
    through both bends without twist has its left turned along.
    """
    up = Bend(RIGHT_ANGLE, 0.1, RIGHT_ANGLE)
    path = path_of_items("p", [Bend(RIGHT_ANGLE, 0.1, LEFT), up], 0.02, np.zeros(3), OPEN)
    np.testing.assert_allclose(ends(path), [0.1, 0.2, 0.1, 0.0, 0.0, 1.0], atol=1e-15)
    path = path_of_items("p", [up, Bend(RIGHT_ANGLE, 0.1, LEFT)], 0.02, np.zeros(3), OPEN)
    np.testing.assert_allclose(ends(path), [0.1, 0.1, 0.2, 0.0, 1.0, 0.0], atol=1e-15)


def test_joints_are_smooth():
    """Place and direction go on at every joint."""
    path = layout(3)
    for segment, joint in zip(path.segments, path.joints[1:], strict=True):
        place, tangent = segment.axis_place(np.array([segment.length]))
        np.testing.assert_allclose(place[0], joint.point, atol=1e-15)
        np.testing.assert_allclose(tangent[0], joint.tangent, atol=1e-15)


def test_a_path_that_crosses_itself():
    """Three quarters of a turn and on; the two segments that meet are named."""
    three = [Bend(RIGHT_ANGLE, 0.05, LEFT)] * 3
    found = crossing(
        PipeNetwork.of_one(
            path_of_items("p", [Straight(0.1), *three, Straight(0.1)], 0.02, np.zeros(2), OPEN)
        )
    )
    assert found is not None
    assert [segment.item for segment in found] == [0, 4]


def test_a_long_path_that_crosses_itself_far_away():
    """The work grows with the logarithm of the length: kilometres are no more than metres."""
    three = [Bend(RIGHT_ANGLE, 0.05, LEFT)] * 3
    for last, met in ((4000.0, True), (0.03, False)):
        items = [Straight(3000.0), *three, Straight(last)]
        path = path_of_items("p", items, 0.02, np.zeros(2), OPEN)
        found = crossing(PipeNetwork.of_one(path))
        assert (found is not None) == met


@pytest.mark.parametrize(
    "items",
    [
        [Straight(0.1), Bend(np.pi, 0.011, LEFT), Straight(0.1)],
        [Bend(np.pi, 0.0101, LEFT), Bend(np.pi, 0.0101, RIGHT), Straight(0.1)],
        [Straight(0.1), *[Bend(RIGHT_ANGLE, 0.05, LEFT)] * 3, Straight(0.03)],
        [Bend(np.radians(340.0), 0.06, LEFT)],
    ],
    ids=["hairpin", "tight S", "stops before it crosses", "nearly a ring"],
)
def test_a_path_that_comes_close_does_not_cross(items):
    assert crossing(PipeNetwork.of_one(path_of_items("p", items, 0.02, np.zeros(2), OPEN))) is None


def test_legs_too_close():
    """A hairpin that widens on its way back touches its first leg."""
    items = [Straight(0.1), Bend(np.pi, 0.011, LEFT), Taper(0.02, 0.04), Straight(0.08)]
    found = crossing(PipeNetwork.of_one(path_of_items("p", items, 0.02, np.zeros(2), OPEN)))
    assert found is not None
    assert found[0].item == 0
