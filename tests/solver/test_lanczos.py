"""The bound of the largest eigenvalue, on matrices whose eigenvalues are known."""

import numpy as np
import pytest

from softsim.solver.stable_step import STEPS, largest_eigenvalue_bound, shortfall


def chain(count):
    """Masses of 1 kg between springs of 1 N/m, both ends held: 4 sin^2(k pi / (2 n + 2))."""

    def product(v):
        result = 2.0 * v
        result[1:] -= v[:-1]
        result[:-1] -= v[1:]
        return result

    return product, 4.0 * np.sin(0.5 * np.pi * count / (count + 1)) ** 2


@pytest.mark.parametrize("count", [2, 5, 40, 3000])
def test_a_chain_of_springs(count):
    product, exact = chain(count)
    bound, mode = largest_eigenvalue_bound(product, np.ones(count, dtype=bool))
    assert exact <= bound <= exact / (1.0 - shortfall(count, STEPS)) * (1.0 + 1e-12)
    # Neighbours swing against each other.
    assert mode @ mode == pytest.approx(1.0, rel=1e-6)
    assert mode @ product(mode) > (1.0 - shortfall(count, STEPS)) * exact


@pytest.mark.parametrize("stiffest", [1.0001, 1.1, 10.0, 1e6])
def test_one_stiff_spring_among_many(stiffest):
    """A single element that is stiffer than ten thousand others is found, and is the mode."""
    values = np.linspace(0.0, 1.0, 10_000)
    values[1234] = stiffest
    bound, mode = largest_eigenvalue_bound(lambda v: values * v, np.ones(10_000, dtype=bool))
    assert stiffest <= bound <= 1.07 * stiffest
    if stiffest > 1.05:
        assert np.argmax(np.abs(mode)) == 1234


def test_what_does_not_move_takes_no_part():
    """The answer does not depend on how stiff fixed components are."""
    moving = np.arange(100) % 3 > 0
    values = np.where(moving, 2.0, 1e9)
    bound, mode = largest_eigenvalue_bound(lambda v: values * v, moving)
    assert bound == pytest.approx(2.0 / (1.0 - shortfall(66, STEPS)), rel=1e-12)
    assert not mode[~moving].any()


def test_of_more_steps_than_unknowns_the_vector_has_unit_length():
    values = np.concatenate([np.geomspace(1e-3, 0.5, 19), [1.0]])
    turn, _ = np.linalg.qr(np.random.default_rng(2).standard_normal((20, 20)))
    matrix = turn @ np.diag(values) @ turn.T
    assert len(values) < STEPS
    bound, vector = largest_eigenvalue_bound(lambda v: matrix @ v, np.ones(20, dtype=bool))
    assert bound >= 1.0
    assert np.linalg.norm(vector) == pytest.approx(1.0, rel=1e-12)
    assert vector @ matrix @ vector == pytest.approx(1.0, rel=1e-6)
