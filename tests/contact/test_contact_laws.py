"""Normal law and friction law alone."""

import numpy as np
import taichi as ti

from softsim.contact.friction import slip
from softsim.contact.penalty import normal_force


@ti.kernel
def evaluate_normal(gap: ti.f64, rate: ti.f64, stiffness: ti.f64, damping: ti.f64) -> ti.f64:
    return normal_force(gap, rate, stiffness, damping)


@ti.kernel
def evaluate_slip(x: ti.f64, y: ti.f64, stiffness: ti.f64, limit: ti.f64) -> ti.types.vector(
    2, ti.f64
):
    return slip(ti.Vector([x, y]), stiffness, limit)


def test_the_normal_force_pushes_and_never_pulls(cpu):
    assert evaluate_normal(1e-6, -1.0, 1e4, 1.0) == 0.0
    assert evaluate_normal(-1e-3, 0.0, 1e4, 1.0) == 10.0
    assert evaluate_normal(-1e-3, -2.0, 1e4, 1.0) == 12.0
    assert evaluate_normal(-1e-3, 100.0, 1e4, 1.0) == 0.0


def test_slip_brings_the_spring_back_to_the_limit(cpu):
    assert not np.any(evaluate_slip(3e-6, 4e-6, 1e4, 0.06).to_numpy())
    slipped = evaluate_slip(3e-6, 4e-6, 1e4, 0.03).to_numpy()
    left = np.array([3e-6, 4e-6]) - slipped
    np.testing.assert_allclose(1e4 * np.linalg.norm(left), 0.03, rtol=1e-12)
    np.testing.assert_allclose(left / np.linalg.norm(left), [0.6, 0.8], rtol=1e-12)
