"""Pneu-nets: fingers with chambers on a common channel, which bend when they are inflated.

Fast pneu-nets have chambers with gaps between them (Mosadegh et al. 2014, Adv. Funct. Mater.
24:2163-2170): on inflation their walls bulge and push each other apart, and since the base does not
stretch, the finger bends. The side walls support the chambers, so this is a body in space.

Four of them on a torso are a quadruped (Shepherd et al. 2011, PNAS 108:20400-20403).
"""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from softsim.errors import MeshError
from softsim.mesh.mesh import Mesh, boundary_facets, facets_on, renumbered
from softsim.mesh.quality import check
from softsim.mesh.surface import CellKind
from softsim.robots.block import EXTRUSIONS, FILLINGS
from softsim.robots.limits import LARGEST_GRID, check_cell_count, check_positive

# Where there is material from the base up: base, channel, bridge, chamber above it, roof.
END_WALL = (True, True, True, True, True)
WALL = (True, False, True, True, True)
CHAMBER = (True, False, False, False, True)
GAP = (True, False, True, False, False)
BESIDE_GAP = TORSO = (True, True, True, False, False)
BETWEEN_LEGS = (False, False, False, False, False)


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
    check_lengths(
        chambers, width, height, roof_thickness, base_thickness, channel_height, bridge_thickness,
        chamber_length=chamber_length, wall_thickness=wall_thickness, gap=gap,
        element_size=element_size,
    )  # fmt: skip
    heights = layer_heights(
        height, roof_thickness, base_thickness, channel_height, bridge_thickness
    )
    points, filling = bricks(
        finger_lengths(chambers, chamber_length, wall_thickness, gap),
        heights,
        [width / 2 - wall_thickness, wall_thickness],
        [inside(chambers), beside(chambers)],
        element_size,
        cells,
    )
    body = renumbered(with_sides(points, filling))
    check(body)
    return body


def quadruped(
    chambers: int = 4,
    chamber_length: float = 6e-3,
    wall_thickness: float = 2e-3,
    gap: float = 2e-3,
    leg_width: float = 16e-3,
    height: float = 14e-3,
    roof_thickness: float = 2e-3,
    base_thickness: float = 2e-3,
    channel_height: float = 2e-3,
    bridge_thickness: float = 2e-3,
    torso_length: float = 20e-3,
    leg_distance: float = 12e-3,
    element_size: float = 3e-3,
    cells: CellKind = "quad",
) -> Mesh:
    """Return a torso with four pneu-nets as legs, its underside on y = 0. All lengths in m.

    Two legs extend along x from the front of the torso (+x) and two from its rear, at both sides
    of z = 0, `leg_distance` apart. Left is -z. The torso is as high as the bridges between two
    chambers. A leg has the dimensions of `pneunet`. Inflated, it bends its tip downwards.

    Node and facet sets: bottom (whole underside), and for front_left, front_right, rear_left and
    rear_right the inside of the leg, under this name. Node sets: tip_front_left ... (lower edges of
    the tips), torso.

    Raises MeshError, naming the parameter, for dimensions that make no such body.
    """
    check_lengths(
        chambers, leg_width, height, roof_thickness, base_thickness, channel_height,
        bridge_thickness, width_name="leg_width", chamber_length=chamber_length,
        wall_thickness=wall_thickness, gap=gap, torso_length=torso_length,
        leg_distance=leg_distance, element_size=element_size,
    )  # fmt: skip
    leg = finger_lengths(chambers, chamber_length, wall_thickness, gap)
    across = [wall_thickness, leg_width - 2.0 * wall_thickness, wall_thickness]
    torso, free = np.array([TORSO]).T, np.array([BETWEEN_LEGS]).T
    along_leg, along_wall = (
        np.hstack([one[:, ::-1], torso, one]) for one in (inside(chambers), beside(chambers))
    )
    between = np.hstack([*(len(leg) * [free]), torso, *(len(leg) * [free])])
    side = [along_wall, along_leg, along_wall]
    points, filling = bricks(
        [*reversed(leg), torso_length, *leg],
        layer_heights(height, roof_thickness, base_thickness, channel_height, bridge_thickness),
        [*across, leg_distance, *across],
        [*side, between, *side],
        element_size,
        cells,
    )
    points -= [sum(leg) + torso_length / 2, 0.0, leg_width + leg_distance / 2]
    body = renumbered(with_legs(points, filling, torso_length))
    check(body)
    return body


