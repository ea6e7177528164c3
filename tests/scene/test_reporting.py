import re
import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import pytest

from softsim.errors import Location, Option, SceneError
from softsim.scene.loading import load_scene
from softsim.scene.reporting import scene_error
from softsim.scene.schema import Scene
from softsim.scene.text import Tree


def problems(path):
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "first", "hint"),
    [
        ("end: 24 s", "end: 1e-300 s", "a.yaml:8:8: end: '1e-300 s' is too small to be represented",
         "a duration such as"),
        ("end: 24 s", "end: 1e300 s", "a.yaml:8:8: end: '1e300 s' is too large to be represented",
         "a duration such as"),
        ("end: 24 s", "end: -1 s", "a.yaml:8:8: end: '-1 s' must be greater than 0 s",
         'a duration such as "24 s"'),
        ("end: 24 s", "end: 24", 'a.yaml:8:8: end: a duration needs a unit: write "24 s"', ""),
        ("end: 24 s", "end: 3 kPa", "end: '3 kPa' is a pressure, a duration is needed", ""),
        ("thickness", "thicknes", "thickness: a plane_strain body needs a thickness", ""),
        ("plane_strain", "axisymmetric",
         "a.yaml:5:16: thickness: has no meaning for a body that is axisymmetric: leave it", ""),
        ("plane_strain", "ring_section\n    rings: b",
         "sector: a ring_section body needs a sector", ""),
        ("plane_strain", "ring_section\n    sector: 9 deg",
         "rings: a ring_section body needs the name of its rings", ""),
        ("plane_strain\n    thickness: 10 mm", "ring_section\n    sector: 9 deg\n    rings: b",
         "thickness: a ring_section body needs a thickness", ""),
        ("plane_strain", "plane_strain\n    sector: 9 deg",
         "a.yaml:5:13: sector: has no meaning for a body that is plane_strain: leave it out", ""),
        ("plane_strain", "ring_section\n    rings: b\n    sector: 0 deg",
         "a.yaml:6:13: sector: 0 deg must be greater than 0", ""),
        ("plane_strain", "ring_section\n    rings: b\n    sector: 181 deg",
         "a.yaml:6:13: sector: 181 deg must be at most", "at most 180 deg"),
        ("  end", "  start: 0 s\n  end", "a.yaml:8:3: unknown key 'start' in time",
         "allowed here: end, cycles, procedure, method, control, settle, until, reach, increment"),
        ("time:", "solvr: {}\ntime:", "a.yaml:7:1: unknown key 'solvr'", "did you mean 'solver'?"),
        ("generator: block", "generator: blok", "a.yaml:3:23: generator: 'blok' is unknown here",
         "did you mean 'block'?"),
        ("generator: block, ", "", "a.yaml:3:5: mesh: the key 'generator' is missing",
         "give generator: block | pfr_section | box | pfr_meridian | pfr_solid | leafbot_section "
         "| leafbot_solid | spike_patch | pneunet | quadruped | bellows_section | bellows_solid "
         "| bending_actuator or file: ..."),
        ("plane_strain", "plane", "a.yaml:4:18: formulation: 'plane' is not one of: plane_strain",
         ""),
        ("dragon_skin_10", "3", "a.yaml:6:15: material: must be a text, not the number 3",
         'write "3" with quotes'),
        ("time:", "environment:\ntime:", "environment: must be a mapping of keys to values, "
         "not nothing", ""),
        ("time:", "loads: {a: 3}\ntime:", "a.yaml:7:12: a: must be a mapping of keys to values, "
         "not the number 3", ""),
        ("time:", "loads: {a: {}}\ntime:", "a.yaml:7:9: a: the key 'kind' is missing",
         "give kind: follower_pressure | added_volume | added_gas | pneumatic | eccentric_mass"),
        ("time:", "contact: {damping_ratio: 2}\ntime:",
         "a.yaml:7:26: damping_ratio: 2 must be at most 1", ""),
        ("time:", "expect: {body_speed: {}}\ntime:", "body_speed: gives no limit", ""),
        ("    material", "    position: [1 mm]\n    material",
         "a.yaml:6:15: position: must have at least 2, not 1", ""),
        ("    material", "    position: [1 mm, 1 mm, 1 mm, 1 mm]\n    material",
         "a.yaml:6:15: position: must have at most 3, not 4", ""),
        ("block:\n", "b.c:\n", "a.yaml:2:3: 'b.c' is not a name: use letters, digits, _ and - only",
         ""),
    ],
)  # fmt: skip
def test_each_problem_names_its_place_and_what_is_right(write, smallest, old, new, first, hint):
    text = problems(write(a=smallest.replace(old, new)))
    assert first in text and hint in text


