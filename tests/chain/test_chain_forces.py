"""Forces of a chain: those with an energy are its gradient, the others do what they say."""

import numpy as np
import pytest

from softsim.chain.backbone import BendingForce, Joint, Tilt, WaveForce
from softsim.chain.ground import (
    ContactDamper,
    Damper,
    Limbs,
    NormalFriction,
    Thrust,
    Weight,
    WeightFriction,
)
from softsim.chain.motor import Motor

STIFFNESSES = np.array([1000.0, 500.0, 500.0])
P = np.array([0.02 - 0.0004j, 0.001 + 0.0003j, -0.012 - 0.0007j])
V = np.array([0.3 - 0.2j, -0.1 + 0.4j, 0.2 - 0.5j])
STORES = {
    "weight": Weight(np.array([3e-2, 5e-3, 6e-3]), 0.3),
    "limbs": Limbs(STIFFNESSES),
    "tilt": BendingForce(Tilt(0.002)),
    "joint": BendingForce(Joint(0.002)),
}


@pytest.mark.parametrize("force", STORES.values(), ids=STORES)
def test_a_force_is_the_gradient_of_its_energy(force):
    found = force.on_nodes(0.0, P, V)
    step = 1e-7
    for node in range(3):
        for way in (1.0, 1.0j):
            aside = step * way * np.eye(3)[node]
            slope = (force.energy(P + aside) - force.energy(P - aside)) / (2.0 * step)
            assert (np.conj(way) * found[node]).real == pytest.approx(-slope, abs=1e-7)


def test_rows_of_a_motion_are_told_as_single_states():
    rows = np.array([P, 2.0 * P, P + 1e-3j])
    limbs = STORES["limbs"]
    motor = Motor(2.8e-7, 892.0, np.array([1.0, 0.0, 0.0]))
    for force in (*STORES.values(), Thrust(limbs, np.full(3, 0.5)), WaveForce(0.4), motor):
        t = np.array([0.0, 1e-3, 2e-3])
        together = np.broadcast_to(force.on_nodes(t, rows, rows), rows.shape)
        for time, row, found in zip(t, rows, together, strict=True):
            assert found == pytest.approx(force.on_nodes(time, row, row))


def test_a_bent_chain_is_driven_back_to_straight():
    """The thesis's 5.19 and 5.20 print the opposite sign."""
    raised = np.array([0.02 + 0.001j, 0.0, -0.02])
    assert STORES["tilt"].on_nodes(0.0, raised, V)[0].imag < 0.0
    assert STORES["joint"].on_nodes(0.0, raised, V)[0].imag < 0.0


def test_only_limbs_on_the_ground_push():
    limbs = STORES["limbs"]
    assert limbs.on_nodes(0.0, P, V) == pytest.approx([0.4j, 0.0, 0.35j])
    ratios = np.array([0.5, 0.5, 0.0])
    assert Thrust(limbs, ratios).on_nodes(0.0, P, V) == pytest.approx([0.2, 0.0, 0.0])


def test_friction_is_against_the_motion_and_of_its_load():
    limits = np.array([2e-2, 3e-3, 4e-3])
    of_weight = WeightFriction(limits, 1e-3).on_nodes(0.0, P, V)
    assert of_weight == pytest.approx([-2e-2, 0.0, -4e-3])
    of_normal = NormalFriction(STORES["limbs"], 0.7, 1e-3).on_nodes(0.0, P, V)
    assert of_normal == pytest.approx([-0.28, 0.0, -0.245])


def test_dampers_act_always_or_in_contact():
    assert Damper(1.3).on_nodes(0.0, P, V) == pytest.approx([0.26j, -0.52j, 0.65j])
    assert ContactDamper(1.3).on_nodes(0.0, P, V) == pytest.approx([0.26j, 0.0, 0.65j])


def test_the_motor_starts_at_its_lowest_point():
    """A quarter turn later a mass that turns counterclockwise pulls forward (thesis 3.1, 3.2)."""
    quarter = 0.25 * 2.0 * np.pi / 892.0
    for turns in (1, -1):
        motor = Motor(2.8e-7, turns * 892.0, np.array([1.0, 0.0, 0.0]))
        assert motor.on_nodes(0.0, P, V) == pytest.approx([-1j * motor.force, 0.0, 0.0])
        assert motor.on_nodes(quarter, P, V)[0] == pytest.approx(turns * motor.force)


def test_the_wave_pulls_up_where_the_node_in_front_is_higher():
    forces = WaveForce(0.4).on_nodes(0.0, np.array([0.03 + 0.04j, 0.0, -0.02]), V)
    assert forces == pytest.approx([0.0, 0.4j * 0.8, 0.0])
