"""Warnings before a run: units that are off by a thousand, paces that no increment shows."""

from pathlib import Path

import numpy as np
import pytest

from softsim.builder import build_model
from softsim.errors import SceneError
from softsim.loads.profile import Profile
from softsim.scene.loading import load_scene
from softsim.scene.outputs import Output
from softsim.solver.plausibility import output_warnings, plausibility_warnings, shortest_swing

SCENES = Path(__file__).parents[2] / "scenes"
SCENE = """\
bodies:
  b: {mesh: {generator: block, length: 20 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: m, fixed: [right]}
materials:
  m: {law: yeoh, C10: 30 kPa, C20: 3 kPa, density: 1 g/cm^3}
rigid_bodies: {r: {mass: 1 g, inertia: 1 g*mm^2}}
loads:
  air: {kind: follower_pressure, facets: [b.surface],
        profile: {kind: constant, value: 5 kPa}}
  motor: {kind: eccentric_mass, acts_on: r, eccentric_mass: 0.1 g, radius: 1 mm,
          frequency: 200 Hz, rotation_axis: z}
time: {end: 1 s}
"""


@pytest.mark.parametrize(
    "override, kind, told",
    [
        ("bodies.b.mesh.length=20 m", "size of b", "measures 2e+04 x 2 mm"),
        ("bodies.b.thickness=20 m", "depth of b", "the section of body 'b' is 2e+04 mm thick"),
        ("materials.m.C10=30 mPa", "stiffness of m", "shear modulus of 0.06 Pa"),
        ("materials.m.density=1000 g/cm^3", "density of m", "1e+06 kg/m^3"),
        ("materials.m.C20=-8 kPa", "stability of m", "uniaxial tension at a stretch of"),
        ("loads.air.profile.value=50 MPa", "pressure of air", "reaches 5e+04 kPa"),
        ("loads.air.profile.value=-150 kPa", "pressure of air", "falls to -150 kPa, below vacuum"),
        ("loads.motor.frequency=20 kHz", "motor 0", "increments per turn"),
        ("time.end=1000000000 s", "length", "days at 50 million"),
    ],
)
def test_what_is_hardly_meant_is_told(build, override, kind, told):
    overrides = [override]
    if override.startswith("bodies"):
        overrides.append("bodies.b.mesh.element_size=1 m")
    found = plausibility_warnings(build(SCENE, *overrides))
    assert told in found[kind]


def test_what_is_meant_is_not_doubted(build):
    assert plausibility_warnings(build(SCENE)) == {}


@pytest.mark.parametrize("name", ["first_look", "pfr_36mm", "pfr_free_inflation"])
def test_no_shipped_scene_is_doubted(name):
    assert plausibility_warnings(build_model(load_scene(SCENES / f"{name}.yaml"))) == {}


@pytest.mark.physics
@pytest.mark.parametrize("path", sorted(SCENES.glob("*.yaml")), ids=lambda path: path.stem)
def test_no_scene_at_all_is_doubted(path):
    """The literal section of the thesis is meant to be as thin as it says."""
    known = {"pfr_36mm_literal": ["depth of skin"]}
    assert list(plausibility_warnings(build_model(load_scene(path)))) == known.get(path.stem, [])


def test_a_motion_faster_than_its_increments(build):
    moved = """
conditions:
  shake: {kind: prescribed, nodes: b.left, direction: x,
          displacement: {kind: table, points: [[0 s, 0 mm], [20 us, 1 mm], [40 us, 0 mm],
                                               [60 us, 1 mm]]}}
"""
    found = plausibility_warnings(build(SCENE + moved))
    assert list(found) == ["motion 0"] and "reverses within 20 us" in found["motion 0"]


def test_swings_of_a_profile():
    """Rests are no turns; the last point is none either."""
    times = np.array([0.0, 1.0, 3.0, 4.0, 8.0, 9.0])
    assert shortest_swing(Profile(times, np.array([0.0, 2.0, 2.0, 1.0, 5.0, 4.0]))) == 1.0
    assert shortest_swing(Profile(times, np.arange(6.0))) == np.inf


