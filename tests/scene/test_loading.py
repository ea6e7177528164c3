from itertools import zip_longest
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from softsim.errors import SceneError
from softsim.scene.loading import load_scene
from softsim.scene.loads import FollowerPressureSpec
from softsim.scene.profiles import TableSpec

WITH_ALL = """\
title: "one: two # three"
materials:
  soft:
    law: yeoh
    C10: 36 kPa
    density: 1070 kg/m^3
    prony:
      - {g: 0.1, relaxation_time: 2 ms}
      - {g: 2e-1, relaxation_time: 3.3333 ms}
bodies:
  skin:
    mesh: {generator: pfr_section, lean: 2.7 mm}
    formulation: plane_strain
    thickness: 10 mm
    material: soft
    position: [1 mm, -2 um]
rigid_bodies:
  frame: {mass: 8 g, inertia: 500 g*mm^2, tied: [skin.knots]}
environment:
  inclination: 33 deg
  walls:
    pipe: {kind: pipe, diameter: 36 mm}
loads:
  air:
    kind: follower_pressure
    facets: [skin.chamber_top, skin.chamber_bottom]
    profile: {kind: table, points: [[0 s, 0 kPa], [1 s, 23 kPa], [2 s, 9.1 kPa]]}
time:
  end: 24 s
expect:
  rows_in_contact: {max: 4}
"""


def problem(*arguments):
    with pytest.raises(SceneError) as caught:
        load_scene(*arguments)
    return str(caught.value)


def test_the_smallest_scene_loads(write, smallest):
    loaded = load_scene(write(a=smallest))
    assert loaded.scene.bodies["block"].thickness == 0.01
    assert (loaded.path, loaded.folder) == (Path("a.yaml"), Path("."))


def test_a_missing_file_is_named(write, smallest):
    write(a=smallest)
    assert "b.yaml: no such file" in problem("b.yaml")
    assert ". is a folder" in problem(".")
    assert "no such file" in problem("a\0b")


def test_parts_lie_below_the_file_and_later_ones_win(write, smallest):
    write(
        a="include: [one.yaml, sub/two.yaml]\ntime: {increment: 1 us}\n"
        + smallest.replace("time:\n  end: 24 s\n", ""),
        one="time: {end: 1 s, increment: 2 us}\nsolver: {safety_factor: 0.5}\n",
        **{"sub/two": "include: three.yaml\ntime: {end: 2 s}\n", "sub/three": "title: deep\n"},
    )
    scene = load_scene("a.yaml").scene
    assert (scene.time.end, scene.time.increment) == (2.0, 1e-6)
    assert (scene.solver.safety_factor, scene.title) == (0.5, "deep")


def test_another_kind_replaces_the_included_mapping(write, smallest):
    write(
        a="include: b.yaml\nenvironment: {walls: {w: {kind: plane}}}\n" + smallest,
        b="environment: {walls: {w: {kind: pipe, diameter: 36 mm}}}\n",
    )
    assert load_scene("a.yaml").scene.environment.walls["w"].kind == "plane"


@pytest.mark.parametrize(
    ("include", "message"),
    [
        ("../b.yaml", "'../b.yaml' is outside the folder of the scene"),
        ("sub/../../b.yaml", "is outside the folder of the scene"),
        ("/etc/hostname", "is outside the folder of the scene"),
        ("none.yaml", "there is no file none.yaml to include"),
        ("[3]", "must be a file name"),
        ("{a: b}", "must be a file name"),
        ("null", "must be a file name"),
        ("x" * 5000, "there is no file"),
        ('"a\\0"', "is outside the folder of the scene"),
        ("away.yaml", "a file outside the folder of the scene, /etc/hostname"),
        ("loop.yaml", "there is no file loop.yaml to include"),
        ("a.yaml", "a.yaml -> a.yaml"),
        ("circle.yaml", "a.yaml -> circle.yaml -> a.yaml"),
    ],
)
def test_includes_that_cannot_be(write, smallest, tmp_path, include, message):
    (tmp_path / "away.yaml").symlink_to("/etc/hostname")
    (tmp_path / "loop.yaml").symlink_to("loop.yaml")
    write(a=f"include: {include}\n" + smallest, circle="include: ./sub/../a.yaml")
    assert message in problem("a.yaml")


def test_an_error_in_a_part_names_the_part(write, smallest):
    write(a="include: b.yaml\n" + smallest, b="\ncontact:\n  friction_coefficient: -1\n")
    assert problem("a.yaml").startswith("b.yaml:3:25: friction_coefficient: -1 must be at least 0")


