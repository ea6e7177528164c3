"""Sets that a scene defines on a body: who is in them, where they may be used, what is refused."""

import re

import numpy as np
import pytest

from softsim.errors import SceneError
from softsim.scene.loading import load_scene

SECTION = """
bodies:
  b:
    mesh: {generator: block, length: 8 mm, height: 4 mm, element_size: 1 mm}
    formulation: plane_strain
    thickness: 5 mm
    material: dragon_skin_10
    position: [14 mm, 0 mm]
    sets:
SETS
time: {end: 1 s}
"""
SOLID = (
    SECTION.replace("generator: block", "generator: box, width: 3 mm")
    .replace("plane_strain\n    thickness: 5 mm", "solid")
    .replace("14 mm", "10 mm")
)
TIPS = "tips: {box: [[10 mm, 0 mm], [12 mm, 4 mm]]}"
UPPER = "upper: {plane: {point: [0 mm, 2 mm], normal: [0, 1]}}"


def with_sets(text, *sets):
    """The text of a scene with sets."""
    return text.replace("SETS", "\n".join(f"      {one}" for one in sets))


@pytest.fixture
def body(build):
    """The first body of a scene with sets."""

    def built(text, *sets):
        return build(with_sets(text, *sets)).bodies[0]

    return built


def test_all_is_the_whole_body(body):
    """As a set of nodes and of cells, from which other sets can be made; not of facets."""
    found = body(SECTION, TIPS, "rest: {difference: [all, tips]}")
    assert len(found.node_sets["all"]) == len(found.points)
    assert len(found.cell_sets["all"]) == len(found.cells)
    assert "all" not in found.facet_sets
    apart = np.concatenate([found.node_sets["rest"], found.node_sets["tips"]])
    np.testing.assert_array_equal(np.sort(apart), found.node_sets["all"])
    with pytest.raises(SceneError, match="the mesh of 'b' has a set 'all' already"):
        body(SECTION, "all: {difference: [surface, surface]}")


def facets_within(body, is_in):
    """Facets of the surface with all corners where the mask (n,) says so."""
    surface = body.facet_sets["surface"]
    return surface[is_in[surface].all(axis=1)]


@pytest.mark.parametrize("text", [SECTION, SOLID], ids=["section", "solid"])
def test_a_box_has_the_nodes_and_facets_in_it(body, text):
    """In placed coordinates, its sides included; any two opposite corners."""
    corners = "[[15 mm, 4 mm], [12 mm, 1 mm]]"
    if text is SOLID:
        corners = "[[15 mm, 4 mm, 0 mm], [12 mm, 1 mm, 1 mm]]"
    b = body(text, f"some: {{box: {corners}}}")
    x, y = b.points.T[:2] * 1e3
    inside = (x > 11.9) & (x < 15.1) & (y > 0.9)
    if text is SOLID:
        inside &= b.points[:, 2] < 1.1e-3
    assert inside.any() and not inside.all()
    assert b.node_sets["some"].tolist() == np.flatnonzero(inside).tolist()
    assert b.facet_sets["some"].tolist() == facets_within(b, inside).tolist() != []


@pytest.mark.parametrize("text", [SECTION, SOLID], ids=["section", "solid"])
def test_a_plane_has_what_its_normal_points_to(body, text):
    """Of any direction, the plane included; in space a z that is left out is zero."""
    b = body(text, "some: {plane: {point: [12 mm, 1 mm], normal: [2, -2]}}")
    x, y = b.points.T[:2] * 1e3
    beside = (x - 12.0) - (y - 1.0) > -1e-6
    assert (np.abs(x - 12.0 - (y - 1.0)) < 1e-6).any()
    assert b.node_sets["some"].tolist() == np.flatnonzero(beside).tolist()
    assert b.facet_sets["some"].tolist() == facets_within(b, beside).tolist() != []


def test_it_is_told_where_the_body_is_placed_and_turned(body):
    """Turned by 90 degrees, what was the right side is on top."""
    text = SECTION.replace("position:", "rotation: 90 deg\n    position:")
    b = body(text, "end: {plane: {point: [0 mm, 4 mm], normal: [0, 1]}}")
    assert sorted(b.node_sets["end"]) == sorted(b.node_sets["right"])
    assert sorted(b.facet_sets["end"].tolist()) == sorted(b.facet_sets["right"].tolist())


