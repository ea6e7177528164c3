"""Stretch, volume ratio and von Mises stress of known deformations."""

import numpy as np
import pytest

from softsim.elements.measures import measure_elements
from softsim.elements.plane_strain import PlaneStrain
from softsim.elements.region import Region
from softsim.materials.material import Material
from softsim.materials.yeoh import Yeoh
from softsim.robots.block import block

RUBBER = Material("rubber", Yeoh(50e3, 1e3), 1e6, 1000.0)


def measured(F):
    mesh = block(2e-3, 2e-3, 1e-3)
    numbers = np.arange(len(mesh.cells))
    plate = Region("b", None, 0, mesh.points, mesh.cells, numbers, PlaneStrain(1e-3), RUBBER)
    return measure_elements(plate, mesh.points @ np.asarray(F).T)


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
