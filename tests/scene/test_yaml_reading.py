from pathlib import Path

import pytest

from softsim.errors import Option, SceneError
from softsim.scene.text import LARGEST_FILE, plain, read_file, read_text

HERE = Option("here")


def value(text):
    return plain(read_text(text, lambda line, column: HERE))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1e-6", 1e-6),
        ("1.5e3", 1500.0),
        ("-.5", -0.5),
        ("12", 12),
        ("1_000", "1_000"),
        ("0x10", "0x10"),
        ("010", 10),
        ("1:30", "1:30"),
        ("2001-01-01", "2001-01-01"),
        (".nan", ".nan"),
        ("on", "on"),
        ("no", "no"),
        ("y", "y"),
        ("true", True),
        ("null", None),
        ("~", None),
        ("36 mm", "36 mm"),
        ("'12'", "12"),
        ("!!str 12", "12"),
        ("!!float 12", 12.0),
        ("{on: 1, 2: b, true: c}", {"on": 1, "2": "b", "true": "c"}),
        ("[a, {b: [1]}]", ["a", {"b": [1]}]),
        ("[&x {a: 1}, *x]", [{"a": 1}, {"a": 1}]),
    ],
)
def test_plain_words_mean_what_they_look_like(text, expected):
    got = value(text)
    assert got == expected and type(got) is type(expected)


def test_no_value_is_no_tree():
    assert read_text("# a comment", lambda line, column: HERE) is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\na: 2", "the key 'a' is given twice"),
        ("{[a]: 1}", "a key must be a word"),
        ("!!python/object/apply:os.system [ls]", "is not supported"),
        ("!!set {a}", "is not supported"),
        ("!!binary aGk=", "is not supported"),
        ("!!int x", "cannot be read as a number"),
        ("9" * 5000, "cannot be read as a number"),
        ("&a [*a]", "an anchor contains its own alias"),
        ("*a", "undefined alias"),
        ("a: b: c", 'put a text that contains ": " in quotes'),
        ("a:\n\tb: 1", "indent with spaces"),
        ("a: 1\n---\nb: 2", "one file holds one scene"),
        ("a: \x07", "a character that YAML does not allow: '\\x07'"),
        ("[" * 5000, "nested deeper than"),
        ('"\\UFFFFFFFF"', "not valid YAML"),
    ],
)
def test_what_no_scene_needs_is_refused(text, message):
    with pytest.raises(SceneError) as caught:
        value(text)
    assert message in str(caught.value)


def test_aliases_cannot_blow_up():
    lines = ["a: &a [x, x, x, x, x, x, x, x, x, x]"]
    for one, following in zip("abcdefgh", "bcdefghi", strict=True):
        lines.append(f"{following}: &{following} [{', '.join([f'*{one}'] * 10)}]")
    with pytest.raises(SceneError, match="more than 200000 values"):
        value("\n".join(lines))


def test_marks_name_file_line_and_column(write):
    tree = read_file_in(write, "time:\r\n  end: 3 s\r\n")
    end = tree.value["time"].value["end"]
    assert str(end.origin) == "a.yaml:2:8"
    assert str(end.key_origin) == "a.yaml:2:3"
    assert end.origin.text == "  end: 3 s"


def read_file_in(write, content):
    return read_file(Path(write(a=content)))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"\xff\xfe\x00", "is not UTF-8 text"),
        (b"- a\n", "a.yaml:1:1: a scene must be a mapping"),
        (b"#" * (LARGEST_FILE + 1), "larger than 1 MB"),
    ],
)
def test_files_that_are_no_scene_are_refused(write, content, message):
    with pytest.raises(SceneError) as caught:
        read_file_in(write, content)
    assert message in str(caught.value)


def test_a_byte_order_mark_does_no_harm(write):
    assert plain(read_file_in(write, b"\xef\xbb\xbfa: 1")) == {"a": 1}
