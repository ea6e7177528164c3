"""The static procedure: equilibria with a closed form, what they do not depend on, its ends."""

import io
import json
import os
import signal

import numpy as np
import pytest
from rich.console import Console

from softsim.errors import Interrupted, SceneError, StabilityError
from softsim.output.fields import read_frames
from softsim.output.history import read_history

KAPPA, SHEAR_MODULUS = 20.0 * 72e3, 72e3
LENGTH, SIZE = 10e-3, 0.5e-3
TOLERANCE = 1e-6  # solver.equilibrium_tolerance by default

MESHES = {
    "plane_strain": "{generator: block, length: 1 mm, height: 10 mm, element_size: 0.5 mm}",
    "axisymmetric": "{generator: block, length: 1 mm, height: 10 mm, element_size: 0.5 mm}",
    "solid": "{generator: box, length: 0.5 mm, width: 0.5 mm, height: 10 mm, element_size: 0.5 mm}",
}
SIDES = {
    "plane_strain": {"left": "x", "right": "x"},
    "axisymmetric": {"right": "x"},
    "solid": {"left": "x", "right": "x", "back": "z", "front": "z"},
}


def hanging(formulation):
    """A bar that hangs from its upper end between smooth walls; x from 0, for the half section."""
    more = ", thickness: 1 mm" if formulation == "plane_strain" else ""
    sides = "".join(
        f"  {side}: {{kind: symmetry, nodes: bar.{side}, normal: {axis}}}\n"
        for side, axis in SIDES[formulation].items()
    )
    shift = "0 mm" if formulation == "solid" else "0.5 mm"
    return f"""
bodies:
  bar: {{mesh: {MESHES[formulation]}, formulation: {formulation}{more},
        position: [{shift}, 0 mm], material: rubber, fixed: [top]}}
materials: {{rubber: {{law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3}}}}
conditions:
{sides}time: {{end: 2 ms, procedure: static}}
output: {{frame_interval: 1 s, probes: {{tip: {{kind: displacement, nodes: bar.bottom}}}}}}
"""


