"""Mullins effect: stress, stored energy, dissipation and stable step.

The closed forms are written anew here, with scipy's error function and quadrature.
"""

import closed_forms
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import erf

from softsim.errors import ModesError, SimulationError

C = (36e3, 5e3, 1e3)
R, M, BETA = 1.6, 2e3, 0.4
MULLINS = f"mullins: {{r: {R}, m: 2 kPa, beta: {BETA}}}"
KAPPA = 20.0 * 72e3


def eta(W, peak):
    """Ogden and Roxburgh 1999, with the constants of ABAQUS."""
    return 1.0 - erf((peak - W) / (M + BETA * peak)) / R


def energy_of(stretches):
    """Isochoric energy density of Yeoh's law [J/m^3]."""
    J = np.prod(stretches)
    return closed_forms.energy_density(J ** (-2.0 / 3.0) * np.sum(np.square(stretches)), C)


def softened_by(peak):
    """Cauchy stress of a point whose largest energy density so far was `peak` [J/m^3]."""

    def stress(stretches, c, kappa):
        W = energy_of(stretches)
        pressure = kappa * (np.prod(stretches) - 1.0)
        deviator = closed_forms.cauchy_stress(stretches, c, kappa) - pressure
        return eta(W, max(W, peak)) * deviator + pressure

    return stress


# A block is pulled, partly released, pulled further and released.
SIDE = 2e-3
PULLS = ((0, 0.0), (1, 2.0e-3), (2, 0.8e-3), (3, 2.6e-3), (4, 0.0))  # [s], [m]
PULL = f"""
bodies:
  b:
    mesh: {{generator: box, length: 2 mm, height: 2 mm, width: 2 mm, element_size: 1 mm}}
    formulation: solid
    material: soft
materials:
  soft: {{law: yeoh, C10: 36 kPa, C20: 5 kPa, C30: 1 kPa, density: 1000 kg/m^3, {MULLINS}}}
environment: {{gravity: 0 m/s^2}}
conditions:
  left: {{kind: symmetry, nodes: b.left, normal: x}}
  bottom: {{kind: symmetry, nodes: b.bottom, normal: y}}
  back: {{kind: symmetry, nodes: b.back, normal: z}}
  right:
    kind: prescribed
    nodes: b.right
    direction: x
    displacement: {{kind: table, points: [{", ".join(f"[{t} s, {u} m]" for t, u in PULLS)}]}}
output: {{history_interval: 50 ms, probes: {{hold: {{kind: reaction, nodes: b.right}}}}}}
solver: {{equilibrium_tolerance: 1e-6}}
"""
STEPS = """
steps:
  pull: {time: {end: 1.5 s, procedure: static}}
  again: {time: {end: 2.5 s, procedure: static}}
"""


