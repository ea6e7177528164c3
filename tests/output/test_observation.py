"""Probes and poses: what the history says of sets and of rigid bodies."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

BAR = """\
bodies:
  b: {mesh: {generator: box, length: 4 mm, height: 1 mm, width: 1 mm, element_size: 0.5 mm},
      formulation: solid, material: dragon_skin_10, fixed: [left]}
environment: {gravity: 0 m/s^2}
conditions:
  pull: {kind: prescribed, nodes: b.right, direction: x,
         displacement: {kind: ramp, value: 0.4 mm, duration: 10 ms}}
output:
  probes:
    end: {kind: displacement, nodes: b.right}
    root: {kind: reaction, nodes: b.left}
    grip: {kind: reaction, nodes: b.right}
    room: {kind: volume, facets: [b.surface]}
time: {end: 10 ms, procedure: static, settle: 1 s}
"""


@pytest.mark.physics
def test_probes_of_a_pulled_bar(write_scene, tmp_path):
    from softsim.output.history import read_units
    from softsim.run import run

    results = run(write_scene(BAR), out=tmp_path / "out", device="cpu")
    last = results.summary["probes"]
    assert last["end_x"] == pytest.approx(0.4e-3, rel=1e-9)
    # Symmetric about the corners' mean only: the tetrahedra are not, so not to round-off.
    assert abs(last["end_y"]) < 1e-3 * 0.4e-3
    # The root pulls back with what the grip pulls: forces balance to the tolerance of 1e-6.
    assert last["grip_x"] > 0.0
    assert last["root_x"] == pytest.approx(-last["grip_x"], rel=1e-3)
    # A clamped bar of aspect 4 with kappa = 20 mu0: between uniaxial and confined, near E.
    E = 9 * 20 * 72e3 * 72e3 / (3 * 20 * 72e3 + 72e3)
    assert last["grip_x"] == pytest.approx(E * 1e-6 * 0.1 / 1.1, rel=0.1)
    # The body is not a chamber: its surface seen from outside bounds minus its volume.
    assert results.history["room"][0] == pytest.approx(-4e-9, rel=1e-9)
    units = read_units(tmp_path / "out" / "history.csv")
    assert [units[n] for n in ("end_x", "root_z", "room")] == ["m", "N", "m^3"]
    assert all(np.isfinite(column).all() for column in results.history.values())


LYING = """\
bodies:
  b: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10}
environment: {walls: {floor: {kind: plane, point: [0 mm, 0 mm], normal: [0, 1]}}}
time: {end: 10 ms}
"""


ROWS = "robot: {rows: [b.top, b.bottom]}\n"


@pytest.mark.physics
def test_walls_press_on_the_rows_and_sides_that_touch(write_scene, tmp_path):
    from softsim.run import run

    history = run(write_scene(LYING + ROWS), out=tmp_path, device="cpu").history
    floor = history["wall_force_normal"]
    assert floor.max() > 0.0
    for pressed in ("row_force_b.bottom", "side_force_bottom"):
        np.testing.assert_allclose(history[pressed], floor, rtol=1e-12)
    for free in ("row_force_b.top", "side_force_top"):
        assert not history[free].any()
    np.testing.assert_array_equal(history["rows_in_contact"], floor > 0.0)


FRAME = "rigid_bodies: {r: {mass: 1 g, inertia: 1 kg*mm^2}}\n"
AIR = """\
loads: {air: {kind: follower_pressure, facets: [b.top], profile: {kind: constant, value: 1 kPa}}}
"""
TWO_CHAMBERS = """\
loads:
  rear: {kind: follower_pressure, facets: [b.top], profile: {kind: constant, value: 1 kPa}}
  front: {kind: follower_pressure, facets: [b.bottom], profile: {kind: constant, value: -2 kPa}}
