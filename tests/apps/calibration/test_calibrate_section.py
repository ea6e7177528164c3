"""softsim calibrate-section as a user types it."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from softsim.cli import app

SCENES = Path(__file__).parents[3] / "scenes"
SECTION, SOLID = SCENES / "pfr_36mm.yaml", SCENES / "pfr_36mm_3d.yaml"


def calibrate(folder, section, reference, *arguments, seconds=120):
    return subprocess.run(
        [sys.executable, "-m", "softsim.cli", "calibrate-section", *map(str, (section,
         "--reference", reference, "--device", "cpu", "--threads", "1", *arguments))],
        capture_output=True, text=True, timeout=seconds, check=False, cwd=folder,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("section", "reference", "arguments", "says"),
    [
        (SOLID, SOLID, [], "'skin' is solid"),
        (SECTION, SECTION, [], "'skin' is ring_section"),
        (
            SECTION, SOLID, ["--set", "environment.walls.pipe.diameter=41 mm"],
            "the pipe of the section is 41 mm wide, that of the reference 36 mm",
        ),
        (
            SECTION, SOLID,
            ["--set-reference", "environment.walls.pipe={kind: plane, normal: [0, 1, 0]}"],
            "0 pipes and 1 other walls",
        ),
        (SCENES / "pfr_mode1.yaml", SOLID, [], "0 loads of kind follower_pressure"),
        (SECTION, SOLID, ["--highest", "23"], "--highest 23: a pressure needs a unit"),
        (SECTION, SOLID, ["--ramp", "0 s"], "--ramp 0 s: '0 s' must be greater than zero"),
        (SECTION, SOLID, ["--spikes", "2"], "--spikes"),
    ],
    ids=["solid section", "plane reference", "pipes", "plane wall", "no air", "no unit", "no time",
         "two spikes"],
)  # fmt: skip
def test_refusals_exit_with_2_before_anything_runs(
    tmp_path, monkeypatch, section, reference, arguments, says
):
    monkeypatch.chdir(tmp_path)
    options = ["calibrate-section", section, "--reference", reference, *arguments]
    done = CliRunner().invoke(app, [str(option) for option in options])
    assert done.exit_code == 2, done.output
    assert says in done.output
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_body_that_never_touches_exits_with_2(tmp_path, write_scene):
    """A short skin far from its pipe: said before the section runs."""
    section = write_scene(_short(SHORT_SECTION, pipe="60 mm"), "section.yaml")
    reference = write_scene(_short(SHORT_RINGS, pipe="60 mm"), "rings.yaml")
    done = calibrate(tmp_path, section, reference, "--highest", "1 kPa", "--ramp", "5 ms")
    assert done.returncode == 2, done.stderr
    assert "no contact with the pipe up to 0.9999 kPa" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "runs" / "section_calibration" / "section").exists()


SHORT_SECTION = """
bodies:
  skin:
    mesh: {generator: pfr_section, free_length: 12 mm, spikes_per_strip: 1, element_size: 0.7 mm}
    formulation: plane_strain
    thickness: 3 mm
    material: dragon_skin_10
rigid_bodies:
  frame: {mass: 5 g, inertia: 1 kg*mm^2, tied: [skin.knots]}
environment: {walls: {pipe: {kind: pipe, diameter: PIPE}}}
loads:
  air:
    kind: follower_pressure
    facets: [skin.chamber_top, skin.chamber_bottom]
    reacts_on: frame
    profile: {kind: constant, value: 1 kPa}
time: {end: 1 s}
"""
SHORT_SOLID = """
bodies:
  skin:
    mesh: {generator: pfr_solid, free_length: 12 mm, rows: 1, spikes_around: 6, element_size: 1 mm}
    formulation: solid
    material: dragon_skin_10
rigid_bodies:
  frame: {mass: 5 g, inertia: 1 kg*mm^2, tied: [skin.knots]}