MESH = "{generator: block, length: 10 mm, height: 5 mm, element_size: 1 mm}"
SOFT = "C10: 3 kPa, density: 1 kg/m^3"
PULL = "kind: nodal_force, nodes: block.top"
BLOW = "kind: follower_pressure, facets: [block.top]"
JARGON = (
    "pydantic", "https:", "union", "tagged", "discriminator", "literal", "Input", "input_value",
    "validation", "NoneType", "dict", "tuple", "Value error", "model_",
)  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "pointed_at"),
    [
        # keys that are unknown or missing, at each depth
        ("time:", "titel: x\ntime:", "titel: x"),
        ("end: 24 s", "end: 24 s\n  stop: 1 s", "stop: 1 s"),
        ("length: 10 mm", "lenght: 10 mm, length: 1 mm", "lenght"),
        ("height: 5 mm, ", "", "mesh: {"),
        ("time:\n  end: 24 s", "", "bodies:"),
        (MESH, "{file: x.msh, unit: 1 mm}", "unit: 1 mm"),
        # which class of thing it is
        ("generator: block", "generator: 3", "3,"),
        ("generator: block", "generator: [block]", "[block],"),
        (MESH, "block", "block"),
        (MESH, "", ""),
        ("time:", "environment: {walls: {w: {kind: tube}}}\ntime:", "tube"),
        ("time:", "environment: {walls: {w: {diameter: 1 mm}}}\ntime:", "w: {"),
        ("time:", f"materials: {{m: {{law: hooke, {SOFT}}}}}\ntime:", "hooke"),
        ("time:", f"materials: {{m: {{{SOFT}}}}}\ntime:", "m: {"),
        ("time:", f"loads: {{a: {{{BLOW}, profile: {{kind: sinus}}}}}}\ntime:", "sinus"),
        ("time:", f"loads: {{a: {{{BLOW}, profile: 3 kPa}}}}\ntime:", "3 kPa"),
        ("time:", f"loads: {{a: {{{BLOW}}}}}\ntime:", "a: {"),
        # values of the wrong type or outside their limits
        ("time:", f"loads: {{a: {{{PULL}, force: [1 N, 2]}}}}\ntime:", "2]"),
        ("time:", f"loads: {{a: {{{PULL}, force: 1 N}}}}\ntime:", "1 N}"),
        ("end: 24 s", "end: 24 s\n  increment: atuo", "atuo"),
        ("end: 24 s", "end: 24 s\n  increment: [auto]", "[auto]"),
        ("24 s", "24 furlong", "24 furlong"),
        ("24 s", "nan s", "nan s"),
        ("24 s", "{s: 24}", "{s: 24}"),
        ("time:", "title: 12\ntime:", "12"),
        ("time:", "contact: {friction_coefficient: 3 mm}\ntime:", "3 mm"),
        ("time:", "contact: {friction_coefficient: true}\ntime:", "true"),
        ("time:", "contact: {friction_coefficient: 1e999}\ntime:", "1e999"),
        ("time:", "environment: {gravity: -1 m/s^2}\ntime:", "-1 m/s^2"),
        ("time:", "environment: {walls: {w: {kind: plane, normal: [0, 0]}}}\ntime:", "[0, 0]"),
        (MESH, "{generator: pfr_section, spikes_per_strip: 2.5}", "2.5"),
        ("time:", "output: {snapshot_field: strech}\ntime:", "strech"),
        ("bodies:", "bodies: {}\nsolver:", "{}"),
        ("bodies:", "bodies: [1]\nsolver:", "[1]"),
        # what is no YAML scene at all
        ("time:", "bodies: {}\ntime:", "bodies: {}"),
        ("end: 24 s", "end: 24: s", ": s"),
        ("24 s", "!!python/name:os.system", "!!python"),
        ("24 s", "*somewhere", "*somewhere"),
        ("24 s", "&here [*here]", "&here"),
    ],
)
def test_the_caret_stands_below_what_is_wrong_and_the_words_are_for_people(
    write, smallest, old, new, pointed_at
):
    assert smallest.count(old) == 1
    text = smallest.replace(old, new)
    with pytest.raises(SceneError) as caught:
        load_scene(write(a=text))
    first = caught.value
    place = first.location
    assert isinstance(place, Location)
    assert place.text == text.splitlines()[place.line - 1]
    assert place.text[place.column - 1 :].startswith(pointed_at)
    head, line, caret = str(SceneError(first.message, location=place)).splitlines()
    assert head.startswith(f"a.yaml:{place.line}:{place.column}: ")
    assert line.endswith(f" | {place.text}")
    assert line[caret.index("^") :].startswith(pointed_at) and caret.endswith("^")
    words = "\n".join(f"{e.message}\n{e.hint}" for e in (first, *first.further))
    assert not [word for word in JARGON if word in words]


