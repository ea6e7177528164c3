"""Cycles of a profile."""

import numpy as np
import pytest

from softsim.loads.profile import Cycle, Profile, cycles, cycles_of, natural_deflation


def test_cycles_end_after_their_rest():
    """Rises of 1 and 0.5 s, holds of 2, falls of 5, rests of 3 s, after a second of nothing."""
    profile = cycles(10e3, 10e3, 2.0, 1e3, 5e3, 3.0, 2, 1.0)
    assert cycles_of(profile) == [Cycle(4.0, 9.0, 12.0), Cycle(14.5, 19.5, 22.5)]


def test_a_curved_fall_is_one_fall():
    profile = natural_deflation(10e3, 10e3, 1.0, 2.0, 10e3 / np.e, 2, 0.0)
    rise = 1.0 - 1.0 / np.e
    expected = [(2.0, 4.0, 4.0), (5.0 + rise, 7.0 + rise, 7.0 + rise)]
    found = [(c.fall_begin, c.fall_end, c.end) for c in cycles_of(profile)]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("values", [[0.0, 5e3, 5e3], [3e3, 3e3, 3e3], [0.0, 1e3, 2e3]])
def test_a_pressure_that_does_not_fall_has_no_cycle(values):
    assert cycles_of(Profile(np.arange(3.0), np.array(values))) == []
