"""A rectangular block in three dimensions."""

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.band import CellKind
from softsim.mesh.mesh import Mesh, boundary_facets, facets_on, renumbered
from softsim.mesh.quality import check
from softsim.robots.block import LARGEST_GRID, block
from softsim.robots.extrusion import EXTRUSIONS
from softsim.robots.limits import check_positive


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
