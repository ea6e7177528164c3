"""Forces of a chain: those with an energy are its gradient, the others do what they say."""

import numpy as np
import pytest

from softsim.apps.chain.mechanics import (
    BendingForce,
    ContactDamper,
    Damper,
    JointStiffness,
    Limbs,
    Motors,
    NormalFriction,
    Thrust,
    Tilt,
    WaveForce,
    Weight,
    WeightFriction,
    ladder,
    line,
)

STIFFNESSES = np.array([1000.0, 500.0, 500.0])
P = np.array([[0.02, -0.0004], [0.001, 0.0003], [-0.012, -0.0007]])
V = np.array([[0.3, -0.2], [-0.1, 0.4], [0.2, -0.5]])
LINE = line(np.array([0.019, 0.013]))
LADDER = ladder(np.array([0.019, 0.013]), 0.03)
RNG = np.random.default_rng(1)
P_IN_SPACE = LADDER.places + RNG.normal(0.0, 1e-3, (6, 3))
STORES = {
    "weight": Weight(np.array([3e-2, 5e-3, 6e-3]), 0.3),
    "limbs": Limbs(STIFFNESSES),
    "tilt": BendingForce(Tilt(0.002), LINE),
    "joint": BendingForce(JointStiffness(0.002), LINE),
}
STORES_IN_SPACE = {
    "weight": Weight(RNG.uniform(1e-3, 3e-2, 6), 0.3),
    "limbs": Limbs(np.tile(STIFFNESSES, 2)),
    "tilt": BendingForce(Tilt(0.002), LADDER),
    "joint": BendingForce(JointStiffness(0.002), LADDER),
}


@pytest.mark.parametrize(
    ("force", "p"),
    [
        *((force, P) for force in STORES.values()),
        *((force, P_IN_SPACE) for force in STORES_IN_SPACE.values()),
    ],
    ids=[*STORES, *(f"{name} in space" for name in STORES_IN_SPACE)],
)
def test_a_force_is_the_gradient_of_its_energy(force, p):
    found = force.on_nodes(0.0, p, np.zeros_like(p))
    step = 1e-7
    for place in np.ndindex(p.shape):
        aside = np.zeros_like(p)
        aside[place] = step
        slope = (force.energy(p + aside) - force.energy(p - aside)) / (2.0 * step)
        assert found[place] == pytest.approx(-slope, abs=1e-7)


def test_rows_of_a_motion_are_told_as_single_states():
    rows = np.array([P, 2.0 * P, P + np.array([0.0, 1e-3])])
    thrust = Thrust(STORES["limbs"], np.full(3, 0.5), LINE)
    for force in (*STORES.values(), thrust, WaveForce(0.4, LINE), motor(892.0)):
        t = np.array([0.0, 1e-3, 2e-3])
        together = np.broadcast_to(force.on_nodes(t, rows, rows), rows.shape)
        for time, row, found in zip(t, rows, together, strict=True):
            assert found == pytest.approx(force.on_nodes(time, row, row))


def motor(angular_velocity):
    """On the first of three nodes."""
    return Motors(2.8e-7 * np.array([1.0, 0.0, 0.0]), np.full(3, angular_velocity), LINE)


def test_a_bent_chain_is_driven_back_to_straight():
    """The thesis's 5.19 and 5.20 print the opposite sign."""
    raised = np.array([[0.02, 0.001], [0.0, 0.0], [-0.02, 0.0]])
    assert STORES["tilt"].on_nodes(0.0, raised, V)[0, 1] < 0.0
    assert STORES["joint"].on_nodes(0.0, raised, V)[0, 1] < 0.0


def up(*sizes):
    return np.column_stack([np.zeros(3), sizes])


def forward(*sizes):
    return np.column_stack([sizes, np.zeros(3)])


def test_only_limbs_on_the_ground_push():
    limbs = STORES["limbs"]
    assert limbs.on_nodes(0.0, P, V) == pytest.approx(up(0.4, 0.0, 0.35))
    thrust = Thrust(limbs, np.array([0.5, 0.5, 0.0]), LINE)
    assert thrust.on_nodes(0.0, P, V) == pytest.approx(forward(0.2, 0.0, 0.0))


def test_friction_is_against_the_motion_and_of_its_load():
    limits = np.array([2e-2, 3e-3, 4e-3])
    of_weight = WeightFriction(limits, 1e-3).on_nodes(0.0, P, V)
    assert of_weight == pytest.approx(forward(-2e-2, 0.0, -4e-3))
    of_normal = NormalFriction(STORES["limbs"], np.full(3, 0.7), 1e-3).on_nodes(0.0, P, V)
    assert of_normal == pytest.approx(forward(-0.28, 0.0, -0.245))


def test_dampers_act_always_or_in_contact():
    assert Damper(1.3).on_nodes(0.0, P, V) == pytest.approx(up(0.26, -0.52, 0.65))
    assert ContactDamper(1.3).on_nodes(0.0, P, V) == pytest.approx(up(0.26, 0.0, 0.65))


def test_the_motor_starts_at_its_lowest_point():
    """A quarter turn later a mass that turns counterclockwise pulls forward (thesis 3.1, 3.2)."""
    quarter = 0.25 * 2.0 * np.pi / 892.0
    for turns in (1, -1):
        force, *others = motor(turns * 892.0).forces
        assert force == pytest.approx(2.8e-7 * 892.0**2) and others == [0.0, 0.0]
        found = motor(turns * 892.0).on_nodes(0.0, P, V)
        assert found == pytest.approx(up(-force, 0.0, 0.0))
        found = motor(turns * 892.0).on_nodes(quarter, P, V)
        assert found[0] == pytest.approx([turns * force, 0.0])


def test_the_wave_pulls_up_where_the_node_in_front_is_higher():
    bent = np.array([[0.03, 0.04], [0.0, 0.0], [-0.02, 0.0]])
    forces = WaveForce(0.4, LINE).on_nodes(0.0, bent, V)
    assert forces == pytest.approx(up(0.0, 0.4 * 0.8, 0.0))


def test_friction_in_space_is_against_the_velocity_along_the_ground():
    """mu N v / |v|, wherever v looks; what goes up and down does not rub."""
    limbs = Limbs(np.full(6, 500.0))
    p = LADDER.places - [0.0, 0.0, 1e-3]
    v = np.tile([0.3, -0.4, 7.0], (6, 1))
    found = NormalFriction(limbs, np.full(6, 0.7), 1e-3).on_nodes(0.0, p, v)
    assert found == pytest.approx(np.tile([-0.6 * 0.35, 0.8 * 0.35, 0.0], (6, 1)))
    rest = NormalFriction(limbs, np.full(6, 0.7), 1e-3).on_nodes(0.0, p, 0.0 * v)
    assert (rest == 0.0).all()


def test_motors_and_limbs_push_where_their_side_looks():
    """Both look to the left after a quarter turn of the robot in that sense."""
    turned = LADDER.places @ np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    p = turned - [0.0, 0.0, 1e-3]
    thrust = Thrust(Limbs(np.full(6, 500.0)), np.full(6, 0.5), LADDER)
    assert thrust.on_nodes(0.0, p, p) == pytest.approx(np.tile([0.0, 0.25, 0.0], (6, 1)))
    motors = Motors(np.eye(6)[0], np.full(6, 2.0 * np.pi), LADDER)
    found = motors.on_nodes(0.25, p, p)[0]
    assert found == pytest.approx([0.0, motors.forces[0], 0.0], abs=1e-12)
