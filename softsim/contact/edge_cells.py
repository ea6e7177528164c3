"""Which edges of a polyline can be nearest to a place: looked up in cells of a grid.

A cell's list has all edges that are nearest to some place in it, and few others: with the cell's
centre c and its half diagonal r, an edge e that is nearest at x has
    |e - c| <= |e - x| + r <= |e' - x| + r <= |e' - c| + 2 r
for every other edge e'. So what is found in a list is exact.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from softsim.contact.polyline import PAIRS, Polyline

MOST_CELLS = 2**14
RIM = 2
"""Cells around the polyline's points, on each side."""


@dataclass(frozen=True, eq=False)
class EdgeCells:
    """Cells of side `size` [m], shape (2,), the first one's corner at `origin` (2,) [m]. The edges
    of cell (i, j) are edge[begin[c]] .. edge[begin[c + 1] - 1], c = i shape[1] + j.
    """

    origin: np.ndarray
    size: float
    shape: np.ndarray
    begin: np.ndarray
    edge: np.ndarray


def cells_of(polyline: Polyline) -> EdgeCells:
    """Cells around a polyline, half as wide as its median edge unless that makes too many."""
    low, high = polyline.points.min(axis=0), polyline.points.max(axis=0)
    size = 0.5 * float(np.median(np.linalg.norm(polyline.ways, axis=1)))
    while np.prod(shape_of_cells(low, high, size)) > MOST_CELLS:
        size *= 1.1
    origin, shape = low - RIM * size, shape_of_cells(low, high, size)
    counts, edges = zip(*near_edges(polyline, origin, size, shape), strict=True)
    begin = np.concatenate([[0], np.cumsum(np.concatenate(counts))])
    return EdgeCells(origin, size, shape, begin, np.concatenate(edges))


def shape_of_cells(low: np.ndarray, high: np.ndarray, size: float) -> np.ndarray:
    """Cells along both axes (2,) of the box (2,) [m] with its rim."""
    return np.maximum(np.ceil((high - low) / size), 1.0).astype(int) + 2 * RIM


def near_edges(
    polyline: Polyline, origin: np.ndarray, size: float, shape: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Of some cells after the other: how many edges each lists, and the edges."""
    across = np.sqrt(2.0) * size * (1.0 + 1e-9)
    part = max(1, PAIRS // len(polyline.starts))
    for first in range(0, int(np.prod(shape)), part):
        cell = np.arange(first, min(first + part, int(np.prod(shape))))
        centre = origin + size * (np.stack(np.unravel_index(cell, shape), axis=1) + 0.5)
        distance = polyline.distances(centre)
        near = distance <= distance.min(axis=1, keepdims=True) + across
        yield near.sum(axis=1), np.nonzero(near)[1]
