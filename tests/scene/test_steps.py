"""Steps of a scene: what each takes over from the one before, and what no step can change."""

import pytest

from softsim.errors import SceneError
from softsim.scene.loading import load_scene
from softsim.scene.schema import scene_json_schema
from softsim.scene.steps import AT_THE_START, following, load_steps

STEPPED = """\
bodies:
  block:
    mesh: {generator: block, length: 10 mm, height: 5 mm, element_size: 1 mm}
    formulation: plane_strain
    thickness: 10 mm
    material: dragon_skin_10
environment: {walls: {floor: {kind: plane, point: [0 mm, -1 mm]}}}
conditions: {hold: {kind: fixed, nodes: block.left}}
loads:
  push: {kind: nodal_force, nodes: block.right, force: [1 mN, 0 N]}
expect: {energy_error: {max: 0.1}}
steps:
  rise:
    time: {end: 1 s, procedure: static}
  swing:
    time: {end: 2 s}
    loads: {pull: {kind: nodal_force, nodes: block.right, force: [0 N, 1 mN]}}
  let_go:
    time: {end: 3 s}
    loads: {push: ~, pull: {force: [0 N, 2 mN]}}
    conditions: {hold: ~}
"""


@pytest.fixture
def steps_of(write):
    """The steps of a scene text, with overrides."""
    return lambda text, *overrides: load_steps(write(a=text), overrides)


def test_a_step_changes_what_it_says_and_the_rest_goes_on(steps_of):
    rise, swing, let_go = (step.loaded.scene for step in steps_of(STEPPED))
    assert [list(s.loads) for s in (rise, swing, let_go)] == [["push"], ["push", "pull"], ["pull"]]
    assert swing.loads["push"] == rise.loads["push"]
    assert let_go.loads["pull"].force == (0.0, 2e-3)
    assert list(swing.conditions) == ["hold"] and not let_go.conditions


def test_time_and_expectations_are_of_the_step(steps_of):
    text = STEPPED.replace("  swing:\n", "  swing:\n    expect: {energy_error: {max: 0.5}}\n")
    scenes = [step.loaded.scene for step in steps_of(text)]
    assert [s.time.procedure for s in scenes] == ["static", "dynamic", "dynamic"]
    assert [s.expect.energy_error.max for s in scenes] == [0.1, 0.5, 0.1]


def test_what_goes_on_has_begun_when_it_was_written(steps_of):
    rise, swing, let_go = (step.loaded.scene for step in steps_of(STEPPED))
    second = following(rise, AT_THE_START, swing, 1.2)
    assert second.of(("loads", "push")) == 0.0 and second.of(("loads", "pull", "profile")) == 1.2
    third = following(swing, second, let_go, 3.2)
    assert third.of(("loads", "pull")) == 3.2  # written anew
    assert following(swing, second, swing, 3.2).of(("loads", "pull")) == 1.2


def test_overrides_of_all_steps_and_from_one_on(steps_of):
    steps = steps_of(STEPPED, "time.end=7 s", "steps.swing.loads.push.force=[3 mN, 0 N]")
    assert [step.loaded.scene.time.end for step in steps] == [7.0, 7.0, 7.0]
    assert [s.loaded.scene.loads["push"].force[0] for s in steps[:2]] == [1e-3, 3e-3]


def test_a_step_includes_files(write):
    part = "loads: {pull: {kind: nodal_force, nodes: block.right, force: [0 N, 5 mN]}}\n"
    text = STEPPED.replace("  let_go:\n", "  let_go:\n    include: part.yaml\n")
    last = load_steps(write(a=text, part=part))[-1].loaded.scene
    assert last.loads["pull"].force == (0.0, 2e-3)  # the step wins over what it includes


def test_a_scene_without_steps_has_none(write, smallest):
    assert load_steps(write(a=smallest)) == ()


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("    time: {end: 2 s}", "    time: {end: 2 s}\n    bodies: {block: {thickness: 3 mm}}",
         ["a.yaml:17:13", "step 'swing', number 2: bodies cannot change between steps"]),
        ("    time: {end: 2 s}", "    time: {end: 2 s, settle: 1 s}",
         ["a.yaml:16:30", "bodies settle before the first step"]),
        ("    time: {end: 2 s}\n", "    time: {end: 2 s}\n    conditions: {v: {kind: "
         "initial_velocity, nodes: block.right, velocity: [1 m/s, 0 m/s]}}\n",
         ["a.yaml:17:21", "bodies keep the velocity of the previous step"]),
        ("    loads: {pull: {kind", "    loads: {air: {kind: added_volume, facets: [block.top], "
         "profile: {kind: ramp, value: 1 ml, duration: 1 s}}, pull: {kind",
         ["a.yaml:17:18", "starts from the shape at rest"]),
        ("    loads: {pull: {kind", "    loads: {line: {kind: tendon, acts_on: a, "
         "stiffness: 1 N/m, direction: [1, 0]}, pull: {kind",
         ["a.yaml:17:19", "starts from the shape at rest"]),
        ("    time: {end: 3 s}\n", "    tim: {end: 3 s}\n", ["unknown key 'tim'", "'time'"]),
        ("  swing:\n", "  Swing it!:\n", ["a.yaml:15:3", "'Swing it!' is not a valid name"]),
        (STEPPED[STEPPED.index("steps:"):], "steps: [a, b]\n", ["must be a mapping of step names"]),
    ],
)  # fmt: skip
def test_what_no_step_can_be_is_refused_at_its_place(steps_of, old, new, told):
    with pytest.raises(SceneError) as caught:
        steps_of(STEPPED.replace(old, new, 1))
    text = str(caught.value)
    assert all(part in text for part in told), text


def test_walls_do_not_jump(steps_of):
    moved = "w: {kind: wall_motion, wall: floor, direction: y, displacement: {kind: ramp, "
    moved += "value: 1 mm, duration: 1 s}}"
    base = STEPPED.replace("conditions: {hold: {", "conditions: {" + moved + ", hold: {")
    steps_of(base)
    with pytest.raises(SceneError, match="without 'w' the wall that it moves would jump back"):
        steps_of(base.replace("conditions: {hold: ~}", "conditions: {hold: ~, w: ~}"))
    other = "conditions: {hold: ~, w: {displacement: {kind: ramp, value: 2 mm, duration: 1 s}}}"
    with pytest.raises(SceneError, match="'w' already moves a wall, which would jump back"):
        steps_of(base.replace("conditions: {hold: ~}", other))


def test_an_override_of_no_step(steps_of):
    with pytest.raises(SceneError, match="there is no step 'swin'") as caught:
        steps_of(STEPPED, "steps.swin.time.end=1 s")
    assert "did you mean 'swing'" in str(caught.value)


def test_one_scene_is_due_elsewhere(write):
    with pytest.raises(SceneError, match="needs a scene without steps") as caught:
        load_scene(write(a=STEPPED))
    assert "a.yaml:12:1" in str(caught.value)


def test_the_json_schema_knows_steps():
    schema = scene_json_schema()
    assert "loads" in schema["properties"]["steps"]["additionalProperties"]["properties"]
    assert schema["anyOf"] == [{"required": ["time"]}, {"required": ["steps"]}]