def test_a_block_is_pulled_twice(write_scene, tmp_path, kernel_cache, monkeypatch,
                                 record_verification):  # fmt: skip
    """Force, stored and dissipated energy of a homogeneous bar in all rows of two steps."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from rich.console import Console

    from softsim.run import run_steps
    from softsim.scene.steps import load_steps

    steps = load_steps(write_scene(PULL + STEPS, "steps.yaml"))
    found = run_steps(steps, tmp_path / "run", "cpu", console=Console(quiet=True))
    pull, again = (found[step].history for step in ("pull", "again"))
    history = {name: np.concatenate([pull[name], again[name]]) for name in pull}
    volume, peak = SIDE**3, 0.0
    largest = dict.fromkeys(("force", "stored", "dissipated"), 0.0)
    for k, t in enumerate(history["time"]):
        stretch = 1.0 + np.interp(t, *np.transpose(PULLS)) / SIDE
        bar = closed_forms.nearly_incompressible_uniaxial(stretch, C, KAPPA, softened_by(peak))
        W = energy_of([stretch, bar.lateral_stretch, bar.lateral_stretch])
        peak = max(peak, W)
        stored = quad(lambda w, p=peak: eta(w, p), 0.0, W, epsabs=1e-9)[0]
        lost = peak - quad(lambda w, p=peak: eta(w, p), 0.0, peak, epsabs=1e-9)[0]
        stored += 0.5 * KAPPA * (bar.J - 1.0) ** 2
        compared = {
            "force": (history["hold_x"][k], bar.stress * SIDE**2),
            "stored": (history["internal_energy"][k], stored * volume),
            "dissipated": (history["damage_dissipation"][k], lost * volume),
        }
        for name, (computed, exact) in compared.items():
            largest[name] = max(largest[name], abs(computed - exact))
    for name, size in (("force", "hold_x"), ("stored", "internal_energy"),
                       ("dissipated", "damage_dissipation")):  # fmt: skip
        share = largest[name] / np.abs(history[size]).max()
        record_verification(f"Mullins effect, bar pulled twice: {name}, largest error", 0.0, share)
        assert share < 1e-8
    error = max(step["energy_error"][-1] for step in (pull, again))
    record_verification("Mullins effect, bar pulled twice: energy error", 0.0, error)
    assert error < 0.005
    assert history["hold_x"][-1] == pytest.approx(0.0, abs=1e-5)  # no permanent set


def test_derivatives_are_refused(write_scene, kernel_cache, monkeypatch):
    """The stiffness on loading differs from that on unloading."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim import Simulation

    simulation = Simulation(write_scene(PULL + "time: {end: 1 s, procedure: static}\n"))
    simulation.step(0.1)
    with pytest.raises(SimulationError, match="material 'soft' softens"):
        simulation.gradient("hold_x", ["materials.soft.C10"])


# Vibration: the energy balance, in three formulations, with both kinds of laws and without m.

SHAKEN = """
bodies: {b: {BODY, material: soft, fixed: [left]}}
materials:
  soft: {LAW, density: 1000 kg/m^3, prony: [{g: 0.3, relaxation_time: 1 ms}], SOFTENING}
environment: {gravity: 0 m/s^2}
loads:
  pull:
    kind: nodal_force
    nodes: b.right
    direction: [1, 0.3, 0]
    profile: {kind: smooth_step, value: 0.1 N, duration: 2 ms}
time: {end: 30 ms}
"""
BLOCK = "{generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm, cells: quad}"
BOX = "{generator: box, length: 4 mm, height: 2 mm, width: 2 mm, element_size: 1 mm}"
YEOH = "law: yeoh, C10: 36 kPa, C20: 5 kPa, C30: 1 kPa"
RING = "{generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm}, position: [4 mm, 0 mm]"
SCALE_FREE = "mullins: {r: 2, beta: 0.1}"
OGDEN = "law: ogden, mu: [60 kPa, 10 kPa, 2 kPa], alpha: [1.3, -2.5, 7]"
SHAKEN_BODIES = {
    "plane_strain": (f"mesh: {BLOCK}, formulation: plane_strain, thickness: 2 mm", OGDEN, MULLINS),
    "axisymmetric": (f"mesh: {RING}, formulation: axisymmetric", YEOH, SCALE_FREE),
    "solid": (f"mesh: {BOX}, formulation: solid", YEOH, MULLINS),
}


@pytest.mark.parametrize("formulation", list(SHAKEN_BODIES))
def test_a_vibration_keeps_its_energy(build, start, record_verification, formulation):
    """Work = stored + kinetic + dissipated, though the peak of the energy density rises."""
    from softsim.solver.energy import EnergyReader

    body, law, mullins = SHAKEN_BODIES[formulation]
    text = SHAKEN.replace("BODY", body).replace("LAW", law).replace("SOFTENING", mullins)
    if formulation != "solid":
        text = text.replace("[1, 0.3, 0]", "[1, 0.3]")
    solver = start(build(text))
    reader = EnergyReader(solver)
    begin, largest, damage = reader.read().balance, 0.0, [0.0]
    while solver.times[0] < 30e-3:
        solver.advance(200)
        energies = reader.read()
        largest = max(largest, abs(energies.balance - begin) / energies.reference_energy)
        damage.append(energies.damage_dissipation)
    record_verification(f"Mullins effect, vibration, {formulation}: energy error", 0.0, largest)
    assert largest < 1e-3
    assert damage[-1] > 0.05 * energies.external_work
    assert np.diff(damage).min() >= 0.0


