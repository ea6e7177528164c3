"""Modes of loaded bodies against closed forms, harmonic response against a run in time."""

import numpy as np
import pytest
from scipy.optimize import brentq

from softsim.run import run
from softsim.run.equilibrium import LoadRange, motors
from softsim.scene.loading import load_scene
from softsim.statics.modes import HarmonicResponse, lines_of, zero_crossings

SHEAR, DENSITY = 72e3, 1000.0
KAPPA = 20.0 * SHEAR

MATERIAL = "materials: {rubber: {law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3}}"

STRIP = f"""
bodies:
  strip: {{mesh: {{generator: block, length: 40 mm, height: 0.4 mm, element_size: 0.4 mm,
                  cells: quad}},
          formulation: plane_strain, thickness: 5 mm, material: rubber, fixed: [left]}}
conditions:
  pull: {{kind: prescribed, nodes: strip.right, direction: x,
         displacement: {{kind: ramp, value: 20 mm, duration: 1 s}}}}
  level: {{kind: fixed, nodes: strip.right, directions: [y]}}
{MATERIAL}
environment: {{gravity: 0 m/s^2}}
time: {{end: 1 s}}
"""

MEMBRANE = f"""
bodies:
  disc: {{mesh: {{generator: block, length: 20 mm, height: 0.2 mm, element_size: 0.4 mm,
                 cells: quad}},
         formulation: axisymmetric, position: [10 mm, 0 mm], material: rubber}}
conditions:
  pull: {{kind: prescribed, nodes: disc.right, direction: x,
         displacement: {{kind: ramp, value: 6 mm, duration: 1 s}}}}
  level: {{kind: fixed, nodes: disc.right, directions: [y]}}
{MATERIAL}
environment: {{gravity: 0 m/s^2}}
time: {{end: 1 s}}
"""

COLUMN = f"""
bodies:
  column: {{mesh: {{generator: block, length: 40 mm, height: 1 mm, element_size: 0.5 mm,
                   cells: quad}},
           formulation: plane_strain, thickness: 5 mm, material: rubber, fixed: [left]}}
loads:
  weight: {{kind: nodal_force, nodes: column.right, direction: [-1, 0],
           profile: {{kind: ramp, value: 1 mN, duration: 1 s}}}}
{MATERIAL}
environment: {{gravity: 0 m/s^2}}
time: {{end: 1 s}}
"""


# A pulled beam with a rigid head that a sinusoidal force shakes; a strongly damped material.
SHAKEN = """
bodies:
  beam: {mesh: {generator: block, length: 5 mm, height: 2 mm, element_size: 1 mm, cells: quad},
         formulation: plane_strain, thickness: 5 mm, material: soft, fixed: [left]}
rigid_bodies:
  head: {mass: 0.1 g, inertia: 1 g*mm^2, center: [4 mm, 0.5 mm], tied: [beam.right]}
loads:
  pull: {kind: rigid_force, acts_on: head, force: [50 mN, 0 N], ramp: 0.1 s}
  motor: {kind: sinusoidal_force, acts_on: head, amplitude: 0.2 mN, direction: [0.3, 1],
          frequency: 60 Hz, spin_up: 20 ms}
materials: {soft: {law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3,
                   prony: [{g: 0.4, relaxation_time: 1 ms}]}}
environment: {gravity: 0 m/s^2}
output: {history_interval: 0.5 ms, frame_interval: 1 s,
         probes: {tip: {kind: displacement, nodes: beam.right}}}
time: {end: 0.4 s}
"""


def stresses(stretch: np.ndarray) -> np.ndarray:
    """Cauchy stresses (3,) [Pa] of W = mu/2 (I1_bar - 3) + kappa/2 (J - 1)^2."""
    J, squares = stretch.prod(), stretch**2
    return SHEAR * J ** (-5.0 / 3.0) * (squares - squares.mean()) + KAPPA * (J - 1.0)


def test_a_stretched_strip_vibrates_as_a_string(equilibria, record_verification):
    """A strip between clamps, stretched by lambda, has the tension T = sigma A and the length L:
    f_n = n / (2 L) sqrt(T / m) (1 + 2 / L sqrt(E I / T)), m its mass per length. The bending
    stiffness adds 1 %, for which an estimate of the modulus along it is enough.
    """
    state = equilibria(STRIP)
    state.reach(state.end)
    found = state.vibrations("stick").modes(3)
    across_it = [m for m in found.loaded if np.abs(m.shape[:, 0]).max() < 0.1]  # one is along it
    stretch = 1.5
    across = brentq(lambda s: stresses(np.array([stretch, s, 1.0]))[1], 0.5, 1.0)

    def force(along: float) -> float:
        free = brentq(lambda s: stresses(np.array([along, s, 1.0]))[1], 0.4, 1.2)
        return float(stresses(np.array([along, free, 1.0]))[0] * free)

    height, width, length = 0.4e-3 * across, 5e-3, 60e-3
    tension = force(stretch) * 0.4e-3 * width
    modulus = stretch * (force(1.501) - force(1.499)) / 0.002 / across
    bending = modulus * width * height**3 / 12.0
    per_length = DENSITY * 0.4e-3 * width / stretch
    assert len(across_it) == 2
    for n, mode in enumerate(across_it, start=1):
        clamped = 1.0 + 2.0 / length * np.sqrt(bending / tension)
        exact = n / (2.0 * length) * np.sqrt(tension / per_length) * clamped
        record_verification(f"stretched strip, mode {n} [Hz]", exact, mode.frequency)
        assert mode.frequency == pytest.approx(exact, rel=3e-3)
    assert found.rigid_motions == 0 and not found.unstable


