"""Band of cells between two lines of points."""

from collections.abc import Callable
from itertools import pairwise
from typing import Literal

import numpy as np

CellKind = Literal["simplex", "quad"]
"""Kinds of cells: triangles and tetrahedra, or quadrilaterals and hexahedra."""

Band = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def triangle_band(points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return triangles (m, 3), counter-clockwise, that fill the band between two lines of nodes.

    points: (n, 2). lower, upper: node numbers along each line, both in the direction that has the
    upper line to the left. The lines may differ in their number of nodes; a line of one node closes
    the band to a fan. Each step along the band takes the shorter of the two diagonals.
    """
    cells = []
    i = j = 0
    while i < len(lower) - 1 or j < len(upper) - 1:
        along_lower = _reach(points, lower, i + 1, upper[j])
        along_upper = _reach(points, upper, j + 1, lower[i])
        # The slack lets equal diagonals fall the same way whatever the rounding.
        if along_lower <= along_upper * (1 + 1e-9):
            cells.append([lower[i], lower[i + 1], upper[j]])
            i += 1
        else:
            cells.append([lower[i], upper[j + 1], upper[j]])
            j += 1
    return np.array(cells, dtype=np.int64).reshape(-1, 3)


def quadrilateral_band(points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return quadrilaterals (m, 4) that fill the band between two lines of nodes.

    Where a line has more nodes than the other, the cells at its end are triangles. See
    `triangle_band`.
    """
    count = min(len(lower), len(upper))
    quadrilaterals = np.column_stack(
        [lower[: count - 1], lower[1:count], upper[1:count], upper[: count - 1]]
    )
    rest = triangle_band(points, lower[count - 1 :], upper[count - 1 :])
    return np.concatenate([quadrilaterals, rest[:, [0, 1, 2, 2]]])


BANDS: dict[CellKind, Band] = {"simplex": triangle_band, "quad": quadrilateral_band}


def stacked_bands(points: np.ndarray, lines: list[np.ndarray], band: Band) -> np.ndarray:
    """Return the cells (m, corners) of the bands between each line of nodes and the next one."""
    return np.concatenate([band(points, lower, upper) for lower, upper in pairwise(lines)])


def _reach(points: np.ndarray, line: np.ndarray, position: int, node: int) -> float:
    """Return the distance from `node` to that at `position` on `line`; infinite beyond its end."""
    if position >= len(line):
        return np.inf
    return float(np.linalg.norm(points[line[position]] - points[node]))
