"""A held robot whose forces are known: what a run at one stiffness says of another."""

import numpy as np
import pytest

from validation.cases import Outcome
from validation.held import held
from validation.thesis import WEIGHT

STIFFNESS, TOUCH, SLOPE = 2.0, 10e3, 1e-4  # -, Pa, N/Pa: beyond TOUCH the walls carry force
HIGHEST = 30e3  # Pa


def run():
    """Pressure up to HIGHEST and down to zero; three rows lie on the bottom before it touches."""
    share = np.concatenate((np.linspace(0.0, 1.0, 301), np.linspace(1.0, 0.0, 301)[1:]))
    pressure = HIGHEST * share
    upper = SLOPE * np.maximum(pressure - TOUCH, 0.0)
    history = {
        "pressure": pressure,
        "chamber_volume": share,
        "rows_in_contact": np.where(pressure < TOUCH, 3.0, 4.0),
        "pull": 0.5 * upper,
        "wall_force_normal": 2.0 * upper + WEIGHT,
        "wall_force_y": np.full(len(share), WEIGHT),
    }
    return held(Outcome("made up", history=history), STIFFNESS)


@pytest.mark.parametrize("factor", [1.0, 2.0, 3.0])
def test_pressures_and_forces_go_with_the_factor(factor):
    pressure = 20.0 * factor / STIFFNESS
    assert run().on_top_at(pressure, factor) == pytest.approx(1.0 * factor / STIFFNESS, rel=1e-9)
    assert run().pull_at(pressure, factor) == pytest.approx(0.5 * factor / STIFFNESS, rel=1e-9)
    assert np.isnan(run().pull_at(31.0 * factor / STIFFNESS, factor))


def test_rows_on_which_it_lies_are_not_pressed():
    assert run().rows_at(9.0, STIFFNESS) == 0.0
    assert run().rows_at(20.0, STIFFNESS) == 4.0


def test_release_is_where_less_than_a_force_is_left():
    """10 kPa and 0.5 N at 1e-4 N/Pa; within a row, 0.1 kPa."""
    assert run().release(0.5, STIFFNESS) == pytest.approx(15.0, abs=0.11)
    assert np.isnan(run().release(-1.0, STIFFNESS))


def test_a_failed_run_holds_nothing():
    assert held(Outcome("made up", failure="crushed"), STIFFNESS) is None
