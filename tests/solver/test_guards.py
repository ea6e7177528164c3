"""Warnings about laws outside their range, and about steps given by the user."""

import dataclasses

import numpy as np
import pytest

from softsim.errors import StabilityError
from softsim.solver.guards import (
    air_line_warnings,
    hourglass_warnings,
    refuse_broken_elements,
    refuse_collapsed_chamber,
    refuse_collapsed_step,
    refuse_unstable_step,
    step_warnings,
    strain_warnings,
    turning_warnings,
)
from softsim.solver.stable_step import StableStep

BLOCK = """\
bodies:
  b: {mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: m}
materials:
  m: {law: yeoh, C10: 30 kPa, C20: -5 kPa, density: 1 g/cm^3, strain_range: 0.5}
time: {end: 1 s}
"""


def stretched(model, stretch):
    """Pure shear by the stretch: I1_bar = stretch^2 + stretch^-2 + 1."""
    return model.points * [stretch, 1.0 / stretch]


def test_strain_within_the_range_is_fine(build):
    model = build(BLOCK)
    assert strain_warnings(model, stretched(model, 1.4), 0.0) == {}


def test_strain_beyond_the_range_is_named(build):
    model = build(BLOCK)
    found = strain_warnings(model, stretched(model, 1.6), 0.25)
    assert list(found) == ["b range"]
    assert "stretched to 1.6" in found["b range"] and "fitted up to 1.5" in found["b range"]
    assert "element" in found["b range"] and "t = 0.25 s" in found["b range"]


def test_a_lost_stiffness_is_named(build):
    """dW/dI1 = 30 - 10 k kPa is gone at k = I1_bar - 3 = 3, a stretch of 2.19."""
    model = build(BLOCK)
    just_below = np.sqrt((5.0 + np.sqrt(21.0)) / 2.0) * 0.999
    assert "b unstable" not in strain_warnings(model, stretched(model, just_below), 0.0)
    found = strain_warnings(model, stretched(model, just_below / 0.998), 0.0)
    assert "has lost its stiffness: I1 = 6" in found["b unstable"]


def test_a_cable_that_is_lost_is_named(build):
    model = build(
        BLOCK + "cables:\n  tail: {points: [[9 mm, 0 mm], [5 mm, 0 mm]], segment_length: 1 mm,\n"
        "    diameter: 1 mm, mass_per_length: 1 g/m, stretching_stiffness: 1 N,\n"
        "    bending_stiffness: 0 N*m^2}\n"
    )
    x = model.points.copy()
    refuse_broken_elements(model, x, 0.25)
    x[-1] = np.nan
    with pytest.raises(StabilityError, match=r"cable 'tail' has a position .* at t = 0\.25 s"):
        refuse_broken_elements(model, x, 0.25)


FOUND = StableStep(5e-6, 7e-6, "contact stiffness", None, 0, None)


def test_a_step_that_collapses_is_refused(build):
    """From 5 us, by default below a twentieth of the one at rest, or below what the scene says."""
    at_rest = dataclasses.replace(FOUND, value=99e-6)
    refuse_collapsed_step(build(BLOCK), FOUND, at_rest, 0.0)
    longer = dataclasses.replace(FOUND, value=101e-6)
    with pytest.raises(
        StabilityError, match=r"has fallen to 5 % of its value at rest at t = 0\.25 s"
    ):
        refuse_collapsed_step(build(BLOCK), FOUND, longer, 0.25)
    refuse_collapsed_step(build(BLOCK, "solver.least_step=0"), FOUND, longer, 0.25)


def test_a_step_is_refused_only_where_it_is_unstable(build):
    model = build(BLOCK)
    refuse_unstable_step(model, FOUND, 0.0)
    refuse_unstable_step(dataclasses.replace(model, time_increment=6.9e-6), FOUND, 0.0)
    with pytest.raises(StabilityError, match=r"7.1 us.*t = 0.25 s.*stability limit 7 us"):
        refuse_unstable_step(dataclasses.replace(model, time_increment=7.1e-6), FOUND, 0.25)


def test_a_step_longer_than_taken_is_doubtful(build):
    model = build(BLOCK)
    assert step_warnings(model, FOUND) == {}
    assert step_warnings(dataclasses.replace(model, time_increment=4.9e-6), FOUND) == {}
    said = step_warnings(dataclasses.replace(model, time_increment=5.1e-6), FOUND)["time step"]
    assert "5.1 us is longer than recommended" in said and "limited by contact" in said


