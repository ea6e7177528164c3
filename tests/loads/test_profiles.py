"""One family of profiles for every load and condition, in the unit of each."""

from pathlib import Path

import numpy as np
import pytest

from softsim.builder import build_model
from softsim.errors import SceneError
from softsim.scene.loading import load_scene

SKIN = Path(__file__).parents[2] / "scenes/skin_inflation.yaml"

SCENE = """
bodies:
  b: {mesh: {generator: block, length: 8 mm, height: 4 mm, element_size: 2 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10, fixed: [bottom]}
rigid_bodies: {r: {center: [0 mm, 50 mm], mass: 1 g, inertia: 1 g*mm^2}}
environment: {gravity: 0 m/s^2, walls: {w: {kind: plane, point: [0 mm, -50 mm]}}}
loads: {LOADS}
conditions: {CONDITIONS}
time: {end: 1 s}
"""
UNIT = {"Pa": "kPa", "N": "kN", "m": "m", "m/s": "m/s", "m^3": "m^3", "kg": "kg", "N/m^3": "kN/m^3"}
IN_SI = {"Pa": 1e3, "N": 1e3, "N/m^3": 1e3}
NODES = "nodes: b.top"
LOADS = {
    "follower_pressure": ("facets: [b.top], profile", "Pa", lambda x: x.source.facet_profile),
    "nodal_force": (f"{NODES}, direction: [0, 2], profile", "N", lambda x: x.share),
    "surface_traction": (
        "facets: [b.top], direction: [0, 2], profile", "Pa", lambda x: x.share
    ),
    "body_force": ("bodies: [b], direction: [0, 2], profile", "N/m^3", lambda x: x.share),
    "rigid_force": ("acts_on: r, direction: [0, 2], profile", "N", lambda x: x.share),
    "pulled_cable": (
        "eyelets: [[1 mm, 2 mm], [3 mm, 2 mm]], tension_profile", "N", lambda x: x.tension
    ),
}  # fmt: skip
CHAMBERS = {"added_volume": "m^3", "added_gas": "kg"}
DRAWN_IN = "eyelets: [[1 mm, 2 mm], [3 mm, 2 mm]], stiffness: 1 N/mm, pull_profile"
MOTIONS = {
    "prescribed": f"{NODES}, direction: y",
    "rigid_motion": "body: r, direction: y",
    "wall_motion": "wall: w, direction: y",
}
# Kind of profile, its keys with the unit U, the values that it has at some times [s].
FAMILY = {
    "constant": ("value: 2 U, ramp: 0.5 s", {0.25: 1.0, 0.75: 2.0}),
    "ramp": ("value: 2 U, duration: 0.5 s", {0.25: 1.0, 0.75: 2.0}),
    "smooth_step": ("value: 2 U, duration: 0.5 s", {0.125: 0.3125, 0.25: 1.0, 0.75: 2.0}),
    "sine": (
        "amplitude: 1 U, mean: 1 U, frequency: 1 Hz, phase: -90 deg",
        {0.25: 1.0, 0.5: 2.0, 0.75: 1.0},
    ),
    "table": ("points: [[0 s, 0 U], [0.5 s, 2 U], [1 s, 1 U]]", {0.25: 1.0, 0.75: 1.5}),
    "cycles": (
        "highest: 2 U, period: 0.4 s, rise: 0.1 s, hold: 0.05 s, fall: 0.1 s",
        {0.05: 1.0, 0.12: 2.0, 0.2: 1.0, 0.3: 0.0, 0.45: 1.0, 0.85: 1.0},
    ),
}


def profile_text(kind, unit):
    """A profile of the family, written in a unit."""
    return f"{{kind: {kind}, {FAMILY[kind][0].replace('U', unit)}}}"


@pytest.fixture(scope="module", params=FAMILY)
def kind(request):
    """Each kind of the family."""
    return request.param


def assert_follows(profile, kind, unit=1.0):
    """A profile has the values that the kind has at some times, in a unit of SI."""
    for time, value in FAMILY[kind][1].items():
        assert profile.at(time) == pytest.approx(value * unit, rel=1e-4, abs=1e-9)


def loaded_by(build, load):
    """The only load of a scene."""
    [found] = build(SCENE.replace("LOADS", f"a: {{{load}}}").replace("CONDITIONS", "")).loads
    return found


@pytest.mark.parametrize("load", LOADS)
def test_every_load_takes_every_profile_in_its_unit(build, kind, load):
    keys, unit, profile_of = LOADS[load]
    found = loaded_by(build, f"kind: {load}, {keys}: {profile_text(kind, UNIT[unit])}")
    assert_follows(profile_of(found), kind, IN_SI[unit])