LINE = """
bodies: {b: {mesh: {generator: pfr_meridian}, formulation: axisymmetric, material: dragon_skin_10,
             fixed: [ends]}}
loads:
  air: {kind: pneumatic, facets: [b.chamber], pump: {flow: 10 ml/s, stall: 50 kPa},
        valve: {flow: 30 ml/s, pressure: 20 kPa}, tube: {length: 2 m, bore: 1.2 mm},
        line_volume: 2 ml, profile: {kind: table, points: [[0 s, 20 kPa], [1 s, 10 kPa]]}}
time: {end: 1 s}
"""


@pytest.mark.parametrize(
    ("before", "after", "kind", "told"),
    [
        ("10 ml/s", "50 ml/s", "flow of air", "at 50 ml/s the flow in the tube has a Reynolds"),
        ("1.2 mm", "0.6 mm", "pump of air", "at 20 kPa the tube passes 1.93 ml/s into an empty"),
        ("30 ml/s", "0.3 ml/s", "valve of air", "a fall of 10 kPa/s needs"),
    ],
)
def test_air_lines_that_do_not_follow_are_told(build, before, after, kind, told):
    found = plausibility_warnings(build(LINE.replace(before, after)))
    assert list(found) == [kind]
    assert told in found[kind]


def test_an_air_line_that_follows_is_not_doubted(build):
    assert plausibility_warnings(build(LINE)) == {}


def test_a_coarse_side_tied_to_a_finer_one(build):
    scene = """
bodies:
  lower: {mesh: {generator: block, length: 8 mm, height: 4 mm, element_size: 2 mm},
          formulation: plane_strain, thickness: 3 mm, material: dragon_skin_10}
  upper: {mesh: {generator: block, length: 8 mm, height: 4 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 3 mm, material: dragon_skin_10,
          position: [0 mm, 4 mm], fixed: [top]}
time: {end: 1 s}
ties: {glue: {nodes: FINER, facets: COARSER}}
"""
    sides = {"FINER": "upper.bottom", "COARSER": "lower.top"}
    right, wrong = scene, scene
    for side, other in zip(sides, reversed(sides), strict=True):
        right, wrong = right.replace(side, sides[side]), wrong.replace(side, sides[other])
    assert plausibility_warnings(build(right)) == {}
    apart = right.replace("[0 mm, 4 mm]", "[0 mm, 5 mm]")
    apart = apart.replace("lower.top}", "lower.top, tolerance: 2 mm}")
    assert (
        "up to 1 mm, 100 % of the size of their"
        in plausibility_warnings(build(apart))["shifts of ties"]
    )
    assert "exchange nodes and facets" in plausibility_warnings(build(wrong))["sides of ties"]


TWO = """
bodies:
  a: {mesh: {generator: block, length: 10 mm, height: 6 mm, element_size: 2 mm},
      formulation: plane_strain, thickness: 3 mm, material: dragon_skin_10}
  b: {mesh: {generator: block, length: 10 mm, height: 6 mm, element_size: 2 mm},
      formulation: plane_strain, thickness: 3 mm, material: dragon_skin_10,
      position: [0 mm, 8 mm]}
environment: {gravity: 0 m/s^2}
time: {end: 1 s}
"""


@pytest.mark.parametrize(
    ("height", "told"),
    [("8 mm", "start so close that they may pass"), ("6 mm", "start so close that they may pass"),
     ("1 mm", "overlap at the start, by up to 3 mm"), ("12 mm", None)],
)  # fmt: skip
def test_bodies_that_may_meet_without_contact(build, height, told):
    """Two blocks of 6 mm, the upper one beginning at this height: near, touching, inside, far."""
    found = plausibility_warnings(build(TWO, f"bodies.b.position.1={height}"))
    if told is None:
        assert found == {}
        return
    assert list(found) == ["contact of a and b"]
    assert told in found["contact of a and b"]
    assert "contact.self_contact" in found["contact of a and b"]


