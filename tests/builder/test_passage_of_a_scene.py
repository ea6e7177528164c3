"""What a scene's layout asks, and layouts that ask nothing that can be answered."""

import numpy as np
import pytest

from softsim.errors import SceneError

SCENE = """\
bodies:
  block: {mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10,
          position: [-50 mm, 0 mm], fixed: [bottom]}
rigid_bodies:
  frame: {mass: 1 g, inertia: 1 g*mm^2, center: [30 mm, 0 mm],
          outline: {length: 33 mm, height: 15 mm}}
environment:
  walls:
    pipe: {kind: pipe_path, diameter: 36 mm,
           pipe: [{straight: 60 mm}, {bend: 90 deg, radius: 60 mm}, {step: 41 mm},
                  {straight: 80 mm}]}
layout: {}
time: {end: 1 s}
"""
PIPE = SCENE[SCENE.index("{kind: pipe_path") : SCENE.index("\nlayout")]
BEND = 0.06 * 0.5 * np.pi


def test_defaults(build):
    model = build(SCENE)
    passage = model.passage
    assert passage.items == (
        "straight 60 mm", "bend 90 deg, radius 60 mm", "step 41 mm", "straight 80 mm",
    )  # fmt: skip
    assert (passage.body, passage.length, passage.start) == (0, 0.033, pytest.approx(0.03))
    assert passage.goals == pytest.approx((0.06 + BEND + 0.0165,))  # wholly in the last segment
    assert (passage.in_cycles, passage.patience, passage.patience_time) == (False, 2, 3.0)
    arms = model.points[passage.outline] - [0.03, 0.0]
    assert np.abs(arms).max(axis=0) == pytest.approx([0.0165, 0.0075])


def test_the_goal_where_the_last_segment_is_short(build):
    short = SCENE.replace("straight: 80 mm", "straight: 20 mm")
    assert build(short).passage.goals == pytest.approx((0.08 + BEND - 0.0165,))


def test_the_goal_where_it_starts_in_the_last_segment(build):
    straight = SCENE.replace(PIPE[PIPE.index("[") :], "[{straight: 80 mm}]}")
    assert build(straight).passage.goals == pytest.approx((0.08 - 0.0165,))


def test_cycles_of_the_pressure_count(build):
    air = "loads: {{air: {{kind: follower_pressure, facets: [block.top], profile: {}}}}}\n"
    cycles = (
        "{kind: cycles, highest: 2 kPa, inflation_rate: 9 kPa/s, deflation_rate: 9 kPa/s, "
        "lowest: 1 kPa}"
    )
    assert build(SCENE + air.format(cycles)).passage.in_cycles
    assert not build(SCENE + air.format("{kind: constant, value: 2 kPa}")).passage.in_cycles


def test_no_question_no_passage(build):
    assert build(SCENE.replace("layout: {}\n", "")).passage is None


@pytest.mark.parametrize(
    ("change", "line", "message"),
    [
        (("layout: {}", "expect: {passes: true}"), 13, "needs a layout"),
        (("layout: {}", "expect: {exit: end}"), 13, "exit needs a layout"),
        ((PIPE, "{kind: plane, point: [0 mm, -99 mm]}"), 10, "needs a wall of kind pipe_path"),
        (("{}", "{path: tube}"), 13, "no wall 'tube' of kind pipe_path"),
        (("{}", "{body: snake}"), 13, "no rigid body 'snake'"),
        (("{}", "{goal: 20 mm}"), 13, "the goal at 20 mm is not between"),
        (("{}", "{goal: 2 m}"), 13, "the goal at 2000 mm is not between"),
        (("{}", "{patience: 0}"), 13, "must be at least 1"),
        ((",\n          outline: {length: 33 mm, height: 15 mm}", ""), 6, "has no outline"),
    ],
)
def test_refused(build, change, line, message):
    with pytest.raises(SceneError, match=message) as caught:
        build(SCENE.replace(*change))
    assert caught.value.exit_code == 2
    assert caught.value.location.line == line


def test_two_pipes_need_a_name(build):
    other = "    other: {kind: pipe_path, diameter: 50 mm, pipe: [{straight: 200 mm}]}\n"
    two = SCENE.replace("layout: {}\n", other + "layout: {}\n")
    with pytest.raises(SceneError, match="there are 2 pipes: pipe, other"):
        build(two)
    assert build(two, "layout.path=other").passage.network.name == "other"


TEE = (
    "[{straight: 60 mm}, {tee: 80 mm, left: up}, {straight: 90 mm}], "
    "branches: {up: [{straight: 90 mm}]}}"
)
BRANCHED = SCENE.replace(PIPE[PIPE.index("[") :], TEE)


def test_each_exit_has_its_goal(build):
    """Where the body lies in the last 90 mm before it: 140 mm along the pipe, 100 + 40 mm to the
    branch, and half its length.
    """
    passage = build(BRANCHED).passage
    assert passage.goals == pytest.approx((0.1565, 0.1565))
    assert passage.items[1] == "tee 80 mm, left up"
    closed = build(BRANCHED.replace("36 mm,", "36 mm, closed: [end],")).passage
    assert closed.goals == (np.inf, pytest.approx(0.1565))
    assert closed.goal_beyond(0) == closed.goals[1]


@pytest.mark.parametrize(
    ("change", "line", "message"),
    [
        (
            ("time:", "expect: {exit: upp}\ntime:"),
            13,
            "no branch leads to the exit 'upp' of 'pipe'",
        ),
        (("center: [30 mm, 0 mm]", "center: [100 mm, 60 mm]"), 6, "starts in the branch 'up'"),
        (("36 mm,", "36 mm, closed: [end, up],"), 10, "no exit is open"),
    ],
)
def test_refused_of_branches(build, change, line, message):
    with pytest.raises(SceneError, match=message) as caught:
        build(BRANCHED.replace(*change))
    assert caught.value.exit_code == 2
    assert caught.value.location.line == line
