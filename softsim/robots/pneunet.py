"""A pneu-net: the section of a bending finger along its length, with chambers on a common channel.

Fast pneu-nets have chambers with gaps between (Mosadegh et al. 2014, Adv. Funct. Mater.
24:2163-2170): inflated, their side walls bulge and press each other apart, and as the base does not
stretch, the finger bends.
"""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from softsim.errors import MeshError
from softsim.mesh.band import CellKind
from softsim.mesh.mesh import Mesh, boundary_facets, facets_on, renumbered
from softsim.mesh.quality import check
from softsim.robots.block import FILLINGS, LARGEST_GRID
from softsim.robots.limits import check_positive


def pneunet_section(
    chambers: int = 6,
    chamber_length: float = 5e-3,
    wall_thickness: float = 1.5e-3,
    gap: float = 1e-3,
    height: float = 14e-3,
    roof_thickness: float = 2e-3,
    base_thickness: float = 2e-3,
    channel_height: float = 2e-3,
    bridge_thickness: float = 2e-3,
    element_size: float = 0.75e-3,
    cells: CellKind = "quad",
) -> Mesh:
    """A row of chambers along x, from x = 0 on, on a base whose underside is y = 0. All in m.

    Each chamber is `chamber_length` long inside, between walls, under a roof; between two of them
    the walls stand `gap` apart, on a bridge over the channel that joins them, which lies on the
    base. A grid of rectangles with sides no longer than `element_size`, for triangles cut.

    Node and facet sets: bottom, root (x = 0), end, chamber (all of the inside). Node set: tip, the
    lower corner of the end.

    Raises MeshError, naming the parameter, for dimensions that make no such body.
    """
    check_positive(
        chamber_length=chamber_length,
        wall_thickness=wall_thickness,
        gap=gap,
        height=height,
        roof_thickness=roof_thickness,
        base_thickness=base_thickness,
        channel_height=channel_height,
        bridge_thickness=bridge_thickness,
        element_size=element_size,
    )
    if chambers < 1:
        raise MeshError(f"chambers is {chambers}; 1 or more are needed")
    bridge_top = base_thickness + channel_height + bridge_thickness
    if not height - roof_thickness > bridge_top:
        raise MeshError(
            f"height is {1e3 * height:g} mm; more than {1e3 * (bridge_top + roof_thickness):g} mm "
            "is needed, above base, channel, bridge and roof"
        )
    unit = [wall_thickness, chamber_length, wall_thickness]
    lengths = unit + (chambers - 1) * [gap, *unit]
    heights = [
        base_thickness, channel_height, bridge_thickness, height - roof_thickness - bridge_top,
        roof_thickness,
    ]  # fmt: skip
    x, column = divided(lengths, element_size)
    y, row = divided(heights, element_size)
    if len(x) * len(y) > LARGEST_GRID:
        raise MeshError(f"element_size is {1e3 * element_size:g} mm: too many cells")
    across, up = np.meshgrid(x, y)
    grid = np.arange(across.size).reshape(across.shape)
    solid = is_solid(chambers)[row[:, None], column].ravel()
    filled = FILLINGS[cells](grid)
    kept = filled[np.repeat(solid, len(filled) // len(solid))]
    used, numbers = np.unique(kept, return_inverse=True)
    points = np.column_stack([across.ravel(), up.ravel()])[used]
    body = renumbered(with_sides(points, numbers.reshape(kept.shape)))
    check(body)
    return body


def divided(sizes: list[float], element_size: float) -> tuple[np.ndarray, np.ndarray]:
    """Places (n + 1,) [m] that divide stretches of these sizes, one after another, into equal parts
    no longer than `element_size`, and the number of the stretch of each part (n,).
    """
    counts = [max(1, int(np.ceil(size / element_size - 1e-9))) for size in sizes]
    steps = np.repeat(np.array(sizes) / counts, counts)
    return np.concatenate([[0.0], np.cumsum(steps)]), np.repeat(np.arange(len(sizes)), counts)


# Where there is material from the base up: base, channel, bridge, chamber above it, roof.
END_WALL = (True, True, True, True, True)
WALL = (True, False, True, True, True)
CHAMBER = (True, False, False, False, True)
GAP = (True, False, True, False, False)


def is_solid(chambers: int) -> np.ndarray:
    """Whether there is material at each stretch of heights and of lengths (5, 4 chambers - 1)."""
    units = [CHAMBER, WALL, GAP, WALL] * chambers
    return np.array([END_WALL, *units[: 4 * chambers - 3], END_WALL]).T


def with_sides(points: np.ndarray, cells: np.ndarray) -> Mesh:
    """The mesh with its sets. Its boundary is two rings, of which the outer one has the lowest
    node.
    """
    surface, (x, y) = boundary_facets(cells, 2), points.T
    links = coo_array((np.ones(len(surface)), surface.T), shape=(len(x), len(x)))
    _, ring = connected_components(links, directed=False)
    sides = {
        "bottom": np.flatnonzero(y == y.min()),
        "root": np.flatnonzero(x == x.min()),
        "end": np.flatnonzero(x == x.max()),
        "chamber": np.setdiff1d(surface, np.flatnonzero(ring == ring[np.argmin(y)])),
    }
    tip = np.intersect1d(sides["end"], sides["bottom"])
    return Mesh(
        points=points,
        cells=cells,
        node_sets={**sides, "tip": tip},
        facet_sets={name: facets_on(surface, nodes) for name, nodes in sides.items()},
    )
