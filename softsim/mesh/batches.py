"""Batches of cells, which limit memory: intermediate results take a kilobyte or more per cell."""

from collections.abc import Callable

import numpy as np

BATCH = 16_384


def batches(count: int) -> list[slice]:
    """Return slices of at most BATCH of `count` cells.

    Without cells there is one empty batch, so that results have their shape.
    """
    return [slice(k, k + BATCH) for k in range(0, max(1, count), BATCH)]


def in_batches(of_cells: Callable[[np.ndarray], np.ndarray], cells: np.ndarray) -> np.ndarray:
    """Apply a function of cells (k, corners) to batches; return all results (m, ...)."""
    return np.concatenate([of_cells(cells[batch]) for batch in batches(len(cells))])