def test_a_stretched_membrane(equilibria, record_verification):
    """A disc that is stretched in its plane: f = alpha / (2 pi a) sqrt(T / (rho h)) with the zeros
    alpha of J0, T = sigma h, and a clamped edge that adds the share sqrt(D / T) / a.
    """
    state = equilibria(MEMBRANE)
    state.reach(state.end)
    stretch, radius = 26.0 / 20.0, 26e-3
    across = brentq(lambda s: stresses(np.array([stretch, stretch, s]))[2], 0.3, 1.0)
    sigma = stresses(np.array([stretch, stretch, across]))[0]
    height = 0.2e-3 * across
    density = DENSITY / (stretch**2 * across)
    bending = 4.0 * SHEAR * height**3 / 12.0
    clamped = 1.0 + np.sqrt(bending / (sigma * height)) / radius
    found = state.vibrations("stick").modes(2).loaded
    for alpha, mode in zip((2.404826, 5.520078), found, strict=True):
        exact = alpha / (2.0 * np.pi * radius) * np.sqrt(sigma / density) * clamped
        record_verification(f"stretched membrane, alpha = {alpha:.3g} [Hz]", exact, mode.frequency)
        assert mode.frequency == pytest.approx(exact, rel=5e-3)


def test_a_column_buckles_where_its_frequency_is_zero(equilibria, record_verification):
    """Euler: P = pi^2 E' I / (4 L^2) of a column that is clamped at its foot, in plane strain."""
    poisson = (3.0 * KAPPA - 2.0 * SHEAR) / (2.0 * (3.0 * KAPPA + SHEAR))
    modulus = 2.0 * SHEAR * (1.0 + poisson) / (1.0 - poisson**2)
    exact = np.pi**2 * modulus * 5e-3 * 1e-9 / 12.0 / (4.0 * 40e-3**2)
    over = LoadRange.read(f"weight=0..{1.3e3 * exact!r} mN", "--over")
    state = equilibria(COLUMN, over=over)
    values, found = over.values(4).tolist(), []
    for value in values:
        state.reach(over.fraction_of_time(value) * state.end)
        found.append(state.vibrations("stick").modes(2))
    assert [len(modes.unstable) for modes in found] == [0, 0, 0, 1]
    [buckling] = zero_crossings(values, found, lines_of(found))
    record_verification("Euler load of a column [mN]", 1e3 * exact, buckling)
    assert buckling == pytest.approx(1e3 * exact, rel=1e-2)
    lowest = [modes.loaded[0].frequency for modes in found]
    assert lowest == sorted(lowest, reverse=True)
    assert "unstable: 1 mode with negative stiffness" in " ".join(found[-1].warnings())


@pytest.mark.physics
@pytest.mark.starts(3)
@pytest.mark.parametrize("frequency", [60.0, 150.0])  # below and above the first mode
def test_a_harmonic_response_is_that_of_a_run_in_time(
    equilibria, write_scene, tmp_path, record_verification, frequency
):
    """Im(u exp(i angle)) of the motor's angle 2 pi f (t - spin_up / 2), fitted to four cycles."""
    text = SHAKEN.replace("60 Hz", f"{frequency} Hz")
    state = equilibria(text)
    state.reach(state.end)
    harmonic = HarmonicResponse(state.vibrations("stick"))
    [(name, motor)] = motors(load_scene(write_scene(text))).items()
    found = state.response(harmonic, name, motor, [frequency])
    assert found.force == pytest.approx(0.2e-3) and not found.contact_changes.any()
    rows = run(write_scene(text), out=tmp_path / "run", device="cpu").history
    late = rows["time"] > 0.4 - 4.0 / frequency
    angle = 2.0 * np.pi * frequency * (rows["time"][late] - 10e-3)
    waves = np.column_stack([np.sin(angle), np.cos(angle), np.ones_like(angle)])
    (a, b, _), *_ = np.linalg.lstsq(waves, rows["tip_y"][late], rcond=None)
    [response] = found.amplitudes["tip_y"]
    record_verification(f"harmonic response at {frequency:g} Hz [um]", 1e6 * np.hypot(a, b),
                        1e6 * abs(response))  # fmt: skip
    assert abs(response - (a + 1j * b)) < 0.005 * abs(response)
