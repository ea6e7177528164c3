"""A motor whose constants are known is found again, and its row agrees; the thesis's is not."""

import numpy as np
import pytest

from validation import motor
from validation.verdicts import AGREES, UNKNOWN

K, R = 0.7e-3, 25.0  # V s/rad, Ohm


def verdicts(claim):
    return [row.verdict for row in motor.rows({}, None) if claim in row.claim]


def test_constants_of_a_motor_are_found_again():
    """Also of one whose winding warms up."""
    w = motor.turning(motor.ON_DISC)[motor.ENDS]
    for warmer in (0.0, 15.0):
        growth = np.array([1.0, 1.0 + motor.COPPER * warmer])
        current = (motor.VOLTAGE[motor.ENDS] - K * w) / (R * growth)
        assert motor.constants(motor.ON_DISC, current, warmer) == pytest.approx((K, R))


def test_a_motor_with_other_currents_would_agree(monkeypatch):
    w = motor.turning(motor.ON_DISC)[motor.ENDS]
    monkeypatch.setattr(motor, "CURRENT", (motor.VOLTAGE[motor.ENDS] - K * w) / R)
    assert verdicts("V = k w + R I at 3 and 5 V on the disc") == [AGREES]
    assert verdicts("speed, voltage, current grow") == [AGREES]
    assert verdicts("friction grows as w^n") == [AGREES]


def test_a_motor_with_other_friction_would_agree(monkeypatch):
    """k w + R I with I = (c_0 + c_1 w) / k on the disc."""
    w = motor.turning(motor.ON_DISC)
    monkeypatch.setattr(motor, "VOLTAGE", 0.4 + 2e-3 * w)
    assert verdicts("Coulomb and viscous: best fit") == [AGREES]


def test_of_the_thesis_nothing_can_be_told():
    found = list(motor.rows({}, None))
    assert len(found) == 14
    assert {row.verdict for row in found} == {UNKNOWN}
    k, resistance = motor.constants(motor.ON_DISC, motor.CURRENT)
    # By hand: (3 I_5 - 5 I_3) and (5 w_3 - 3 w_5) over (w_3 I_5 - w_5 I_3).
    assert k == pytest.approx(-1.401e-4, rel=1e-3)
    assert resistance == pytest.approx(47.53, rel=1e-3)
