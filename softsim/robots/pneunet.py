"""Pneu-net: a finger with chambers on a common channel, which bends when it is inflated.

Fast pneu-nets have chambers with gaps between them (Mosadegh et al. 2014, Adv. Funct. Mater.
24:2163-2170): on inflation their walls bulge and push each other apart, and since the base does not
stretch, the finger bends. The side walls support the chambers, so this is a body in space.
"""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from softsim.errors import MeshError
from softsim.mesh.mesh import Mesh, boundary_facets, facets_on, renumbered
from softsim.mesh.quality import check
from softsim.mesh.surface import CellKind
from softsim.robots.block import FILLINGS, LARGEST_GRID, check_cell_count
from softsim.robots.box import EXTRUSIONS
from softsim.robots.limits import check_positive

# Where there is material from the base up: base, channel, bridge, chamber above it, roof.
END_WALL = (True, True, True, True, True)
WALL = (True, False, True, True, True)
CHAMBER = (True, False, False, False, True)
GAP = (True, False, True, False, False)
BESIDE_GAP = (True, True, True, False, False)


def pneunet(
    chambers: int = 6,
    chamber_length: float = 5e-3,
    wall_thickness: float = 1.5e-3,
    gap: float = 1e-3,
    width: float = 15e-3,
    height: float = 14e-3,
    roof_thickness: float = 2e-3,
    base_thickness: float = 2e-3,
    channel_height: float = 2e-3,
    bridge_thickness: float = 2e-3,
    element_size: float = 1.5e-3,
    cells: CellKind = "quad",
) -> Mesh:
    """Return half of a finger along x from x = 0, its underside on y = 0. All lengths in m.

    z = 0 is its plane of symmetry, z = width / 2 its side.

    Each chamber is `chamber_length` long inside and has walls of `wall_thickness` all around, under
    a roof; between two of them the walls stand `gap` apart, on a bridge over the channel that joins
    them, which lies on the base and is as wide as they are. The mesh is a grid of bricks with sides
    no longer than `element_size`, which are cut for tetrahedra.

    Node and facet sets: bottom, root (x = 0), end, middle (z = 0), chamber (all of the inside).
    Node set: tip, the lower corner of the end in the middle.

    Raises MeshError, naming the parameter, for dimensions that make no such body.
    """
    check_positive(
        chamber_length=chamber_length,
        wall_thickness=wall_thickness,
        gap=gap,
        width=width,
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
    if not width > 2.0 * wall_thickness:
        raise MeshError(
            f"width is {1e3 * width:g} mm; more than {2e3 * wall_thickness:g} mm is needed, for "
            "two walls"
        )
    unit = [wall_thickness, chamber_length, wall_thickness]
    x, column = divided(unit + (chambers - 1) * [gap, *unit], element_size)
    side = height - roof_thickness - bridge_top
    y, row = divided(
        [base_thickness, channel_height, bridge_thickness, side, roof_thickness], element_size
    )
    z, layer = divided([width / 2 - wall_thickness, wall_thickness], element_size)
    if len(x) * len(y) * len(z) > LARGEST_GRID:
        raise MeshError(f"element_size is {1e3 * element_size:g} mm: too many cells")
    across, up = np.meshgrid(x, y)
    filled = FILLINGS[cells](np.arange(across.size).reshape(across.shape))
    each = len(filled) // (len(row) * len(column))  # cells in a rectangle
    sections = [
        filled[np.repeat(solid[row[:, None], column], each)]
        for solid in (inside(chambers), beside(chambers))
    ]
    stations = np.arange(len(z) * across.size).reshape(len(z), across.size)
    filling = EXTRUSIONS[cells]([sections[k] for k in layer], stations)
    points = np.column_stack(
        [np.tile(across.ravel(), len(z)), np.tile(up.ravel(), len(z)), np.repeat(z, across.size)]
    )
    used, numbers = np.unique(filling, return_inverse=True)
    body = renumbered(with_sides(points[used], numbers.reshape(filling.shape)))
    check(body)
    return body


def divided(sizes: list[float], element_size: float) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (n + 1,) [m] that divide intervals of these sizes, one after another.

    Parts are equal within an interval and no longer than `element_size`. Also return the number of
    the interval of each part (n,).
    """
    check_cell_count(sum(sizes) / element_size, element_size)
    counts = [max(1, int(np.ceil(size / element_size - 1e-9))) for size in sizes]
    steps = np.repeat(np.array(sizes) / counts, counts)
    return np.concatenate([[0.0], np.cumsum(steps)]), np.repeat(np.arange(len(sizes)), counts)


def inside(chambers: int) -> np.ndarray:
    """Return a mask (5, 4 chambers - 1), True for material, over heights and lengths."""
    units = [CHAMBER, WALL, GAP, WALL] * chambers
    return np.array([END_WALL, *units[: 4 * chambers - 3], END_WALL]).T


def beside(chambers: int) -> np.ndarray:
    """Return the same map for the wall at the side, which closes chambers and channel."""
    units = [END_WALL, END_WALL, END_WALL, BESIDE_GAP] * chambers
    return np.array(units[:-1]).T


def with_sides(points: np.ndarray, cells: np.ndarray) -> Mesh:
    """Return the mesh with its sets.

    Without the plane of symmetry its boundary has two parts: the one with the lowest node is the
    outside, the other the inside.
    """
    surface, (x, y, z) = boundary_facets(cells, 3), points.T
    skin = surface[(z[surface] > 0.0).any(axis=1)]
    links = (np.repeat(skin[:, 0], skin.shape[1] - 1), skin[:, 1:].ravel())
    _, part = connected_components(
        coo_array((np.ones(len(links[0])), links), shape=(len(x), len(x))), directed=False
    )
    sides = {
        "bottom": np.flatnonzero(y == y.min()),
        "root": np.flatnonzero(x == x.min()),
        "end": np.flatnonzero(x == x.max()),
        "middle": np.flatnonzero(z == 0.0),
        "chamber": np.setdiff1d(skin, np.flatnonzero(part == part[np.argmin(y)])),
    }
    tip = np.intersect1d(np.intersect1d(sides["end"], sides["bottom"]), sides["middle"])
    facets = {name: facets_on(surface, nodes) for name, nodes in sides.items()}
    facets["chamber"] = facets_on(skin, sides["chamber"])
    return Mesh(points=points, cells=cells, node_sets={**sides, "tip": tip}, facet_sets=facets)
