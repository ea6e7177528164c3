"""Negative gauge pressure: it acts as given, against what the same overpressure does."""

import numpy as np
import pytest

from softsim.analysis.measures import whole_cycles
from softsim.errors import SceneError
from softsim.scene.loading import load_scene
from softsim.scene.profiles import ever_falls

BLOCK = """
bodies:
  b: {mesh: {generator: block, length: 8 mm, height: 3 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10, fixed: [bottom]}
environment: {gravity: 0 m/s^2}
loads: {air: {kind: follower_pressure, facets: [b.top, b.right], profile: {PROFILE}}}
time: {end: 1 s}
"""
TABLE = "kind: table, points: [[0 s, 2 kPa], [0.5 s, -6 kPa], [1 s, -6 kPa]]"


def with_profile(profile):
    """The text of the scene with a profile."""
    return BLOCK.replace("PROFILE", profile)


@pytest.mark.parametrize(
    ("profile", "at", "pressure"),
    [
        ("kind: constant, value: -3 kPa", 0.0, -3e3),
        ("kind: constant, value: -3 kPa, ramp: 10 ms", 5e-3, -1.5e3),
        (TABLE, 0.125, 0.0),
        (TABLE, 0.25, -2e3),
        (TABLE, 9.0, -6e3),
    ],
)
def test_the_facets_feel_the_profile(build, profile, at, pressure):
    source = build(with_profile(profile)).pressures[0].source
    assert source.facet_profile.at(at) == pytest.approx(pressure, abs=1e-9)
    assert source.facet_profile.at(at) == source.profile.at(at)


def test_the_forces_are_those_of_the_overpressure_reversed(build, start):
    """On free nodes at rest: half a kick of p dV/dx over the mass, to the round-off of the strains
    that elements start with.
    """
    blown = build(with_profile("kind: constant, value: 3 kPa"))
    sucked = build(with_profile("kind: constant, value: -3 kPa"))
    solver = start(blown, sucked)
    outward, inward = solver.velocities()[0]
    np.testing.assert_allclose(inward, -outward, rtol=1e-9, atol=1e-12)
    load, force = sucked.pressures[0], np.zeros_like(sucked.points)
    np.add.at(force, load.facets, -3e3 * load.geometry.volume_gradient(sucked.points, load.facets))
    kick = 0.5 * solver.time_increment * force / sucked.mass[:, None]
    np.testing.assert_allclose(inward, np.where(sucked.is_free, kick, 0.0), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    "given", ["factor: 0.5", "offset: 1 kPa", "on_skin: [[0 kPa, 0 kPa], [9 kPa, 5 kPa]]"]
)
@pytest.mark.parametrize("profile", ["kind: constant, value: -3 kPa", TABLE])
def test_what_holds_for_overpressure_does_not_go_with_it(build, profile, given):
    text = with_profile(profile).replace("facets:", f"{given}, facets:")
    with pytest.raises(SceneError, match="does not go with a negative pressure") as caught:
        build(text)
    location = caught.value.location
    assert location.text[location.column - 1 :].startswith(given.partition(": ")[2])


@pytest.mark.parametrize(
    "profile",
    [
        "kind: cycles, highest: 2 kPa, inflation_rate: 1 kPa/s, deflation_rate: 1 kPa/s, "
        "lowest: -1 kPa",
        "kind: natural_deflation, highest: 2 kPa, inflation_rate: 1 kPa/s, time_constant: 1 s, "
        "lowest: -1 kPa",
    ],
)
def test_cycles_of_a_gauge_stay_above_zero(build, profile):
    with pytest.raises(SceneError, match="lowest: '-1 kPa' must not be less than 0 kPa"):
        build(with_profile(profile))


@pytest.mark.parametrize(
    ("profile", "count"),
    [
        ("kind: constant, value: -3 kPa", 0),
        ("kind: constant, value: -3 kPa, ramp: 10 ms", 1),
        ("kind: constant, value: 3 kPa, ramp: 10 ms", 0),
        (TABLE, 1),
    ],
)
def test_a_pressure_that_falls_below_zero_falls(build, write_scene, profile, count):
    """What a scene is said to tell of cycles is what is found."""
    model = build(with_profile(profile))
    assert len(whole_cycles(model, {"time": np.array([0.0, 2.0])})) == count
    air = load_scene(write_scene(with_profile(profile))).scene.loads["air"]
    assert ever_falls(air.profile) == (count > 0)
