"""A rectangular block."""

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.mesh import Mesh, renumbered
from softsim.mesh.surface import CellKind

LARGEST_GRID = 5_000_000


def block(length: float, height: float, element_size: float, cells: CellKind = "simplex") -> Mesh:
    """Return a rectangle: x in [-length/2, length/2], y in [0, height], all in m.

    Equal rectangles with sides no longer than `element_size`, for triangles cut along alternating
    diagonals (union jack), so that the mesh has no preferred direction. Node and facet sets:
    bottom, top, left, right.

    Raises MeshError for a dimension that is not positive.
    """
    for name, value in (("length", length), ("height", height), ("element_size", element_size)):
        if not (np.isfinite(value) and value > 0):
            raise MeshError(f"block: {name} is {value:g} m; it must be positive")
    # A hair of slack: a length of exactly n sizes gives n columns, whatever its last digit.
    columns, rows = (max(1, int(np.ceil(side / element_size - 1e-9))) for side in (length, height))
    if columns * rows > LARGEST_GRID:
        raise MeshError(
            f"block: element_size {element_size:g} m cuts it into {columns} x {rows} cells; "
            f"at most {LARGEST_GRID:g} fit in a reasonable memory"
        )
    x, y = np.meshgrid(
        np.linspace(-length / 2, length / 2, columns + 1), np.linspace(0, height, rows + 1)
    )
    node = np.arange(x.size).reshape(rows + 1, columns + 1)
    sides = {"bottom": node[0], "right": node[:, -1], "top": node[-1, ::-1], "left": node[::-1, 0]}
    return renumbered(
        Mesh(
            points=np.column_stack([x.ravel(), y.ravel()]),
            cells=FILLINGS[cells](node),
            node_sets=sides,
            facet_sets={
                name: np.column_stack([nodes[:-1], nodes[1:]]) for name, nodes in sides.items()
            },
        )
    )


def check_cell_count(count: float, element_size: float) -> None:
    """Raise MeshError if the number of elements of this size [m] exceeds LARGEST_GRID."""
    if count > LARGEST_GRID:
        raise MeshError(
            f"element_size is {1e3 * element_size:g} mm and makes at least {count:.3g} elements; "
            f"at most {LARGEST_GRID:g} fit in a reasonable memory",
            hint="increase element_size",
        )


def grid_cells(node: np.ndarray) -> np.ndarray:
    """Return the quadrilaterals (m, 4) of a grid of nodes (rows, columns), counter-clockwise."""
    corners = node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]
    return np.stack(corners, axis=-1).reshape(-1, 4)


def _union_jack(node: np.ndarray) -> np.ndarray:
    """Return the triangles (m, 3) of a grid of nodes, with alternating diagonals."""
    a, b, c, d = node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]
    rising = np.stack([a, b, c, a, c, d], axis=-1)
    falling = np.stack([a, b, d, b, c, d], axis=-1)
    row, column = np.indices(a.shape)
    even = ((row + column) % 2 == 0)[..., None]
    return np.where(even, rising, falling).reshape(-1, 3)


FILLINGS = {"simplex": _union_jack, "quad": grid_cells}
