"""What the overrides of the scripts make of a scene."""

import pytest

from softsim.loads.profile import built_profile
from softsim.robots.pfr import pfr_section
from softsim.scene.loading import load_scene
from validation import prototypes
from validation.air import natural_deflation
from validation.cases import SCENES
from validation.propulsion_force import HIGHESTS, LOOK, case
from validation.slope import upwards


def profile_of(scene):
    return built_profile(scene.loads["air"].profile, scene.time.end)


@pytest.mark.parametrize("highest", HIGHESTS)
def test_the_frame_of_the_contact_rows_lies_at_the_highest_pressure(highest):
    scene = case(41, 64, highest).loaded.scene
    assert scene.output.frame_interval == LOOK
    assert profile_of(scene).at(LOOK) == pytest.approx(1e3 * highest)
    assert scene.environment.walls["pipe"].axis_height == pytest.approx(6.95e-3)  # it lies below
    assert scene.loads["gauge"].direction[0] < 0.0  # held back: it pulls forward


@pytest.mark.parametrize(
    ("overrides", "highest", "lowest"),
    [
        (natural_deflation(1.5, 9.0, 1, 26.0), 26e3, 9e3),
        (upwards(41, 60, 12.5), 23e3, 12.5e3),
    ],
)
def test_a_run_ends_with_its_cycle(overrides, highest, lowest):
    """Not before the end of the fall, and within 1 ms of it."""
    scene = load_scene(SCENES / "pfr_41mm.yaml", overrides).scene
    profile = profile_of(scene)
    assert 0.0 <= scene.time.end - profile.times[-1] < 1e-3
    assert profile.values.max() == pytest.approx(highest)
    assert profile.values[-1] == pytest.approx(lowest)


def test_a_climbing_robot_does_not_settle_since_nothing_holds_it():
    assert load_scene(SCENES / "pfr_41mm.yaml", upwards(41, 60, 12.5)).scene.time.settle is None


def test_a_climbing_robot_may_fall_no_further_than_its_line():
    line = load_scene(SCENES / "pfr_41mm.yaml", upwards(41, 60, 12.5)).scene.loads["line"]
    assert line.direction[0] > 0.0 and line.slack == pytest.approx(0.2)


def test_a_climbing_section_carries_half_of_the_weight_along_the_axis():
    loads = load_scene(SCENES / "pfr_41mm.yaml", upwards(41, 30, 12.5)).scene.loads
    assert loads["relief"].share == 0.5


def test_prototypes_differ_as_table_3_2_says():
    """Thickness as the number around; frame as the body's volume; a mesh that can be made."""
    bodies = {
        design.name: prototypes.case(36, design).loaded.scene for design in prototypes.DESIGNS
    }
    first, second, third = bodies.values()
    thickness = second.bodies["skin"].thickness
    assert first.bodies["skin"].thickness == pytest.approx(thickness * 10 / 14)
    assert third.bodies["skin"].thickness == pytest.approx(thickness * 18 / 14)
    mass = second.rigid_bodies["frame"].mass
    assert first.rigid_bodies["frame"].mass == pytest.approx(mass)
    assert third.rigid_bodies["frame"].mass == pytest.approx(mass * (21 / 17) ** 2, rel=1e-5)
    for scene, rows, widest in ((first, 3, 27e-3), (second, 5, 27e-3), (third, 5, 31e-3)):
        given = scene.bodies["skin"].mesh.model_dump(exclude={"generator"})
        mesh = pfr_section(**given)
        assert f"j{rows}" in mesh.node_sets and f"j{rows + 1}" not in mesh.node_sets
        assert mesh.points[:, 1].max() == pytest.approx(widest / 2)  # OD_S