def test_a_cable_is_drawn_in_by_every_profile(build, kind):
    found = loaded_by(build, f"kind: pulled_cable, {DRAWN_IN}: {profile_text(kind, 'm')}")
    assert_follows(found.pull, kind)


@pytest.mark.parametrize("load", CHAMBERS)
def test_a_chamber_takes_every_profile_of_volume_and_of_gas(kind, load):
    scene = load_scene(SKIN, [
        "time.end=1 s",
        f"loads={{a: {{kind: {load}, facets: [skin.chamber], "
        f"profile: {profile_text(kind, CHAMBERS[load])}}}}}",
    ])  # fmt: skip
    [chamber] = build_model(scene).pressures
    assert_follows(chamber.source.profile, kind)


def motions(model):
    """The displacement of everything that a scene of MOTIONS moves."""
    [wall] = model.walls
    return [wall.displacement, *(load.profile for load in model.loads)]


def test_every_motion_takes_every_profile_of_displacement_and_of_velocity(build, kind):
    text = SCENE.replace("LOADS", "")
    times = np.linspace(0.0, 1.0, 20001)
    for key, unit in (("displacement", "m"), ("velocity", "m/s")):
        said = ", ".join(
            f"{name}: {{kind: {name}, {keys}, {key}: {profile_text(kind, unit)}}}"
            for name, keys in MOTIONS.items()
        )
        found = motions(build(text.replace("CONDITIONS", said)))
        assert len(found) == 3
        for profile in found:
            if key == "displacement":
                values = profile
                assert_follows(profile, kind)
            else:
                v = values.at(times)
                integral = np.append(0.0, np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(times)))
                np.testing.assert_allclose(profile.at(times), integral, atol=2e-5 * integral.max())


def test_a_force_with_a_direction_is_the_force_given_whole_times_a_factor(build):
    """3 and 4 N, of 5 N along [3, 4], for each spelling of a force."""
    factor = "profile: {kind: table, points: [[0 s, 0], [1 s, 2]]}"
    whole = f"kind: nodal_force, {NODES}, force: [3 N, 4 N], {factor}"
    size = "profile: {kind: table, points: [[0 s, 0 N], [1 s, 10 N]]}"
    along = f"kind: nodal_force, {NODES}, direction: [0.3, 0.4], {size}"
    one, other = (loaded_by(build, text) for text in (whole, along))
    for time in (0.3, 1.0):
        np.testing.assert_allclose(
            one.forces * one.share.at(time), other.forces * other.share.at(time), rtol=1e-12
        )


def test_a_factor_has_every_kind_of_the_family(build, kind):
    factor = f"{{kind: {kind}, {FAMILY[kind][0].replace(' U', '')}}}"
    load = f"kind: nodal_force, {NODES}, force: [0 N, 1 N], profile: {factor}"
    assert_follows(loaded_by(build, load).share, kind)


@pytest.mark.parametrize(
    ("load", "problem"),
    [
        (f"kind: nodal_force, {NODES}, force: [0 N, 1 N], profile: {{kind: ramp, value: 3 N, "
         "duration: 1 s}", "value: must be a number without a unit"),
        (f"kind: nodal_force, {NODES}, direction: [0, 1], profile: {{kind: ramp, value: 3, "
         "duration: 1 s}", "value: a force needs a unit"),
        (f"kind: nodal_force, {NODES}, direction: [0, 1], force: [0 N, 1 N]",
         "unknown key 'force' in a"),
        ("kind: follower_pressure, facets: [b.top], profile: {kind: cycles, highest: 1 kPa, "
         "rise: 1 s, fall: 1 s}", "profile: the key 'period' is missing"),
        ("kind: follower_pressure, facets: [b.top], profile: {kind: cycles, highest: 1 kPa, "
         "rise: 1 s, fall: 1 s, period: 1 s}", "rise, hold and fall take 2 s, more than"),
        ("kind: follower_pressure, facets: [b.top], profile: {kind: cycles, highest: 1 kPa, "
         "deflation_rate: 1 kPa/s}", "profile: the key 'inflation_rate' is missing"),
        ("kind: pulled_cable, eyelets: [[1 mm, 2 mm], [3 mm, 2 mm]], ramp: 1 s, tension_profile: "
         "{kind: ramp, value: 1 N, duration: 1 s}", "tension_profile gives the values over time"),
    ],
)  # fmt: skip
def test_a_profile_of_the_wrong_kind_is_refused(build, load, problem):
    with pytest.raises(SceneError) as caught:
        build(SCENE.replace("LOADS", f"a: {{{load}}}").replace("CONDITIONS", ""))
    told = [caught.value, *caught.value.further]
    assert any(problem in each.message for each in told)
