import subprocess
import sys

import pytest

from softsim.errors import SceneError
from softsim.scene.loading import load_scene


def problems(path):
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "first", "hint"),
    [
        ("end: 24 s", "end: -1 s", "a.yaml:8:8: end: '-1 s' must be greater than 0 s",
         'a duration such as "24 s"'),
        ("end: 24 s", "end: 24", 'a.yaml:8:8: end: a duration needs a unit: write "24 s"', ""),
        ("end: 24 s", "end: 3 kPa", "end: '3 kPa' is a pressure, a duration is due", ""),
        ("thickness", "thicknes", "a.yaml:2:3: block: the key 'thickness' is missing", ""),
        ("  end", "  start: 0 s\n  end", "a.yaml:8:3: unknown key 'start' in time",
         "allowed here: end, increment"),
        ("time:", "solvr: {}\ntime:", "a.yaml:7:1: unknown key 'solvr'", "did you mean 'solver'?"),
        ("generator: block", "generator: blok", "a.yaml:3:23: generator: 'blok' is unknown here",
         "did you mean 'block'?"),
        ("generator: block, ", "", "a.yaml:3:5: mesh: the key 'generator' is missing",
         "give generator: block | pfr_section or file: ..."),
        ("plane_strain", "plane", "a.yaml:4:18: formulation: 'plane' is not one of: plane_strain",
         ""),
        ("dragon_skin_10", "3", "a.yaml:6:15: material: must be a text, not the number 3",
         'write "3" with quotes'),
        ("time:", "environment:\ntime:", "environment: must be a mapping of keys to values, "
         "not nothing", ""),
        ("time:", "loads: {a: 3}\ntime:", "a.yaml:7:12: a: must be a mapping of keys to values, "
         "not the number 3", ""),
        ("time:", "loads: {a: {}}\ntime:", "a.yaml:7:9: a: the key 'kind' is missing",
         "give kind: follower_pressure | eccentric_mass | sinusoidal_force | nodal_force"),
        ("time:", "contact: {damping_ratio: 2}\ntime:",
         "a.yaml:7:26: damping_ratio: 2 must be at most 1", ""),
        ("time:", "expect: {body_speed: {}}\ntime:", "body_speed: gives no limit", ""),
        ("    material", "    position: [1 mm]\n    material",
         "a.yaml:6:15: position: must have 2 entries, not 1", ""),
        ("    material", "    position: [1 mm, 1 mm, 1 mm]\n    material",
         "a.yaml:6:15: position: must have 2 entries, not 3", ""),
        ("block:\n", "b.c:\n", "a.yaml:2:3: 'b.c' is no name: letters, digits, _ and - make one",
         ""),
    ],
)  # fmt: skip
def test_each_problem_names_its_place_and_what_is_right(write, smallest, old, new, first, hint):
    text = problems(write(a=smallest.replace(old, new)))
    assert first in text and hint in text


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