def test_bodies_with_contact_or_tied_are_not_doubted(build):
    assert plausibility_warnings(build(TWO, "contact.self_contact=[a, b.bottom]")) == {}
    assert "contact of a and b" in plausibility_warnings(build(TWO, "contact.self_contact=[a]"))
    glue = TWO + "ties: {glue: {nodes: b.bottom, facets: a.top}}\n"
    assert plausibility_warnings(build(glue, "bodies.b.position.1=6 mm")) == {}


FILLED = """
bodies: {b: {mesh: {generator: pfr_meridian}, formulation: axisymmetric, material: dragon_skin_10,
             fixed: [ends]}}
loads:
  air: {kind: KIND, facets: [b.chamber],
        profile: {kind: smooth_step, value: VALUE, duration: 1 s}}
time: {end: 1 s}
"""
WATER = FILLED.replace("KIND", "added_volume").replace("VALUE", "12 ml")
GAS = FILLED.replace("KIND", "added_gas").replace("VALUE", "12 mg")
BESIDE = (
    SCENE + "environment: {walls: {table: {kind: plane, point: [0 mm, -1 mm], normal: [0, 1]}}}\n"
)
DRAGGED = SCENE.replace("time:", "  drag: {kind: tether, acts_on: r, drag: 1 mN}\ntime:")
LOOSE = BESIDE.replace(", fixed: [right]", "")
CYCLES = SCENE.replace(
    "{kind: constant, value: 5 kPa}",
    "{kind: cycles, highest: 5 kPa, lowest: 1 kPa, inflation_rate: 10 kPa/s, "
    "deflation_rate: 10 kPa/s, count: 1}",
)


@pytest.mark.parametrize(
    ("scene", "override", "kind", "told"),
    [
        (
            WATER,
            "loads.air.profile.value=12 l",
            "filling of air",
            "2.26e+03 times the initial content of its",
        ),
        (GAS, "loads.air.dead_volume=55000 l", "line of air", "5.5e+07 ml of gas"),
        (DRAGGED, "loads.drag.drag=5 MN", "force of drag", "exerts 5e+06 N"),
        (BESIDE, "environment.walls.table.point.1=-8 km", "distance of table", "is 8e+03 m away"),
        (LOOSE, "environment.walls={}", "support", "nothing holds the bodies: they fall by 4.91 m"),
        (
            CYCLES,
            "loads.air.profile.deflation_rate=1.4e-15 kPa/s",
            "time of air",
            "changes until 2.86e",
        ),
        (
            CYCLES,
            "loads.air.profile.inflation_rate=4.6e-14 kPa/s",
            "time of air",
            "changes until 1.09e",
        ),
        (BESIDE, "time.end=2 us", "end", "the run ends after 2 us"),
        (BESIDE, "time.settle=1 h", "settle", "time.settle allows 3.6e+03 s of settling"),
        (BESIDE, "rigid_bodies.r.mass=100 kg", "mass of r", "'r' has a mass of 100 kg"),
    ],
)
def test_what_does_not_fit_the_model_is_told(build, scene, override, kind, told):
    """The scene is not doubted before."""
    assert plausibility_warnings(build(scene)) == {}
    found = plausibility_warnings(build(scene, override))
    assert told in found[kind]


def test_intervals_that_leave_no_rows(build):
    model = build(SCENE)
    assert output_warnings(model, Output()) == {}
    found = output_warnings(model, Output(history_interval="5e11 s", frame_interval="2e13 s"))
    assert list(found) == ["history_interval", "frame_interval"]
    assert "is 5e+11 s in a run of 1 s" in found["history_interval"]


@pytest.mark.parametrize("angle", ["4.5e16 rad", "-361 deg"])
def test_slopes_are_within_a_turn(build, angle):
    build(SCENE, "environment.inclination=-360 deg")
    with pytest.raises(SceneError, match="is more than one turn"):
        build(SCENE, f"environment.inclination={angle}")