def test_options_win_over_files_and_later_ones_over_earlier(write):
    options = ["time.end=3 s", "time.end=4 s", "solver.safety_factor=5e-1", "title=yes",
               "loads.air.profile.points[1][1]=3 kPa", "materials.soft.prony[0].g=0.2",
               "environment.walls.floor={kind: plane}"]  # fmt: skip
    scene = load_scene(write(a=WITH_ALL), options).scene
    assert (scene.time.end, scene.solver.safety_factor, scene.title) == (4.0, 0.5, "yes")
    load = scene.loads["air"]
    assert isinstance(load, FollowerPressureSpec) and isinstance(load.profile, TableSpec)
    assert load.profile.points[1][1] == 3000.0
    assert scene.materials["soft"].prony[0].g == 0.2
    assert scene.environment.walls["floor"].kind == "plane"


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("time.end", "--set time.end: must read PATH=VALUE"),
        ("=3", "must read PATH=VALUE"),
        ("time..end=3 s", "must read PATH=VALUE"),
        ("time.end=3", 'a duration needs a unit: write "3 s"'),
        ("time.end=", "must be a text with a number and a unit"),
        ("time.and=3 s", "there is no 'time.and'\n  did you mean 'end'?"),
        ("contact.friction=1", "did you mean 'friction_coefficient'"),
        ("tim.end=3 s", "there is no 'tim'\n  did you mean 'time'?"),
        ("bodies.skn.thickness=1 mm", "there is no 'bodies.skn'\n  did you mean 'skin'?"),
        ("bodies.skin.mesh.leen=1 mm", "did you mean 'lean'?"),
        ("time.end.x=3 s", "end has no keys below it"),
        ("loads.air.facets.7=skin.x", "'7' is not an entry of this list\n  entries 0 to 1"),
        ("loads.air.facets.x=skin.x", "'x' is not an entry of this list"),
        ("title=[", "--set title=[:"),
        ("title=!!set x", "is not supported"),
        ("include=b.yaml", "there is no 'include'"),
        ("rigid_bodies.frame.supports.0.x=1", "give 'rigid_bodies.frame.supports' as a whole"),
    ],
)
def test_options_that_lead_nowhere_are_named(write, option, message):
    text = problem(write(a=WITH_ALL), [option])
    assert message in text and f"--set {option}" in text


def test_later_layers_point_at_a_key_or_at_what_stands_above_it(write):
    loaded = load_scene(write(a=WITH_ALL), ["solver.safety_factor=0.5"])
    assert "a.yaml:15:15" in str(loaded.error(("bodies", "skin", "material"), "unknown"))
    assert "a.yaml:12:5" in str(loaded.error(("bodies", "skin", "rotation"), "too large"))
    assert "--set solver" in str(loaded.error(("solver", "safety_factor"), "too large"))


