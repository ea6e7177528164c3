"""Strip of skin with curved spikes on it, from which the robots' sections are made."""

import math
from dataclasses import dataclass

import numpy as np

from softsim.mesh.band import BANDS, CellKind, stacked_bands
from softsim.mesh.mesh import Mesh
from softsim.robots.block import check_cell_count
from softsim.robots.spike import CROSSINGS, Spike
from softsim.robots.strip import LINES, node_lines, whole

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
