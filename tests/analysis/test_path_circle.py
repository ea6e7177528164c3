"""The circle that fits a path: how tightly it turns, and where to."""

import numpy as np
import pytest

from softsim.analysis.travel import centre_of_circle, curvature, running_mean


def circling(radius, turned, count=400):
    """Points of a circle about (0.3, -0.2) that begin below its centre, (rows, 2)."""
    angles = np.linspace(0.0, turned, count)
    return [0.3, -0.2] + radius * np.column_stack([np.sin(angles), -np.cos(angles)])


@pytest.mark.parametrize("turned", [0.2, -0.2, 3.0, 9.0, -9.0])
def test_a_circle_is_found(turned):
    path = circling(0.067, turned)
    assert curvature(path) == pytest.approx(np.sign(turned) / 0.067, rel=1e-6)
    assert curvature(path[::-1]) == pytest.approx(-np.sign(turned) / 0.067, rel=1e-6)
    assert centre_of_circle(path) == pytest.approx([0.3, -0.2], abs=1e-7)


def test_noise_does_not_bend_a_circle():
    """The fit by least squares of x^2 + y^2 alone finds it 1.6 times too tight here."""
    noise = np.random.default_rng(3).normal(0.0, 5e-4, (20000, 2))
    assert curvature(circling(0.067, 0.5, 20000) + noise) == pytest.approx(1.0 / 0.067, rel=0.02)


def test_a_straight_path_and_one_that_stands():
    path = np.outer(np.linspace(0.0, 0.1, 50), [0.8, 0.6])
    assert curvature(path) == pytest.approx(0.0, abs=1e-6)
    assert np.isnan(curvature(np.zeros((50, 2))))


def test_a_running_mean_leaves_out_what_repeats():
    t = np.arange(50.0)
    path = np.column_stack([t, 3.0 + np.sin(2.0 * np.pi * t / 10.0)])
    means = running_mean(path, 10)
    assert means[:, 0] == pytest.approx(t[:41] + 4.5)
    assert means[:, 1] == pytest.approx(3.0)
