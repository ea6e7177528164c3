"""The wall time of runs: when they began, and what the time went into."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

START, KERNEL = "start", "kernel"
INSPECTIONS, ROWS, FRAMES, CHECKPOINTS = "inspections", "rows", "frames", "checkpoints"
# Work of the host beside the increments.
HOST_WORK = (INSPECTIONS, ROWS, FRAMES, CHECKPOINTS)


class WallClock:
    """Wall time of runs that are computed together: since they began, since their loop began, and
    since its first block, which compiles kernels; the rate counts from there on.

    counts_before: increments of each run (scenarios,) done before the rate counts. spent: wall time
    [s] of each part, START being all before the loop, bodies that come to rest included.
    """

    def __init__(self) -> None:
        self.began = time.monotonic()
        self.first_increment_after = 0.0
        self.spent = dict.fromkeys((START, KERNEL, *HOST_WORK), 0.0)

    @property
    def age(self) -> float:
        """Wall time [s] since the runs began."""
        return time.monotonic() - self.began

    def enter_loop(self, increment_counts: np.ndarray) -> None:
        """The loop begins, with so many increments done by each run (scenarios,)."""
        self.loop_began = self.steady_since = time.monotonic()
        self.spent[START] = self.loop_began - self.began
        self.counts_before = increment_counts.copy()

    def note_block(self, increment_counts: np.ndarray) -> None:
        """A block has ended, with so many increments done by each run (scenarios,)."""
        if self.first_increment_after == 0.0:
            self.steady_since, self.counts_before = time.monotonic(), increment_counts.copy()
            self.first_increment_after = self.steady_since - self.began

    def parts(self) -> dict[str, float]:
        """Wall time [s] since the runs began, by part; "other": what is in none."""
        whole = self.age
        return self.spent | {"other": whole - sum(self.spent.values())}

    @contextmanager
    def spending_on(self, part: str) -> Iterator[None]:
        """Book the wall time of the block, in which no other part is booked."""
        began = time.monotonic()
        try:
            yield
        finally:
            self.spent[part] += time.monotonic() - began
