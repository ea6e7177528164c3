import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.units import (
    KINDS,
    UNIT_NAMES,
    format_quantity,
    number_in,
    parse,
    size_of,
    unit_of,
    usual_unit,
)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("36 mm", "m", 0.036),
        ("3.5mm", "m", 0.0035),
        (" 36  mm ", "m", 0.036),
        ("1e-3 mm", "m", 1e-6),
        ("-3 mm", "m", -0.003),
        ("0 mm", "m", 0.0),
        (".5 µm", "m", 5e-7),
        ("1.3 kPa/s", "Pa/s", 1300.0),
        ("192 Hz", "Hz", 192.0),
        ("192 rpm", "Hz", 3.2),
        ("9.81 m/s^2", "m/s^2", 9.81),
        ("9.81 m/s**2", "m/s^2", 9.81),
        ("9.81 m s^-2", "m/s^2", 9.81),
        ("9.81 m/s²", "m/s^2", 9.81),
        ("1070 kg/m^3", "kg/m^3", 1070.0),
        ("1.07 g/cm3", "kg/m^3", 1070.0),
        ("0.5 kg*mm^2", "kg*m^2", 5e-7),
        ("1/MPa", "1/Pa", 1e-6),
        ("0.5 1/MPa", "1/Pa", 5e-7),
        ("2 J/m", "N", 2.0),
        ("1 bar", "Pa", 1e5),
        ("1 ft", "m", 0.3048),
        ("1 lb", "kg", 0.45359237),
        ("16 oz", "kg", 0.45359237),
        ("1 slug", "kg", 14.593902937206364),
        ("1 lb/in^3", "kg/m^3", 27679.90471020312),
        ("1 slug/ft^3", "kg/m^3", 515.3788183931962),
        ("1 lbf*s^2/in^4", "kg/m^3", 10686895.178201316),
        ("1 lb*in^2", "kg*m^2", 2.926396534292e-4),
        ("1 lbf", "N", 4.4482216152605),
        ("1 lbf/in^2", "Pa", 6894.757293168362),
        ("1 1/psi", "1/Pa", 1.450377377302092e-4),
        ("1 psi/s", "Pa/s", 6894.757293168361),
        ("1 psi·in", "N/m", 175.12683524647636),
        ("1 lbf/in", "N/m", 175.1268352464764),
        ("1 lbf/in^3", "N/m^3", 271447.1375263134),
        ("1 lbf*in", "J", 0.1129848290276167),
        ("1 lbf*in/rad", "N*m/rad", 0.1129848290276167),
        ("1 lbf*in^2", "N*m^2", 0.002869814657301464),
        ("1 lbf*s/in", "N*s/m", 175.1268352464764),
    ],
)
def test_a_quantity_is_read_to_the_nearest_float(text, unit, value):
    assert parse(text, unit) == value


# No subnormals: a kernel that ran in this process may have set it to flush them to zero.
ANY_FLOAT = st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=False)


@given(ANY_FLOAT, st.sampled_from(sorted(KINDS)))
def test_every_float_written_out_reads_back_as_the_same_float(value, unit):
    assert parse(f"{value!r} {unit}", unit) == value


@given(ANY_FLOAT, st.sampled_from([("km", 3), ("mm", -3), ("um", -6), ("µm", -6), ("nm", -9)]))
def test_prefixes_scale_without_rounding_twice(value, prefixed):
    name, power = prefixed
    exact = Fraction(repr(value)) * Fraction(10) ** power
    try:
        expected = float(exact)
    except OverflowError:
        with pytest.raises(ValueError, match="too large for a length"):
            parse(f"{value!r} {name}", "m")
    else:
        assert parse(f"{value!r} {name}", "m") == expected


def test_angles_and_turns():
    assert parse("180 deg", "rad") == math.pi
    assert parse("30 °", "rad") == pytest.approx(math.pi / 6)
    assert parse("1 turn", "rad") == 2 * math.pi
    assert parse("60 rpm", "rad/s") == pytest.approx(2 * math.pi)


