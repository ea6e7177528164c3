"""Chatter: nodes that come back to a wall at once, told apart from a body that bounces."""

import io
import json

import numpy as np
import pytest
from rich.console import Console

from softsim.solver.guards import chatter, chatter_warnings, oscillation_period, return_time

SLIDES = """
bodies:
  block: {mesh: {generator: block, length: 10 mm, height: 6 mm, element_size: 2 mm},
          formulation: plane_strain, thickness: 10 mm, material: elastic}
materials: {elastic: {law: yeoh, C10: 60 kPa, density: 1070 kg/m^3}}
environment: {inclination: 45 deg, walls: {floor: {kind: plane}}}
contact: {friction_coefficient: 0.8}
time: {end: 200 ms}
output: {history_interval: 10 ms, frame_interval: 100 ms}
"""
DAMPED = ["bodies.block.material=dragon_skin_30", "contact.friction_coefficient=0.4"]


@pytest.fixture
def run(write_scene, tmp_path, kernel_cache, monkeypatch):
    """Summary and log of a run of the scene with overrides."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run as run_scene

    def quiet(*overrides):
        out = tmp_path / "out"
        run_scene(write_scene(SLIDES), overrides, out, "cpu", console=Console(file=io.StringIO()))
        return json.loads((out / "summary.json").read_text()), (out / "run.log").read_text()

    return quiet


def test_an_elastic_block_that_slides_is_told_to_chatter(run):
    """With the place and the remedies, once; the summary has the measure."""
    summary, log = run()
    assert summary["contact_chatter"] > 1.0
    assert log.count("contact chatters") == 1
    warning = next(line for line in log.splitlines() if "contact chatters" in line)
    assert "of 'block' at rest at (" in warning
    for remedy in ("spectrum", "contact.damping_ratio", "time.settle"):
        assert remedy in warning


def test_a_damped_block_is_not(run):
    summary, log = run(*DAMPED)
    assert summary["contact_chatter"] < 1.0
    assert "contact chatters" not in log


def test_a_block_that_bounces_as_a_whole_does_not_chatter(run):
    """Dropped from 5 mm on a level floor without friction it is away for 60 ms, far longer than a
    tenth of its swing.
    """
    summary, log = run(
        "bodies.block.position=[0 mm, 5 mm]",
        "environment.inclination=0 deg",
        DAMPED[0],
        "contact.friction_coefficient=0",
    )
    assert summary["contact_chatter"] < 1.0
    assert "contact chatters" not in log


# --- the measure alone ---------------------------------------------------------------------------


def test_the_period_is_that_of_the_first_shear_mode_of_the_height(build):
    """4 h / sqrt(mu0 / rho), mu0 = 2 C10."""
    model = build(SLIDES)
    assert oscillation_period(model) == pytest.approx(4.0 * 6e-3 / np.sqrt(120e3 / 1070.0))
    assert return_time(model) == pytest.approx(0.1 * oscillation_period(model))


def test_returns_count_per_oscillation_of_contact(build):
    """A node hardly in contact is neither counted in the worst nor, alone, in the measure."""
    model = build(SLIDES)
    count, period = len(model.contact.nodes), oscillation_period(model)
    returns, contact_time = np.zeros(count), np.zeros(count)
    returns[:3], contact_time[:3] = [20, 100, 5], np.array([10.0, 20.0, 0.5]) * period
    found = chatter(model, returns, contact_time)
    assert found.returns == pytest.approx(125.0 / 30.5)
    assert found.worst == model.contact.nodes[1]
    assert found.worst_returns == pytest.approx(5.0)
    assert "chatter" in chatter_warnings(model, found)
    brief = chatter(model, returns, 0.01 * contact_time)
    assert (brief.returns, brief.worst) == (0.0, None)
    assert chatter_warnings(model, brief) == {}


def test_some_returns_are_no_chatter(build):
    model = build(SLIDES)
    count, period = len(model.contact.nodes), oscillation_period(model)
    found = chatter(model, np.full(count, 9.0), np.full(count, 10.0 * period))
    assert found.returns == pytest.approx(0.9)
    assert chatter_warnings(model, found) == {}
