"""Mass scaling: what it must leave as it is, and what it slows."""

import numpy as np
import pytest

from softsim.compute import fields
from softsim.errors import SceneError
from softsim.solver.natural_modes import natural_modes

BLOCK = """
bodies:
  b: {mesh: {generator: block, length: 3 mm, height: 2 mm, element_size: 0.5 mm, cells: quad},
      formulation: plane_strain, thickness: 5 mm, material: rubber, position: [1 mm, 0 mm],
      initial_velocity: [0.3 m/s, 0.1 m/s]}
materials:
  rubber: {law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3,
           prony: [{g: 0.3, relaxation_time: 1 ms}]}
conditions: {blow: {kind: initial_velocity, nodes: b.top, velocity: [1 m/s, -2 m/s]}}
environment: {gravity: 0 m/s^2}
time: {end: 1 s}
"""
WHOLE = ["solver.mass_scaling={within: 4 mm, factor: 9}"]
PARTS = ["solver.mass_scaling={within: 1.1 mm, factor: 9}"]

BEAM = """
bodies:
  b: {mesh: {generator: block, length: 20 mm, height: 1 mm, element_size: 1 mm, cells: quad},
      formulation: plane_strain, thickness: 5 mm, material: rubber, fixed: [left]}
materials: {rubber: {law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3}}
time: {end: 20 ms, procedure: static}
output: {frame_interval: 1 s, probes: {tip: {kind: displacement, nodes: b.right}}}
"""


def scaled_momentum(solver):
    """M' v (n, d) of all nodes at half steps."""
    model = solver.models[0]
    root = np.sqrt(model.mass)[:, None]
    velocity = fields.read(solver.terms.nodes.velocity)[0]
    inertia = model.mass_scaling.scaled(model.mass, model.dimension, 1.0)
    return root * (inertia @ (root * velocity).ravel()).reshape(velocity.shape)


def test_momenta_and_energy_are_kept(build, fresh_taichi):
    """A struck block that flies and vibrates: angular momentum is that of M'. The balance is off by
    the square of the step: 2e-3 at 0.9 of the stable one.
    """
    from softsim.solver.energy import EnergyReader
    from softsim.solver.explicit import ExplicitSolver
    from softsim.solver.stable_step import stable_step

    model = build(BLOCK, *PARTS)
    solver = ExplicitSolver([model])
    solver.begin(0.45 * stable_step(model, model.points).value)
    reader = EnergyReader(solver)

    def books():
        x, p = solver.positions()[0], scaled_momentum(solver)
        turning = (x[:, 0] * p[:, 1] - x[:, 1] * p[:, 0]).sum()
        return p.sum(axis=0), turning, reader.read()

    linear, turning, energies = books()
    solver.advance(4000)
    linear_after, turning_after, after = books()
    np.testing.assert_allclose(linear_after, linear, rtol=1e-11)
    np.testing.assert_allclose(
        linear, solver.models[0].mass @ fields.read(solver.terms.nodes.velocity)[0], rtol=1e-11
    )
    assert turning_after == pytest.approx(turning, rel=1e-10)
    assert after.viscous_dissipation > 0.01 * energies.kinetic
    assert after.balance == pytest.approx(energies.balance, rel=3e-4)


def test_one_group_slows_every_mode_alike(build, fresh_taichi):
    """Where all nodes are in one group, every vibration has 1 / sqrt(factor) of its frequency."""
    model, scaled = build(BLOCK), build(BLOCK, *WHOLE)
    of_block = [natural_modes(m, m.bodies[0], 4) for m in (model, scaled)]
    fast, slow = ([mode.frequency for mode in found.modes] for found in of_block)
    np.testing.assert_allclose(np.array(fast) / slow, 3.0, rtol=1e-6)
    assert of_block[1].rigid_motions == 3


def test_small_groups_leave_slow_modes_alone(build, fresh_taichi, record_verification):
    """Of a cantilever with one element across, whose cross sections are the groups: they turn, and
    h^2 / 4 of the ends' masses is added (factor - 1) times. By Rayleigh, with the turning energy
    of a clamped beam's first mode, 4.648 / L^2 of that of its motion.
    """
    model = build(BEAM)
    scaled = build(BEAM, "solver.mass_scaling={within: 1.01 mm, factor: 4}")
    first, slowed = (natural_modes(m, m.bodies[0], 1).modes[0].frequency for m in (model, scaled))
    expected = 1.0 / np.sqrt(1.0 + 3.0 * 0.25 * 4.648 / 20.0**2)
    record_verification("first mode of a beam under mass scaling 4", expected, slowed / first)
    assert slowed / first == pytest.approx(expected, abs=5e-4)


def test_statics_are_untouched(build, restart):
    """Dynamic relaxation to the same sag, its damping booked."""
    from softsim.solver.energy import EnergyReader
    from softsim.solver.explicit import ExplicitSolver
    from softsim.solver.stable_step import stable_step

    sags = []
    for settings in ([], ["solver.mass_scaling={within: 1.01 mm, factor: 4}"]):
        model = build(BEAM.replace("20 mm", "6 mm"), *settings)
        restart()
        solver = ExplicitSolver([model])
        reader = EnergyReader(solver)
        solver.begin(0.9 * stable_step(model, model.points).value)
        solver.damp(0, 0.8)
        initial = reader.read().balance
        solver.advance(20_000)
        energies = reader.read()
        assert energies.balance == pytest.approx(initial, abs=2e-2 * energies.internal)
        sags.append(solver.positions()[0][:, 1].min() - model.points[:, 1].min())
    assert sags[0] < -20e-6
    assert sags[1] == pytest.approx(sags[0], rel=1e-4)


def test_a_distance_that_joins_nothing_is_refused(build, fresh_taichi):
    with pytest.raises(SceneError, match=r"shortest element edge is 0\.5 mm"):
        build(BLOCK, "solver.mass_scaling={within: 0.4 mm}")
