"""Pipes along a path in a scene: the path that is built, and what bad input gets."""

import numpy as np
import pytest

from softsim.builder import build_model
from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.pipe_path import PipePath
from softsim.errors import SceneError
from softsim.scene.loading import load_scene

SECTION = """\
bodies:
  cube: {mesh: {generator: block, length: 10 mm, height: 6 mm, element_size: 5 mm},
         formulation: plane_strain, thickness: 10 mm, material: dragon_skin_10,
         position: [5 mm, -3 mm]}
time: {end: 1 s}
"""
SPACE = SECTION.replace("height: 6 mm,", "height: 6 mm, width: 6 mm,").replace(
    "block", "box").replace("plane_strain, thickness: 10 mm", "solid").replace(
    "-3 mm]", "-3 mm, -3 mm]")  # fmt: skip
HALF = SECTION.replace("plane_strain, thickness: 10 mm", "axisymmetric").replace("-3 mm", "0 mm")
WALL = """\
environment:
  walls:
    pipe:
      kind: pipe_path
      diameter: 36 mm
      closed: [start]
      pipe:
"""
ITEMS = """\
        - {straight: 120 mm}
        - {bend: 90 deg, radius: 60 mm}
        - {bend: -90 deg, radius: 60 mm}
        - {taper: 30 mm, to: 41 mm}
        - {step: 30 mm}
        - {straight: 100 mm, diameter: 30 mm}
"""
TURNED = ITEMS + "        - {bend: 90 deg, radius: 60 mm, turned: 90 deg}\n"


def built_path(path) -> PipePath:
    (wall,) = build_model(load_scene(path)).walls
    assert isinstance(wall, PipeNetwork)
    return wall.branches[0].path