def test_sets_of_sets(body):
    """Nodes and facets, of the mesh's sets and of defined ones, in any order of definition."""
    b = body(
        SECTION,
        "both: {union: [tips, upper]}",
        "corner: {intersection: [tips, upper]}",
        "rest: {difference: [surface, both]}",
        "nested: {difference: [both, corner]}",
        "sides: {union: [left, right, top]}",
        TIPS,
        UPPER,
    )
    nodes = {name: set(members.tolist()) for name, members in b.node_sets.items()}
    facets = {name: {*map(tuple, members.tolist())} for name, members in b.facet_sets.items()}
    for sets in (nodes, facets):
        assert sets["both"] == sets["tips"] | sets["upper"]
        assert sets["corner"] == sets["tips"] & sets["upper"] != set()
        assert sets["rest"] == sets["surface"] - sets["both"] != set()
        assert sets["nested"] == sets["tips"] ^ sets["upper"]
        assert sets["sides"] == sets["left"] | sets["right"] | sets["top"]


def test_facets_that_are_turned_about_are_the_same(body, tmp_path):
    """A file may list the corners of a facet from any of them on."""
    (tmp_path / "t.inp").write_text(
        "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n"
        "*ELEMENT, TYPE=C3D4, ELSET=ALL\n1, 1, 2, 3, 4\n*SURFACE, NAME=BASE\nALL, S1\n"
    )
    text = SOLID.replace(SOLID[SOLID.index("{generator") : SOLID.index("}") + 1], "{file: t.inp}")
    b = body(text, "sloped: {difference: [surface, BASE]}", "both: {union: [sloped, BASE]}")
    assert len(b.facet_sets["sloped"]) == 3
    assert sorted(b.facet_sets["both"].tolist()) == sorted(b.facet_sets["surface"].tolist())


def test_a_set_within_a_body_has_no_facets(body):
    b = body(SECTION, "core: {box: [[12 mm, 1 mm], [14 mm, 3 mm]]}",
             "more: {union: [core, left]}")  # fmt: skip
    assert len(b.node_sets["core"]) >= 9 and "core" not in b.facet_sets
    assert sorted(b.facet_sets["more"].tolist()) == sorted(b.facet_sets["left"].tolist())


def test_a_set_is_of_nodes_or_of_facets_where_all_its_parts_are(build):
    """The ends are nodes alone, the rings facets alone, the chamber is both."""
    text = """
bodies:
  skin: {mesh: {generator: pfr_meridian, ring_rows: 3, element_size: 1 mm},
         formulation: axisymmetric, material: dragon_skin_10, sets: {made: {union: [UNION]}}}
time: {end: 1 s}
"""
    b = build(text.replace("UNION", "ends, chamber")).bodies[0]
    expected = np.union1d(b.node_sets["ends"], b.node_sets["chamber"])
    assert b.node_sets["made"].tolist() == expected.tolist() and "made" not in b.facet_sets
    b = build(text.replace("UNION", "rings, chamber")).bodies[0]
    count = len(b.facet_sets["rings"]) + len(b.facet_sets["chamber"])
    assert len(b.facet_sets["made"]) == count and "made" not in b.node_sets
    with pytest.raises(SceneError, match=r"'skin\.made' is empty") as caught:
        build(text.replace("UNION", "rings, ends"))
    assert re.search(r"rings: \d+ facets and \d+ cells; ends: \d+ nodes$", caught.value.hint)


def test_they_serve_wherever_a_set_is_named(build):
    text = with_sets(SECTION, TIPS, UPPER, "low: {difference: [surface, upper]}",
                     "far: {plane: {point: [17 mm, 0 mm], normal: [1, 0]}}")  # fmt: skip
    text = text.replace("    sets:", "    fixed: [tips]\n    sets:") + (
        "rigid_bodies: {r: {mass: 1 g, inertia: 1 kg*mm^2, tied: [b.far]}}\n"
        "conditions: {v: {kind: initial_velocity, nodes: b.upper, velocity: [1 m/s, 0 m/s]}}\n"
        "loads: {p: {kind: follower_pressure, facets: [b.low], "
        "profile: {kind: constant, value: 1 kPa}}}\n"
        "output: {probes: {u: {kind: displacement, nodes: b.upper}}}\n"
    )
    model = build(text)
    sets, facets = model.bodies[0].node_sets, model.bodies[0].facet_sets
    assert not model.is_free[sets["tips"]].any()
    assert np.isin(sets["far"], model.rigid_bodies[0].tied).all()
    assert model.pressures[0].facets.tolist() == facets["low"].tolist()
    assert model.probes[0].members.tolist() == sets["upper"].tolist()
    free = np.setdiff1d(sets["upper"], [*sets["tips"], *sets["far"]])
    assert (model.velocity[free] == [1.0, 0.0]).all()


