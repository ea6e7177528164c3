import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.errors import Location
from softsim.scene.text import DISCRIMINATORS, Tree, child, merged, nearest, plain, replaced


def tree(value, line=1):
    """The tree of plain values, each at the given line."""
    here = Location("a.yaml", line, 1, "")
    if isinstance(value, dict):
        return Tree({key: tree(entry, line) for key, entry in value.items()}, here, here)
    if isinstance(value, list):
        return Tree([tree(entry, line) for entry in value], here, here)
    return Tree(value, here, here, str(value))


KEYS = st.sampled_from("abcd")
VALUES = st.recursive(
    st.integers(0, 9),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3),
    max_leaves=10,
)
MAPPINGS = st.dictionaries(KEYS, VALUES, max_size=4)


def line_of(tree, keys):
    """The line that the value at `keys` was written in."""
    place = nearest(tree, keys)[0].origin
    assert isinstance(place, Location)
    return place.line


def leaves(value, keys=()):
    """Path and value of everything in nested mappings that is no mapping."""
    if isinstance(value, dict) and value:
        for key, entry in value.items():
            yield from leaves(entry, (*keys, key))
    else:
        yield keys, value


def at(value, keys):
    for key in keys:
        value = value[key]
    return value


@given(VALUES)
def test_plain_values_come_back(value):
    assert plain(tree(value)) == value


@given(MAPPINGS)
def test_merging_with_nothing_changes_nothing(value):
    assert plain(merged(tree({}), tree(value))) == value
    assert plain(merged(tree(value), tree({}))) == value


@given(MAPPINGS, MAPPINGS)
def test_the_upper_mapping_wins_and_the_lower_one_fills_up(lower, upper):
    result = plain(merged(tree(lower), tree(upper)))
    for keys, value in leaves(upper):
        assert value == {} or at(result, keys) == value
    assert set(result) == {*lower, *upper}
    for key in set(lower) - set(upper):
        assert result[key] == lower[key]


@given(MAPPINGS, MAPPINGS, MAPPINGS)
def test_the_last_of_three_layers_wins_over_the_first_two(first, second, third):
    result = plain(merged(merged(tree(first), tree(second)), tree(third)))
    for keys, value in leaves(third):
        assert value == {} or at(result, keys) == value


def test_lists_are_replaced_not_joined():
    assert plain(merged(tree({"a": [1, 2, 3]}), tree({"a": [4]}))) == {"a": [4]}


@pytest.mark.parametrize("key", DISCRIMINATORS)
def test_another_class_of_thing_replaces_the_lower_mapping_whole(key):
    lower = tree({"wall": {key: "pipe", "diameter": 1}})
    assert plain(merged(lower, tree({"wall": {key: "plane"}}))) == {"wall": {key: "plane"}}
    same = merged(lower, tree({"wall": {key: "pipe", "height": 2}}))
    assert plain(same) == {"wall": {key: "pipe", "diameter": 1, "height": 2}}


def test_a_merged_value_keeps_the_place_where_it_was_written():
    result = merged(tree({"a": {"x": 1, "y": 1}}, line=3), tree({"a": {"y": 2}}, line=7))
    assert line_of(result, ("a", "x")) == 3
    assert line_of(result, ("a", "y")) == 7


@pytest.mark.parametrize(
    ("keys", "value", "depth"),
    [
        ((), {"a": [{"b": 5}]}, 0),
        (("a", 0, "b"), 5, 3),
        (("a", 0, "c"), {"b": 5}, 2),
        (("a", 1), [{"b": 5}], 1),
        (("a", -1), [{"b": 5}], 1),
        (("a", "0"), [{"b": 5}], 1),
        (("a", 0, "b", "x"), 5, 3),
        (("z", "a"), {"a": [{"b": 5}]}, 0),
    ],
)
def test_the_nearest_value_that_is_written(keys, value, depth):
    found, count = nearest(tree({"a": [{"b": 5}]}), keys)
    assert (plain(found), count) == (value, depth)


def test_a_scalar_has_no_children():
    assert child(tree(3), "a") is None
    assert child(tree("abc"), 0) is None


@given(MAPPINGS, st.lists(KEYS, min_size=1, max_size=4), VALUES)
def test_what_is_replaced_is_found_again_and_nothing_beside_it_moves(value, keys, new):
    before = tree(value)
    after = replaced(before, keys, tree(new, line=9))
    found, depth = nearest(after, keys)
    assert (plain(found), depth, line_of(after, keys)) == (new, len(keys), 9)
    assert plain(before) == value
    assert {**plain(after), keys[0]: None} == {**value, keys[0]: None}


def test_an_entry_of_a_list_is_replaced_in_place():
    assert plain(replaced(tree({"a": [1, 2, 3]}), ("a", 1), tree(9))) == {"a": [1, 9, 3]}
