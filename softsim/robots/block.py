"""Rectangular blocks in the plane and in space, and the cells of grids and of swept sections."""

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.mesh import Mesh, boundary_facets, facets_on, renumbered
from softsim.mesh.quality import check
from softsim.mesh.surface import CellKind
from softsim.robots.limits import LARGEST_GRID, check_positive


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


# -------------------------------------------------------------------------------------------------
# Cells of a plane section swept through space, from one position to the next.


def extruded_tetrahedra(layers: list[np.ndarray], stations: np.ndarray) -> np.ndarray:
    """Return tetrahedra (m, 4) of positive volume between neighbouring positions of a section.

    layers: for each layer the triangles (k, 3) of the section that it fills, counter-clockwise seen
    against the sweep; they may differ from layer to layer. stations: (layers + 1, n) node numbers
    of the section's nodes at each position. A closed sweep repeats its first station as its last.

    Each triangle becomes a prism and each prism three tetrahedra, conforming across all prisms. The
    diagonals on the prisms' sides alternate from layer to layer, so that the mesh has no twist of
    its own.
    """
    cells = []
    for layer, triangles in enumerate(layers):
        low, high = stations[layer], stations[layer + 1]
        # Swept backwards, a triangle seen from behind, the diagonals lean the other way.
        forth = layer % 2 == 0
        cells.append(
            _prism_cells(triangles, low, high)
            if forth
            else _prism_cells(triangles[:, ::-1], high, low)
        )
    return np.concatenate(cells)


def extruded_hexahedra(layers: list[np.ndarray], stations: np.ndarray) -> np.ndarray:
    """Return hexahedra (m, 8) of positive volume between neighbouring positions of a section.

    layers: the quadrilaterals (k, 4) of each; a triangle among them becomes a wedge. See
    `extruded_tetrahedra`.
    """
    below_and_above = zip(stations[:-1], stations[1:], layers, strict=True)
    return np.concatenate([np.hstack([low[q], high[q]]) for low, high, q in below_and_above])


EXTRUSIONS = {"simplex": extruded_tetrahedra, "quad": extruded_hexahedra}


def _prism_cells(triangles: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the tetrahedra of the prisms between the section's nodes at `low` and at `high`.

    On every side the diagonal rises from the node with the smaller number in the section, so that
    both prisms at a side cut it in the same way.
    """
    first, second, third = triangles.T
    # An odd permutation sorts these: it turns the triangle's sense, and its tetrahedra with it.
    odd = (second - first) * (third - first) * (third - second) < 0
    a, b, c = np.sort(triangles, axis=1).T
    cells = np.stack(
        [
            np.column_stack([low[a], low[b], low[c], high[c]]),
            np.column_stack([low[a], low[b], high[c], high[b]]),
            np.column_stack([low[a], high[a], high[b], high[c]]),
        ],
        axis=1,
    )
    return np.where(odd[:, None, None], cells[:, :, [0, 1, 3, 2]], cells).reshape(-1, 4)


# -------------------------------------------------------------------------------------------------
# A rectangular block in three dimensions.


def box(
    length: float,
    width: float,
    height: float,
    element_size: float,
    cells: CellKind = "simplex",
) -> Mesh:
    """Return a block in space: x in [0, length], y in [0, height], z in [0, width], all in m.

    y is up. Equal bricks with sides no longer than `element_size`; tetrahedra: each cut into six,
    along diagonals that alternate as in `block`. Node and facet sets: left, right (x = 0, length),
    bottom, top (y = 0, height), back, front (z = 0, width).

    Raises MeshError for a dimension that is not positive, or more bricks than fit in memory.
    """
    check_positive(length=length, width=width, height=height, element_size=element_size)
    # A hair of slack: a width of exactly n sizes gives n layers, whatever its last digit.
    layers = max(1, int(np.ceil(width / element_size - 1e-9)))
    bricks = layers * max(1, length / element_size) * max(1, height / element_size)
    if bricks > LARGEST_GRID:
        raise MeshError(
            f"element_size is {1e3 * element_size:g} mm and cuts the box into {bricks:.3g} bricks; "
            f"at most {LARGEST_GRID:g} fit in a reasonable memory",
            hint="increase element_size",
        )
    side = block(length, height, element_size, cells)
    # Numbered in the order of x and y, the section's nodes make regular diagonals.
    order = np.lexsort(side.points.T)
    section = side.points[order] + [length / 2, 0]
    of_section = np.argsort(order)[side.cells]

    z = np.linspace(0, width, layers + 1)
    points = np.column_stack([np.tile(section, (len(z), 1)), np.repeat(z, len(section))])
    stations = np.arange(len(points)).reshape(len(z), len(section))
    filling = EXTRUSIONS[cells]([of_section] * layers, stations)
    sides = {
        name: np.flatnonzero(points[:, axis] == extreme(points[:, axis]))
        for axis, names in enumerate((("left", "right"), ("bottom", "top"), ("back", "front")))
        for name, extreme in zip(names, (np.min, np.max), strict=True)
    }
    boundary = boundary_facets(filling, 3)
    body = renumbered(
        Mesh(
            points=points,
            cells=filling,
            node_sets=sides,
            facet_sets={name: facets_on(boundary, nodes) for name, nodes in sides.items()},
        )
    )
    check(body)
    return body
