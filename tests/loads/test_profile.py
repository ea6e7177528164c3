"""Pressure over time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.loads.nodal import eccentric_mass, sinusoidal_force
from softsim.loads.profile import (
    Profile,
    constant,
    cycles,
    natural_deflation,
    periodic_cycles,
)

X, Z = np.eye(3)[[0, 2]]
CYCLE = {
    "highest": 23e3, "inflation_rate": 23e3, "hold": 1.0, "deflation_rate": 1.3e3, "lowest": 11e3,
    "rest": 0.5, "count": 2, "start": 0.2,
}  # fmt: skip


def test_cycles_rise_hold_fall_and_rest():
    p = cycles(**CYCLE)
    assert p.at(0.1) == 0.0
    assert p.at(0.7) == pytest.approx(11.5e3)
    assert p.at(1.7) == 23e3
    fall = (23e3 - 11e3) / 1.3e3
    assert p.at(2.2 + 0.5 * fall) == pytest.approx(17e3)
    assert p.at(2.2 + fall + 0.3) == 11e3
    # The second inflation begins where the first cycle ended.
    assert p.at(2.2 + fall + 0.5 + 6e3 / 23e3) == pytest.approx(17e3)
    assert p.times[-1] == pytest.approx(0.2 + 1.0 + 2.0 + 12.0 / 23.0 + 2.0 * (fall + 0.5))
    assert p.at(1e9) == 11e3


@given(
    st.floats(1e3, 1e5), st.floats(0.01, 0.99), st.floats(10.0, 1e6), st.floats(10.0, 1e6),
    st.floats(0.0, 5.0), st.floats(0.0, 5.0), st.integers(1, 5), st.floats(0.0, 3.0),
)  # fmt: skip
def test_cycles_stay_in_bounds_and_keep_their_rates(high, share, up, down, hold, rest, n, start):
    p = cycles(high, up, hold, down, share * high, rest, n, start)
    assert (np.diff(p.times) >= 0.0).all()
    assert p.values.min() >= 0.0
    assert p.values.max() == high
    rates = np.diff(p.values) / np.maximum(np.diff(p.times), 1e-300)
    moving = rates != 0.0
    near = np.isclose(rates, up, rtol=1e-6) | np.isclose(rates, -down, rtol=1e-6)
    # A step that is short beside its time keeps only a few digits of the rate.
    long = np.diff(p.times) > 1e-9 * p.times[-1]
    assert near[moving & long].all()


def test_natural_deflation_is_an_exponential():
    p = natural_deflation(20e3, 20e3, 0.5, 2.0, 5e3, 1, 0.0)
    t = np.linspace(0.0, 2.0 * np.log(4.0), 1000)
    exact = 20e3 * np.exp(-t / 2.0)
    # Chords of an exponential: (step / tau)^2 / 8 of the pressure.
    np.testing.assert_allclose(p.at(1.5 + t), exact, rtol=1.0 / (8.0 * 79.0**2))


def test_constant_with_and_without_ramp():
    assert constant(5.0, 0.0).at(0.0) == 5.0
    assert constant(5.0, 2.0).at(1.0) == 2.5


def test_translated_reads_each_value_off_the_scale():
    p = cycles(**CYCLE)
    scale = np.array([[0.0, 0.0], [9e3, 5e3], [20e3, 8e3]])
    t = np.linspace(0.0, p.times[-1], 5001)
    beyond = 8e3 + (p.at(t) - 20e3) * 3.0 / 11.0
    expected = np.where(p.at(t) > 20e3, beyond, np.interp(p.at(t), *scale.T))
    np.testing.assert_allclose(p.translated(scale).at(t), expected, rtol=1e-12)


def test_reduced_is_the_positive_part_of_the_excess():
    p = Profile(np.array([0.0, 1.0, 3.0]), np.array([0.0, 10.0, 2.0]))
    reduced = p.reduced(0.5, 4.0)
    t = np.linspace(0.0, 4.0, 801)
    np.testing.assert_allclose(reduced.at(t), 0.5 * np.maximum(p.at(t) - 4.0, 0.0), atol=1e-12)


def test_eccentric_mass_has_the_amplitude_of_the_measured_motor():
    """m_e r_e omega^2 of the PFR's motor: 0.159, 0.729, 0.994, 1.432 N."""
    for frequency, force in ((64, 0.159), (137, 0.729), (160, 0.994), (192, 1.432)):
        across = eccentric_mass(0.572e-3, 1.72e-3, frequency, X, 1, 0.0, 0.0, 2)
        assert across.cosine[1] == pytest.approx(force, abs=5e-4)
        assert across.cosine[0] == 0.0
        assert not across.sine.any()
    turning = eccentric_mass(1.0, 1.0, 1.0, Z, 1, 0.0, 0.0, 2)
    assert np.linalg.norm(turning.cosine) == pytest.approx((2.0 * np.pi) ** 2)
    assert turning.cosine @ turning.sine == 0.0


