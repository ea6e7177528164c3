"""Standard robots that ship with softsim, and layouts that are given one."""

from pathlib import Path

import numpy as np
import pytest

from softsim.builder import build_model
from softsim.errors import SceneError
from softsim.loads.tether import Tether
from softsim.scene.loading import LIBRARY, load_layout, load_scene, part_names, robot_names

PIPE = """\
environment: {walls: {pipe: {kind: pipe, diameter: 36 mm}}}
"""


def test_names():
    leafbots = {"leafbot3", "leafbot5", "leafbot9", "leafbot_x5"}
    assert {"pfr", "pfr_solid", *leafbots} == set(robot_names())
    assert {"robot:pfr", "robot:pfr/section", "robot:pfr/motor"} <= set(part_names())
    assert not set(robot_names()) & {"section", "motor"}


def test_a_part_is_included_by_its_name(write_scene):
    scene = write_scene("include: [robot:pfr/section, robot:pfr/motor]\ntime: {end: 1 s}\n")
    loaded = load_scene(scene, ["loads.motor.frequency=64 Hz"])
    assert loaded.scene.loads["motor"].frequency == 64.0
    error = loaded.error(("rigid_bodies", "frame", "mass"), "too heavy")
    assert error.location.file == LIBRARY / "pfr" / "section.yaml"


@pytest.mark.parametrize("scene", ["pfr_36mm.yaml", "pfr_36mm_3d.yaml"])
def test_the_tether_goes_with_section_and_space(write_scene, scene):
    """The shipped scenes are copied, because an include lies below the scene that names it."""
    shipped = (Path(__file__).parents[2] / "scenes" / scene).read_text(encoding="utf-8")
    write_scene(shipped, "robot.yaml")
    tethered = write_scene("include: [robot.yaml, robot:pfr/tether]\n")
    model = build_model(load_scene(tethered, []))
    (tether,) = model.of_kind(Tether)
    assert tether.drag == 10e-3
    assert np.linalg.norm(tether.carried_mass * model.gravity) == pytest.approx(3.4e-3)


@pytest.mark.parametrize("scene", ["pfr_36mm.yaml", "pfr_36mm_3d.yaml"])
def test_the_cable_is_clamped_in_the_frame_of_section_and_space(write_scene, scene):
    shipped = (Path(__file__).parents[2] / "scenes" / scene).read_text(encoding="utf-8")
    write_scene(shipped, "robot.yaml")
    model = build_model(load_scene(write_scene("include: [robot.yaml, robot:pfr/cable]\n"), []))
    (cable,), (frame,) = model.structures, model.rigid_bodies
    held = np.intersect1d(frame.tied, cable.nodes)
    np.testing.assert_array_equal(held, cable.nodes[:2])
    assert model.points[held[1], 0] == pytest.approx(-16.5e-3)  # the rear of the outline
    assert model.mass[cable.nodes].sum() == pytest.approx(205e-3 * 3e-3)


@pytest.mark.parametrize("name", ["robot:snake", "robot:pfr/", "robot:../scene/library/pfr"])
def test_an_unknown_part(write_scene, name):
    with pytest.raises(SceneError, match=r"there is no .* to include") as caught:
        load_scene(write_scene(f"title: t\ninclude: [{name}]\ntime: {{end: 1 s}}\n"))
    assert caught.value.location.line == 2
    assert "robot:pfr" in caught.value.hint


@pytest.mark.parametrize("robot", robot_names())
def test_every_robot_is_whole(write_scene, robot):
    loaded = load_layout(write_scene(PIPE), robot, [])
    assert loaded.scene.rigid_bodies
    assert loaded.scene.layout is not None
    assert loaded.scene.expect.passes is True


def test_the_layout_wins_and_the_command_line_over_it(write_scene):
    layout = write_scene(
        PIPE + "time: {end: 7 s}\nlayout: {patience: 3}\n"
        "contact: {friction_coefficient: 0.3}\nexpect: {passes: false}\n"
    )
    scene = load_layout(layout, "pfr", ["layout.patience=4"]).scene
    assert (scene.time.end, scene.contact.friction_coefficient) == (7.0, 0.3)
    assert (scene.layout.patience, scene.expect.passes) == (4, False)


def test_an_unknown_robot(write_scene):
    with pytest.raises(SceneError, match="there is no robot 'snake'") as caught:
        load_layout(write_scene(PIPE), "snake", [])
    assert "pfr" in caught.value.hint
    assert caught.value.exit_code == 2


def test_a_mistake_in_a_layout_has_its_line(write_scene):
    with pytest.raises(SceneError, match="diametre") as caught:
        load_layout(write_scene(PIPE.replace("diameter", "diametre")), "pfr", [])
    assert caught.value.location.line == 1


LAYOUTS = sorted((Path(__file__).parents[2] / "scenes" / "layouts").glob("*.yaml"))


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda path: path.stem)
def test_every_layout_takes_every_robot_for_pipes(layout):
    for robot in ("pfr", "pfr_solid"):
        model = build_model(load_layout(layout, robot, []))
        assert model.passage is not None
        assert model.passage.in_cycles


@pytest.mark.parametrize(
    ("robot", "page", "numbers"),
    [
        ("pfr", "README.md", ["12 of 12 claims", "1 of 5"]),
        ("pfr_solid", "docs/validation/index.md", ["22", "11 agree"]),
    ],
)
def test_what_a_robot_says_of_its_validation_is_what_the_documentation_says(robot, page, numbers):
    layout = Path(__file__).parents[2] / "scenes" / "layouts" / "elbow_90_36mm.yaml"
    loaded = load_layout(layout, robot, [])
    [said] = [text for text in loaded.scene.robot.assumptions if text.startswith("validation")]
    documented = (Path(__file__).parents[2] / page).read_text(encoding="utf-8")
    for number in numbers:
        assert number in documented
        assert all(word in said for word in number.split())
