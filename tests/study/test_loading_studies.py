"""What a study may say, in a file or in Python, and what is said of one that is wrong."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from softsim.errors import SceneError
from softsim.scene.loading import load_layout
from softsim.study.cases import Source, resolved
from softsim.study.factors import Interval
from softsim.study.loading import Spread, describe, load_study, repeated_assessment, study_from
from softsim.study.schema import Plot, StudyAxis

STUDY = """\
scene: block.yaml
set: {time.end: 1 s}
factors:
  thick: {key: bodies.block.thickness, values: [5 mm, 1 cm]}
  friction: {key: contact.friction_coefficient, range: [0.2, 0.8], count: 3}
measures:
  moved: {of: body_displacement, unit: mm}
"""
THICK = "thick: {key: bodies.block.thickness, values: [5 mm, 1 cm]}"
MEASURES = "measures:"


@pytest.fixture
def load(folder):
    """Load the study above with one piece of its text replaced by another."""

    def load_text(old: str = "", new: str = "", *overrides: str):
        assert old in STUDY
        Path("study.yaml").write_text(STUDY.replace(old, new, 1), encoding="utf-8")
        return load_study("study.yaml", overrides)

    return load_text


def test_a_study_has_axes_and_cases(load):
    study = load()
    assert study.factors == (StudyAxis("thick", "mm"), StudyAxis("friction"))
    assert [measure.column for measure in study.measures] == ["moved [mm]"]
    assert study.plots == (Plot("heat_map", "thick", "friction", colour="moved"),)
    assert study.goal is None and study.title == "study"
    assert study.case_count == len(study.cases()) == 6
    third = study.cases()[2]
    assert (third.number, third.values) == (3, {"thick": 5.0, "friction": 0.8})
    assert third.source.scene == Path("block.yaml") and third.source.robot is None
    assert third.overrides == (
        "time.end=1 s", "bodies.block.thickness=5 mm", "contact.friction_coefficient=0.8",
    )  # fmt: skip


def test_values_are_in_the_unit_of_the_first(load):
    assert [case.values["thick"] for case in load().cases()[::3]] == [5.0, 10.0]


def test_the_scene_is_relative_to_the_study(folder):
    Path("studies").mkdir()
    text = "scene: ../block.yaml\nfactors: {end: {key: time.end, values: [1 s]}}\n"
    Path("studies/a.yaml").write_text(text + "measures: {e: {of: energy_error}}\n")
    study = load_study("studies/a.yaml")
    assert study.cases()[0].source.scene == Path("block.yaml")


def test_options_win_over_what_the_study_sets(load):
    study = load("", "", "time.end=2 s", "solver.safety_factor=0.5")
    assert study.cases()[0].overrides[:2] == ("time.end=2 s", "solver.safety_factor=0.5")
    study = load("1 s}", "1 s, time.settle: 1 s}", "time={end: 3 s}")
    assert study.cases()[0].overrides[0] == "time={end: 3 s}"


def test_scenes_variants_and_words_are_labels(load):
    Path("thin.yaml").write_text(Path("block.yaml").read_text().replace("10 mm\n", "2 mm\n"))
    study = load(
        f"scene: block.yaml\nset: {{time.end: 1 s}}\nfactors:\n  {THICK}",
        "factors:\n  size: {scenes: {thick: block.yaml, thin: thin.yaml}, about: size}\n"
        "  law: {variants: {soft: {bodies.block.material: dragon_skin_10, time.end: 2 s},\n"
        "                   hard: {bodies.block.material: dragon_skin_30}}}\n"
        "  shown: {key: output.snapshot_field, values: [stretch, pressure]}\n",
    )
    assert study.factors[0] == StudyAxis("size", is_label=True, about="size")
    assert all(axis.is_label for axis in study.factors[:3])
    assert study.plots == tuple(Plot("scatter", name, "moved") for name in study.search_space)
    case = study.cases()[12]
    assert case.source.scene == Path("thin.yaml")
    assert case.values == {"size": "thin", "law": "soft", "shown": "stretch", "friction": 0.2}
    assert case.overrides[:3] == (
        "bodies.block.material=dragon_skin_10", "time.end=2 s", "output.snapshot_field=stretch",
    )  # fmt: skip


def test_a_layout_takes_its_robot():
    scenes = Path(__file__).parents[2] / "scenes"
    content = {
        "robot": "pfr",
        "factors": {
            "layout": {"scenes": {"bend": "layouts/c_bend.yaml"}},
            "rate": {"key": "loads.air.profile.deflation_rate", "values": ["1 kPa/s", "500 Pa/s"]},
        },
        "measures": {
            "passes": {"of": "layout.verdict"},
            "turn": {"of": "deflation_end_pressure", "take": "last"},
        },
    }
    study = study_from(content, scenes)
    assert [axis.column for axis in study.measures] == ["passes", "turn [kPa]"]
    assert study.measures[0].is_label
    case = study.cases()[1]
    assert case.values == {"layout": "bend", "rate": 0.5}
    assert case.source == Source(scenes / "layouts/c_bend.yaml", "pfr")


@pytest.mark.parametrize(
    ("old", "new", "place", "message"),
    [
        # the scene
        ("block.yaml", "blok.yaml", "1:8", "there is no file blok.yaml"),
        ("scene: block.yaml", "title: x", "1:1", "the study names no scene"),
        ("factors:", "factors:\n  s: {scenes: {a: block.yaml}}", "1:1", "scene is given twice"),
        ("factors:", "robot: pfx\nfactors:", "3:8", "no robot 'pfx'\n  did you mean 'pfr'?"),
        # what is set
        ("time.end", "time.and", "2:7", "there is no 'time.and'\n  did you mean 'end'?"),
        ("1 s", "1 mm", "2:17", "end: '1 mm' is a length, a duration is needed"),
        ("time.end: 1 s", "contact.friction_coefficient: 1", "5:19", "is already set\n"),
        (THICK, THICK + "\n  b: {key: bodies.block, values: [a]}", "5:12", "is already set\n"),
        # factors
        ("block.thickness", "blok.thickness", "4:16", "'bodies.blok'\n  did you mean 'block'?"),
        ("5 mm", "5 kPa", "4:49", "'5 kPa' is a pressure, a length is needed"),
        ("1 cm", "5", "4:55", 'a length needs a unit: write "5 mm"'),
        ("5 mm", "-5 mm", "4:49", "'-5 mm' must be greater than 0 mm"),
        ("values: [5 mm, 1 cm]", "about: x", "4:3", "thick has no values\n  give one of"),
        ("[5 mm, 1 cm]", "[]", "4:48", "must have at least 1"),
        ("1 cm", "0.5 cm", "4:55", "0.5 cm is given twice"),
        ("1 cm", "[1 mm]", "4:55", "must be a number, a quantity"),
        ("thick: {key", "thick: {keys", "4:10", "does not state its kind\n  did you mean 'key'?"),
        ("thick:", "t t:", "4:3", "'t t' is not a name"),
        ("thick:", "repeat:", "4:3", "a table already has a column repeat"),
        ("1 cm]", "1 cm], count: 3", "4:62", "count: has no effect with values"),
        ("1 cm]", "1 cm], range: [1 mm, 2 mm]", "4:62", "the values are already given by values"),
        ("0.2, 0.8", "0.8, 0.2", "5:62", "a range must rise"),
        ("0.2, 0.8", "0.2, 0.8 mm", "5:57", "a range needs two numbers"),
        ("[0.2", "[-0.2", "5:57", "friction_coefficient: -0.2 must be at least 0"),
        ("range: [0.2", "log_range: [0", "5:61", "no value for log_range"),
        (", count: 3", "", "5:3", "friction: a grid needs a number of values"),
        (THICK, "form: {key: bodies.block.formulation, values: [plane_strain, solid]}", "4:64",
         "form = solid does not fit the other settings\n"),
        (THICK, "kind: {variants: {a: {time.settle: 1 s}, b: {time.settle: 1 Pa}}}", "4:61",
         "settle: '1 Pa' is a pressure"),
        # measures
        ("body_d", "boddy_d", "7:15", "result 'boddy_displacement'\n  did you mean 'body_disp"),
        ("of: body_displacement", "of: mean_speed", "7:15", "no run of this scene has the result"),
        ("unit: mm", "unit: kPa", "7:40", "'kPa' is a pressure, a length is needed"),
        ("unit: mm", "unit: mn", "7:40", "unknown unit 'mn'"),
        ("unit: mm", "take: first", "7:40", "is a single value, not a list"),
        ("of: body_displacement", "of: slip_share", "7:33", "slip_share has no unit"),
        ("moved:", "thick:", "7:3", "a table already has a column thick"),
        # plots, designs
        (MEASURES, "plots: [{kind: curve, x: thik, y: moved}]\nmeasures:", "6:26",
         "no factor or measure 'thik'\n  did you mean 'thick'?"),
        (MEASURES, "plots: [{kind: heat_map, x: thick, y: moved, colour: moved}]\nmeasures:",
         "6:39", "y: there is no factor 'moved'"),
        (MEASURES, "design: {kind: sobol, count: 12}\nmeasures:", "6:30",
         "12 is not a power of two, so the sequence would not be uniform\n  use 8 or 16"),
        (MEASURES, "design: {kind: grit}\nmeasures:", "6:16", "did you mean 'grid'?"),
        (MEASURES, "design: {kind: list, cases: [{thick: 3 mm}]}\nmeasures:", "6:30",
         "the case has no value of friction"),
        (MEASURES, "design: {kind: list, cases: [{thik: 3 mm}]}\nmeasures:", "6:31",
         "there is no factor 'thik'\n  did you mean 'thick'?"),
        (MEASURES, "design: {kind: list, cases: [{thick: 3 mm, friction: 1}]}\nmeasures:", "4:40",
         "values: the cases of the list already give its values\n  leave it out"),
        # repeats
        (MEASURES, "repeats: {count: 2, perturb: {time.and: 1 %}}\nmeasures:", "6:31",
         "did you mean 'end'?"),
        (MEASURES, "repeats: {count: 2, perturb: {time.end: 1 mm}}\nmeasures:", "6:41",
         "'1 mm' is a length, a duration is needed"),
        (MEASURES, "repeats: {count: 2, perturb: {time.end: 1}}\nmeasures:", "6:41",
         "a duration needs a unit"),
        (MEASURES, "repeats: {count: 2, perturb: {time.increment: 1 %}}\nmeasures:", "6:47",
         "time.increment is 'auto', which cannot be perturbed"),
        (MEASURES, "repeats: {count: 9, perturb: {solver.safety_factor: 1}}\nmeasures:", "6:53",
         "in repeat 4: safety_factor: "),
        # what is optimised
        (MEASURES, "optimize: {maximize: muved, trials: 3}\nmeasures:", "6:22",
         "there is no measure 'muved'\n  did you mean 'moved'?"),
        # keys of the study
        (MEASURES, "kep: thin\nmeasures:", "6:1", "unknown key 'kep'\n"),
        ("  moved: {of", "  moved: {off", "7:11", "unknown key 'off' in moved"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_at_its_place(load, old, new, place, message):
    with pytest.raises(SceneError) as caught:
        load(old, new)
    assert caught.value.exit_code == 2
    said = [caught.value, *caught.value.further]
    assert str(said[0]).startswith(f"study.yaml:{place}: "), str(said[0])
    without_excerpt = "\n".join([said[0].message, f"  {said[0].hint}"])
    assert message in without_excerpt


def test_a_factor_may_not_set_what_an_option_sets(load):
    with pytest.raises(SceneError, match="is already set\n"):
        load("", "", "bodies.block.thickness=3 mm")
    with pytest.raises(SceneError, match=r"^--set time\.end: must read PATH=VALUE"):
        load("", "", "time.end")


def test_a_broken_scene_is_reported_in_its_own_file(load):
    scene = Path("block.yaml")
    scene.write_text(scene.read_text().replace("friction_coefficient", "friction"))
    with pytest.raises(SceneError, match=r"^block.yaml:7:11: unknown key 'friction'"):
        load()


def test_a_mesh_file_that_is_missing_is_found_before_anything_runs(load):
    scene = Path("block.yaml")
    mesh = "{generator: block, length: 10 mm, height: 5 mm, element_size: 1 mm}"
    scene.write_text(scene.read_text().replace(mesh, "{file: none.msh}"))
    with pytest.raises(SceneError, match=r"^block.yaml:3:18: file: there is no file none.msh"):
        load()


def test_a_study_that_only_says_what_to_optimise_has_no_cases(load):
    study = load(", count: 3}\n", "}\noptimize: {maximize: moved, trials: 3}\n")
    assert (study.goal.measure, study.goal.sense) == ("moved", "maximize")
    assert study.search_space == {"thick": (5.0, 10.0), "friction": Interval(0.2, 0.8)}
    with pytest.raises(SceneError, match="defines an optimization and no design"):
        _ = study.case_count
    case = study.case(7, {"thick": 7.5, "friction": 0.3})
    assert case.number == 7 and case.overrides[1] == "bodies.block.thickness=7.5 mm"


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(start=st.integers(0, 240), length=st.integers(0, 12), new=st.text(max_size=4))
def test_a_torn_study_loads_or_is_a_scene_error(folder, start, length, new):
    text = STUDY[:start] + new + STUDY[start + length :]
    Path("torn.yaml").write_text(text, encoding="utf-8", errors="replace")
    try:
        load_study("torn.yaml")
    except SceneError as error:
        assert str(error)


def content(**changed):
    """A study of block.yaml, with some keys of another value."""
    given = {
        "scene": "block.yaml",
        "factors": {"thick": {"key": "bodies.block.thickness", "values": ["5 mm", "6 mm"]}},
        "measures": {"moved": {"of": "body_displacement"}},
    }
    return {**given, **changed}


def test_numbers_of_numpy_and_paths_are_taken(folder):
    friction = {"key": "contact.friction_coefficient", "values": np.linspace(0.25, 1.0, 4)}
    steps = {"key": "solver.safety_factor", "range": (np.float32(0.5), 1), "count": np.int64(3)}
    study = study_from(
        content(scene=folder / "block.yaml", factors={"friction": friction, "steps": steps}), folder
    )
    assert study.search_space == {"friction": (0.25, 0.5, 0.75, 1.0), "steps": (0.5, 0.75, 1)}
    assert study.title == "study"


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"scene": "none.yaml"}, "^scene: there is no file "),
        ({"measures": {"m": {"of": "bodi"}}}, r"^measures\.m\.of: no run of this scene has"),
        ({"factors": {"t": {"key": "bodies.block.thickness", "values": ["5 mm", 3]}}},
         r"^factors\.t\.values\[1\]: a length needs a unit"),
        ({"set": {"time.end": object()}}, r"^set\.time\.end: a object cannot be part of a study"),
        ({"mesures": {}}, "^mesures: unknown key 'mesures'\n  did you mean 'measures'"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_by_its_keys(folder, changed, message):
    with pytest.raises(SceneError, match=message):
        study_from(content(**changed), folder)


def test_a_study_in_words(folder):
    study = study_from(
        {
            "scene": "block.yaml",
            "set": {"environment.inclination": "35 deg", "time": {"end": "1 s"}},
            "factors": {
                "end": {"key": "time.end", "log_range": ["1 ms", "1 s"], "count": 7},
                "thick": {"key": "bodies.block.thickness", "values": ["5 mm", "1 cm"]},
                "friction": {"key": "contact.friction_coefficient", "range": [0, 1]},
            },
            "design": {"kind": "latin_hypercube", "count": 2000},
            "repeats": {"count": 2, "perturb": {"solver.bulk_viscosity": "5 %"}},
            "measures": {"moved": {"of": "body_displacement"}, "error": {"of": "energy_error"}},
            "optimize": {"minimize": "error", "trials": 3},
        },
        folder,
    )
    assert describe(study) == [
        ("end [ms]", "7 values, 1, 3.16228, 10 ... 1000, logarithmic"),
        ("thick [mm]", "5, 10"),
        ("friction", "0 to 1, continuous"),
        ("scene", "block.yaml"),
        ("in all cases", "environment.inclination: 35 deg, time: {end: 1 s}"),
        ("design", "latin hypercube, 4,000 cases"),
        ("repeats", "2 of each case, perturbed: solver.bulk_viscosity by 5 %"),
        ("measures", "moved [mm], error"),
        ("goal", "minimize error"),
    ]


# -------------------------------------------------------------------------------------------------
# Repeated assessments.

LAYOUT = Path(__file__).parents[2] / "scenes" / "layouts" / "elbow_90_36mm.yaml"


def study(*overrides, **spread):
    loaded = load_layout(LAYOUT, "pfr", overrides)
    return repeated_assessment(LAYOUT, "pfr", loaded, Spread(**{"count": 10} | spread), overrides)


def test_friction_start_and_phase_fill_their_ranges_and_a_seed_draws_the_same():
    cases = study().cases()
    scenes = [resolved(case).scene for case in cases]
    friction = [scene.contact.friction_coefficient for scene in scenes]
    nominal = load_layout(LAYOUT, "pfr", []).scene
    mu = nominal.contact.friction_coefficient
    assert len(friction) == 10 and min(friction) >= 0.9 * mu and max(friction) <= 1.1 * mu
    # One in each tenth of the range.
    assert sorted(int((f / mu - 0.9) / 0.02) for f in friction) == list(range(10))
    start = nominal.environment.walls["pipe"].start[0]
    starts = [scene.environment.walls["pipe"].start[0] - start for scene in scenes]
    assert -2e-3 <= min(starts) < -1.5e-3 and 1.5e-3 < max(starts) <= 2e-3
    phases = [scene.loads["motor"].phase for scene in scenes]
    assert max(phases) - min(phases) > 5.0  # [rad]
    assert {scene.expect.passes for scene in scenes} == {True}

    assert [case.overrides for case in study().cases()] == [case.overrides for case in cases]
    assert [case.overrides for case in study(seed=2).cases()] != [c.overrides for c in cases]


def test_what_is_overridden_varies_about_its_value():
    cases = study("contact.friction_coefficient=0.4", "time.end=7 s", friction=0.5).cases()
    scenes = [resolved(case).scene for case in cases]
    friction = [scene.contact.friction_coefficient for scene in scenes]
    assert 0.2 <= min(friction) < 0.25 and 0.55 < max(friction) <= 0.6
    assert {scene.time.end for scene in scenes} == {7.0}


def test_nothing_that_varies_is_refused():
    motor = "loads.motor={kind: nodal_force, nodes: skin.knots, force: [0 N, 0 N]}"
    with pytest.raises(SceneError, match="nothing varies"):
        study(motor, friction=0.0, start=0.0)
