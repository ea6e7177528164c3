"""Normal law and friction law alone."""

import numpy as np
import pytest
import taichi as ti

from softsim.contact.forces import limit_with_memory, normal_force, shear_force, slip


@ti.kernel
def evaluate_normal(gap: ti.f64, rate: ti.f64, stiffness: ti.f64, damping: ti.f64) -> ti.f64:
    return normal_force(gap, rate, stiffness, damping)


@ti.kernel
def evaluate_slip(
    x: ti.f64, y: ti.f64, before: ti.f64, stiffness: ti.f64, damping_rate: ti.f64, limit: ti.f64
) -> ti.types.vector(2, ti.f64):
    """Of the elastic slip (x, y), an increment ago (before, 0)."""
    return slip(ti.Vector([x, y]), ti.Vector([before, 0.0]), stiffness, damping_rate, limit)


@ti.kernel
def evaluate_force(
    x: ti.f64, y: ti.f64, before: ti.f64, stiffness: ti.f64, damping_rate: ti.f64
) -> ti.types.vector(2, ti.f64):
    """Of the elastic slip (x, y), an increment ago (before, 0)."""
    return shear_force(ti.Vector([x, y]), ti.Vector([before, 0.0]), stiffness, damping_rate)


@ti.kernel
def evaluate_limit(
    last: ti.f64, instant: ti.f64, age: ti.f64, memory: ti.f64, speed: ti.f64, dt: ti.f64
) -> ti.f64:
    """With a slip length of 30 um."""
    return limit_with_memory(last, instant, age, memory, 30e-6, speed, dt)


def test_the_normal_force_pushes_and_never_pulls(fresh_taichi):
    assert evaluate_normal(1e-6, -1.0, 1e4, 1.0) == 0.0
    assert evaluate_normal(-1e-3, 0.0, 1e4, 1.0) == 10.0
    assert evaluate_normal(-1e-3, -2.0, 1e4, 1.0) == 12.0
    assert evaluate_normal(-1e-3, 100.0, 1e4, 1.0) == 0.0


def test_slip_brings_the_spring_back_to_the_limit(fresh_taichi):
    assert not np.any(evaluate_slip(3e-6, 4e-6, 0.0, 1e4, 0.0, 0.06).to_numpy())
    slipped = evaluate_slip(3e-6, 4e-6, 0.0, 1e4, 0.0, 0.03).to_numpy()
    left = np.array([3e-6, 4e-6]) - slipped
    np.testing.assert_allclose(1e4 * np.linalg.norm(left), 0.03, rtol=1e-12)
    np.testing.assert_allclose(left / np.linalg.norm(left), [0.6, 0.8], rtol=1e-12)


def test_slip_brings_spring_and_dashpot_together_back_to_the_limit(fresh_taichi):
    """k_t s + c_t (s - s_0) / dt of what is left of the elastic slip has the size of the limit and
    the direction that it had.
    """
    stretch, before = np.array([3e-6, 4e-6]), np.array([1e-6, 0.0])
    trial = evaluate_force(*stretch, before[0], 1e4, 2e3).to_numpy()
    np.testing.assert_allclose(trial, 1e4 * stretch + 2e3 * (stretch - before), rtol=1e-12)
    size = np.linalg.norm(trial)
    held = evaluate_slip(*stretch, before[0], 1e4, 2e3, 1.01 * size).to_numpy()
    assert not np.any(held)
    left = stretch - evaluate_slip(*stretch, before[0], 1e4, 2e3, 0.03).to_numpy()
    force = evaluate_force(*left, before[0], 1e4, 2e3).to_numpy()
    np.testing.assert_allclose(force, 0.03 * trial / size, rtol=1e-12)


def test_without_memory_the_limit_follows_at_once(fresh_taichi):
    assert evaluate_limit(0.7, 0.2, 1.0, 0.0, 1.0, 1e-5) == pytest.approx(0.2, rel=1e-15)


def test_a_new_contact_has_the_mean_limit(fresh_taichi):
    """Within the first t*: the mean of mu N since it touched."""
    dt, instants = 1e-3, np.array([0.5, 0.1, 0.9, 0.3])
    limit = 0.0
    for k, instant in enumerate(instants):
        limit = evaluate_limit(limit, instant, (k + 1) * dt, 10e-3, 0.0, dt)
        assert limit == pytest.approx(instants[: k + 1].mean(), rel=1e-12)


@pytest.mark.parametrize(("speed", "time"), [(0.0, 10e-3), (3e-3, 5e-3), (0.3, 0.1e-3 / 1.01)])
def test_the_limit_follows_a_step_of_the_normal_force_exponentially(fresh_taichi, speed, time):
    """From 1 to 0.2, in the time of 1 / (1 / t* + |V| / d), to the first order of dt over it."""
    dt = 0.01 * time
    limit = 1.0
    for _ in range(100):
        limit = evaluate_limit(limit, 0.2, 1.0, 10e-3, speed, dt)
    assert limit == pytest.approx(0.2 + 0.8 * 0.99**100, rel=1e-12)
    assert limit == pytest.approx(0.2 + 0.8 * np.exp(-1.0), rel=0.005)
