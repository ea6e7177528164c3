"""The three tiers of tests: the default one, `physics` and `slow`.

The default tier holds what needs no solver, and the tests that say with the marker `starts` how
often they start Taichi. Any other test that starts a solver belongs to the tier `physics`: the
fixture `kernel_cache`, through which all solvers of tests are started, puts it there, and a test
of the default tier that starts Taichi more often than it says fails. `slow` is for what takes
minutes. tests/test_tiers.py bounds the starts of the default tier.
"""

import pytest

OTHER_TIERS = ("physics", "slow")


def in_default_tier(item: pytest.Item) -> bool:
    """Return True for a test that the README's command runs."""
    return not any(item.get_closest_marker(tier) for tier in OTHER_TIERS)


class StartCount:
    """Number of times that a test started Taichi in this process, with its limit.

    A start costs 0.1 s, and the kernels of a structure that no test had before cost 2 to 20 s.
    """

    def __init__(self) -> None:
        self.done, self.allowed = 0, float("inf")

    def begin(self, item: pytest.Item) -> None:
        """Begin the count of a test."""
        self.done, self.allowed = 0, starts_of(item) if in_default_tier(item) else float("inf")

    def watch(self, start):
        """Return a function that counts a call and then calls `start`."""

        def counted(*arguments, **options):
            self.done += 1
            if self.done > self.allowed:
                pytest.fail(
                    f"start number {self.done} of Taichi, where this test may start it "
                    f"{self.allowed} times: mark it physics, or with starts({self.done})"
                )
            return start(*arguments, **options)

        return counted


def starts_of(item: pytest.Item) -> int:
    """Return how often a test of the default tier may start Taichi."""
    marker = item.get_closest_marker("starts")
    return 0 if marker is None else marker.args[0]