def check_lengths(
    chambers: int,
    width: float,
    height: float,
    roof: float,
    base: float,
    channel: float,
    bridge: float,
    width_name: str = "width",
    **others: float,
) -> None:
    """Raise MeshError, naming the parameter, if a pneu-net cannot have these lengths [m]."""
    check_positive(
        **{width_name: width}, height=height, roof_thickness=roof, base_thickness=base,
        channel_height=channel, bridge_thickness=bridge, **others,
    )  # fmt: skip
    if chambers < 1:
        raise MeshError(f"chambers is {chambers}; 1 or more are needed")
    least = base + channel + bridge + roof
    if not height > least:
        raise MeshError(
            f"height is {1e3 * height:g} mm; more than {1e3 * least:g} mm "
            "is needed, above base, channel, bridge and roof"
        )
    walls = 2.0 * others["wall_thickness"]
    if not width > walls:
        raise MeshError(
            f"{width_name} is {1e3 * width:g} mm; more than {1e3 * walls:g} mm is needed, for "
            "two walls"
        )


def finger_lengths(chambers: int, chamber: float, wall: float, gap: float) -> list[float]:
    """Return the lengths [m] along a pneu-net: wall, chamber, wall, gap, wall ..."""
    unit = [wall, chamber, wall]
    return unit + (chambers - 1) * [gap, *unit]


def layer_heights(
    height: float, roof: float, base: float, channel: float, bridge: float
) -> list[float]:
    """Return the heights [m] of base, channel, bridge, the chamber above it, and roof."""
    return [base, channel, bridge, height - roof - base - channel - bridge, roof]


def bricks(
    lengths: list[float],
    heights: list[float],
    widths: list[float],
    solid: list[np.ndarray],
    element_size: float,
    cells: CellKind,
) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 3) [m] and cells of a body of bricks of these lengths along x, y and z.

    solid: for each of the widths a mask (heights, lengths), True for material. Bricks are divided
    into equal parts with sides no longer than `element_size`, which are cut for tetrahedra.
    """
    x, column = divided(lengths, element_size)
    y, row = divided(heights, element_size)
    z, layer = divided(widths, element_size)
    if len(x) * len(y) * len(z) > LARGEST_GRID:
        raise MeshError(f"element_size is {1e3 * element_size:g} mm: too many cells")
    across, up = np.meshgrid(x, y)
    filled = FILLINGS[cells](np.arange(across.size).reshape(across.shape))
    each = len(filled) // (len(row) * len(column))  # cells in a rectangle
    sections = [filled[np.repeat(mask[row[:, None], column], each)] for mask in solid]
    stations = np.arange(len(z) * across.size).reshape(len(z), across.size)
    filling = EXTRUSIONS[cells]([sections[k] for k in layer], stations)
    points = np.column_stack(
        [np.tile(across.ravel(), len(z)), np.tile(up.ravel(), len(z)), np.repeat(z, across.size)]
    )
    used, numbers = np.unique(filling, return_inverse=True)
    return points[used], numbers.reshape(filling.shape)


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
    part = part_numbers(skin, len(points))
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


def with_legs(points: np.ndarray, cells: np.ndarray, torso_length: float) -> Mesh:
    """Return the mesh of a quadruped with a torso of this length [m], with its sets."""
    surface, (x, y, z) = boundary_facets(cells, 3), points.T
    part = part_numbers(surface, len(points))
    inner = surface[part[surface[:, 0]] != part[np.argmin(y)]]
    bottom = np.flatnonzero(y == y.min())
    torso = np.flatnonzero(np.abs(x) <= (0.5 + 1e-9) * torso_length)
    node_sets = {"bottom": bottom, "torso": torso}
    facet_sets = {"bottom": facets_on(surface, bottom)}
    for along, ahead in (("front", 1.0), ("rear", -1.0)):
        for side, right in (("left", -1.0), ("right", 1.0)):
            leg = (ahead * x > 0.0) & (right * z > 0.0)
            name = f"{along}_{side}"
            facet_sets[name] = inner[leg[inner].all(axis=1)]
            node_sets[name] = np.unique(facet_sets[name])
            tip = np.isclose(np.abs(x), x.max()) & (y == y.min())
            node_sets[f"tip_{name}"] = np.flatnonzero(leg & tip)
    return Mesh(points=points, cells=cells, node_sets=node_sets, facet_sets=facet_sets)


def part_numbers(facets: np.ndarray, count: int) -> np.ndarray:
    """Return the number of the connected part of a surface that each of `count` nodes is in."""
    links = (np.repeat(facets[:, 0], facets.shape[1] - 1), facets[:, 1:].ravel())
    _, part = connected_components(
        coo_array((np.ones(len(links[0])), links), shape=(count, count)), directed=False
    )
    return part
