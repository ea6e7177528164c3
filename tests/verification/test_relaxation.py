"""Maxwell branches: the stress after a sudden stretch falls as exp(-t / tau), exactly, and a
vibration meets their complex modulus, whether they are held for some increments or not.
"""

import numpy as np
import pytest

from softsim.compute import fields

SCENE = """
bodies:
  b: {mesh: {generator: block, length: 2 mm, height: 1 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: m, fixed: [surface]}
materials:
  m: {law: yeoh, C10: 50 kPa, density: 1000 kg/m^3, prony: [{g: 0.4, relaxation_time: 2 ms}]}
environment: {gravity: 0 m/s^2}
solver: {bulk_viscosity: 0}
time: {end: 1 s}
"""


def test_step_strain_relaxes_exponentially(build, start):
    model = build(SCENE)
    solver = start(model)
    F = np.array([[1.3, 0.2], [0.0, 1.0 / 1.3]])
    fields.write(solver.terms.nodes.position, (model.points @ F.T)[None].copy())

    def surface_force():
        return fields.read(solver.terms.nodes.force)[0]

    solver.advance(1)
    first, t1 = surface_force(), solver.time
    solver.advance(400)
    later, t2 = surface_force(), solver.time
    solver.advance(20000)
    rest = surface_force()
    # The update is exact for a constant strain, so only round-off remains.
    expected = rest + (first - rest) * np.exp(-(t2 - t1) / 2e-3)
    np.testing.assert_allclose(later, expected, atol=1e-9 * np.abs(first).max())
    # The branch was held so far: it carries g / (1 - g) of the neo-Hookean long-term stress.
    # det F = 1: the long-term force is that of the law alone.
    np.testing.assert_allclose(first - rest, rest * 0.4 / 0.6, atol=1e-6 * np.abs(first).max())


@pytest.mark.parametrize(
    ("steps", "radians"), [(60.0, 1.0), (1000.0, 20.0), (2.0, 1.0), (0.25, 0.04)]
)
def test_a_vibration_meets_the_complex_modulus(build, start, steps, radians, record_verification):
    """Relaxation times of so many steps, w tau in radians: the branch adds i w tau / (1 + i w tau)
    times g / (1 - g) of the law's modulus, but for (w h)^2 / 12 of that, held for h; g = 0.4.
    """
    dt = start(build(SCENE)).time_increment
    model = build(SCENE, f"materials.m.prony=[{{g: 0.4, relaxation_time: {steps * dt!r} s}}]")
    solver = start(model)
    assert solver.time_increment == pytest.approx(dt)
    phase = radians / steps  # w dt
    per_period = 2.0 * np.pi / phase
    shear = model.points[:, 1:] * [[1e-4, 0.0]]
    angles, forces = [], []
    for n in range(1, int(np.ceil(2.0 * per_period))):
        fields.write(solver.terms.nodes.position, (model.points + np.sin(n * phase) * shear)[None])
        solver.advance(1)
        if n > per_period:
            angles.append(n * phase)
            forces.append(fields.read(solver.terms.nodes.force)[0, -1, 0])
    start_up = np.exp(-np.array(angles) / radians)
    waves = np.stack([np.sin(angles), np.cos(angles), start_up], axis=1)
    real, imaginary, _ = np.linalg.lstsq(waves, np.array(forces), rcond=None)[0]
    fields.write(solver.terms.nodes.position, (model.points + shear)[None])
    solver.advance(int(100 * steps) + 100)
    law = fields.read(solver.terms.nodes.force)[0, -1, 0]
    exact = 1j * radians / (1.0 + 1j * radians)
    computed = ((real + 1j * imaginary) / law - 1.0) * 0.6 / 0.4
    case = f"loss of a branch of {steps:g} steps at w tau = {radians:g}"
    record_verification(case, exact.imag, computed.imag)
    held = solver.terms.elements[0].points.relaxation.holds.to_numpy()[0, 0]
    assert abs(computed - exact) < 0.001 + (held * phase) ** 2 / 12.0


def test_dissipation_is_what_the_branch_loses(build, start):
    """No work is done while it relaxes, so stored plus dissipated energy stays."""
    from softsim.solver.energy import EnergyReader

    model = build(SCENE)
    solver = start(model)
    reader = EnergyReader(solver)
    F = np.array([[1.3, 0.2], [0.0, 1.0 / 1.3]])
    fields.write(solver.terms.nodes.position, (model.points @ F.T)[None].copy())
    solver.advance(8)
    before = reader.read()
    solver.advance(2000)
    after = reader.read()
    lost = before.internal - after.internal
    gained = after.viscous_dissipation - before.viscous_dissipation
    assert lost > 0.0
    # Sampled every 8 increments at the right end: relative error 8 dt / tau at most.
    assert abs(gained - lost) < 8.0 * solver.time_increment / 2e-3 * lost


STRUCK = """
bodies:
  b: {mesh: {generator: block, length: 10 mm, height: 6 mm, element_size: 2 mm},
      formulation: plane_strain, thickness: 10 mm, material: m, fixed: [left]}
materials:
  m: {law: yeoh, C10: 60 kPa, density: 1070 kg/m^3, prony: [{g: 0.4, relaxation_time: 50 us}]}
environment: {gravity: 0 m/s^2}
solver: {bulk_viscosity: 0}
loads: {blow: {kind: nodal_force, nodes: b.right, force: [0 N, -0.2 N]}}
time: {end: 1 s}
"""


def books_after_a_blow(model, start, share):
    """Within 20 ms, with this share of the stable step [-]: the largest error of the balance in use
    [-], what is missing at most [J], and the last energies.
    """
    from softsim.solver.energy import EnergyBalance, EnergyReader

    solver = start(model, share=share)
    reader = EnergyReader(solver)
    first = reader.read()
    balance = EnergyBalance.starting(first, model)
    errors, missing = [], []
    while solver.time < 20e-3:
        solver.advance(10)
        energies = reader.read()
        errors.append(balance.error(energies))
        missing.append(abs(energies.balance - first.balance))
    return max(errors), max(missing), energies


def test_books_of_a_short_branch(build, start, record_verification):
    """A branch of 50 us under a sudden load, the step some 20 us: its books are off by the square
    of the step, as all others are.
    """
    model = build(STRUCK)
    error, coarse, energies = books_after_a_blow(model, start, 0.9)
    fine = books_after_a_blow(model, start, 0.45)[1]
    order = np.log2(coarse / fine)
    record_verification("energy error, branch of 50 us under a blow", 0.0, error, order)
    assert energies.viscous_dissipation > 0.02 * energies.external_work
    assert error < 0.005
    assert order > 1.8


def test_a_branch_that_relaxes_within_a_step(build, start):
    """A branch of a twentieth of a step is a dashpot: it dissipates as much as with a short step,
    and its books close.
    """
    model = build(STRUCK, "materials.m.prony=[{g: 0.4, relaxation_time: 1 us}]")
    assert start(model).time_increment > 15e-6
    error, _, energies = books_after_a_blow(model, start, 0.9)
    _, _, short = books_after_a_blow(model, start, 0.045)
    assert error < 0.005
    assert energies.viscous_dissipation == pytest.approx(short.viscous_dissipation, rel=0.05)
