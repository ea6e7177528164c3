"""The force on a wall over pressure, from a history."""

import numpy as np
import pytest

from softsim.apps.calibration.result import WallCurve, wall_curve
from softsim.errors import CalibrationError


def curve(pressure, force):
    pressure, force = np.array(pressure, dtype=float), np.array(force, dtype=float)
    return WallCurve(pressure, force, (force > 0.0).astype(float), np.zeros(len(force)))


def test_touch_is_where_contact_is_never_lost_again():
    bounces = curve([1, 2, 3, 4, 5], [0, 0.5, 0, 0.2, 1])
    assert bounces.touch == 4.0


def test_touch_from_the_start():
    assert curve([1, 2], [0.1, 0.2]).touch == 1.0


def test_no_contact_is_refused_with_the_pressure_and_a_way_out():
    with pytest.raises(CalibrationError, match=r"up to 0\.003 kPa") as refusal:
        _ = curve([1, 2, 3], [0.5, 0, 0]).touch
    assert refusal.value.exit_code == 2
    assert "--highest" in refusal.value.hint


def test_the_pressure_of_a_force_undoes_the_force_of_a_pressure():
    rising = curve([0, 1, 2, 4], [0, 1, 3, 9])
    pressure = np.array([1.0, 1.5, 3.0, 4.0])
    assert rising.pressure_at(rising.force_at(pressure)) == pytest.approx(pressure, rel=1e-12)


def test_a_force_is_reached_first_where_the_curve_falls_for_a_moment():
    falling = curve([0, 1, 2, 3, 4], [0, 2, 1, 1.5, 3])
    assert falling.pressure_at(np.array([2.0]))[0] == 1.0
    # On the line from (3, 1.5) to (4, 3), not on one from the first peak.
    assert falling.pressure_at(np.array([2.5]))[0] == pytest.approx(3.0 + 1.0 / 1.5)


def test_a_force_beyond_the_curve_has_no_pressure():
    assert np.isnan(curve([1, 2], [1, 2]).pressure_at(np.array([2.1]))[0])


def test_rows_are_those_of_the_nearest_sample():
    rows = WallCurve(np.array([1.0, 2.0, 3.0]), np.ones(3), np.array([1.0, 2.0, 3.0]), np.zeros(3))
    assert rows.rows_at(np.array([0.0, 1.4, 1.6, 9.0])).tolist() == [1, 1, 2, 3]


def test_a_force_belongs_to_the_pressure_halfway_through_its_interval():
    """A wall that pushes with 2 p over a rising p: the history's means lie on that very line."""
    pressure = np.array([0.0, 1.0, 3.0, 3.0, 6.0])
    means = np.array([0.0, *(pressure[1:] + pressure[:-1])])
    history = {
        "pressure": pressure,
        "wall_force_normal": means,
        "rows_in_contact": np.ones(5),
        "internal_energy": np.array([0.0, 1.0, 2.0, 2.0, 4.0]),
        "kinetic_energy": np.array([0.0, 0.1, 0.1, 0.1, 0.1]),
    }
    found = wall_curve(history)
    assert found.pressure.tolist() == [0.5, 2.0, 3.0, 4.5]
    assert found.force == pytest.approx(2.0 * found.pressure, rel=1e-12)
    assert found.largest_kinetic_share == pytest.approx(0.1)


def test_a_history_that_hardly_began_is_refused():
    with pytest.raises(CalibrationError, match="fewer than three rows"):
        wall_curve({"pressure": np.zeros(2)})