def test_a_frequency_is_counted_in_turns_never_in_radians():
    assert parse("1 rad/s", "Hz") == pytest.approx(1 / (2 * math.pi))
    with pytest.raises(ValueError, match="'3 Hz' is a frequency, an angular velocity is needed"):
        parse("3 Hz", "rad/s")


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("36", "m", 'a length needs a unit: write "36 mm"'),
        ("1e-3", "Pa", 'a pressure needs a unit: write "1e-3 kPa"'),
        ("36 kPa", "m", "'36 kPa' is a pressure, a length is needed, such as \"36 mm\""),
        ("36 m^9", "m", "'36 m^9' measures something else: a length is needed"),
        ("36 kpa", "Pa", "unknown unit 'kpa': did you mean kPa?"),
        ("3 zyx", "m", "known: nm, um, mm"),
        ("1 nan", "m", "unknown unit 'nan'"),
        ("nan mm", "m", "'nan mm' is not a length: write it like \"36 mm\""),
        ("inf", "m", "is not a length"),
        ("", "m", "is not a length"),
        ("1e9999 mm", "m", "is too large"),
        ("3 mm**", "m", "has no readable unit"),
        ("3 __import__('os')", "m", "has no readable unit"),
        ("3 " + "km9 " * 9999, "m", "is not a length"),
    ],
)
def test_what_is_wrong_is_told_with_what_is_right(text, unit, message):
    with pytest.raises(ValueError) as caught:
        parse(text, unit)
    assert message in str(caught.value)


@pytest.mark.parametrize("unit", KINDS)
def test_every_kind_reads_its_own_example_and_units(unit):
    assert parse(KINDS[unit].example, unit) > 0.0
    assert parse(f"1 {unit}", unit) == 1.0
    assert all(parse(f"1 {shown}", unit) > 0.0 for shown in KINDS[unit].shown_in)


@pytest.mark.parametrize("name", UNIT_NAMES)
def test_every_unit_that_is_offered_is_known(name):
    with pytest.raises(ValueError, match="is needed"):
        parse(f"1 {name}", "kg*m^2")


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.036, "m", "36 mm"),
        (1.0 - 1e-12, "m", "1 m"),
        (1e-9, "m", "0.001 um"),
        (-3e-6, "m", "-3 um"),
        (0.0, "m", "0 m"),
        (23e3, "Pa", "23 kPa"),
        (192.0, "Hz", "192 Hz"),
        (1e-6, "1/Pa", "1 1/MPa"),
        (math.pi / 2, "rad", "90 deg"),
    ],
)
def test_people_see_handy_numbers(value, unit, text):
    assert format_quantity(value, unit) == text


@given(st.floats(-1e9, 1e9), st.sampled_from(sorted(KINDS)))
def test_what_people_see_reads_back_to_six_digits(value, unit):
    assert parse(format_quantity(value, unit), unit) == pytest.approx(value, rel=5e-6, abs=1e-300)


@given(st.text(max_size=30), st.sampled_from(sorted(KINDS)))
def test_any_text_is_a_finite_number_or_a_value_error(text, unit):
    try:
        assert math.isfinite(parse(text, unit))
    except ValueError as error:
        assert str(error)


@given(st.from_regex(r"-?[0-9]{1,4}(\.[0-9]{1,3})? ?(k|m|M|u)?(m|s|g|Pa|Hz|rad)[/*^0-9msPag ]*"))
def test_near_quantities_are_read_or_refused_too(text):
    for unit in ("m", "Hz", "1/Pa"):
        try:
            assert math.isfinite(parse(text, unit))
        except ValueError as error:
            assert str(error)


# Nearer to zero the metres between have fewer digits, or none.
PLAIN = st.floats(-1e6, 1e6).filter(lambda value: value == 0.0 or abs(value) > 1e-300)


@given(PLAIN, st.sampled_from(["mm", "um", "in", "m"]))
def test_a_number_in_another_unit(value, unit):
    text = f"{value!r} {unit}"
    assert number_in(text, unit, "m") == value  # nothing is lost on the way through metres
    assert number_in(text, "mm", "m") == pytest.approx(parse(text, "m") * 1e3, rel=1e-12)
    assert size_of(unit, "m") == parse(f"1 {unit}", "m")


def test_turns_are_counted_in_any_unit():
    assert number_in("3 Hz", "rpm", "Hz") == pytest.approx(180.0, rel=1e-12)
    assert number_in("30 deg", "deg", "rad") == 30.0
    with pytest.raises(ValueError, match="is a pressure, a length is needed"):
        size_of("kPa", "m")
    with pytest.raises(ValueError, match="is not a quantity"):
        number_in("mm", "mm", "m")


@pytest.mark.parametrize("unit", sorted(KINDS))
def test_the_usual_unit_is_one(unit):
    assert size_of(usual_unit(unit), unit) > 0.0


def test_the_unit_of_a_text():
    assert unit_of("-1 s") == "s"
    with pytest.raises(ValueError):
        unit_of("s")
