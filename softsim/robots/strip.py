"""Plane section of a skin with fins on its outside: spikes or rings."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from softsim.mesh.band import BANDS, CellKind, stacked_bands
from softsim.robots.block import check_cell_count


@dataclass(frozen=True)
class Fin:
    """Fin on a strip's outside: its root from column `start` to `end`, its lines above the root.

    lines: points (k, 2) [m] of each line, in the direction of the strip, from root to tip.
    """

    start: int
    end: int
    lines: Sequence[np.ndarray]


@dataclass(frozen=True)
class Strip:
    """Strip of cells along x with its inner side on y = 0 and its fins upward.

    points: (n, 2) [m]. skin_lines: node numbers from -x to +x of the skin's lines, from the inner
    side to the outer one. fins: node numbers of each fin above the skin. skin_cells, fin_cells: (m,
    3) triangles or (m, 4) quadrilaterals.
    """

    points: np.ndarray
    skin_lines: list[np.ndarray]
    fins: list[np.ndarray]
    skin_cells: np.ndarray
    fin_cells: np.ndarray

    @property
    def cells(self) -> np.ndarray:
        """All cells (m, corners), those of the skin first."""
        return np.concatenate([self.skin_cells, self.fin_cells])

    def at_middle(self, nodes: np.ndarray) -> np.ndarray:
        """Return those of the nodes that lie on x = 0, where even columns place a node."""
        x = self.points[:, 0]
        return nodes[np.abs(x[nodes]) < 1e-9 * np.ptp(x)]


def even_columns(
    stations: np.ndarray, size: float, of_fins: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions with an even number of equal steps between stations, and stations' indices.

    size: approximate length of a step. of_fins: number of steps between the first and the second
    station, the third and the fourth ... of those inside; None: like all others.

    An even number puts a position in the middle between two stations, and gives mirrored stations
    mirrored tetrahedra.
    """
    check_cell_count(float(np.ptp(stations)) / size, size)
    steps = np.array([even(piece / size) for piece in np.diff(stations)])
    if of_fins is not None:
        steps[1::2] = of_fins
    ends = np.concatenate([[0], np.cumsum(steps)])
    return np.interp(np.arange(ends[-1] + 1), ends, stations), ends


def even(count: float) -> int:
    """Return the even number nearest to a count, 2 or more."""
    return 2 * max(1, math.floor(count / 2 + 0.5))


def whole(count: float) -> int:
    """Return the whole number nearest to a count, 1 or more."""
    return max(1, math.floor(count + 0.5))


ROWS: dict[CellKind, Callable[[float], int]] = {"simplex": even, "quad": whole}
"""Functions that round a count to a number of rows of cells."""


def staggered(x: np.ndarray, count: int) -> list[np.ndarray]:
    """Return `count` lines of positions; the first is x, and neighbours are half a cell apart.

    Staggered rows have triangles of nearly equal sides, whose altitude is that of the row. The
    midpoints next to the ends are left out: they would make small cells in the corners.
    """
    midpoints = (x[:-1] + x[1:]) / 2
    between = np.concatenate([x[:1], midpoints[1:-1], x[-1:]])
    return [x if line % 2 == 0 else between for line in range(count)]


def straight(x: np.ndarray, count: int) -> list[np.ndarray]:
    """Return `count` lines of the positions x."""
    return [x] * count


LINES: dict[CellKind, Callable[[np.ndarray, int], list[np.ndarray]]] = {
    "simplex": staggered,
    "quad": straight,
}


def finned_strip(
    x: np.ndarray, thickness: float, rows: int, fins: Sequence[Fin], kind: CellKind
) -> Strip:
    """Return a skin of this thickness [m] with columns at x [m], and fins that stand on it.

    rows: of cells through the skin; an even number of triangles, for nodes at x on its inner side
    too.
    """
    check_cell_count(rows * len(x), float(np.ptp(x)) / len(x))
    skin = _rows(LINES[kind](x, rows + 1), np.linspace(0, thickness, rows + 1))
    blocks, skin_lines = list(skin), node_lines(0, skin)
    outer, first_free = skin_lines[-1], sum(map(len, skin))
    stacks = []
    for fin in fins:
        above = node_lines(first_free, fin.lines)
        first_free += sum(map(len, above))
        blocks += fin.lines
        stacks.append([outer[fin.start : fin.end + 1], *above])
    points = np.concatenate(blocks)
    skin_cells = stacked_bands(points, skin_lines, BANDS[kind])
    of_fins = [stacked_bands(points, stack, BANDS[kind]) for stack in stacks]
    return Strip(
        points=points,
        skin_lines=skin_lines,
        fins=[np.concatenate(stack[1:]) for stack in stacks],
        skin_cells=skin_cells,
        fin_cells=np.concatenate([skin_cells[:0], *of_fins]),
    )


def upright(x: np.ndarray, low: float, high: float, rows: int, kind: CellKind) -> list[np.ndarray]:
    """Return the lines above the root of a rectangular fin: columns at x, y in [low, high] [m]."""
    return _rows(LINES[kind](x, rows + 1), np.linspace(low, high, rows + 1))[1:]


def _rows(lines: list[np.ndarray], heights: np.ndarray) -> list[np.ndarray]:
    return [
        np.column_stack([line, np.full(len(line), y)])
        for line, y in zip(lines, heights, strict=True)
    ]


def node_lines(first: int, lines: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return the node numbers of lines of points, numbered from `first` on."""
    ends = first + np.cumsum([0, *map(len, lines)])
    return [np.arange(start, end) for start, end in pairwise(ends)]
