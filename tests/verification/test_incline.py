"""A soft block on an incline: Coulomb's law as a whole body feels it."""

import numpy as np
import pytest

BLOCK = """
bodies:
  block: {mesh: {generator: block, length: 10 mm, height: 6 mm, element_size: 2 mm},
          formulation: plane_strain, thickness: 10 mm, material: dragon_skin_30}
environment: {inclination: 20 deg, walls: {floor: {kind: plane}}}
contact: {friction_coefficient: 0.5}
time: {end: 1 s}
"""
# atan(0.5) = 26.57 deg: at 20 deg it sticks, at 35 deg it slides.


def centre_x(solver):
    model = solver.models[0]
    return float(model.mass @ solver.positions()[0][:, 0] / model.mass.sum())


def settle(solver, until):
    while solver.time < until:
        solver.advance(2000)


def test_sticks_below_the_friction_angle(build, start):
    """Once settled it does not creep: less than 1 um in 0.5 s (in 10 s: the slow test)."""
    solver = start(build(BLOCK))
    settle(solver, 0.5)
    before = centre_x(solver)
    settle(solver, 1.0)
    assert abs(centre_x(solver) - before) < 1e-6


def test_holds_a_pull_just_below_the_limit(build, start):
    """On a level floor, pulled gently with 0.95 mu m g, it stays; with 1.05 mu m g it goes."""
    weight = 1080.0 * 10e-3 * 6e-3 * 10e-3 * 9.81
    for share, holds in ((0.95, True), (1.05, False)):
        pull = share * 0.5 * weight
        load = f"{{kind: nodal_force, nodes: block.surface, force: [{pull} N, 0 N], ramp: 200 ms}}"
        solver = start(build(BLOCK, "environment.inclination=0 deg", f"loads.pull={load}"))
        settle(solver, 0.3)
        before = centre_x(solver)
        settle(solver, 0.5)
        assert (abs(centre_x(solver) - before) < 1e-6) is holds


@pytest.mark.slow
def test_does_not_creep_in_ten_seconds(build, start):
    solver = start(build(BLOCK))
    settle(solver, 0.5)
    before = centre_x(solver)
    settle(solver, 10.5)
    assert abs(centre_x(solver) - before) < 1e-6


def test_slides_above_it(build, start):
    """Acceleration down the slope is g (sin - mu cos), within 1 %."""
    solver = start(build(BLOCK, "environment.inclination=35 deg"))
    settle(solver, 0.3)
    positions, times = [], []
    while solver.time < 0.6:
        solver.advance(500)
        positions.append(centre_x(solver))
        times.append(solver.time)
    acceleration = 2.0 * np.polyfit(times, positions, 2)[0]
    angle = np.deg2rad(35.0)
    exact = -9.81 * (np.sin(angle) - 0.5 * np.cos(angle))
    assert acceleration == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize("angle, slips", [(20, False), (35, True)])
def test_slip_share(build, start, angle, slips):
    """Of the normal impulse, a block that rests carries nothing in slip, one that slides all but
    what nodes carry within their first increments after a hop, until the friction spring from where
    they touched down is stretched to mu N: under a hundredth.
    """
    from softsim.solver.energy import Meter

    solver = start(build(BLOCK, f"environment.inclination={angle} deg"))
    meter = Meter(solver)
    settle(solver, 0.3)
    for walls in solver.terms.wall_contacts:
        walls.clear_impulses(0)
    assert meter.read()[1].slip_share == 0.0  # nothing yet, and no division by it
    settle(solver, 0.5)
    share = meter.read()[1].slip_share
    assert share > 0.99 if slips else share == 0.0


def test_friction_dissipates_what_gravity_puts_in(build, start):
    """The books close while it slides: work of weight = kinetic + internal + friction."""
    from softsim.solver.energy import EnergyBalance, Meter

    # A chattering contact lasts a few increments and is booked to first order: a smaller step.
    model = build(BLOCK, "environment.inclination=35 deg")
    solver = start(model, share=0.3)
    meter = Meter(solver)
    balance = EnergyBalance.starting(meter.read()[0], model)
    settle(solver, 0.4)
    energies = meter.read()[0]
    assert energies.friction_dissipation > 0.5 * energies.external_work
    assert balance.error(energies) < 0.01
