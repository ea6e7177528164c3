import pytest

from softsim.errors import (
    DeviceError,
    ExpectationError,
    Interrupted,
    Location,
    MeshError,
    Option,
    OutputError,
    SceneError,
    SoftsimError,
    StabilityError,
)


def test_exit_codes_tell_the_causes_apart():
    codes = {
        error: error("x").exit_code for error in (SceneError, MeshError, DeviceError, OutputError)
    }
    assert set(codes.values()) == {2}
    assert [e.exit_code for e in (StabilityError, Interrupted, ExpectationError)] == [3, 4, 5]


def test_the_hint_stands_on_a_line_of_its_own():
    assert str(SoftsimError("no device", hint="take another")) == "no device\n  take another"
    assert str(SoftsimError("no device")) == "no device"


def test_a_scene_error_shows_the_line_and_a_caret():
    place = Location("scenes/pfr_36mm.yaml", 12, 8, "  end: -1 s")
    error = SceneError("end: '-1 s' must be greater than 0 s", 'a duration such as "24 s"', place)
    assert str(error).splitlines() == [
        "scenes/pfr_36mm.yaml:12:8: end: '-1 s' must be greater than 0 s",
        "   12 |   end: -1 s",
        "      |        ^",
        '  a duration such as "24 s"',
    ]


def test_the_caret_follows_tabs_and_control_characters_are_not_printed():
    number, caret = Location("a", 1, 3, "\ta\x1b").excerpt()
    assert number == "    1 | \ta?"
    assert caret == "      | \t ^"


def test_an_option_is_named_instead_of_a_line():
    error = SceneError("must be a text", location=Option("--set title=3"))
    assert str(error) == "--set title=3: must be a text"


def test_further_problems_are_listed_too():
    error = SceneError("one", further=[SceneError("two", "try this"), SceneError("three")])
    assert str(error) == "one\ntwo\n  try this\nthree"


@pytest.mark.parametrize("column", [1, 700, 990_000])
def test_of_a_long_line_the_part_around_the_caret_is_shown(column):
    text = "".join(chr(ord("a") + k % 26) for k in range(990_000))
    line, caret = Location("a.yaml", 1, column, text).excerpt()
    assert len(line) < 140
    assert line[caret.index("^")] == text[column - 1]


def test_a_quoted_value_of_any_length_leaves_a_message_that_can_be_read():
    said = str(SoftsimError("'" + 5000 * "x" + "' is no length", "such as 3 mm"))
    assert len(said) < 2100 and said.endswith("x' is no length\n  such as 3 mm")
