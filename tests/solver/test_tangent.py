"""The bound of the tangent against the second variation of the energy, by finite differences."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softsim.materials.laws import FirstInvariantLaw, Functions, MooneyRivlin, Ogden, Yeoh
from softsim.materials.material import Material
from softsim.solver.element_bound import tangent_bound

LAWS = [Yeoh(36e3, 5e3, 1e3), MooneyRivlin(30e3, 6e3), MooneyRivlin(45e3, -5e3),
        Ogden((60e3, 10e3, 2e3), (1.3, -2.5, 7.0))]  # fmt: skip
GRADIENT = st.lists(st.floats(-0.3, 0.3, allow_subnormal=False), min_size=9, max_size=9).map(
    lambda entries: np.eye(3) + np.reshape(entries, (3, 3))
)


def energy(law, F, pressure):
    """W + p J [J/m^3]."""
    J = np.linalg.det(F)
    b = np.linalg.eigvalsh(F @ F.T) * J ** (-2.0 / 3.0)
    I1, I2 = b.sum(), (1.0 / b).sum()
    if isinstance(law, FirstInvariantLaw):
        return law.energy_density(I1, law.constants) + pressure * J
    return law.energy_density(I1, I2, law.constants, Functions()) + pressure * J


def second_variation(law, F, pressure, step=1e-3):
    """The matrix (9, 9) [Pa] of the energy's second variation in h, F + h F."""
    moves = [np.reshape(row, (3, 3)) @ F for row in np.eye(9)]
    result = np.empty((9, 9))
    for i, one in enumerate(moves):
        for k, other in enumerate(moves):
            result[i, k] = sum(
                sign * turn * energy(law, F + step * (sign * one + turn * other), pressure)
                for sign in (1.0, -1.0)
                for turn in (1.0, -1.0)
            ) / (4.0 * step**2)  # fmt: skip
    return result


@pytest.mark.parametrize("law", LAWS, ids=str)
@settings(max_examples=30)
@given(GRADIENT, st.floats(-40e3, 40e3))
def test_no_variation_is_above_the_bound(law, F, pressure):
    J = np.linalg.det(F)
    b_bar = J ** (-2.0 / 3.0) * F @ F.T
    material = Material("m", law, 1e6, 1000.0)
    found = tangent_bound(material, np.array([J]), b_bar[..., None], np.array([pressure]))
    # |Grad u|^2 = tr(h F F^T h^T).
    bound = found.material * np.kron(np.eye(3), F @ F.T) + found.spatial * np.eye(9)
    exact = second_variation(law, F, pressure)
    slack = np.linalg.eigvalsh(bound - exact)
    assert slack[0] > -1e-4 * np.abs(exact).max()
