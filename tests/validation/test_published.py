"""Scripts on published measurements: their page, their columns, and the skip without data."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from softsim.materials import laws as modes
from softsim.materials.laws import MooneyRivlin
from softsim.mesh.reading import read_mesh
from validation.cases import Outcome
from validation.command import validate
from validation.published import (
    ds10_beam,
    falling_rod,
    rubber_multiaxial,
    soft_tentacle,
)
from validation.published.__main__ import SCRIPTS
from validation.script import PUBLISHED, Script
from validation.verdicts import AGREES, DISAGREES, Row

ROWS = [
    Row(None, "height", "20 mm", "21 mm", AGREES, error="5 %", band="10 %"),
    Row(None, "width", "20 mm", "30 mm", DISAGREES, error="50 %", band="10 %"),
]
STRIP = Script(
    name="strip",
    figure="Somebody 1950",
    about="First paragraph.\n\nSecond paragraph.",
    quick=(),
    rows=lambda outcomes, points: ROWS,
    draw=lambda outcomes, points, path: path.write_bytes(b"picture"),
    evidence=PUBLISHED,
)


def pages_of(scripts, folder):
    console = Console(file=io.StringIO(), width=200)
    everything = validate(scripts, False, 1, folder, None, console)
    return everything, console.file.getvalue()


def test_each_evidence_has_its_page(tmp_path):
    thesis = replace(STRIP, name="thesis_strip", evidence=Script.evidence)
    everything, shown = pages_of([STRIP, thesis], tmp_path)
    published = (tmp_path / "published.html").read_text()
    for text in (*PUBLISHED.columns, "5 %", "50 %", "Somebody 1950"):
        assert text in published and text in shown
    assert "<p>Second paragraph.</p>" in published
    assert "python -m validation.published.strip" in published
    assert "thesis_strip" not in published and "Constants" not in published
    index = (tmp_path / "index.html").read_text()
    assert "thesis_strip" in index and "Constants" in index and "50 %" not in index
    stored = json.loads((tmp_path / "validation.json").read_text())
    assert stored == everything
    assert [row["band"] for row in stored["rows"]] == 4 * ["10 %"]
    assert stored["scripts"]["strip"]["evidence"] == "published data"


def test_script_without_its_data_is_skipped(tmp_path):
    absent = tmp_path / "absent"
    everything, shown = pages_of([replace(STRIP, data=absent)], tmp_path / "out")
    sentence = f"strip: skipped, because the folder of its data is absent: {absent}"
    assert everything["skipped"] == [sentence] and everything["rows"] == []
    assert "skipped, because" in shown
    assert not (tmp_path / "out" / "published.html").exists()


def test_the_quick_subset_names_the_scripts_that_it_leaves_out():
    long = replace(STRIP, quick=None)
    assert long.reason_to_skip(quick=True) == (
        "strip: left out of the quick subset; run it by python -m validation.published.strip"
    )
    assert long.reason_to_skip(quick=False) == STRIP.reason_to_skip(quick=True) == ""


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.name)
def test_script_states_its_protocol(script):
    assert script.evidence is PUBLISHED
    assert "Protocol" in script.about and "Band" in script.about
    if not script.reason_to_skip(quick=True):
        assert {case.name for case in script.chosen(quick=True)} == set(script.quick)


def points_of(mode, stretches, law):
    """Points that an incompressible solid of this law would give."""
    second = [rubber_multiaxial._second_stretch(mode, first, "") for first in stretches]
    rows = [(first, other, 0.0, 0) for first, other in zip(stretches, second, strict=True)]
    points = rubber_multiaxial._points(rows)
    return replace(points, stress=points.predicted(law))


def test_predicted_stress_of_each_mode():
    """That of the closed forms; compression is consistent with equibiaxial tension."""
    law, stretches = MooneyRivlin(3e4, 1e4), np.array([1.1, 1.5, 2.0])
    pairs = [("uniaxial", modes.UNIAXIAL), ("equibiaxial", modes.EQUIBIAXIAL),
             ("pure shear", modes.PLANAR)]  # fmt: skip
    for name, mode in pairs:
        assert points_of(name, stretches, law).stress == pytest.approx(
            mode.nominal_stress(law, stretches)
        )
    measured = {
        "equibiaxial": points_of("equibiaxial", stretches, law),
        "uniaxial compression": points_of("uniaxial compression", stretches**-2.0, law),
    }
    assert rubber_multiaxial.inconsistency(measured) == pytest.approx(0.0, abs=1e-9)


def test_falling_rod_of_theory(monkeypatch):
    """In weak gravity: first frequency and twice the static drop of a cantilever."""
    monkeypatch.setattr(falling_rod, "LINKS", 16)
    monkeypatch.setattr(falling_rod, "GRAVITY", 0.01)
    for function in (falling_rod.rod, falling_rod.swing_end):
        function.cache_clear()
    bending = 1e6 * 0.03**2 / 4.0 / 1000.0
    drop, time = falling_rod.rod().lowest
    frequency = 3.516 / (2.0 * np.pi * 0.6**2) * bending**0.5
    assert time == pytest.approx(0.5 / frequency, rel=0.03)
    assert drop == pytest.approx(2.0 * 0.01 * 0.6**4 / (8.0 * bending), rel=0.03)
    for function in (falling_rod.rod, falling_rod.swing_end):
        function.cache_clear()


@pytest.mark.parametrize("density", [soft_tentacle.COARSE, soft_tentacle.FINE])
def test_section_of_the_tentacle(density):
    """The polygon has the second moment of area of the unit circle about either axis."""
    points, cells = soft_tentacle.section(density.side, density.rings)
    x, y = points[cells].transpose(2, 0, 1)
    cross = x * np.roll(y, -1, 1) - y * np.roll(x, -1, 1)
    assert len(cells) == density.elements and cross.sum(axis=1).min() > 0.0
    for c in (x, y):
        after = np.roll(c, -1, 1)
        assert (cross * (c * c + c * after + after * after)).sum() / 12.0 == pytest.approx(
            np.pi / 4.0
        )


def test_mesh_of_the_tentacle(tmp_path, monkeypatch, caplog):
    """Its node sets lie where the markers are, and none of its cells is inverted."""
    monkeypatch.setattr(soft_tentacle, "SCENE", tmp_path / "soft_tentacle.yaml")
    density = soft_tentacle.COARSE
    soft_tentacle.write_mesh.__wrapped__(density)
    mesh = read_mesh(density.file).mesh
    assert "inverted" not in caplog.text
    for k, station in enumerate(soft_tentacle.STATIONS, 1):
        [node] = mesh.node_sets[f"m{k}"]
        assert mesh.points[node] == pytest.approx([0.0, -station, 0.0], abs=1e-9)


def test_markers_of_the_unloaded_tentacle():
    """They are on their arms, a moved body takes them along, and a failed run has none."""
    names = [f"m{k}{part}" for k in (1, 2, 3) for part in ("", "_side", "_other")]
    names += ["m4", "m4_above"]
    still = {f"{name}_{axis}": np.zeros(1) for name in names for axis in "xyz"}
    found = soft_tentacle.predicted(Outcome("", history=still), soft_tentacle.COARSE)
    assert found == pytest.approx(
        np.array([[25, -129.1, 0], [-21, -219.5, 0], [20, -280, 0], [0, -368, 0]]) * 1e-3
    )
    lifted = {**still, **{f"{name}_y": np.full(1, 0.1) for name in names}}
    moved = soft_tentacle.predicted(Outcome("", history=lifted), soft_tentacle.COARSE)
    assert moved - found == pytest.approx(np.tile([0.0, 0.1, 0.0], (4, 1)), abs=1e-12)
    failed = soft_tentacle.predicted(Outcome("", failure="stopped"), soft_tentacle.COARSE)
    assert np.isnan(failed).all()


def test_rod_beside_the_tentacle(monkeypatch):
    """Small torque without gravity: that of a beam; exchanged torques give mirror images."""
    one, other = (soft_tentacle.rod(pair, True) for pair in ((0.1, 0.05), (0.05, 0.1)))
    assert one == pytest.approx(other * (1.0, 1.0, -1.0), abs=1e-9)
    monkeypatch.setattr(soft_tentacle, "GRAVITY", 0.0)
    s = np.linspace(0.0, 0.305, 20001)
    radius = np.interp(s, *soft_tentacle.RADII)
    moment = 1e-4 / 0.0325 * (0.0114 - 0.0295 * s)
    away = np.trapezoid((0.368 - s) * moment / (315e3 * np.pi / 4.0 * radius**4), s)
    tip = soft_tentacle.rod((1e-4, 0.0), False)[-1]
    assert tip == pytest.approx(
        [0.5 * away, -0.368, -np.sqrt(0.75) * away], rel=5e-3, abs=1e-6 * 0.368
    )


def test_frequency_and_damping_of_a_decay():
    """The swing of a damped oscillator, also with a creep beside it."""
    time = np.arange(0.0, 2.0, 5e-3)
    decay = np.exp(-0.05 * 2.0 * np.pi * 7.0 * time)
    height = decay * np.cos(2.0 * np.pi * 7.0 * np.sqrt(1.0 - 0.05**2) * time) - 0.02 * time
    found = ds10_beam.swing(time, height)
    assert found.frequency == pytest.approx(7.0 * np.sqrt(1.0 - 0.05**2), rel=2e-3)
    assert found.damping_ratio == pytest.approx(0.05, rel=0.02)
    assert np.isnan(ds10_beam.swing(time[:100], height[:100]).frequency)
