"""Whole runs of deformable bodies that hit each other: energy, momentum, the same bits."""

import numpy as np
import pytest
from present_row import wall_contact
from surface_rig import PLANE

from softsim.compute import fields
from softsim.solver.energy import EnergyBalance, EnergyReader
from softsim.solver.increments import Span
from softsim.solver.stable_step import stable_step

ASLANT = "bodies.upper.initial_velocity=[3 m/s, -8 m/s]"


def touching(solver):
    """Number of nodes that touch a facet."""
    return int((fields.read(solver.terms.self_contacts[0].facet) >= 0).sum())


def momenta(solver):
    """Linear and angular momentum about the origin, at half steps as the scheme keeps them."""
    mass, x = solver.models[0].mass, solver.positions()[0]
    v = fields.read(solver.terms.nodes.velocity)[0]
    return np.array([*(mass @ v), mass @ (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])])


def test_a_body_thrown_at_another_comes_back(build, start):
    """At 13 m/s, as fast as a spike has been seen to snap: no node gets past the other body's
    surface for good, momenta are kept to round-off and energy within its limit.
    """
    model = build(PLANE, "bodies.upper.initial_velocity=[2 m/s, -13 m/s]")
    solver = start(model)
    reader = EnergyReader(solver)
    balance = EnergyBalance.starting(reader.read(), model)
    before, touched, errors = momenta(solver), 0, []
    for _ in range(30):
        solver.advance(10)
        errors.append(balance.error(reader.read()))
        touched = max(touched, touching(solver))
    assert touched > 10
    x = solver.positions()[0]
    assert x[model.bodies[1].nodes, 1].min() > x[model.bodies[0].nodes, 1].max()
    assert max(errors) < model.energy_error_limit
    energies = reader.read()
    assert energies.friction_dissipation > 0.0
    assert wall_contact(solver.scenario(0)).contact_count == 0  # of walls only
    scale = np.abs(model.mass[:, None] * model.velocity).sum() * np.array([1.0, 1.0, 8e-3])
    np.testing.assert_array_less(np.abs(momenta(solver) - before), 1e-12 * scale)


def test_a_resumed_run_goes_on_to_the_same_bits(build, start):
    """From the memory of a checkpoint, taken while the bodies rub. Lists are not part of it: they
    are made anew at another time than in the run that was not interrupted.
    """
    model = build(PLANE, ASLANT)
    whole = start(model)
    while not touching(whole):
        whole.advance(1)
    whole.advance(3)
    kept, then, done = whole.state(), whole.time, whole.increment_count
    whole.advance(60)
    expected = whole.state()
    resumed = start(model)
    resumed.restore(kept, then, done, whole.time_increment)
    resumed.advance(60)
    after = resumed.state()
    for name, array in expected.items():
        np.testing.assert_array_equal(after[name], array, err_msg=name)


def test_workers_give_the_bits_of_one_in_self_contact(build, restart):
    """One thread by itself or two side by side."""
    from softsim.compute.machine import processor_count
    from softsim.solver.explicit import ExplicitSolver

    if processor_count() == 1:
        pytest.skip("one processor")
    restart(threads=2, device="cpu")
    model = build(PLANE, ASLANT)
    dt = 0.9 * stable_step(model, model.points).value
    solver = ExplicitSolver([model])
    solver.begin(dt)
    rest, found = solver.state(), []
    for workers in (1, 2):
        solver.restore(rest, 0.0, 0, dt)
        solver.kernels.together(0, Span(60, solver.time, dt, drift=dt, kick=dt), workers)
        assert fields.read(solver.terms.self_contacts[0].friction_dissipation).any()
        found.append(solver.state())
    for name, array in found[0].items():
        np.testing.assert_array_equal(found[1][name], array, err_msg=name)