def test_the_error_function_of_kernels(fresh_taichi):
    """It is as accurate as scipy's."""
    import taichi as ti

    from softsim.compute import backend
    from softsim.elements.kinematics import LaneFunctions

    lane, functions = backend.lane_vector(), LaneFunctions()
    x = np.linspace(0.0, 12.0, 1201)
    computed = np.zeros((2, len(x)))

    @ti.kernel
    def fill(x: ti.types.ndarray(ti.f64, ndim=1), y: ti.types.ndarray(ti.f64, ndim=2)):
        for i in x:
            at = lane(x[i])
            y[0, i] = functions.erf(at)[0]
            y[1, i] = functions.erf_integral(at)[0]

    fill(x, computed)
    np.testing.assert_allclose(computed[0], erf(x), atol=1e-13)
    integral = [quad(erf, 0.0, end)[0] for end in x[::100]]
    np.testing.assert_allclose(computed[1][::100], integral, rtol=1e-11, atol=1e-13)


TWO_BLOCKS = f"""
bodies:
  low: {{mesh: {BLOCK}, formulation: plane_strain, thickness: 2 mm, material: soft}}
  high:
    mesh: {BLOCK}
    formulation: plane_strain
    thickness: 2 mm
    material: soft
    position: [0 mm, 10 mm]
    sets: {{end: {{box: [[0 mm, 9 mm], [1 mm, 13 mm]]}}}}
    regions: {{end: {{material: firm}}}}
materials:
  soft: {{{YEOH}, density: 1000 kg/m^3, {MULLINS}}}
  firm: {{{YEOH}, density: 1000 kg/m^3}}
environment: {{gravity: 0 m/s^2}}
time: {{end: 1 s}}
"""


def test_the_peaks_of_each_region(build, start):
    """Bodies of one material share kernels; stresses of frames are those of the softened cells."""
    from softsim.compute import fields
    from softsim.output.observation import frame

    model = build(TWO_BLOCKS)
    solver = start(model)
    [softening] = [term for term in solver.terms.elements if term.points.softens]
    peak = softening.points.softening.peak
    values = fields.read(peak)
    numbers = np.arange(1.0, values.size + 1.0)
    fields.write(peak, 1e3 * numbers.reshape(values.shape))
    peaks = solver.scenario(0).peak_energies()
    soft = [k for k, region in enumerate(model.regions) if region.material.name == "soft"]
    counts = [len(model.regions[k].cells) for k in soft]
    np.testing.assert_array_equal(
        np.concatenate([peaks[k] for k in soft]), 1e3 * numbers[: sum(counts)]
    )
    assert [len(peaks[k]) for k in soft] == counts
    assert [peaks[k] for k in range(len(peaks)) if k not in soft] == [0.0]

    x = model.points.copy()
    x[:, 0] *= 1.2
    fields.write(solver.terms.nodes.position, x[None])
    stress = frame(solver.scenario(0), ()).cell_data["von_mises"]
    fields.write(peak, 0.0)
    virgin = frame(solver.scenario(0), ()).cell_data["von_mises"]
    W = energy_of([1.2, 1.0, 1.0])
    expected = eta(W, np.maximum(W, 1e3 * numbers[: counts[0]]))
    np.testing.assert_allclose((stress / virgin)[: counts[0]], expected, rtol=1e-9)


def test_modes(build, fresh_taichi):
    """Modes about an equilibrium are refused; those at rest are those of the new material."""
    from softsim.solver.natural_modes import natural_modes
    from softsim.statics.modes import refuse_softening

    softening = TWO_BLOCKS.replace(MULLINS, SCALE_FREE)
    models = [build(softening), build(softening.replace(f", {SCALE_FREE}", ""))]
    with pytest.raises(ModesError, match="material 'soft' softens"):
        refuse_softening(models[0])
    at_rest = [natural_modes(m, m.bodies[0], 3).modes[0].frequency for m in models]
    assert at_rest[0] == pytest.approx(at_rest[1], rel=1e-12)
