"""Momentum, angular momentum and energy of a robot that flies freely."""

import numpy as np
import pytest

from softsim.compute import fields

ROBOT = """
bodies:
  skin: {mesh: {generator: pfr_section, element_size: 0.5 mm}, formulation: plane_strain,
         thickness: 7 mm, material: dragon_skin_10, initial_velocity: [0.3 m/s, 0.1 m/s]}
rigid_bodies:
  frame: {mass: 8.8 g, inertia: 1 kg*mm^2, tied: [skin.knots], initial_velocity: [0 m/s, 0.2 m/s],
          initial_angular_velocity: 20 rad/s, outline: {length: 33 mm, height: 15 mm},
          supports: [skin.chamber_top, skin.chamber_bottom], support_friction_coefficient: 0.4}
environment: {gravity: 0 m/s^2}
loads:
  air: {kind: follower_pressure, facets: [skin.chamber_top, skin.chamber_bottom],
        reacts_on: frame, profile: {kind: constant, value: 1 kPa, ramp: 2 ms}}
time: {end: 1 s}
"""
STRUCK = """
conditions: {blow: {kind: initial_velocity, nodes: skin.tips_top, velocity: [0.5 m/s, -1 m/s]}}
"""
RINGS = ROBOT.replace("plane_strain,", "ring_section, sector: 90 deg, rings: skin,")


def momenta(solver):
    """Linear (2,) and angular momentum about the origin, at half steps as the scheme keeps them."""
    model, terms = solver.models[0], solver.terms
    free = model.is_free.all(axis=1)
    m, x = model.mass[free], solver.positions()[0][free]
    v = fields.read(terms.nodes.velocity)[0][free]
    bodies = terms.rigid_bodies
    M = fields.read(bodies.mass)[0]
    X, V = fields.read(bodies.centre)[0, 0], fields.read(bodies.velocity)[0, 0]
    linear = m @ v + M * V
    angular = (m * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])).sum()
    angular += M * (X[0] * V[1] - X[1] * V[0])
    angular += fields.read(bodies.angular_momentum)[0, 0, 2]
    return linear, angular


def test_free_flight_keeps_momenta(build, start):
    """Inflating, vibrating, rubbing against its frame: only inner forces, so both stay."""
    solver = start(build(ROBOT))
    linear, angular = momenta(solver)
    solver.advance(4000)
    linear_after, angular_after = momenta(solver)
    assert fields.read(solver.terms.supports[0].friction_dissipation).sum() > 0.0
    np.testing.assert_allclose(linear_after, linear, rtol=1e-9)
    assert angular_after == pytest.approx(angular, rel=1e-9)


def test_rings_in_free_flight_keep_their_momenta(build, start):
    """One strip struck, the frame spinning: what rings hand from one strip to the other, it loses,
    and they do not hold the section back, which turns by half a radian. Each increment rounds the
    momenta off by eps.
    """
    solver = start(build(RINGS.replace("20 rad/s", "60 rad/s") + STRUCK))
    linear, angular = momenta(solver)
    solver.advance(3500)
    linear_after, angular_after = momenta(solver)
    w, _, _, z = fields.read(solver.terms.rigid_bodies.orientation)[0, 0]
    assert 2.0 * np.arctan2(z, w) > 0.5
    np.testing.assert_allclose(linear_after, linear, rtol=3500 * 1e-15)
    assert angular_after == pytest.approx(angular, rel=3500 * 1e-15)


@pytest.mark.parametrize("robot", [ROBOT, RINGS], ids=["plane_strain", "ring_section"])
def test_pressure_in_a_closed_chamber_moves_nothing(build, start, robot):
    """From rest: the centre of mass of skin and frame stays where it is."""
    text = robot.replace(", initial_velocity: [0.3 m/s, 0.1 m/s]", "")
    text = text.replace(" initial_velocity: [0 m/s, 0.2 m/s],", "")
    text = text.replace("initial_angular_velocity: 20 rad/s,", "")
    model = build(text)
    solver = start(model)
    solver.advance(4000)
    free = model.is_free.all(axis=1)
    mass = model.mass[free]
    bodies = solver.terms.rigid_bodies
    moved = mass @ (solver.positions()[0] - model.points)[free]
    moved = (
        moved
        + fields.read(bodies.mass)[0] * (fields.read(bodies.centre) - bodies.rest_centre)[0, 0]
    )
    inflated = np.abs(solver.positions()[0] - model.points).max()
    assert inflated > 0.2e-3
    assert np.abs(moved).max() / (mass.sum() + 8.8e-3) < 1e-9 * inflated


@pytest.mark.parametrize(
    "robot",
    [
        pytest.param(ROBOT, id="plane_strain"),
        pytest.param(RINGS, id="ring_section", marks=pytest.mark.slow),
    ],
)
def test_energy_balance_of_free_flight(build, start, robot):
    """The books close to the scheme's order: halving the step quarters what is left."""
    from softsim.solver.energy import EnergyBalance, EnergyReader

    errors = []
    for share in (0.8, 0.4):
        text = robot.replace("material: dragon_skin_10", "material: elastic") + ELASTIC
        # Without contact: an impact within a step is of first order.
        text = text.replace("supports: [skin.chamber_top, skin.chamber_bottom], ", "")
        model = build(text)
        solver = start(model, share=share)
        reader = EnergyReader(solver)
        balance = EnergyBalance.starting(reader.read(), model)
        worst = 0.0
        while solver.time < 6e-3:
            solver.advance(16)
            worst = max(worst, balance.error(reader.read()))
        errors.append(worst)
    assert errors[0] < 1e-3
    assert errors[1] < 0.3 * errors[0]


ELASTIC = """
materials:
  elastic: {law: yeoh, C10: 36 kPa, density: 1070 kg/m^3}
solver: {bulk_viscosity: 0}
"""


def test_free_fall(build, start):
    """Everything falls by g t^2 / 2, nothing deforms: exact for a constant force."""
    model = build(
        "bodies: {b: {mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm},"
        " formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10}}\n"
        "time: {end: 1 s}\n"
    )
    solver = start(model)
    solver.advance(3000)
    fallen = solver.positions()[0][:, 1] - model.points[:, 1]
    np.testing.assert_allclose(fallen, -0.5 * 9.81 * solver.time**2, rtol=1e-9)
