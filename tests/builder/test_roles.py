"""Roles that a scene gives to its parts: frame, chamber, rows."""

from pathlib import Path

import numpy as np
import pytest

from softsim.builder import build_model
from softsim.errors import SceneError
from softsim.scene.loading import load_scene

SCENES = Path(__file__).parents[2] / "scenes"

SCENE = """
bodies:
  skin: {mesh: {generator: pfr_section, element_size: 1 mm}, formulation: ring_section,
         sector: 90 deg, rings: skin, thickness: 7 mm, material: dragon_skin_10}
rigid_bodies:
  frame: {mass: 8.5 g, inertia: 1 kg*mm^2, tied: [skin.knots]}
  load: {mass: 1 g, inertia: 1 g*mm^2, center: [0 mm, 50 mm]}
loads:
  low: {kind: follower_pressure, facets: [skin.chamber_bottom],
        profile: {kind: constant, value: 1 kPa}}
  high: {kind: follower_pressure, facets: [skin.chamber_top],
         profile: {kind: constant, value: 2 kPa}}
time: {end: 1 s}
"""


def test_by_default_the_first_of_each(build):
    robot = build(SCENE).robot
    assert (robot.frame, robot.chamber, robot.rows) == (0, "low", {})


def test_what_the_scene_says(build):
    robot = build(
        SCENE,
        "robot={frame: load, chamber: high, rows: ['skin.j?', skin.j4]}",
    ).robot
    assert (robot.frame, robot.chamber) == (1, "high")
    assert list(robot.rows) == [f"skin.j{k}" for k in range(1, 6)]


@pytest.mark.parametrize("name", ["pfr_36mm.yaml", "pfr_36mm_3d.yaml"])
def test_the_rows_of_the_robot_are_its_rings_of_spikes(name):
    """Not their upper and lower halves, which have sets of their own."""
    rows = build_model(load_scene(SCENES / name)).robot.rows
    assert list(rows) == [f"skin.j{k}" for k in range(1, 6)]


@pytest.mark.parametrize(("name", "across"), [("pfr_36mm.yaml", 1), ("pfr_36mm_3d.yaml", 2)])
def test_sides_share_the_nodes_of_all_rows(name, across):
    """To the right is +z of a robot that goes along +x with +y up."""
    model = build_model(load_scene(SCENES / name))
    sides, points = model.robot.sides, model.points
    assert list(sides) == ["bottom", "top", "left", "right"][: 2 * across]
    together = np.concatenate(list(sides.values()))
    assert sorted(together) == sorted(np.concatenate(list(model.robot.rows.values())))
    for k, (low, high) in enumerate((("bottom", "top"), ("left", "right"))[:across], start=1):
        assert points[sides[low], k].max() < -5e-3
        assert points[sides[high], k].min() > 5e-3


@pytest.mark.parametrize(
    "given, said",
    [
        ("frame: skin", "no rigid body 'skin'"),
        ("chamber: frame", "load 'frame' is not a pressure"),
        ("rows: [skin.i*]", "no node set is called 'skin.i\\*'"),
        ("rows: [j1]", "rows"),
    ],
)
def test_what_plays_no_role_is_refused(build, given, said):
    with pytest.raises(SceneError, match=said):
        build(SCENE, f"robot={{{given}}}")


IN_SPACE = """
bodies:
  b: {mesh: {generator: box, length: 2 mm, height: 1 mm, width: 1 mm, element_size: 1 mm},
      formulation: solid, material: dragon_skin_10}
rigid_bodies: {frame: {mass: 1 g, inertia: 1 g*mm^2}}
output: {probes: {top: {kind: displacement, nodes: b.top}, held: {kind: reaction, nodes: b.top}}}
robot: {track: top}
time: {end: 1 s}
"""


def test_a_track_is_that_of_a_probe_in_space(build):
    assert build(IN_SPACE).robot.track == "top"
    assert build(SCENE).robot.track is None


@pytest.mark.parametrize(
    "change, said",
    [
        ("robot.track=held", "robot.track.*no probe 'held' of kind displacement"),
        ("robot.track=tip", "no probe 'tip' of kind displacement"),
        ("rigid_bodies={}", "a track needs a 3D model of a robot with a frame"),
    ],
)
def test_a_track_of_nothing_that_moves_is_refused(build, change, said):
    with pytest.raises(SceneError, match=said):
        build(IN_SPACE, change)


def test_a_section_has_no_track(build):
    probe = "output.probes={equator: {kind: displacement, nodes: skin.knots}}"
    with pytest.raises(SceneError, match="a track needs a 3D model"):
        build(SCENE, probe, "robot.track=equator")
