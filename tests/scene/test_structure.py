"""What the schema knows of a key."""

from pathlib import Path

import pytest

from softsim.scene.loading import flow_text, keys_at, load_scene, read_scene
from softsim.scene.schema import Scene
from softsim.scene.text import entries, listed, place_in, plain, read_text

PFR = Path(__file__).parents[2] / "scenes/pfr_36mm.yaml"


@pytest.mark.parametrize(
    ("path", "unit", "is_whole"),
    [
        ("time.end", "s", False),
        ("time.increment", "s", False),  # or auto
        ("bodies.skin.thickness", "m", False),  # or none
        ("bodies.skin.sector", "rad", False),
        ("rigid_bodies.frame.center.1", "m", False),
        ("loads.air.profile.deflation_rate", "Pa/s", False),
        ("loads.air.on_skin.1.0", "Pa", False),
        ("loads.air.profile.count", None, True),
        ("contact.friction_coefficient", None, False),
        ("bodies.skin.material", None, False),
        ("materials.sleeve.spectrum.relaxation_time", "s", False),
        ("materials.elastic.prony.0.relaxation_time", "s", False),
    ],
)
def test_what_is_due_at_a_key(path, unit, is_whole):
    overrides = [
        "rigid_bodies.frame.center=[0 mm, 0 mm]",
        "loads.air.on_skin=[[0 kPa, 0 kPa], [23 kPa, 10 kPa]]",
        "materials.elastic={law: neo_hooke, C10: 36 kPa, density: 1070 kg/m^3, "
        "prony: [{g: 0.1, relaxation_time: 1 ms}]}",
    ]
    tree = load_scene(PFR, overrides).tree
    place = place_in(Scene, tree, keys_at(tree, path, tree.origin))
    assert place is not None
    assert (place.quantity and place.quantity.unit, place.is_whole) == (unit, is_whole)


def test_what_the_schema_does_not_have():
    assert place_in(Scene, read_scene(PFR), ("time", "and")) is None


def test_mappings_and_lists_at_keys():
    tree = read_scene(PFR)
    assert list(entries(tree, "environment", "walls")) == ["pipe"]
    assert len(listed(tree, "rigid_bodies", "frame", "free")) == 2
    assert entries(tree, "loads", "none") == {} and listed(tree, "environment", "walls") == ()


@pytest.mark.parametrize(
    "value",
    ["23 kPa", "yes: no", "", "# x", "1e-3", "null", 1, -2.5e-7, True, None, [1, [2, "a b"]], [],
     {}, {"a": {"b c": [1, "x, y"]}, "kind": "cycles"}, "ä\n{"],
)  # fmt: skip
def test_values_on_one_line_read_back(value):
    text = flow_text(value)
    assert "\n" not in text
    tree = read_text(text, lambda line, column: PFR)
    assert tree is not None and plain(tree) == value
    assert plain(read_text(flow_text(tree), lambda line, column: PFR)) == value