@pytest.mark.parametrize("sense", [1, -1])
def test_eccentric_mass_turns_about_any_axis_either_way(sense):
    """Its force is m_e r_e omega^2 across the axis, and turns with dF/d(angle) = sense n x F."""
    diagonal = np.array([1.0, -2.0, 2.0])
    for axis in (*np.eye(3), -X, diagonal):
        rotor = eccentric_mass(2.0, 0.5, 1.0, axis, sense, 0.0, 0.0, 3)
        n = axis / np.linalg.norm(axis)
        for angle in (0.0, 0.7, 4.0):
            force = np.cos(angle) * rotor.cosine + np.sin(angle) * rotor.sine
            turning = np.cos(angle) * rotor.sine - np.sin(angle) * rotor.cosine
            assert np.linalg.norm(force) == pytest.approx((2.0 * np.pi) ** 2)
            assert abs(force @ n) < 1e-12
            np.testing.assert_allclose(turning, sense * np.cross(n, force), atol=1e-12)
    starts = [eccentric_mass(1.0, 1.0, 1.0, n, sense, 0.0, 0.0, 3).cosine for n in np.eye(3)]
    np.testing.assert_allclose(starts, (2.0 * np.pi) ** 2 * np.eye(3)[[1, 2, 0]])


def test_sinusoidal_force_takes_only_the_direction():
    load = sinusoidal_force(3.0, np.array([0.0, 10.0]), 5.0, 0.0, 0.0)
    np.testing.assert_allclose(load.sine, [0.0, 3.0])
    in_space = sinusoidal_force(3.0, np.array([0.0, 0.0, 2.0]), 5.0, 0.0, 0.0)
    np.testing.assert_allclose([in_space.cosine, in_space.sine], [[0.0] * 3, [0.0, 0.0, 3.0]])


@given(
    st.floats(0.1, 3.0), st.floats(0.05, 0.4), st.floats(0.0, 0.3), st.floats(0.05, 0.3),
    st.floats(-900.0, 900.0), st.one_of(st.none(), st.integers(1, 4)),
)  # fmt: skip
def test_periodic_cycles_are_the_trapezoid_of_the_time_in_their_period(T, r, h, f, degrees, count):
    profile = periodic_cycles(
        T, 5.0, -1.0, r * T, h * T, f * T, np.deg2rad(degrees), count, end=4.0
    )
    t = np.linspace(0.0, 4.0, 4001)
    begun = t / T + degrees / 360.0
    u = begun % 1.0
    wave = np.interp(u, [0.0, r, r + h, r + h + f, 1.0], [-1.0, 5.0, 5.0, -1.0, -1.0])
    wave[(begun < 0.0) if count is None else (begun < 0.0) | (begun > count)] = -1.0
    np.testing.assert_allclose(profile.at(t), wave, atol=1e-6)
    assert (np.diff(profile.times) > 0.0).all()


def test_the_integral_of_a_profile_is_exact_to_its_chords():
    ramp = Profile(np.array([0.0, 1.0]), np.array([0.0, 2.0])).integrated(3.0)
    t = np.linspace(0.0, 3.0, 1001)
    exact = np.where(t < 1.0, t**2, 2.0 * t - 1.0)
    np.testing.assert_allclose(ramp.at(t), exact, atol=1e-5 * exact.max())
    assert len(ramp.times) < 200
    assert len(constant(2.0, 0.0).integrated(3.0).times) == 2