class Counted(dict):
    """One of pydantic's errors; counts how often any of them is looked at."""

    looks = 0

    def __getitem__(self, key):
        Counted.looks += 1
        return super().__getitem__(key)


def looks_at(count):
    """How often `scene_error` looks at one of `count` problems."""
    problem = {"type": "too_short", "input": [], "ctx": {"min_length": 1, "actual_length": 0}}
    found = [
        Counted(problem, loc=("loads", f"a{n}", "follower_pressure", "facets"))
        for n in range(count)
    ]
    Counted.looks = 0
    place = Option("--set x")
    all_of_them: Any = SimpleNamespace(errors=lambda **_: found)
    error = scene_error(all_of_them, Tree({}, place, place), Scene)
    assert "must have at least 1, not 0" in str(error)
    return Counted.looks


def test_twice_the_problems_are_twice_the_work():
    assert looks_at(400) - looks_at(200) == 2 * (looks_at(200) - looks_at(100)) > 0


def test_no_word_of_the_parser_reaches_the_user(write, smallest):
    text = problems(write(a=smallest.replace("generator: block", "generator: 3") + "x: 1\n"))
    for word in ("pydantic", "https:", "tag", "discriminator", "Input", "NoneType"):
        assert word not in text


def test_all_problems_are_told_at_once(write, smallest):
    text = problems(write(a=smallest.replace("24 s", "x").replace("10 mm", "x") + "x: 1\n"))
    assert text.count("a.yaml:") == 4


def test_one_wrong_entry_is_one_problem(write, smallest):
    profile = "profile: {kind: constant, value: 1 kPa}"
    load = f"loads: {{a: {{kind: follower_pressure, facets: [3], {profile}}}}}"
    text = problems(write(a=smallest + load))
    assert "facets[0]: must be a text, not the number 3" in text and text.count("a.yaml:") == 1


def test_a_flood_of_problems_is_cut_short(write, smallest):
    keys = "".join(f"wrong_{n}: 1\n" for n in range(50))
    text = problems(write(a=smallest + keys))
    assert "and 30 more problems" in text and text.count("a.yaml:") == 20


def test_loading_a_module_needs_no_pint_and_no_taichi():
    code = "import softsim.scene.loading, sys; assert not {'pint', 'taichi'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


INDENTED = """bodies:
  b:
    mesh: {generator: block, length: 10 mm, height: 6 mm, element_size: 2 mm}
    formulation: plane_strain
    material: dragon_skin_10
    thickness: 10 mm
loads:
  air:
    kind: follower_pressure
    facets: [b.top]
    profile: {kind: constant, value: 3 kPa}
time:
  end: 1 s
"""


NEEDS_THICKNESS = "a.yaml:3:5: thickness: a plane_strain body needs a thickness"
TOO_FAR_OUT = "is one level too far out: it belongs to"


@pytest.mark.parametrize(
    ("old", "new", "lines"),
    [
        ("    profile", "  profile", [f"a.yaml:11:3: 'profile' {TOO_FAR_OUT} 'air'"]),
        ("  end: 1 s", "end: 1 s", [f"a.yaml:13:1: 'end' {TOO_FAR_OUT} 'time'"]),
        ("    thickness", "  thickness",
         [f"a.yaml:6:3: 'thickness' {TOO_FAR_OUT} 'b'", NEEDS_THICKNESS]),
        ("    thickness", "    thicknes",
         ["a.yaml:6:5: unknown key 'thicknes' in b", NEEDS_THICKNESS]),
        ("    profile", "    profil",
         ["a.yaml:11:5: unknown key 'profil' in air"]),
        ("    profile", "    curve",
         ["a.yaml:11:5: unknown key 'curve' in air",
          "a.yaml:8:3: air: the key 'profile' is missing"]),
    ],
)  # fmt: skip
def test_the_cause_comes_before_its_consequence(write, old, new, lines):
    said = problems(write(a=INDENTED.replace(old, new)))
    assert re.findall(r"a\.yaml:\d+:\d+: .*", said) == lines
