"""Stretch, volume ratio and von Mises stress of known deformations."""

import numpy as np
import pytest

from softsim.elements.geometry import Region, cauchy_stress, measure_elements
from softsim.elements.plane_elements import PlaneStrain
from softsim.materials.laws import Yeoh
from softsim.materials.material import Material
from softsim.robots.block import block

RUBBER = Material("rubber", Yeoh(50e3, 1e3), 1e6, 1000.0)


def measured(F, measure=measure_elements):
    mesh = block(2e-3, 2e-3, 1e-3)
    numbers = np.arange(len(mesh.cells))
    plate = Region("b", None, 0, mesh.points, mesh.cells, numbers, PlaneStrain(1e-3), RUBBER)
    return measure(plate, mesh.points @ np.asarray(F).T)


def test_pure_shear_of_an_incompressible_strip():
    """Plane strain, stretches l, 1/l, 1: Cauchy deviator 2 W' (b - tr b / 3)."""
    stretch = 1.4
    m = measured([[stretch, 0.0], [0.0, 1.0 / stretch]])
    b = np.array([stretch**2, stretch**-2, 1.0])
    slope = Yeoh.energy_slope(b.sum(), RUBBER.law.constants)
    s = 2.0 * slope * (b - b.mean())
    np.testing.assert_allclose(m.von_mises, np.sqrt(1.5 * (s**2).sum()), rtol=1e-12)
    np.testing.assert_allclose(m.stretch, stretch, rtol=1e-12)
    np.testing.assert_allclose(m.J, 1.0, rtol=1e-12)
    np.testing.assert_allclose(m.nodal_pressure, 0.0, atol=1e-6)


def test_dilation_presses():
    m = measured([[0.99, 0.0], [0.0, 1.0]])
    np.testing.assert_allclose(m.nodal_pressure, 0.01 * 1e6, rtol=1e-9)


@pytest.mark.parametrize("angle", [0.4, 2.0])
def test_rotation_changes_nothing(angle):
    c, s = np.cos(angle), np.sin(angle)
    m = measured([[c, -s], [s, c]])
    np.testing.assert_allclose(m.stretch, 1.0, rtol=1e-12)
    np.testing.assert_allclose(m.von_mises, 0.0, atol=1e-6)


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_cauchy_stress(angle):
    """dW/dF F^T / J by differences of the energy, in axes that turn with the body."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s], [s, c]])
    F = turn @ np.array([[1.3, 0.2], [0.1, 0.9]])
    whole = np.eye(3)
    whole[:2, :2] = F

    def energy(F):
        J = np.linalg.det(F)
        I1_bar = J ** (-2.0 / 3.0) * (F**2).sum()
        law = 50e3 * (I1_bar - 3.0) + 1e3 * (I1_bar - 3.0) ** 2
        return law + 0.5 * RUBBER.bulk_modulus * (J - 1.0) ** 2

    step = 1e-6
    P = np.zeros((3, 3))
    for i, j in np.ndindex(3, 3):
        change = np.zeros((3, 3))
        change[i, j] = step
        P[i, j] = (energy(whole + change) - energy(whole - change)) / (2.0 * step)
    exact = P @ whole.T / np.linalg.det(whole)
    found = measured(F, cauchy_stress)
    components = exact[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
    np.testing.assert_allclose(found, np.tile(components, (len(found), 1)), rtol=1e-6, atol=1.0)
    deviator = exact - np.trace(exact) / 3.0 * np.eye(3)
    mises = np.sqrt(1.5 * (deviator**2).sum())
    np.testing.assert_allclose(measured(F).von_mises, mises, rtol=1e-6)
