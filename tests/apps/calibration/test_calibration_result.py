"""Factor and offset from curves whose factor and offset are known."""

import numpy as np
import pytest

from softsim.apps.calibration.experiments import FORCE_SHARE, WallCurve, matched, wall_curve
from softsim.errors import CalibrationError


def force_of_section(q):
    """A section that touches at 1 kPa and stiffens: N [N] over q [Pa]."""
    beyond = np.maximum(q - 1e3, 0.0) / 1e3
    return 0.3 * beyond + 0.01 * beyond**2


def curve(pressure, force):
    return WallCurve(pressure, force, np.where(force > 0.0, 3.0, 0.0), np.zeros(len(force)))


def pair(factor, offset, highest=20e3, section_highest=80e3, bend=0.0):
    """Reference and section of which q = factor (p - offset) + bend (p - offset)^2 is exact."""
    p, q = np.linspace(0.0, highest, 4001), np.linspace(0.0, section_highest, 4001)
    on_section = factor * np.maximum(p - offset, 0.0) + bend * np.maximum(p - offset, 0.0) ** 2
    reference = curve(p, force_of_section(on_section) / FORCE_SHARE)
    return reference, curve(q, force_of_section(q))


# Linear interpolation of a force between samples h apart is off by h^2 N''/8, h = 20 Pa:
# 1e-6 N of 0.3 N/kPa, a hundredth of a pascal; touch is found to a sample, 20 Pa, on the section.


@pytest.mark.parametrize(("factor", "offset"), [(0.4, 3e3), (1.0, 0.0), (4.0, 9e3)])
def test_factor_and_offset_come_back(factor, offset):
    found = matched(*pair(factor, offset))
    # The touch, off by a sample in 4000 of the range, moves the line by no more than that.
    assert found.factor == pytest.approx(factor, rel=1e-3)
    assert found.offset == pytest.approx(offset, abs=5.0)
    assert found.largest_deviation < 20.0
    assert found.pressure[0] == pytest.approx(offset + 1e3 / factor, abs=5.0)


def test_an_offset_that_would_be_negative_becomes_zero():
    """q = p + 2 kPa cannot be said by a scene; the best line through zero can."""
    p = np.linspace(0.0, 20e3, 4001)
    reference = curve(p, force_of_section(p + 2e3) / FORCE_SHARE)
    found = matched(reference, curve(np.linspace(0.0, 40e3, 4001), force_of_section(
        np.linspace(0.0, 40e3, 4001))))  # fmt: skip
    assert found.offset == 0.0
    # Least squares of p + c through the origin over 0 to P: 1 + (c P^2/2) / (P^3/3).
    assert found.factor == pytest.approx(1.0 + 1.5 * 2e3 / 20e3, rel=1e-3)


def test_it_ends_where_the_section_does():
    found = matched(*pair(4.0, 9e3, section_highest=20e3))
    assert found.pressure[-1] == pytest.approx(9e3 + 20e3 / 4.0, abs=5.0)
    assert found.section_pressure[-1] == pytest.approx(20e3, abs=1.0)
    assert found.factor == pytest.approx(4.0, rel=1e-3)


def test_the_deviation_from_the_line_is_told():
    """A parabola of pressures, of which least squares know the distance to their line."""
    bend = 1e-5
    found = matched(*pair(1.0, 2e3, bend=bend))
    span = found.pressure[-1] - found.pressure[0]
    # x^2 on [0, 1] against its least-squares line x - 1/6: 1/6 at the ends, 1/12 in the middle;
    # at the touch, one of the ends, the section's pressure is off by a sample at most.
    assert found.largest_deviation == pytest.approx(bend * span**2 / 6.0, abs=20.0)


def test_a_thicker_section_needs_less_pressure():
    """Twice as thick it presses twice as hard at the same q: half the force is due of `section`."""
    reference, section = pair(1.0, 5e3)
    found = matched(reference, section, thickness_ratio=2.0)
    share = 2.0 * section.force_at(found.section_pressure)
    due = FORCE_SHARE * reference.force_at(found.pressure)
    touching = found.section_pressure > 1.1e3
    assert share[touching] == pytest.approx(due[touching], rel=1e-3)


def test_a_section_too_weak_for_the_first_touch_is_refused():
    reference, section = pair(1.0, 5e3)
    weak = curve(section.pressure, 1e-9 * section.force)
    strong = curve(reference.pressure, np.where(reference.force > 0.0, 1.0, 0.0))
    with pytest.raises(CalibrationError, match="at most") as refusal:
        matched(strong, weak)
    assert "--highest" in refusal.value.hint


# -------------------------------------------------------------------------------------------------
# Force on a wall over pressure, from a history.


def touching_curve(pressure, force):
    pressure, force = np.array(pressure, dtype=float), np.array(force, dtype=float)
    return WallCurve(pressure, force, (force > 0.0).astype(float), np.zeros(len(force)))


def test_touch_is_where_contact_is_never_lost_again():
    bounces = touching_curve([1, 2, 3, 4, 5], [0, 0.5, 0, 0.2, 1])
    assert bounces.touch == 4.0


def test_touch_from_the_start():
    assert touching_curve([1, 2], [0.1, 0.2]).touch == 1.0


def test_no_contact_is_refused_with_the_pressure_and_a_way_out():
    with pytest.raises(CalibrationError, match=r"up to 0\.003 kPa") as refusal:
        _ = touching_curve([1, 2, 3], [0.5, 0, 0]).touch
    assert refusal.value.exit_code == 2
    assert "--highest" in refusal.value.hint


def test_the_pressure_of_a_force_undoes_the_force_of_a_pressure():
    rising = touching_curve([0, 1, 2, 4], [0, 1, 3, 9])
    pressure = np.array([1.0, 1.5, 3.0, 4.0])
    assert rising.pressure_at(rising.force_at(pressure)) == pytest.approx(pressure, rel=1e-12)


def test_a_force_is_reached_first_where_the_curve_falls_for_a_moment():
    falling = touching_curve([0, 1, 2, 3, 4], [0, 2, 1, 1.5, 3])
    assert falling.pressure_at(np.array([2.0]))[0] == 1.0
    # On the line from (3, 1.5) to (4, 3), not on one from the first peak.
    assert falling.pressure_at(np.array([2.5]))[0] == pytest.approx(3.0 + 1.0 / 1.5)


def test_a_force_beyond_the_curve_has_no_pressure():
    assert np.isnan(touching_curve([1, 2], [1, 2]).pressure_at(np.array([2.1]))[0])


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
