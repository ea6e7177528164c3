"""A pressure that follows events: what a scene says of it, and what it is refused for."""

import pytest

from softsim.errors import SceneError
from softsim.loads.pressure_control import ControlledPressure

SCENE = """\
bodies:
  b: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10, fixed: [bottom]}
rigid_bodies: {frame: {mass: 8 g, inertia: 1 kg*mm^2}}
loads:
  air:
    kind: follower_pressure
    facets: [b.top]
    profile:
      kind: event_cycles
      highest: 9 kPa
      lowest: 1 kPa
      inflation_rate: 4 kPa/s
      deflation_rate: 2 kPa/s
      contact_force: 0.5 N
      contact_rows: 0
      least_rows: 0
time: {end: 1 s}
"""
SECOND = (
    "  later: {kind: follower_pressure, facets: [b.left],\n"
    "          profile: {kind: constant, value: 1 kPa}}\n"
)


def test_what_the_scene_says(build):
    load = build(SCENE, "loads.air.profile.hold=0.3 s", "loads.air.profile.count=3").pressures[0]
    settings = load.source.settings
    assert isinstance(load.source, ControlledPressure)
    assert (settings.highest, settings.lowest, settings.start) == (9e3, 1e3, 0.0)
    assert (settings.inflation_rate, settings.deflation_rate) == (4e3, 2e3)
    assert (settings.contact_rows, settings.least_rows, settings.contact_force) == (0, 0, 0.5)
    assert (settings.motion_speed, settings.motion_window) == (20e-3, 0.2)
    assert (settings.contact_window, settings.hold, settings.count) == (20e-3, 0.3, 3)
    assert build(SCENE).pressures[0].source.settings.count is None


def test_other_chambers_may_follow(build):
    model = build(SCENE.replace("time:", SECOND + "time:"))
    assert isinstance(model.pressures[0].source, ControlledPressure)
    assert len(model.pressures) == 2


@pytest.mark.parametrize(
    ("old", "new", "place", "message"),
    [
        ("lowest: 1 kPa", "lowest: 9 kPa", ":12:15", "lowest: must be below highest"),
        ("count", "      count: 0\n", ":18:14", "count: 0 must be at least 1"),
        ("contact_force: 0.5 N", "contact_force: 0 N", ":15:22", "greater than 0 N"),
        ("      contact_force: 0.5 N\n", "", ":9:5", "the key 'contact_force' is missing"),
        ("least_rows: 0", "least_rows: 2", ":17:19", "must not be above contact_rows, 0"),
        ("count", "      motion_window: 4 s\n", ":18:22", "a deflation, which takes 4 s at most"),
        ("count", "      contact_window: 2 s\n", ":18:23", "an inflation, which takes 2 s"),
        ("count", "      motion_window: 7 ms\n", ":18:22", "too few rows to compute a speed"),
        ("count", "    on_skin: [[0 Pa, 0 Pa], [2 Pa, 1 Pa]]\n", ":18:14", "on_skin: does not go"),
        ("count", "    factor: 0.5\n", ":18:13", "factor: does not go with event_cycles"),
        ("count", "    offset: 1 kPa\n", ":18:13", "offset: does not go with event_cycles"),
        ("contact_rows: 0", "contact_rows: 5", ":16:21", "robot.rows names 0"),
        ("rigid_bodies: {frame: {mass: 8 g, inertia: 1 kg*mm^2}}", "", ":10:7", "is no frame"),
        ("end: 1 s", "end: 1 s, procedure: static", ":10:7", "a static procedure has none"),
    ],
)  # fmt: skip
def test_refusals_say_where(build, old, new, place, message):
    """Each with the line and column of the value, or of the key where a value is missing."""
    text = SCENE.replace("time:", new + "time:") if old == "count" else SCENE.replace(old, new)
    with pytest.raises(SceneError) as caught:
        build(text)
    assert message in str(caught.value)
    assert str(caught.value.location).endswith(place)
    assert caught.value.hint


def test_it_drives_the_chamber_of_the_robot(build):
    """The history shows one pressure, by default that of the first."""
    text = SCENE.replace("  air:\n", SECOND + "  air:\n")
    with pytest.raises(SceneError, match="the chamber of the robot, which is 'later'"):
        build(text)
    assert build(text, "robot.chamber=air").robot.chamber == "air"


def test_a_factor_that_changes_nothing_is_none(build):
    build(SCENE.replace("time:", "    factor: 1\n    offset: 0 kPa\n    on_skin: []\ntime:"))