def test_mesh_files_are_found_beside_the_file_that_names_them(write, smallest, tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub/x.msh").touch()
    keys = ("bodies", "block", "mesh", "file")
    own = smallest.replace(
        "{generator: block, length: 10 mm, height: 5 mm, element_size: 1 mm}", "{}"
    )
    write(
        a="include: sub/b.yaml\n" + own.replace("    mesh: {}\n", ""),
        **{"sub/b": "bodies: {block: {mesh: {file: x.msh}}}"},
    )
    assert load_scene("a.yaml").resolve_file(keys) == Path("sub/x.msh")
    with pytest.raises(SceneError, match=r"there is no file sub/y\.msh"):
        load_scene("a.yaml", ["bodies.block.mesh.file=sub/y.msh"]).resolve_file(keys)
    with pytest.raises(SceneError, match="is outside the folder of the scene"):
        load_scene("a.yaml", ["bodies.block.mesh.file=../y.msh"]).resolve_file(keys)
    (tmp_path / "sub/beside.msh").symlink_to("x.msh")
    at_x, away = ["bodies.block.mesh.file=sub/beside.msh"], ["bodies.block.mesh.file=sub/away.msh"]
    assert load_scene("a.yaml", at_x).resolve_file(keys) == Path("sub/beside.msh")
    (tmp_path / "sub/away.msh").symlink_to("/etc/hostname")
    with pytest.raises(
        SceneError, match="is a symbolic link to a file outside the folder of the scene, /etc/"
    ):
        load_scene("a.yaml", away).resolve_file(keys)


def test_a_resolved_scene_tells_origins_and_loads_to_the_same(write):
    loaded = load_scene(write(a=WITH_ALL), ["time.end=3.3 s", "loads.air.profile.points.1.1=7 kPa"])
    text = loaded.resolved()
    write(b=text)
    assert load_scene("b.yaml").scene == loaded.scene
    for line in (
        "    mass: 8 g  # a.yaml:18",
        "  end: 3.3 s  # --set",
        "  increment: auto  # default",
        "        - [1 s, 7 kPa]  # a.yaml:27, --set",
        "      lean: 2.7 mm  # a.yaml:12",
        "      rear_radius: 3.5 mm  # default",
    ):
        assert line in text.splitlines()


SCENES = sorted((Path(__file__).parents[2] / "scenes").glob("*.yaml"))


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_each_scene_of_the_project_is_the_same_when_resolved(path, tmp_path):
    loaded = load_scene(path)
    written = tmp_path / "resolved.yaml"
    written.write_text(loaded.resolved(), encoding="utf-8")
    assert load_scene(written).scene == loaded.scene


def scalars(read):
    """Every scalar in what a line of YAML says: a value, or those of a list, also as an entry."""
    if isinstance(read, dict):
        read = list(read.values())
    return [word for part in read for word in scalars(part)] if isinstance(read, list) else [read]


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_each_value_of_a_resolved_scene_stands_where_its_origin_says(path):
    for line in load_scene(path, ["solver.safety_factor=0.5"]).resolved().splitlines():
        if line.endswith(":"):
            continue  # a mapping: its values have origins
        entry, _, origin = line.rpartition("  # ")
        assert entry, f"no origin: {line}"
        if origin == "--set":
            assert entry.strip() == "safety_factor: 0.5"
        elif origin != "default":
            for place, word in zip_longest(
                origins := origin.split(", "), scalars(yaml.load(entry, yaml.BaseLoader))
            ):
                # One line has all values of a list, or each value begins on a line of its own.
                file, _, number = (place or origins[0]).rpartition(":")
                there = Path(file).read_text(encoding="utf-8").splitlines()[int(number) - 1 :]
                begins = word in there[0] or word in " ".join(" ".join(there[:4]).split())
                assert begins, line


def test_a_part_may_be_included_twice_but_files_do_not_multiply_without_end(write, smallest):
    write(
        a="include: [b.yaml, c.yaml]\n" + smallest,
        b="include: d.yaml\n",
        c="include: d.yaml\ntitle: c\n",
        d="title: d\nsolver: {safety_factor: 0.5}\n",
    )
    scene = load_scene("a.yaml").scene
    assert (scene.title, scene.solver.safety_factor) == ("c", 0.5)
    twice = {f"s{n}": f"include: [s{n + 1}.yaml, s{n + 1}.yaml]\n" for n in range(12)}
    write(**twice, s12="title: last\n")
    assert "more than 100 files are included" in problem("s0.yaml")


def test_a_value_from_an_option_is_reported_under_its_option_not_under_the_file(write):
    with pytest.raises(SceneError) as caught:
        load_scene(write(a=WITH_ALL), ["bodies.skin.thickness=-1 mm"])
    assert str(caught.value.location) == "--set bodies.skin.thickness=-1 mm"
    assert "a.yaml" not in str(caught.value)


FUZZ = settings(max_examples=150, suppress_health_check=list(HealthCheck))


@FUZZ
@given(title=st.text(), source=st.text())
@pytest.mark.physics
def test_any_text_survives_being_resolved(write, title, source):
    scene = yaml.safe_load(WITH_ALL)
    scene["title"], scene["materials"]["soft"]["source"] = title, source
    write(a=yaml.safe_dump(scene, allow_unicode=True))
    try:
        loaded = load_scene("a.yaml")
    except SceneError:
        return  # such as a text that YAML cannot hold
    write(b=loaded.resolved())
    assert load_scene("b.yaml").scene == loaded.scene


@FUZZ
@given(text=st.one_of(st.text(), st.binary()))
def test_any_file_is_a_scene_or_a_scene_error(write, text):
    write(a=text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass"))
    assert problem("a.yaml")


WORDS = st.sampled_from(
    ["bodies", "skin", "mesh", "generator", "block", "file", "kind", "pipe", "loads", "time", "end",
     "table", "points", "profile", "law", "include", "3 s", "3", "-1 mm", "~", "true", "1e-3", "[]",
     "{}", "[key]", "expect", "min", "walls", "environment", "prony", "materials", "\"\\ud800\""]
)  # fmt: skip
TREES = st.recursive(
    WORDS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3).map(lambda entries: f"[{', '.join(entries)}]"),
        st.dictionaries(WORDS, inner, max_size=3).map(
            lambda pairs: "{" + ", ".join(f"{k}: {v}" for k, v in pairs.items()) + "}"
        ),
    ),
    max_leaves=12,
)
SECTIONS = st.sampled_from(
    ["bodies.skin", "bodies.skin.mesh", "materials.soft.prony", "loads.air", "loads.air.profile",
     "loads.air.profile.points", "environment.walls.pipe", "environment", "expect.body_speed",
     "rigid_bodies.frame.outline", "time.end", "contact", "bodies", "loads", "title"]
)  # fmt: skip


@FUZZ
@given(section=SECTIONS, value=TREES)
def test_any_wrong_value_anywhere_is_a_scene_error_that_can_be_printed(write, section, value):
    write(a=WITH_ALL)
    try:
        loaded = load_scene("a.yaml", [f"{section}={value}"])
    except SceneError as error:
        assert str(error).encode()
        return
    write(b=loaded.resolved())
    assert load_scene("b.yaml").scene == loaded.scene


@FUZZ
@given(start=st.integers(0, len(WITH_ALL)), length=st.integers(0, 40), new=st.text(max_size=5))
def test_a_torn_scene_loads_or_is_a_scene_error(write, start, length, new):
    write(a=(WITH_ALL[:start] + new + WITH_ALL[start + length :]).encode("utf-8", "replace"))
    try:
        loaded = load_scene("a.yaml")
    except SceneError as error:
        assert str(error).encode()
        return
    write(b=loaded.resolved())
    assert load_scene("b.yaml").scene == loaded.scene
