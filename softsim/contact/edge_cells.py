"""Grid of cells that list the edges of a polyline that can be nearest to a point.

The list of a cell has all edges that are nearest to some point in it, and few others: with the
cell's centre c and its half diagonal r, an edge e that is nearest at x satisfies

    |e - c| <= |e - x| + r <= |e' - x| + r <= |e' - c| + 2 r

for every other edge e'. The nearest edge in a list is therefore exact.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from softsim.contact.polyline import PAIRS, Polyline

MOST_CELLS = 2**13
HALF_DIAGONAL = np.sqrt(0.5) * (1.0 + 1e-9)
"""Half diagonal of a cell over its side."""

RIM = 2
"""Number of cells around the polyline's points, on each side."""


@dataclass(frozen=True, eq=False)
class EdgeCells:
    """Grid of square cells with the edges near each of them.

    Cells have the side `size` [m], their number along the axes is shape (2,), and the corner of the
    first one is at `origin` (2,) [m]. The edges of cell (i, j) are edge[begin[c]] .. edge[begin[c +
    1] - 1] with c = i shape[1] + j; no gap in it is below clearance[c] [m].
    """

    origin: np.ndarray
    size: float
    shape: np.ndarray
    begin: np.ndarray
    edge: np.ndarray
    clearance: np.ndarray


def cells_of(polyline: Polyline) -> EdgeCells:
    """Return the cells around a polyline, the smallest within the limit of MOST_CELLS."""
    low, high = polyline.points.min(axis=0), polyline.points.max(axis=0)
    size = float((high - low).max()) / MOST_CELLS
    while np.prod(shape_of_cells(low, high, size)) > MOST_CELLS:
        size *= 1.1
    origin, shape = low - RIM * size, shape_of_cells(low, high, size)
    counts, edges = zip(*near_edges(polyline, origin, size, shape), strict=True)
    clearance = polyline.gaps(centres(np.arange(np.prod(shape)), origin, size, shape))
    begin = np.concatenate([[0], np.cumsum(np.concatenate(counts))])
    return EdgeCells(
        origin, size, shape, begin, np.concatenate(edges), clearance - size * HALF_DIAGONAL
    )


def shape_of_cells(low: np.ndarray, high: np.ndarray, size: float) -> np.ndarray:
    """Return the number of cells (2,) along both axes of the box (2,) [m] with its rim."""
    return np.maximum(np.ceil((high - low) / size), 1.0).astype(int) + 2 * RIM


def near_edges(
    polyline: Polyline, origin: np.ndarray, size: float, shape: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield, for successive groups of cells, the number of edges listed by each, and the edges."""
    across = 2.0 * HALF_DIAGONAL * size
    part = max(1, PAIRS // len(polyline.starts))
    for first in range(0, int(np.prod(shape)), part):
        cell = np.arange(first, min(first + part, int(np.prod(shape))))
        distance = polyline.distances(centres(cell, origin, size, shape))
        near = distance <= distance.min(axis=1, keepdims=True) + across
        yield near.sum(axis=1), np.nonzero(near)[1]


def centres(cell: np.ndarray, origin: np.ndarray, size: float, shape: np.ndarray) -> np.ndarray:
    """Return the centres (k, 2) [m] of cells (k,)."""
    index = np.stack(np.unravel_index(cell, tuple(shape)), axis=1)
    return np.asarray(origin + size * (index + 0.5))
