"""The default tier of tests stays small: what compiles kernels belongs to the tier `physics`."""

import pytest
from tiers import starts_of

MOST_STARTS = 40
"""Starts of Taichi in the default tier. Each compiles kernels for 1 to 20 s: make a test `physics`
rather than raise this.
"""


def test_the_default_tier_starts_few_solvers(request: pytest.FixtureRequest):
    starts = {item.nodeid: starts_of(item) for item in request.session.items if starts_of(item)}
    assert sum(starts.values()) <= MOST_STARTS, starts