def test_as_users_write_it(write_scene):
    """In a section: left, right, wider, narrower; at 120 + 2 60 mm, 120 mm up, then on."""
    path = built_path(write_scene(SECTION + WALL + ITEMS))
    kinds = ["straight", "bend", "bend", "taper", "straight"]
    assert [s.kind for s in path.segments] == kinds
    end = path.joints[-1]
    np.testing.assert_allclose(end.point, [0.370, 0.120], atol=1e-15)
    np.testing.assert_allclose(end.tangent, [1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(path.segments[-1].radii, 15e-3)
    assert path.closed == (True, False)


def test_in_space(write_scene):
    """The last bend leads up, along z."""
    path = built_path(write_scene(SPACE + WALL + TURNED))
    end = path.joints[-1]
    np.testing.assert_allclose(end.point, [0.430, 0.120, 0.060], atol=1e-15)
    np.testing.assert_allclose(end.tangent, [0.0, 0.0, 1.0], atol=1e-15)


def refused_with(message, hint, pointed_at, text, write_scene):
    with pytest.raises(SceneError) as caught:
        build_model(load_scene(write_scene(text)))
    error = caught.value
    assert message in error.message and hint in error.hint, (error.message, error.hint)
    place = error.location
    assert place.text[place.column - 1 :].startswith(pointed_at), (place.text, place.column)


@pytest.mark.parametrize(
    ("old", "new", "pointed_at", "message", "hint"),
    [
        ("radius: 60 mm}", "radius: 18 mm}", "18 mm}", "too tight for a pipe 36 mm wide",
         "greater than 18 mm"),
        ("{bend: 90 deg", "{bend: 360 deg", "360 deg", "less than 360 deg", ""),
        ("{bend: 90 deg", "{bend: 0 deg", "0 deg", "must not be 0", ""),
        ("60 mm}", "60 mm, turned: 90 deg}", "90 deg}", "out of the plane of a 2D model",
         "bend: -90 deg"),
        ("100 mm, diameter: 30 mm", "100 mm, diameter: 41 mm", "41 mm}",
         "30 mm wide at the start of this item, not 41 mm", "add a taper or a step before it"),
        ("{straight: 120 mm}", "{straight: 120 mm, diameter: 30 mm}", "30 mm}",
         "36 mm wide at the start of this item, not 30 mm", "add a taper or a step before it"),
        ("{straight: 120 mm}", "{step: 120 mm}", "{step", "cannot start with a step", "diameter"),
        ("        - {straight: 100 mm, diameter: 30 mm}\n", "", "{step", "cannot be the last", ""),
        ("{bend: -90 deg, radius: 60 mm}", "{bend: 300 deg, radius: 60 mm}", "{",
         "the pipe crosses itself: pipe[2], bend, meets pipe[0], straight, of ", "turned"),
        ("{straight: 120 mm}", "{straight: 6e7 mm}", "6e7 mm}", "6e+07 mm in a pipe that "
         "starts 36 mm wide: the sizes differ by more than a factor of 100000", "check the units"),
        ("to: 41 mm}", "to: 2e10 mm}", "2e10 mm}", "2e+10 mm in a pipe", "check the units"),
        ("diameter: 36 mm", "diameter: 3e-14 mm", "120 mm}", "starts 3e-14 mm wide", "diameter"),
        ("diameter: 36 mm", "diameter: 5 mm", "{straight", "pipe[0] of 'pipe', straight, starts",
         "at least 6 mm wide"),
        ("diameter: 36 mm", "diameter: 36 mm\n      start: [8 mm, 0 mm]", "[start]",
         "beyond the closed start of 'pipe'", "leave the start of the pipe open"),
        ("{straight: 120 mm}", "{strait: 120 mm}", "{strait", "pipe[0]: does not state its kind",
         "did you mean 'straight'?"),
        ("{straight: 120 mm}", "{length: 120 mm}", "{length", "pipe[0]: does not state its kind",
         "start with one of straight, bend, taper, step"),
        ("{straight: 120 mm}", "{straight: 120 mm, radius: 2 mm}", "radius",
         "unknown key 'radius' in pipe[0]", ""),
        ("{taper: 30 mm, to: 41 mm}", "{taper: 30 mm}", "{taper",
         "pipe[3]: the key 'to' is missing", "Diameter at the end"),
        ("[start]", "[strat]", "strat]", "'strat' is not one of: start, end", ""),
    ],
)  # fmt: skip
def test_each_refusal_points_at_its_item(old, new, pointed_at, message, hint, write_scene):
    """With what would be right."""
    text = SECTION + WALL + ITEMS
    assert old in text
    refused_with(message, hint, pointed_at, text.replace(old, new, 1), write_scene)


def test_no_item(write_scene):
    text = SECTION + WALL.removesuffix("\n") + " []\n"
    refused_with("at least 1", "", "[]", text, write_scene)


def test_refused_in_a_half_section(write_scene):
    text = HALF + WALL + ITEMS
    refused_with("a pipe_path is not possible", "kind: pipe", "pipe_path", text, write_scene)


def test_a_bend_that_is_too_narrow_for_what_starts_in_it(write_scene):
    """The segment where the body overlaps is named, and how wide it would have to be there: the
    corner of the block farthest out, at (10, -3) mm, is hypot(10, 63) - 60 mm off the centre line.
    """
    text = SECTION + WALL.replace("36 mm", "5 mm") + "        - {bend: 90 deg, radius: 60 mm}\n"
    enough = np.ceil(2e3 * (np.hypot(10.0, 63.0) - 60.0)) / 1e3
    refused_with("pipe[0] of 'pipe', bend", f"at least {enough:g} mm", "{bend", text, write_scene)


def test_a_body_before_an_open_end_is_free(write_scene):
    text = SECTION.replace("[5 mm, -3 mm]", "[-100 mm, 50 mm]") + WALL + ITEMS
    path = built_path(write_scene(text.replace("closed: [start]", "closed: [end]")))
    assert path.gap(np.array([[-0.1, 0.05]]))[0] > 0.05


@pytest.mark.parametrize(
    ("inclination", "roll", "expected"),
    [
        (0, 0, [0.0, -1.0, 0.0]),
        (0, 90, [0.0, 0.0, 1.0]),
        (90, 40, [-1.0, 0.0, 0.0]),
        (30, -90, [-0.5, 0.0, -np.sqrt(0.75)]),
        (0, 180, [0.0, 1.0, 0.0]),
    ],
)
def test_weight_of_a_rolled_scene(inclination, roll, expected, build):
    """In space the whole vector, in a section what lies in its plane."""
    options = [f"environment.inclination={inclination} deg", f"environment.roll={roll} deg"]
    for text, d in ((SPACE, 3), (SECTION, 2)):
        found = build(text, *options).gravity
        np.testing.assert_allclose(found, 9.81 * np.array(expected[:d]), atol=1e-14)


TEE = """\
environment:
  walls:
    pipe:
      kind: pipe_path
      diameter: 36 mm
      pipe:
        - {straight: 60 mm}
        - {tee: 80 mm, left: up}
        - {straight: 60 mm}
      branches:
        up: [{straight: 20 mm}, {tee: 90 mm, left: west, right: east, to: 40 mm}]
        west: [{straight: 20 mm}]
        east: [{straight: 20 mm}]
"""


@pytest.mark.parametrize("text", [SECTION, SPACE])
def test_branches(text, write_scene):
    """Exits are named by branches; the second tee's pipes are 40 mm wide, 180 mm from the start."""
    (wall,) = build_model(load_scene(write_scene(text + TEE))).walls
    assert list(wall.exits) == ["end", "west", "east"]
    west = wall.branches[wall.exits["west"]].path
    np.testing.assert_allclose(west.segments[0].radii, 20e-3)
    np.testing.assert_allclose(west.segments[0].point[:2], [0.1, 0.105], atol=1e-15)
    assert west.segments[0].start == pytest.approx(0.205)
    assert [j.fillet for j in wall.junctions] == [2e-3, 2e-3]


@pytest.mark.parametrize(
    ("old", "new", "pointed_at", "message", "hint"),
    [
        ("left: west, ", "", "[{straight", "the pipes are not connected: no path leads from the "
         "start to the exit 'west'", "add a tee or cross that leads there"),
        ("left: up", "left: upp", "upp", "there is no branch 'upp'", "did you mean 'up'?"),
        ("right: east", "right: west", "west", "the branch 'west' already leaves from up[1]",
         "its own branch"),
        ("left: west", "left: up", "up", "'up' already leaves from pipe[1]", "its own branch"),
        ("{tee: 80 mm, left: up}", "{tee: 80 mm}", "{tee", "a tee leads to a branch", ""),
        ("{tee: 80 mm, left: up}", "{cross: 80 mm, left: up}", "{cross", "'right' is missing", ""),
        ("to: 40 mm}]", "to: 40 mm}, {straight: 9 mm}]", "{straight: 9", "no pipe leads to this",
         "write cross instead of tee"),
        ("to: 40 mm", "to: 30 mm", "30 mm", "36 mm wide does not fit a pipe 30 mm wide",
         "at least 36 mm"),
        ("80 mm, left: up", "80 mm, left: up, to: 40 mm", "40 mm", "40 mm wide does not fit",
         "at most 36 mm"),
        ("80 mm, left: up", "79 mm, left: up", "{tee", "pipe[1] is 79 mm long: too short",
         "at least 80 mm long"),
        ("80 mm, left: up", "80 mm, left: up, fillet: 0 mm", "0 mm", "", ""),
        ("80 mm, left: up", "80 mm, left: up, turned: 90 deg", "90 deg", "out of the plane", ""),
        ("diameter: 36 mm", "diameter: 36 mm\n      closed: [upp]", "upp",
         "'upp' is not one of: start, end, west, east", "ends: start, end, west, east"),
        ("diameter: 36 mm", "diameter: 5 mm", "{straight", "starts", "at least 6 mm wide"),
        ("20 mm}, {tee", "20 mm}, {bend: 270 deg, radius: 40 mm}, {straight: 90 mm}, {tee",
         "", "crosses itself", "turned bends"),
    ],
)  # fmt: skip
def test_each_refusal_of_branches(old, new, pointed_at, message, hint, write_scene):
    text = SECTION + TEE
    assert old in text
    refused_with(message, hint, pointed_at, text.replace(old, new, 1), write_scene)