environment: {walls: {pipe: {kind: pipe, diameter: PIPE}}}
loads:
  air:
    kind: follower_pressure
    facets: [skin.chamber]
    reacts_on: frame
    profile: {kind: constant, value: 1 kPa}
time: {end: 1 s}
"""
SHORT_RINGS = """
bodies:
  skin:
    mesh: {generator: pfr_meridian, free_length: 12 mm, ring_rows: 1, element_size: 0.5 mm}
    formulation: axisymmetric
    material: dragon_skin_10
    fixed: [ends]
environment: {walls: {pipe: {kind: pipe, diameter: PIPE}}}
loads:
  air:
    kind: follower_pressure
    facets: [skin.chamber]
    profile: {kind: constant, value: 1 kPa}
time: {end: 1 s}
"""


def _short(scene, pipe="28 mm"):
    return scene.replace("PIPE", pipe)


@pytest.mark.slow
def test_a_section_with_the_found_factor_and_offset_presses_as_it_should(tmp_path, write_scene):
    """A short robot of one row of six spikes; the lines found are put into its section's scene."""
    section = write_scene(_short(SHORT_SECTION), "section.yaml")
    solid = write_scene(_short(SHORT_SOLID), "solid.yaml")
    done = calibrate(
        tmp_path, section, solid, "--spikes", 6, "--highest", "12 kPa", "--ramp", "50 ms",
        "--out", tmp_path / "out", seconds=1800,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "out" / "calibration.json").read_text())
    assert (tmp_path / "out" / "calibration.png").stat().st_size > 5000
    assert found["reference_kinetic_share"] < 0.05 and found["section_kinetic_share"] < 0.05
    # A row of 6 spikes of 2 mm holds a frame at least as stiffly as the 3 that the strips are wide:
    # beside them the skin around the frame holds it in the body in space, across and along it.
    for axis in "xy":
        assert found["stiffness"][axis]["ratio"] > 1.0
        assert found["stiffness"][axis]["reference"]["unrest"] < 0.05
    said = yaml.safe_load(
        done.stdout[done.stdout.index("# section as") : done.stdout.index("# alternative")]
    )
    assert said["loads"]["air"]["factor"] == pytest.approx(found["factor"], rel=1e-3)

    from softsim.run import run

    pressure = found["samples"]["pressure"][4]
    results = run(
        section,
        ["rigid_bodies.frame.free=[]", f"loads.air.factor={found['factor']!r}",
         f"loads.air.offset={found['offset']!r} Pa", "environment.gravity=0 m/s^2",
         f"loads.air.profile={{kind: constant, value: {pressure!r} Pa, ramp: 0.2 s}}",
         "time.end=0.3 s"],
        tmp_path / "again", "cpu",
    )  # fmt: skip
    late = results.history["time"] > 0.28
    force = results.history["wall_force_normal"][late].mean()
    # Slow or less slow, the same force: 5 % for the friction that remembers the way.
    assert force == pytest.approx(found["samples"]["section_force"][4], rel=0.05)


@pytest.mark.slow
def test_rings_are_a_reference_too(tmp_path, write_scene):
    """Without a frame to push: pressures only. The rings' force is that all around the pipe."""
    section = write_scene(_short(SHORT_SECTION), "section.yaml")
    rings = write_scene(_short(SHORT_RINGS), "rings.yaml")
    done = calibrate(
        tmp_path, section, rings, "--highest", "12 kPa", "--ramp", "50 ms",
        "--out", tmp_path / "out", seconds=1800,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "out" / "calibration.json").read_text())
    assert found["stiffness"] == {} and found["equivalent_thickness"] is None
    force = np.array(found["reference_curve"]["force"])
    pressure = np.array(found["reference_curve"]["pressure"])
    # The wall can feel no more than the air on the whole skin as wide as the pipe.
    assert 0.0 < force[-1] < pressure[-1] * np.pi * 28e-3 * 12e-3
