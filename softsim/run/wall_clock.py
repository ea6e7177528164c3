"""The wall time of runs, and its division into parts."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

START, KERNEL = "start", "kernel"
INSPECTIONS, ROWS, FRAMES, CHECKPOINTS = "inspections", "rows", "frames", "checkpoints"
# Work of the host beside the increments.
HOST_WORK = (INSPECTIONS, ROWS, FRAMES, CHECKPOINTS)


class WallClock:
    """Wall time of runs that are computed together.

    It is measured from their start, from the start of their loop, and from the end of its first
    block, which compiles kernels; the rate counts from there. counts_before: increments of each run
    (scenarios,) done before that. spent: wall time [s] of each part; START is all before the loop,
    including the settling of bodies.
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
        """Mark the start of the loop; increment_counts (scenarios,): increments of each run."""
        self.loop_began = self.steady_since = time.monotonic()
        self.spent[START] = self.loop_began - self.began
        self.counts_before = increment_counts.copy()

    def note_block(self, increment_counts: np.ndarray) -> None:
        """Mark the end of a block; increment_counts (scenarios,): increments done by each run."""
        if self.first_increment_after == 0.0:
            self.steady_since, self.counts_before = time.monotonic(), increment_counts.copy()
            self.first_increment_after = self.steady_since - self.began

    def parts(self) -> dict[str, float]:
        """Return the wall time [s] since the runs began, by part; "other": the rest."""
        whole = self.age
        return self.spent | {"other": whole - sum(self.spent.values())}

    @contextmanager
    def spending_on(self, part: str) -> Iterator[None]:
        """Add the wall time of the block to a part; blocks must not be nested."""
        began = time.monotonic()
        try:
            yield
        finally:
            self.spent[part] += time.monotonic() - began