def test_they_are_numbered_within_the_model(build):
    second = with_sets(SECTION, TIPS).split("\n  b:\n")[1].split("time:")[0]
    model = build(with_sets(SECTION, UPPER).replace("time:", f"  c:\n{second}time:"))
    first_node = model.bodies[1].first_node
    assert model.bodies[1].node_sets["tips"].min() >= first_node > 0
    assert "tips" not in model.bodies[0].node_sets


def test_a_resolved_scene_has_them(write_scene):
    sets = (TIPS, UPPER, "both: {union: [tips, upper]}", "rest: {difference: [surface, both]}")
    loaded = load_scene(write_scene(with_sets(SECTION, *sets)))
    assert load_scene(write_scene(loaded.resolved(), "b.yaml")).scene == loaded.scene


def test_one_value_can_be_set_from_outside(build):
    b = build(with_sets(SECTION, TIPS), "bodies.b.sets.tips.box.1.0=10 mm").bodies[0]
    assert sorted(b.node_sets["tips"]) == sorted(b.node_sets["left"])


@pytest.mark.parametrize(
    ("sets", "pointed_at", "message", "hint"),
    [
        (["far: {box: [[0 mm, 0 mm], [2 mm, 4 mm]]}"], "{box",
         "the set 'b.far' is empty", "the body extends from (10.00, 0.00) mm to (18.00, 4.00) mm"),
        (["far: {plane: {point: [19 mm, 0 mm], normal: [1, 0]}}"], "{plane",
         "the set 'b.far' is empty", "the body extends from"),
        (["none: {intersection: [left, right]}"], "{intersection",
         "the set 'b.none' is empty", "left: 5 nodes and 4 facets; right: 5 nodes"),
        (["none: {difference: [left, surface]}"], "{difference", "is empty", "surface: "),
        (["more: {union: [left, tpis]}", TIPS], "tpis]",
         "there is no set 'tpis' of 'b'", "did you mean 'tips'"),
        (["one: {union: [one, left]}"], "{union",
         "sets of 'b' are defined by each other in a circle", "one -> one"),
        (["one: {union: [two, left]}", "two: {difference: [left, one]}"], "{",
         "in a circle", " -> one"),
        (["left: {box: [[10 mm, 0 mm], [12 mm, 4 mm]]}"], "{box",
         "the mesh of 'b' has a set 'left' already", "another name"),
        (["flat: {box: [[10 mm, 0 mm], [12 mm, 4 mm, 1 mm]]}"], "[12 mm",
         "has 3 coordinates; this model has 2", "all coordinates of both corners"),
        (["off: {plane: {point: [0 mm, 0 mm], normal: [0, 0, 1]}}"], "[0, 0, 1]",
         "has 3 components; this model has 2", "solid"),
        (["off: {plane: {point: [0 mm, 0 mm], normal: [0, 0]}}"], "[0, 0]",
         "a direction must not be [0.0, 0.0]", "selected side"),
        (["off: {bx: [[0 mm, 0 mm], [1 mm, 1 mm]]}"], "{bx",
         "off: does not state its kind", "did you mean 'box'?"),
        (["off: {difference: [left]}"], "[left]", "must have 2 entries, not 1", "without"),
        (["off: {union: []}"], "[]", "must have at least 1, not 0", ""),
        (["b.c: {union: [left]}"], "b.c", "'b.c' is not a name", ""),
        (["off: {box: [[0, 0 mm], [1 mm, 1 mm]]}"], "0,", "needs a unit", "length"),
    ],
)  # fmt: skip
def test_each_refusal_points_at_what_is_wrong(body, sets, pointed_at, message, hint):
    with pytest.raises(SceneError) as caught:
        body(SECTION, *sets)
    assert message in caught.value.message and hint in caught.value.hint
    place = caught.value.location
    assert place.text[place.column - 1 :].startswith(pointed_at)


def test_a_box_in_space_needs_all_of_its_corners(body):
    with pytest.raises(SceneError, match="has 2 coordinates; this model has 3"):
        body(SOLID, TIPS)


def test_what_has_no_facets_is_no_facet_set(build):
    load = (
        "loads: {p: {kind: follower_pressure, facets: [b.core], "
        "profile: {kind: constant, value: 1 kPa}}}"
    )
    core = "core: {box: [[12 mm, 1 mm], [14 mm, 3 mm]]}"
    with pytest.raises(SceneError, match=r"there is no facet set 'b\.core'"):
        build(with_sets(SECTION, core) + load)
