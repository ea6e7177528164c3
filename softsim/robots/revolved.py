"""Actuators that are bodies of revolution: bellows and bending tubes.

A body in space is its half section, revolved in steps. Revolved cells would be slivers close to the
axis; there the body consists of discs instead, each meshed as a square in a circle.
"""

import math
from itertools import pairwise

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.mesh import Mesh, boundary_facets, renumbered
from softsim.mesh.quality import check
from softsim.robots.block import grid_cells
from softsim.robots.limits import check_at_least_one, check_cell_count, check_positive

Chain = np.ndarray
"""Node numbers of the half section (n,) along a line on its boundary."""

STRETCH_AROUND = 1.5
"""Length of the cells around the axis over that in the half section."""

SQUARE = 0.7
"""Half of the diagonal of the square in a disc, over the radius of the disc."""


def bellows_section(
    convolutions: int = 4,
    root_radius: float = 10e-3,
    crown_radius: float = 16e-3,
    ring_spacing: float = 4e-3,
    wall_thickness: float = 1.5e-3,
    lid_thickness: float = 3.5e-3,
    element_size: float = 0.55e-3,
) -> Mesh:
    """Return the half section of a bellows (x: radius, y: axis) in quadrilaterals. Lengths in m.

    Each convolution has two flat rings from root_radius to crown_radius; half circles join them.
    The middle planes of two rings are ring_spacing apart, that of the lowest is y = 0. The lid at
    the top begins as the wall does and is thicker upwards.

    Node and facet sets: base (end face at the open end), chamber (inside), folds (all that can
    touch: outside of the wall, inside without the middle of the lid), top (of the lid).

    Raises MeshError, naming the parameter, for dimensions that make no such body.
    """
    check_at_least_one(convolutions=convolutions)
    check_positive(
        root_radius=root_radius, ring_spacing=ring_spacing, wall_thickness=wall_thickness,
        element_size=element_size,
    )  # fmt: skip
    check_above("crown_radius", crown_radius, "root_radius", root_radius)
    check_above("ring_spacing", ring_spacing, "wall_thickness", wall_thickness)
    check_above("lid_thickness", lid_thickness, "wall_thickness", wall_thickness)
    narrowest = 0.5 * (ring_spacing + wall_thickness)
    check_above("root_radius", root_radius, "half of ring_spacing and wall_thickness", narrowest)
    length = 2 * convolutions * (crown_radius - root_radius + 2.0 * ring_spacing)
    check_cell_count(length * wall_thickness / element_size**2, element_size)

    middle, normal = bellows_path(
        convolutions, root_radius, crown_radius, ring_spacing, element_size
    )
    half_lid = cells_along(root_radius / 2, element_size)  # columns between rim, half, and axis
    x = np.linspace(root_radius, 0.0, 2 * half_lid + 1)[1:]
    middle = np.concatenate([middle, np.column_stack([x, np.full(len(x), middle[-1, 1])])])
    normal = np.concatenate([normal, np.repeat(normal[-1:], len(x), axis=0)])
    offsets = wall_thickness * np.linspace(-0.5, 0.5, cells_along(wall_thickness, element_size) + 1)
    wall = middle + offsets[:, None, None] * normal  # (rows + 1, columns + 1, 2), outside first
    lid = slice(-2 * half_lid - 1, None)
    extra = lid_thickness - wall_thickness
    heights = np.linspace(extra, 0.0, cells_along(extra, element_size) + 1)[:-1]
    upper = wall[0, lid] + heights[:, None, None] * [0.0, 1.0]

    nodes = np.arange(wall.size // 2).reshape(wall.shape[:2])
    upper_nodes = nodes.size + np.arange(upper.size // 2).reshape(upper.shape[:2])
    inside = nodes[-1]
    section = section_mesh(
        np.concatenate([wall.reshape(-1, 2), upper.reshape(-1, 2)]),
        np.concatenate(
            [grid_cells(nodes), grid_cells(np.concatenate([upper_nodes, nodes[:1, lid]]))]
        ),
        {
            "base": [nodes[:, 0]],
            "chamber": [inside],
            "folds": [nodes[0, : -2 * half_lid], inside[:-half_lid]],
            "top": [upper_nodes[0]],
        },
    )
    check(section)
    return section


def bellows_path(
    convolutions: int, root: float, crown: float, spacing: float, element_size: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 2) [m] on the middle of a bellows' wall and its unit normals to the inside.

    The path starts at the inner end of the lowest ring and ends at that of the highest.
    """
    straight = cells_along(crown - root, element_size)
    quarter = cells_along(math.pi / 4 * spacing, element_size)
    angles = np.linspace(-math.pi / 2, math.pi / 2, 2 * quarter + 1)[1:-1]
    points, normals = [], []
    for ring in range(2 * convolutions):
        outwards = 1.0 if ring % 2 == 0 else -1.0
        start, end = (root, crown)[:: int(outwards)]
        r = np.linspace(start, end, straight + 1)
        points.append(np.column_stack([r, np.full(len(r), ring * spacing)]))
        normals.append(np.tile([0.0, outwards], (len(r), 1)))
        if ring < 2 * convolutions - 1:
            away = np.column_stack([outwards * np.cos(angles), np.sin(angles)])
            points.append([end, (ring + 0.5) * spacing] + 0.5 * spacing * away)
            normals.append(-outwards * away)
    return np.concatenate(points), np.concatenate(normals)


def bellows_solid(
    convolutions: int = 4,
    root_radius: float = 10e-3,
    crown_radius: float = 16e-3,
    ring_spacing: float = 4e-3,
    wall_thickness: float = 1.5e-3,
    lid_thickness: float = 3.5e-3,
    element_size: float = 1.5e-3,
) -> Mesh:
    """Return the bellows of `bellows_section` in space, in hexahedra. Its axis is y.

    Around the axis the cells are about one and a half times as long as in the section. Sets and
    errors as there; folds ends at the root radius of the lid.
    """
    section = bellows_section(
        convolutions, root_radius, crown_radius, ring_spacing, wall_thickness, lid_thickness,
        element_size,
    )  # fmt: skip
    mean = 0.5 * (root_radius + crown_radius)
    body = renumbered(revolved(section, root_radius, mean, element_size))
    check(body)
    return body


def bending_actuator(
    length: float = 60e-3,
    inner_radius: float = 8e-3,
    wall_thickness: float = 2e-3,
    plug_thickness: float = 4e-3,
    element_size: float = 2e-3,
) -> Mesh:
    """Return a tube along x, closed by a plug at its tip, in hexahedra. All lengths in m.

    The chamber extends from x = 0 to `length`. A strip on the set bottom and fibres around the tube
    make it a bending actuator. Around the axis the cells are about one and a half times as long as
    `element_size`.

    Node and facet sets: root (end face at x = 0), chamber (inside), tip (end face of the plug),
    outside (mantle), bottom (quarter of the mantle that faces -y).

    Raises MeshError, naming the parameter, for dimensions that make no such body.
    """
    check_positive(
        length=length, inner_radius=inner_radius, wall_thickness=wall_thickness,
        plug_thickness=plug_thickness, element_size=element_size,
    )  # fmt: skip
    outer = inner_radius + wall_thickness
    check_cell_count((length + plug_thickness) * outer / element_size**2, element_size)
    in_core, in_wall, along, in_plug = (
        cells_along(size, element_size)
        for size in (inner_radius, wall_thickness, length, plug_thickness)
    )
    r = np.concatenate([
        np.linspace(0.0, inner_radius, in_core + 1)[:-1],
        np.linspace(inner_radius, outer, in_wall + 1),
    ])  # fmt: skip
    y = np.concatenate([
        np.linspace(0.0, length, along + 1)[:-1],
        np.linspace(length, length + plug_thickness, in_plug + 1),
    ])  # fmt: skip
    points = np.stack(np.meshgrid(r, y), axis=-1)
    nodes = np.arange(points.size // 2).reshape(points.shape[:2])
    section = section_mesh(
        points.reshape(-1, 2),
        np.concatenate([grid_cells(nodes[:, in_core:]), grid_cells(nodes[along:, : in_core + 1])]),
        {
            "root": [nodes[0, in_core:]],
            "chamber": [np.concatenate([nodes[:along, in_core], nodes[along, in_core::-1]])],
            "tip": [nodes[-1]],
            "outside": [nodes[:, -1]],
        },
    )
    body = revolved(section, inner_radius, outer, element_size)
    body = Mesh(  # the axis of revolution becomes x
        points=body.points[:, [1, 2, 0]], cells=body.cells, node_sets=body.node_sets,
        facet_sets=body.facet_sets,
    )  # fmt: skip
    y, z = body.points[:, 1], body.points[:, 2]
    mantle = body.facet_sets["outside"]
    below = mantle[(y[mantle] <= -(1.0 - 1e-9) * np.abs(z[mantle])).all(axis=1)]
    body.facet_sets["bottom"], body.node_sets["bottom"] = below, np.unique(below)
    body = renumbered(body)
    check(body)
    return body


def cells_along(length: float, element_size: float) -> int:
    """Return the number of equal cells no longer than `element_size` [m] along a length [m]."""
    return max(1, math.ceil(length / element_size - 1e-9))


def check_above(name: str, value: float, least_name: str, least: float) -> None:
    """Raise MeshError, naming the parameter, unless a length [m] is larger than another."""
    if not (math.isfinite(value) and value > least):
        raise MeshError(
            f"{name} is {1e3 * value:.4g} mm; more than {least_name}, {1e3 * least:.4g} mm, "
            "is needed"
        )


def section_mesh(points: np.ndarray, cells: np.ndarray, sides: dict[str, list[Chain]]) -> Mesh:
    """Return a half section with node and facet sets along its sides; loose points are left out."""
    used, numbers = np.unique(cells, return_inverse=True)
    new = np.zeros(len(points), int)
    new[used] = np.arange(len(used))
    cells = numbers.reshape(cells.shape)
    chains = {name: [new[one] for one in several] for name, several in sides.items()}
    boundary = boundary_facets(cells, 2)
    return Mesh(
        points=points[used],
        cells=cells,
        node_sets={name: np.unique(np.concatenate(several)) for name, several in chains.items()},
        facet_sets={
            name: oriented(
                boundary, np.concatenate([np.column_stack([one[:-1], one[1:]]) for one in several])
            )
            for name, several in chains.items()
        },
    )


def oriented(boundary: np.ndarray, facets: np.ndarray) -> np.ndarray:
    """Return the facets (k, corners) of the boundary that have the nodes of the given facets."""
    wanted = {tuple(sorted(facet)) for facet in facets.tolist()}
    return boundary[[tuple(sorted(facet)) in wanted for facet in boundary.tolist()]]


def revolved(section: Mesh, core: float, radius: float, element_size: float) -> Mesh:
    """Return a half section (x: radius, y: axis) revolved about y, with its sets.

    core: radius [m] of the discs that replace the cells of the section beside its nodes on the
    axis. Each disc takes the sets of its node there. radius [m]: where cells have the length around
    the axis that `element_size` [m] gives.
    """
    quarter = cells_along(0.5 * math.pi * radius, STRETCH_AROUND * element_size)
    count = 4 * quarter
    r, y = section.points.T
    check_cell_count(len(r) * count, element_size)
    tiny = 1e-9 * r.max()
    on_axis = np.flatnonzero(r <= tiny)
    on_axis = on_axis[np.argsort(y[on_axis])]
    in_core = (r < core - tiny) & (y >= y[on_axis[0]] - tiny)
    wall = section.cells[~in_core[section.cells].any(axis=1)]
    rims = np.flatnonzero(np.abs(r - core) <= tiny)
    levels = rims[[np.argmin(np.abs(y[rims] - y[axis])) for axis in on_axis]]

    revolve = np.union1d(wall, levels)
    station = np.full((count, len(r)), -1)
    station[:, revolve] = np.arange(count * len(revolve)).reshape(count, -1)
    angles = math.pi / 4 + 2.0 * math.pi * np.arange(count) / count
    around = np.stack([np.cos(angles), np.sin(angles)], axis=-1)  # (count, 2): x, z
    flat, disc_cells = disc(around, cells_along((1.0 - SQUARE) * core, element_size))
    inner = np.arange(len(flat) - count)  # the nodes of a disc that are not on its rim
    first = count * len(revolve) + len(inner) * np.arange(len(levels))
    discs = [
        np.concatenate([station[:, rim], start + inner])[disc_cells]
        for rim, start in zip(levels, first, strict=True)
    ]
    xz = np.concatenate([
        (around[:, None] * r[revolve, None]).reshape(-1, 2),
        np.tile(core * flat[count:], (len(levels), 1)),
    ])  # fmt: skip
    height = np.concatenate([np.tile(y[revolve], count), np.repeat(y[levels], len(inner))])
    following = np.roll(station, -1, axis=0)
    cells = np.concatenate([
        np.concatenate([station[:, wall], following[:, wall]], axis=-1).reshape(-1, 8),
        *(np.hstack([above, below]) for below, above in pairwise(discs)),
    ])  # fmt: skip

    boundary = boundary_facets(cells, 3)
    node_sets, facet_sets = {}, {}
    for name, edges in section.facet_sets.items():
        swept = edges[~in_core[edges].any(axis=1)]
        quads = np.concatenate([station[:, swept], following[:, swept[:, ::-1]]], axis=-1)
        covered = np.isin(on_axis, edges)
        faces = [quads.reshape(-1, 4), *(discs[k] for k in np.flatnonzero(covered))]
        facet_sets[name] = oriented(boundary, np.concatenate(faces))
        node_sets[name] = np.unique(facet_sets[name])
    return Mesh(
        points=np.column_stack([xz[:, 0], height, xz[:, 1]]),
        cells=cells,
        node_sets=node_sets,
        facet_sets=facet_sets,
    )


def disc(rim: np.ndarray, rings: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes (n, 2) and quadrilaterals (m, 4) of a unit disc: a square in a circle.

    rim: nodes (4 k, 2) on the circle, the first at 45 degrees; they are the first of the nodes.
    rings: of cells between circle and square.
    """
    count, quarter = len(rim), len(rim) // 4
    side = SQUARE * math.sqrt(0.5) * np.linspace(-1.0, 1.0, quarter + 1)
    grid = np.stack(np.meshgrid(side, side), axis=-1)
    top, left, bottom, right = grid[-1, :0:-1], grid[:0:-1, 0], grid[0, :-1], grid[:-1, -1]
    square = np.concatenate([top, left, bottom, right])
    inwards = np.linspace(0.0, 1.0, rings + 1)[:, None, None]
    points = ((1.0 - inwards) * rim + inwards * square).reshape(-1, 2)
    ring = np.arange(len(points)).reshape(rings + 1, count)
    closed = np.hstack([ring, ring[:, :1]])
    node = len(points) + np.arange(-(quarter + 1), (quarter + 1) * quarter).reshape(grid.shape[:2])
    node[1:-1, 1:-1] = len(points) + np.arange((quarter - 1) ** 2).reshape(quarter - 1, -1)
    node[-1, :0:-1], node[:0:-1, 0], node[0, :-1], node[:-1, -1] = ring[-1].reshape(4, quarter)
    cells = np.concatenate([grid_cells(closed), grid_cells(node)])
    return np.concatenate([points, grid[1:-1, 1:-1].reshape(-1, 2)]), cells
