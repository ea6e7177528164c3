"""Strip of skin with curved spikes on it, from which the robots' sections are made."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from softsim.mesh.mesh import Mesh
from softsim.mesh.surface import BANDS, CellKind, stacked_bands
from softsim.robots.limits import check_cell_count
from softsim.robots.spike import CROSSINGS, Spike

# -------------------------------------------------------------------------------------------------
# Plane section of a skin with fins on its outside: spikes or rings.


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


FEWEST_ROWS = 3
"""Smallest number of rows of triangles through the skin, required for its bending."""

FLATTEST_CELL = 1.5
"""Largest length of a triangle of the skin over the height of its row."""


@dataclass(frozen=True)
class Fineness:
    """Mesh sizes of a strip.

    rows: of cells through the skin. longest [m]: of cells along the skin. edge [m]: side of a
    spike's cells. columns: of cells across a spike; None: as many as `longest` gives.
    """

    kind: CellKind
    rows: int
    longest: float
    edge: float
    columns: int | None


def fineness_of(
    kind: CellKind, skin: float, element_size: float, rows: int | None, columns: int
) -> Fineness:
    """Return the mesh sizes for a skin of this thickness [m].

    rows: number through it, where given. columns: of quadrilaterals across a spike.
    """
    if kind == "quad":
        rows = rows or whole(skin / element_size)
        return Fineness(kind, rows, element_size, element_size, columns)
    edge = math.sqrt(2) * element_size
    rows = max(FEWEST_ROWS, int(skin / (edge * math.sin(math.pi / 3))))
    return Fineness(kind, rows, min(edge, FLATTEST_CELL * skin / rows), edge, None)


def spiked_strip(
    length: float,
    skin: float,
    centers: np.ndarray,
    root: float,
    shape: Spike,
    fineness: Fineness,
) -> Mesh:
    """Return a strip with its inner face on y = 0 and spikes upward on `centers`, from the rear.

    All cells lie in bands between lines of nodes: along the skin, and across each spike.
    """
    kind, rows = fineness.kind, fineness.rows
    check_cell_count(rows * length / fineness.longest, fineness.edge)
    stations = np.sort([-length / 2, *(centers - root / 2), *(centers + root / 2), length / 2])
    x, ends = _columns(stations, fineness.longest, fineness.columns)
    coordinates = [
        np.column_stack([line, np.full(len(line), y)])
        for line, y in zip(
            LINES[kind](x, rows + 1)[::-1], np.linspace(0, skin, rows + 1), strict=True
        )
    ]
    lines = node_lines(0, coordinates)
    blocks, stacks = [*coordinates], [lines]
    outer, first_free = lines[-1], sum(map(len, coordinates))
    for center, start, end in zip(centers, ends[1:-1:2], ends[2:-1:2], strict=True):
        across = CROSSINGS[kind](shape, fineness.edge, end - start)
        above = node_lines(first_free, across[1:])
        first_free += sum(map(len, above))
        blocks += [line + np.array([center, skin]) for line in across[1:]]
        stacks.append([outer[start : end + 1], *above])

    points = np.concatenate(blocks)
    cells = [stacked_bands(points, stack, BANDS[kind]) for stack in stacks]
    knot_rear, knot_front = (np.array([line[side] for line in lines]) for side in (0, -1))
    node_sets = {
        "knot_front": knot_front,
        "knot_rear": knot_rear,
        "knots": np.concatenate([knot_front, knot_rear]),
        "chamber": lines[0],
    }
    cell_numbers = np.arange(sum(map(len, cells)))
    cell_sets = {"skin": cell_numbers[: len(cells[0])]}
    if len(centers):
        spikes = [np.concatenate(stack[1:]) for stack in reversed(stacks[1:])]
        node_sets |= {f"j{row}": nodes for row, nodes in enumerate(spikes, start=1)}
        node_sets["tips"] = _highest(points, np.concatenate(spikes))
        cell_sets["spikes"] = cell_numbers[len(cells[0]) :]
    return Mesh(
        points=points,
        cells=np.concatenate(cells),
        node_sets=node_sets,
        facet_sets={"chamber": np.column_stack([lines[0][:-1], lines[0][1:]])},
        cell_sets=cell_sets,
    )


def _columns(
    stations: np.ndarray, longest_cell: float, of_spikes: int | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions along the skin, equally spaced between stations, and the stations' indices.

    of_spikes: number of cells below a spike; None: as many as cells of longest_cell [m] give.
    """
    pieces = np.diff(stations)
    # Rounded down, for cells a little longer: the rows' height is the shorter measure.
    segments = np.maximum(1, np.floor(pieces / longest_cell + 1e-9)).astype(int)
    if of_spikes is not None:
        segments[1::2] = of_spikes
    ends = np.concatenate([[0], np.cumsum(segments)])
    return np.interp(np.arange(ends[-1] + 1), ends, stations), ends


def _highest(points: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    y = points[nodes, 1]
    return nodes[y > y.max() * (1 - 1e-9)]