robot: {chamber: front}
"""
OF_FRAME = {"frame_x", "frame_y", "frame_z", "frame_angle"} | {
    f"frame_rotation_{axis}" for axis in "xyz"
}


@pytest.mark.parametrize(
    ("added", "expected"),
    [
        ("", set()),
        (FRAME, OF_FRAME),
        (AIR, {"pressure", "section_pressure"}),
        (FRAME + AIR, OF_FRAME | {"pressure", "section_pressure"}),
        (TWO_CHAMBERS, {"pressure", "section_pressure", "pressure_rear", "pressure_front"}),
    ],
)
def test_columns_of_what_there_is(build, added, expected):
    """A robot without a chamber has no pressure, a body without a frame has no place of one."""
    from softsim.output.observation import columns

    found = set(columns(build(BAR + added)))
    assert {name for name in found if name.startswith(("frame", "pressure", "section"))} == expected


@pytest.mark.physics
def test_each_of_several_chambers_has_its_pressure(write_scene, tmp_path):
    from softsim.run import run

    history = run(write_scene(LYING + TWO_CHAMBERS), out=tmp_path / "out", device="cpu").history
    np.testing.assert_allclose(history["pressure_rear"], 1e3, rtol=1e-12)
    np.testing.assert_allclose(history["pressure_front"], -2e3, rtol=1e-12)
    np.testing.assert_array_equal(history["pressure"], history["pressure_front"])


SPINNING = """\
bodies:
  b: {mesh: {generator: box, length: 1 mm, height: 1 mm, width: 1 mm, element_size: 1 mm},
      formulation: solid, material: dragon_skin_10}
rigid_bodies:
  r: {mass: 1 g, inertia: 1 kg*mm^2, center: [1 m, 0 m, 0.5 m], initial_angular_velocity: 300 rad/s,
      initial_velocity: [0 m/s, 2 m/s, 1 m/s]}
environment: {gravity: 0 m/s^2}
time: {end: 1 s}
"""


def test_the_pose_of_a_spinning_body(build, start):
    """omega t about z; the angle goes on beyond half a turn, the rotation vector too."""
    from softsim.output.observation import frame_readings

    solver = start(build(SPINNING))
    while solver.time < 13e-3:
        solver.advance(50)
    pose = solver.scenario(0).pose(0)
    turned = 300.0 * solver.time
    assert np.pi < turned < 2.0 * np.pi
    assert pose.angle == pytest.approx(turned, rel=1e-9)
    expected = [1.0, 2.0 * solver.time, 0.5 + solver.time]
    np.testing.assert_allclose(pose.centre, expected, rtol=1e-9)
    readings = frame_readings(pose)
    assert readings["frame_rotation_z"] == pytest.approx(turned, rel=1e-9)
    assert readings["frame_rotation_x"] == readings["frame_rotation_y"] == 0.0


def test_the_rotation_of_nodes_is_that_of_a_rigid_motion_beside_a_stretch():
    from softsim.output.observation import mean_rotation

    rest = np.random.default_rng(1).normal(size=(20, 3))
    rest -= rest.mean(axis=0)
    rest = np.concatenate([rest, -rest])
    vector = np.array([0.4, -0.9, 0.3])
    turn = Rotation.from_rotvec(vector).as_matrix()
    moved = rest @ (turn * [1.2, 1.2, 1.2]).T + [1.0, 2.0, 3.0]
    np.testing.assert_allclose(mean_rotation(rest, moved), vector, rtol=1e-12)
    angle = np.radians(170.0)
    in_plane = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = 1.2 * rest[:, :2] @ in_plane.T - [5.0, 0.0]
    np.testing.assert_allclose(mean_rotation(rest[:, :2], moved), [angle], rtol=1e-12)


def test_the_rotation_of_a_strip_under_shear_is_half_of_the_angle():
    """For a small shear gamma of a square: rotation gamma / 2."""
    from softsim.output.observation import mean_rotation

    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    sheared = square + 1e-6 * np.column_stack([-square[:, 1], np.zeros(4)])
    assert mean_rotation(square, sheared)[0] == pytest.approx(0.5e-6, rel=1e-6)


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_rotation_of_places_that_are_not_finite_is_not_a_number(dimension):
    from softsim.output.observation import mean_rotation

    rest = np.random.default_rng(1).normal(size=(5, dimension))
    for bad in (np.nan, np.inf):
        now = rest.copy()
        now[2, 1] = bad
        assert np.isnan(mean_rotation(rest, now)).all()
