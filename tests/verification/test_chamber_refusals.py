"""What is no chamber is refused, at the place where it is open or with the volume that it lacks."""

import re

import pytest
from shells import BOX, GAS, SPHERE, half_section, hollow_box

from softsim.errors import SceneError

PLANE = """
bodies: {b: {mesh: {generator: block, length: 10 mm, height: 4 mm, element_size: 2 mm},
             formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10}}
loads: {drive: {kind: added_volume, facets: [b.top],
                profile: {kind: ramp, value: 1 ml, duration: 10 ms}}}
time: {end: 10 ms}
"""
HELD_ENDS = ("fixed: [bottom]", "material: dragon_skin_10")
TUBE = """
bodies: {b: {mesh: {generator: pfr_meridian}, formulation: axisymmetric, material: dragon_skin_10}}
loads: {drive: {kind: added_gas, facets: [b.chamber],
                profile: {kind: ramp, value: 1 mg, duration: 10 ms}}}
time: {end: 10 ms}
"""


@pytest.fixture
def refused(build, tmp_path):
    """The error of a scene text and its shell."""

    def refusal(text, shell=None):
        if shell is not None:
            shell.write(tmp_path / "shell.inp")
        with pytest.raises(SceneError) as caught:
            build(text)
        assert caught.value.exit_code == 2
        assert caught.value.location is not None
        return caught.value

    return refusal


def test_an_open_chamber_is_refused_where_it_ends(refused):
    """Plane, revolved and solid: a rim that nothing holds, at its place."""
    error = refused(PLANE)
    assert "the chamber is open: its facets end at (-5.00, 4.00) mm" in error.message
    assert "added_volume" in error.location.text
    error = refused(TUBE)
    assert "the chamber is open: its facets end at (7.50, -15.00) mm" in error.message
    error = refused(BOX.replace(", fixed: [floor]", ""), hollow_box())
    assert "the chamber is open: its facets end at (" in error.message
    assert ", 0.00, " in error.message  # on the floor


def test_a_chamber_closed_by_something_else_than_its_body_is_open(refused):
    """With reacts_on the rim must be tied to that body; fixed nodes close nothing then."""
    text = TUBE.replace("material: dragon", "fixed: [ends], material: dragon")
    text = text.replace("facets: [b.chamber]", "facets: [b.chamber], reacts_on: frame")
    text += "rigid_bodies: {frame: {mass: 1 g, inertia: 1 kg*mm^2}}\n"
    assert "the chamber is open" in refused(text).message


def test_facets_that_face_away_are_refused(refused):
    """The outside of the sphere: seen from there the chamber holds less than nothing."""
    text = SPHERE + GAS.replace("added_gas", "added_volume").replace("1 mg", "1 ml")
    text = text.replace("shell.chamber", "shell.outside")
    error = refused(text, half_section(2))
    assert "enclose -4.1" in error.message  # -4/3 pi (10 mm)^3, of a polygon
    assert "face away" in error.message


def test_facets_that_face_away_are_refused_for_gas_too(refused):
    """A dead volume must not hide that the chamber is inside out."""
    text = (SPHERE + GAS).replace("shell.chamber", "shell.outside")
    text = text.replace("kind: added_gas,", "kind: added_gas, dead_volume: 50 ml,")
    assert "face away" in refused(text, half_section(2)).message


CLOSED = TUBE.replace("material: dragon", "fixed: [ends], material: dragon")


@pytest.mark.parametrize(
    ("kind", "taken", "told"),
    [
        ("added_volume", "-9 ml", r"1\.7 times the content .* it holds \d\.\d+ ml"),
        ("added_gas", "-9 mg", r"1\.\d+ times the content .* it holds \d\.\d+ mg of gas"),
    ],
)
def test_a_chamber_gives_no_more_than_it_holds(refused, kind, taken, told):
    error = refused(CLOSED.replace("added_gas", kind).replace("1 mg", taken))
    assert re.search(told, error.message), error.message
    assert "value: -9" in error.location.text


@pytest.mark.parametrize("kind", ["added_volume", "added_gas"])
def test_a_flat_chamber_holds_nothing(refused, kind):
    """The face of a block, held at its ends, encloses nothing with its chord, however turned."""
    text = PLANE
    if kind == "added_gas":
        text = text.replace("added_volume", "added_gas").replace("1 ml", "1 mg")
    for angle in range(0, 90, 10):
        turned = f"rotation: {angle} deg, fixed: [left, right], material:"
        assert "ml" in refused(text.replace("material:", turned)).message


def test_gas_needs_room(refused):
    """What stands inside the chamber must not fill it."""
    text = TUBE.replace("material: dragon", "fixed: [ends], material: dragon")
    text = text.replace("kind: added_gas,", "kind: added_gas, excluded_volume: 6 ml,")
    error = refused(text)
    assert "holds 5.301 ml, of which 6 ml are excluded" in error.message  # pi (7.5 mm)^2 30 mm
    assert "no volume is left for the gas" in error.message


def test_a_facet_counts_once(refused):
    """The same facets in two sets would be pressed twice."""
    text = (SPHERE + GAS).replace("[shell.chamber]", "[shell.chamber, shell.chamber]")
    error = refused(text, half_section(2))
    assert "20 facet(s) are in more than one" in error.message


AIR_LINE = (
    "kind: pneumatic, pump: {flow: 10 ml/s, stall: 30 kPa}, valve: {flow: 30 ml/s, "
    "pressure: 20 kPa}, tube: {length: 2 m, bore: 1.2 mm}, line_volume: 2 ml,"
)
RISE = "profile: {kind: table, points: [[0 s, 0 kPa], [1 s, 20 kPa]]}"


HELD_TUBE = (
    TUBE.replace("material: dragon", "fixed: [ends], material: dragon")
    .replace("kind: added_gas,", AIR_LINE)
    .replace("profile: {kind: ramp, value: 1 mg, duration: 10 ms}", RISE)
)


@pytest.mark.parametrize(
    ("before", "after", "told", "at"),
    [
        ("stall: 30 kPa", "stall: 20 kPa", "the pump stalls at 20 kPa", "stall"),
        (
            "end: 10 ms",
            "end: 10 ms, procedure: static",
            "which a static procedure does not have",
            "drive",
        ),
        ("[1 s, 20 kPa]", "[1 s, -2 kPa]", "must not be negative: the pump blows", "profile"),
        ("line_volume: 2 ml", "line_volume: 0 ml", "must be greater than 0 ml", "line_volume"),
        ("2 ml,", "2 ml, excluded_volume: 7 ml,", "no volume is left for the gas", "drive"),
    ],
)
def test_air_lines_that_cannot_work(refused, before, after, told, at):
    error = refused(HELD_TUBE.replace(before, after))
    assert told in error.message
    assert at in error.location.text