@pytest.fixture
def run(kernel_cache, monkeypatch, write_scene, tmp_path):
    """Run a scene text quietly on the CPU."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run as run_scene

    def quiet(text, *settings, out="out", resume=False):
        console = Console(file=io.StringIO())
        return run_scene(
            write_scene(text), settings, tmp_path / out, "cpu", resume=resume, console=console
        )

    return quiet


@pytest.mark.parametrize("formulation", list(MESHES))
def test_hanging_bar(run, record_verification, formulation):
    """Under its own weight, sides held: the tip drops by rho g L^2 / (2 (kappa + 4 mu/3)).

    The strain is 1e-4 at most. Linear elements in a row are exact at their nodes; the nodal
    pressure is one-sided at the ends, by half an element of the stress that rises over the length:
    (a/L)^2 of the drop, and the tolerance adds as many parts as there are rows, see below.
    """
    results = run(hanging(formulation))
    assert results.summary["status"] == "done"
    assert results.history["unbalanced_share"][-1] <= TOLERANCE
    assert results.history["time"][-1] >= 2e-3
    drop = -results.summary["probes"]["tip_y"]
    exact = 1000.0 * 9.81 * LENGTH**2 / (2.0 * (KAPPA + 4.0 / 3.0 * SHEAR_MODULUS))
    record_verification(f"drop of a hanging bar [m], {formulation}", exact, drop)
    assert drop == pytest.approx(exact, rel=(SIZE / LENGTH) ** 2 + 1e-4 + 20.0 * TOLERANCE)


def test_equilibrium_depends_on_nothing_else(run):
    """Pulled by a force: density, ramp and step change the way there, not the equilibrium.

    An error of the lowest mode of n rows, whose forces are the share `tolerance` of the inner
    ones, 2 n times the force's square in sum, is about 0.8 n times the tolerance of the stretch.
    """
    text = hanging("plane_strain") + (
        "environment: {gravity: 0 m/s^2}\n"
        "loads: {pull: {kind: nodal_force, nodes: bar.bottom, force: [0 N, -1 mN], ramp: 2 ms}}\n"
    )
    tip = run(text).summary["probes"]["tip_y"]
    assert tip < -1e-6
    other = run(
        text,
        "materials.rubber.density=4000 kg/m^3",
        "time.end=20 ms",
        "loads.pull.ramp=20 ms",
        "solver.safety_factor=0.5",
    )
    assert other.summary["probes"]["tip_y"] == pytest.approx(tip, rel=20.0 * TOLERANCE)


def test_a_falling_body_has_no_equilibrium(run, tmp_path):
    """Stopped after time.settle with the cause and what to do; the run is kept."""
    text = hanging("plane_strain").replace(", fixed: [top]", "")
    with pytest.raises(StabilityError, match=r"no equilibrium was found within 0\.01 s") as caught:
        run(text, "time.settle=10 ms")
    assert caught.value.exit_code == 3
    assert "free to move away" in caught.value.hint
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["status"] == "aborted"
    assert "no equilibrium" in summary["failure"]
    history = read_history(tmp_path / "out" / "history.csv")
    assert history["tip_y"][-1] < -1e-5
    assert history["time"][-1] > 10e-3
    assert len(read_frames(tmp_path / "out" / "results.vtkhdf")) >= 1


def test_a_motor_has_no_equilibrium(build):
    """Refused before anything starts, at the load."""
    text = hanging("plane_strain") + (
        "rigid_bodies: {frame: {mass: 1 g, inertia: 1 g*mm^2, tied: [bar.bottom]}}\n"
        "loads:\n"
        "  motor: {kind: eccentric_mass, acts_on: frame, eccentric_mass: 0.1 g, radius: 1 mm,\n"
        "          frequency: 50 Hz}\n"
    )
    text = text.replace("  left: {kind: symmetry, nodes: bar.left, normal: x}\n", "")
    text = text.replace("  right: {kind: symmetry, nodes: bar.right, normal: x}\n", "")
    text = text.replace("conditions:\n", "")
    line = text[: text.index("  motor:")].count("\n") + 1
    with pytest.raises(SceneError, match=rf"scene\.yaml:{line}:\d+.*'motor' vibrates"):
        build(text)
    build(text, "time.procedure=dynamic")


def test_interrupted_and_resumed_gives_the_same_result(run, tmp_path, monkeypatch):
    """SIGTERM while forces settle, then --resume: the history of a run that was left alone."""
    from softsim.solver.explicit import ExplicitSolver

    text = hanging("plane_strain").replace("output: {", "output: {history_interval: 200 us, ")
    text = text.replace("static}", "static, method: relaxation}")
    run(text, out="whole")
    continue_block = ExplicitSolver.continue_block

    def continue_and_stop(solver, count):
        continue_block(solver, count)
        if solver.time > 3e-3 and not stopped:
            stopped.append(solver.time)
            os.kill(os.getpid(), signal.SIGTERM)

    stopped = []
    monkeypatch.setattr(ExplicitSolver, "continue_block", continue_and_stop)
    with pytest.raises(Interrupted):
        run(text, out="parts")
    assert stopped[0] > 2e-3
    rows = len(read_history(tmp_path / "parts" / "history.csv")["time"])
    run(text, out="parts", resume=True)
    whole, parts = (tmp_path / name / "history.csv" for name in ("whole", "parts"))
    assert parts.read_bytes() == whole.read_bytes()
    assert len(read_history(parts)["time"]) > rows + 2


def test_it_settles_whatever_bulk_viscosity_is_asked_for(build, start):
    """A cantilever under its own weight, within nine periods of its lowest mode.

    Local damping of 0.8 is a quarter of critical: exp(-2 pi 9 / 4) = 1e-6 of the sag would be left.
    """
    text = """
bodies:
  beam: {mesh: {generator: block, length: 20 mm, height: 1 mm, element_size: 0.5 mm},
         formulation: plane_strain, thickness: 1 mm, material: rubber, fixed: [left]}
materials: {rubber: {law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3, poisson_ratio: 0.3}}
time: {end: 100 ms, procedure: static}
"""
    sags = []
    for viscosity in (0.06, 0.0):
        model = build(text, f"solver.bulk_viscosity={viscosity}")
        solver = start(model)
        solver.advance(int(1.3 / solver.time_increment))
        tip = model.bodies[0].node_sets["right"]
        sags.append((model.points - solver.positions()[0])[tip, 1].mean())
    assert sags[0] > 5e-3
    assert np.isclose(sags[1], sags[0], rtol=1e-3)


def test_a_steady_probe_ends_it(run):
    """Within the share of its rest that was asked for, before forces balance."""
    text = hanging("plane_strain").replace("static}", "static, until: {probe: tip, within: 0.02}}")
    ended = run(text, "output.history_interval=0.1 ms", out="steady")
    whole = run(hanging("plane_strain"), "time.method=relaxation")
    assert ended.summary["ended_by"] == "probe 'tip' at rest"
    assert ended.summary["simulated_time"] < whole.summary["simulated_time"]
    assert ended.history["tip_y"][-1] == pytest.approx(whole.history["tip_y"][-1], rel=0.02)


@pytest.mark.parametrize(
    "override, message",
    [
        ("time.until={probe: tap, within: 0.1}", "there is no probe 'tap'"),
        ("time={end: 1 s, until: {probe: tip, within: 0.1}}", "only a static run can end"),
    ],
)
def test_a_probe_that_cannot_end_it(build, override, message):
    with pytest.raises(SceneError) as caught:
        build(hanging("plane_strain"), override)
    assert message in caught.value.message
