"""The command for modes about an equilibrium: files, tables, and what it refuses."""

import json
import re

import pytest

SCENE = """
bodies:
  b: {mesh: {generator: block, length: 4 mm, height: 1 mm, element_size: 0.5 mm},
      formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10, fixed: [left]}
loads: {push: {kind: nodal_force, nodes: b.right, force: [0 N, -1 mN], ramp: 1 s}}
time: {end: 1 s, procedure: PROCEDURE}
"""


@pytest.mark.physics
def test_modes_of_a_scene_and_of_its_run(softsim, write_scene, tmp_path):
    scene, run = write_scene(SCENE.replace("PROCEDURE", "static")), tmp_path / "run"
    done = softsim("modes", scene, "--count", "2", "--out", tmp_path / "a", "--device", "cpu")
    assert done.exit_code == 0, done.stderr
    said = re.sub(r"\s+", " ", done.stdout)
    for word in ("equilibrium at t = 1 s", "natural modes of 'b': 3 nodes held", "no contact",
                 "damping", "results in"):  # fmt: skip
        assert word in said, word
    written = json.loads((tmp_path / "a" / "modes.json").read_text())
    assert len((tmp_path / "a" / "modes.csv").read_text().splitlines()) == 3
    assert (tmp_path / "a" / "modes.png").stat().st_size > 5000
    assert softsim("run", scene, "--no-report", "--out", run, "--device", "cpu").exit_code == 0
    done = softsim("modes", run, "--count", "2", "--out", tmp_path / "b", "--device", "cpu")
    assert done.exit_code == 0, done.stderr
    again = json.loads((tmp_path / "b" / "modes.json").read_text())
    for one, other in zip(written["modes"], again["modes"], strict=True):
        assert one["frequency"] == pytest.approx(other["frequency"], rel=1e-4)
    refused = softsim("modes", run, "--load", "push=1")
    assert refused.exit_code == 2 and "--load does not go with a run folder" in refused.stderr


@pytest.mark.physics
def test_frequencies_over_a_load(softsim, write_scene, tmp_path):
    scene = write_scene(SCENE.replace("PROCEDURE", "dynamic"))
    options = ["--over", "push=0..1", "--points", "3", "--count", "2", "--device", "cpu"]
    done = softsim("modes", scene, *options, "--out", tmp_path)
    assert done.exit_code == 0, done.stderr
    assert "push = 0.5: " in done.stdout
    rows = (tmp_path / "frequencies.csv").read_text().splitlines()
    assert rows[0].startswith("push,line,mode,frequency [Hz]") and len(rows) == 1 + 3 * 2
    assert (tmp_path / "frequencies.png").stat().st_size > 5000


def test_what_modes_refuses(softsim, write_scene, tmp_path):
    scene = write_scene(SCENE.replace("PROCEDURE", "static"))
    one = softsim("modes", scene, "--over", "push=1")
    assert one.exit_code == 2 and "'push=1' is one value" in one.stderr
    nothing = softsim("modes", tmp_path)
    assert nothing.exit_code == 2 and "is not a run folder" in nothing.stderr


SHAKEN = """
bodies:
  b: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 4 mm, material: dragon_skin_10}
rigid_bodies:
  lid: {mass: 2 g, inertia: 1 g*mm^2, center: [0 mm, 2.1 mm], tied: [b.top]}
environment: {walls: {floor: {kind: plane}}}
loads: {motor: {kind: sinusoidal_force, acts_on: lid, amplitude: FORCE, frequency: 100 Hz}}
output: {probes: {top: {kind: displacement, nodes: b.top}}}
time: {end: 1 s}
"""


@pytest.mark.physics
@pytest.mark.starts(2)
@pytest.mark.parametrize("force, is_small", [("1 uN", True), ("1 N", False)])
def test_a_response_says_where_contact_opens(softsim, write_scene, tmp_path, force, is_small):
    scene = write_scene(SHAKEN.replace("FORCE", force))
    options = ["--points", "5", "--device", "cpu", "--out", tmp_path / "out"]
    done = softsim("response", scene, *options)
    assert done.exit_code == 0, done.stderr
    said = re.sub(r"\s+", " ", done.stdout)
    assert "5 of 12 points touch" in said and "top_y" in said
    assert ("warning: from " in said and "run the scene in time" in said) != is_small
    rows = (tmp_path / "out" / "response.csv").read_text().splitlines()
    assert rows[0].startswith("motor,frequency [Hz],force [N],contact_changes,lid_x amplitude [m]")
    assert [row.split(",")[1] for row in rows[1:]] == ["10", "57.5", "100", "105", "152.5", "200"]
    assert (tmp_path / "out" / "response.png").stat().st_size > 5000


def test_what_a_response_refuses(softsim, write_scene):
    scene = write_scene(SCENE.replace("PROCEDURE", "dynamic"))
    without = softsim("response", scene)
    assert without.exit_code == 2 and "the scene has no motor" in without.stderr
    wrong = softsim("response", scene, "--frequencies", "20..10 Hz")
    assert wrong.exit_code == 2 and "'20..10 Hz' is not a range of frequencies" in wrong.stderr