def test_hourglass_modes_are_judged_when_they_hold_most():
    """6 % at 2 s: what they hold of next to nothing at 1 s does not count."""
    history = {
        "time": np.array([1.0, 2.0, 3.0]),
        "internal_energy": np.array([1e-9, 1.0, 2.0]),
        "hourglass_energy": np.array([9e-10, 0.06, 0.05]),
    }
    said = hourglass_warnings(history)["hourglass"]
    assert "at 2 s" in said and "6 % of the internal energy" in said
    assert hourglass_warnings(history | {"internal_energy": np.array([1e-9, 1.3, 2.0])}) == {}
    assert hourglass_warnings({"time": np.zeros(0), "hourglass_energy": np.zeros(0)}) == {}
    assert hourglass_warnings({"time": history["time"]}) == {}
    burst = {k: np.append(v, np.nan) for k, v in history.items()}
    assert hourglass_warnings(burst)["hourglass"] == said
    assert hourglass_warnings({k: np.full(3, np.nan) for k in history}) == {}


def test_groups_that_are_not_small_against_a_body_are_doubtful(build):
    """A square of 2 mm whose nine nodes are one group turns four times as slowly."""
    scaled = build(BLOCK, "solver.mass_scaling={within: 3 mm, factor: 4}")
    assert scaled.added_turning == pytest.approx(3.0)
    assert (
        "moment of inertia of a body by 300 %"
        in turning_warnings(scaled.added_turning)["mass scaling"]
    )
    assert turning_warnings(build(BLOCK).added_turning) == {}


def test_a_sensor_that_does_not_follow_is_told():
    """The valve is open at 2 s, and 9 kPa are shown where 4 are wanted; a lag of 1 kPa is none."""
    history = {
        "time": np.array([0.0, 1.0, 2.0, 3.0]),
        "wanted_pressure": np.array([0.0, 20e3, 4e3, 4e3]),
        "pressure": np.array([0.0, 19e3, 9e3, 9e3]),
        "air_supply": np.array([0.0, 1.0, -1.0, 0.0]),
    }
    said = air_line_warnings(history)["air line"]
    assert (
        "at 2 s the valve was open, and the sensor showed 9 kPa instead of the prescribed 4 kPa"
        in said
    )
    assert air_line_warnings({name: column[:2] for name, column in history.items()}) == {}
    assert air_line_warnings({"time": np.zeros(1)}) == {}


LINER = """
bodies: {b: {mesh: {generator: pfr_meridian}, formulation: axisymmetric, material: dragon_skin_10,
             fixed: [ends]}}
loads: {air: {kind: KIND, facets: [b.chamber],
              profile: {kind: smooth_step, value: VALUE, duration: 1 s}}}
time: {end: 1 s}
"""
DRIVEN = {
    "added_volume": ("1 ml", "add less volume"),
    "added_gas": ("1 mg", "add less gas"),
    "follower_pressure": ("1 kPa", "drive the chamber by added_volume"),
}


@pytest.mark.parametrize("kind", DRIVEN)
def test_advice_follows_what_drives_the_chamber(build, kind):
    """Only a given pressure is to be exchanged for a volume."""
    value, advice = DRIVEN[kind]
    text = LINER.replace("KIND", kind).replace("VALUE", value)
    if kind == "follower_pressure":
        text = text.replace("smooth_step", "constant").replace(", duration: 1 s", "")
    model = build(text)
    at_rest = dataclasses.replace(FOUND, value=1.0)
    with pytest.raises(StabilityError) as caught:
        refuse_collapsed_step(model, FOUND, at_rest, 0.0)
    assert advice in caught.value.hint
    assert ("added_volume" in caught.value.hint) == (kind == "follower_pressure")
    with pytest.raises(StabilityError) as caught:
        refuse_broken_elements(model, np.nan * model.points, 0.0)
    assert advice in caught.value.hint


@pytest.mark.parametrize(("kind", "value"), [("added_volume", "1 ml"), ("added_gas", "1 mg")])
def test_a_collapsed_chamber_is_refused(build, kind, value):
    """Inside out, or below vacuum."""
    [load] = build(LINER.replace("KIND", kind).replace("VALUE", value)).pressures
    refuse_collapsed_chamber(load.name, load.source, 1e-6, -101e3, 0.25)
    with pytest.raises(StabilityError, match=r"'air' is turned inside out at t = 0\.25 s.* -2 ml"):
        refuse_collapsed_chamber(load.name, load.source, -2e-6, 0.0, 0.25)
    with pytest.raises(
        StabilityError, match=r"'air' is below vacuum .* -102 kPa, and vacuum is -101\.3"
    ):
        refuse_collapsed_chamber(load.name, load.source, 1e-6, -102e3, 0.25)
