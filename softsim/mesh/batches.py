"""Cells treated some at a time: what is computed on the way takes a kilobyte or more of each."""

from collections.abc import Callable

import numpy as np

BATCH = 16_384


def batches(count: int) -> list[slice]:
    """So many cells, BATCH at a time; none are one batch, so that results have their shape."""
    return [slice(k, k + BATCH) for k in range(0, max(1, count), BATCH)]


def in_batches(of_cells: Callable[[np.ndarray], np.ndarray], cells: np.ndarray) -> np.ndarray:
    """What a function finds (k, ...) of cells (k, corners), of all of them (m, ...)."""
    return np.concatenate([of_cells(cells[batch]) for batch in batches(len(cells))])
