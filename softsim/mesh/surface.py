"""Closed surfaces: triangles from STL files, and refinement of facets."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from softsim.errors import MeshError
from softsim.mesh.content import meshio_mesh

# -------------------------------------------------------------------------------------------------
# Band of cells between two lines of points.

CellKind = Literal["simplex", "quad"]
"""Kinds of cells: triangles and tetrahedra, or quadrilaterals and hexahedra."""

Band = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def triangle_band(points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return triangles (m, 3), counter-clockwise, that fill the band between two lines of nodes.

    points: (n, 2). lower, upper: node numbers along each line, both in the direction that has the
    upper line to the left. The lines may differ in their number of nodes; a line of one node closes
    the band to a fan. Each step along the band takes the shorter of the two diagonals.
    """
    cells = []
    i = j = 0
    while i < len(lower) - 1 or j < len(upper) - 1:
        along_lower = _reach(points, lower, i + 1, upper[j])
        along_upper = _reach(points, upper, j + 1, lower[i])
        # The slack lets equal diagonals fall the same way whatever the rounding.
        if along_lower <= along_upper * (1 + 1e-9):
            cells.append([lower[i], lower[i + 1], upper[j]])
            i += 1
        else:
            cells.append([lower[i], upper[j + 1], upper[j]])
            j += 1
    return np.array(cells, dtype=np.int64).reshape(-1, 3)


def quadrilateral_band(points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return quadrilaterals (m, 4) that fill the band between two lines of nodes.

    Where a line has more nodes than the other, the cells at its end are triangles. See
    `triangle_band`.
    """
    count = min(len(lower), len(upper))
    quadrilaterals = np.column_stack(
        [lower[: count - 1], lower[1:count], upper[1:count], upper[: count - 1]]
    )
    rest = triangle_band(points, lower[count - 1 :], upper[count - 1 :])
    return np.concatenate([quadrilaterals, rest[:, [0, 1, 2, 2]]])


BANDS: dict[CellKind, Band] = {"simplex": triangle_band, "quad": quadrilateral_band}


def stacked_bands(points: np.ndarray, lines: list[np.ndarray], band: Band) -> np.ndarray:
    """Return the cells (m, corners) of the bands between each line of nodes and the next one."""
    return np.concatenate([band(points, lower, upper) for lower, upper in pairwise(lines)])


def _reach(points: np.ndarray, line: np.ndarray, position: int, node: int) -> float:
    """Return the distance from `node` to that at `position` on `line`; infinite beyond its end."""
    if position >= len(line):
        return np.inf
    return float(np.linalg.norm(points[line[position]] - points[node]))


# -------------------------------------------------------------------------------------------------
# Sizes and sharp edges of facets, and an upper bound of the load on their corners.
#
# A node on a facet loads its corners with its barycentric weights. A corner's weight falls to zero
# over its reach, h; nodes at distances s apart on a line load it with at most
#
#     1 + 2 sum_j max(0, 1 - j s/h),
#
# with one of them on the corner, and in space with the square of that. This is one if s = h.


def weights_in_line(ratio: np.ndarray) -> np.ndarray:
    """Return an upper bound of the sum of weights that loads a corner along a line.

    ratio: reach of the corner over the distance of the nodes.
    """
    whole = np.floor(ratio)
    return 1.0 + 2.0 * whole - whole * (whole + 1.0) / np.maximum(ratio, 1e-300)


def nodal_extents(x: np.ndarray, facets: np.ndarray) -> np.ndarray:
    """Return the length (n,) [m] of the facets (f, d) that belongs to each node.

    In space it is the square root of the node's area; it is zero for other nodes.
    """
    d = x.shape[1]
    edges = x[facets[:, 1:]] - x[facets[:, :1]]
    squared = np.linalg.det(edges @ edges.transpose(0, 2, 1))
    share = np.sqrt(squared) / (2.0 if d == 2 else 6.0)
    own = np.bincount(facets.ravel(), np.repeat(share, d), minlength=len(x))
    return own ** (1.0 / (d - 1))


def side_lengths(x: np.ndarray, facets: np.ndarray) -> np.ndarray:
    """Return the distance (f, c) [m] of each corner of facets (f, c) from the one before it.

    x (n, d) [m]: positions of all nodes.
    """
    return np.linalg.norm(x[facets] - x[np.roll(facets, 1, axis=1)], axis=2)


def area_vectors(x: np.ndarray, facets: np.ndarray) -> np.ndarray:
    """Return the outward normals (f, d) of facets (f, d), whose lengths are the facets' sizes.

    Sizes are lengths of edges [m] or areas of triangles [m^2]. x (n, d) [m]: positions of all
    nodes.
    """
    sides = x[facets[:, 1:]] - x[facets[:, :1]]
    if x.shape[1] == 2:
        return np.stack([sides[:, 0, 1], -sides[:, 0, 0]], axis=1)
    return 0.5 * np.cross(sides[:, 0], sides[:, 1])


def sharp_edges(x: np.ndarray, facets: np.ndarray, angle: float) -> np.ndarray:
    """Return the convex edges (e, 2) between triangles (f, 3) whose normals differ by over `angle`.

    angle [rad]. x (n, 3) [m]: positions of the nodes.
    """
    sides = np.stack([facets, np.roll(facets, -1, axis=1)], axis=2).reshape(-1, 2)
    owner = np.repeat(np.arange(len(facets)), 3)
    order = np.lexsort((sides.max(axis=1), sides.min(axis=1)))
    ends = np.sort(sides, axis=1)[order]
    first = np.flatnonzero((ends[1:] == ends[:-1]).all(axis=1))
    one, other = owner[order][first], owner[order][first + 1]
    normals = area_vectors(x, facets)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    is_sharp = (normals[one] * normals[other]).sum(axis=1) < np.cos(angle)
    arm = x[facets[other]].mean(axis=1) - x[facets[one]].mean(axis=1)
    is_convex = (arm * normals[one]).sum(axis=1) < 0.0
    return ends[first][is_sharp & is_convex]


# -------------------------------------------------------------------------------------------------
# Closest points of a surface of facets to given points.

# Newton's steps to the foot on a bilinear facet; three do where it is nearly plane.
MOST_STEPS = 20


def closest_on_facets(
    places: np.ndarray, points: np.ndarray, facets: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the facet (k,) closest to each point (k, d) [m], and weights at its closest point.

    The weights are the shape functions (k, corners) of the facet's corners. points (n, d) [m];
    facets (f, corners): edges, triangles or bilinear quadrilaterals, of which a triangle has its
    last corner twice. Of facets that are equally close the first counts.
    """
    corners = points[facets]
    centres = corners.mean(axis=1)
    size = np.linalg.norm(corners - centres[:, None], axis=2).max()
    # No corner is closer than the closest facet, whose centre is not farther than its size beyond.
    used = points[np.unique(facets)]
    nearest, _ = cKDTree(used).query(places)
    near = cKDTree(centres).query_ball_point(places, nearest + size * (1.0 + 1e-9))
    place = np.repeat(np.arange(len(places)), [len(members) for members in near])
    facet = np.concatenate([np.sort(members) for members in near]).astype(int)
    weights = closest_weights(places[place], corners[facet])
    distance = np.linalg.norm(at(weights, corners[facet]) - places[place], axis=1)
    # By place, then by distance, to round-off of the model's size; then by the facet's number.
    rounded = np.round(distance / (1e-12 * np.ptp(used, axis=0).max()))
    order = np.lexsort((facet, rounded, place))
    first = order[np.searchsorted(place[order], np.arange(len(places)))]
    return facet[first], weights[first]


def at(weights: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the points (k, d) with these weights (k, c) of corners (k, c, d)."""
    return np.einsum("kc,kcd->kd", weights, corners)


def closest_weights(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the shape functions (k, c) at the point of each facet closest to a point (k, d).

    Facets have corners (k, c, d). The closest point is the foot of the perpendicular where that
    lies on the facet, else a point of a side.
    """
    count = corners.shape[1]
    if count == 2:
        return _along(places, corners)
    weights = _triangle_feet(places, corners[:, :3])
    if count == 4:
        weights = np.pad(weights, ((0, 0), (0, 1)))
        whole = np.flatnonzero((corners[:, 2] != corners[:, 3]).any(axis=1))
        weights[whole] = _quadrilateral_feet(places[whole], corners[whole])
    beside = np.flatnonzero(~(weights >= -1e-12).all(axis=1))
    weights[beside] = _on_sides(places[beside], corners[beside])
    return np.maximum(weights, 0.0)


def _along(places: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return the weights (k, 2) of the closest point of an edge (k, 2, d)."""
    way = ends[:, 1] - ends[:, 0]
    square = (way**2).sum(axis=1)
    along = ((places - ends[:, 0]) * way).sum(axis=1)
    share = np.clip(np.divide(along, square, out=np.zeros_like(along), where=square > 0.0), 0, 1)
    return np.stack([1.0 - share, share], axis=1)


def _on_sides(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the weights (k, c) of the closest point of the sides of a facet (k, c, d)."""
    count = corners.shape[1]
    found, best = np.zeros(corners.shape[:2]), np.full(len(places), np.inf)
    for first in range(count):
        second = (first + 1) % count
        shares = _along(places, corners[:, [first, second]])
        distance = np.linalg.norm(at(shares, corners[:, [first, second]]) - places, axis=1)
        closer = distance < best
        best[closer] = distance[closer]
        found[closer] = 0.0
        found[closer, first], found[closer, second] = shares[closer].T
    return found


def _triangle_feet(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return barycentric weights (k, 3) of the foot on the plane of a triangle (k, 3, 3)."""
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal, apart = np.cross(e, f), places - corners[:, 0]
    square = (normal**2).sum(axis=1)
    second = (np.cross(apart, f) * normal).sum(axis=1) / square
    third = (np.cross(e, apart) * normal).sum(axis=1) / square
    return np.stack([1.0 - second - third, second, third], axis=1)


def _quadrilateral_feet(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return bilinear weights (k, 4) of the foot on a quadrilateral (k, 4, 3).

    They are found by the Gauss-Newton method; some are negative, or not a number, where the foot
    lies beside the facet.
    """
    local = np.full((len(places), 2), 0.5)
    for _ in range(MOST_STEPS):
        a, b = local.T
        weights, slopes = _bilinear(a, b)
        apart = places - at(weights, corners)
        along = np.einsum("kcp,kcd->kpd", slopes, corners)
        square = np.einsum("kpd,kqd->kpq", along, along)
        step = np.linalg.solve(square, np.einsum("kpd,kd->kp", along, apart)[:, :, None])[:, :, 0]
        # What is far beside the facet need not go on: its closest point is on a side.
        local = np.clip(local + step, -2.0, 3.0)
    return _bilinear(*local.T)[0]


def _bilinear(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return shape functions (k, 4) at (a, b) of the unit square, and derivatives (k, 4, 2)."""
    weights = np.stack([(1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b], axis=1)
    by_a = np.stack([b - 1, 1 - b, b, -b], axis=1)
    by_b = np.stack([a - 1, -a, a, 1 - a], axis=1)
    return weights, np.stack([by_a, by_b], axis=2)


log = logging.getLogger(__name__)

MOST_FACETS = 200_000
"""Largest number of facets into which a surface is divided."""

FLAT = 1e-5
"""Height of a triangle over its longest side below which its normal is round-off."""


@dataclass(frozen=True, eq=False)
class SurfaceMesh:
    """Closed surface of triangles (m, 3) with points (n, 3) [m].

    Normals are outwards by the right-hand rule.
    """

    points: np.ndarray
    triangles: np.ndarray


def read_surface(path: Path, length_unit: float) -> SurfaceMesh:
    """Return the closed surface in an STL file, binary or ASCII.

    length_unit: metres in one unit of the file. Corners with exactly the same coordinates are one
    point. A triangle two of whose corners are one point is left out, and a warning logged. A
    surface that is inside out as a whole is turned.

    Raises MeshError, naming the file, if it is no STL or damaged, has no triangles, is open (an
    edge has not exactly two triangles), or has triangles of two orientations at an edge.
    """
    path = Path(path)
    if path.suffix.lower() != ".stl":
        raise MeshError(f"{path}: not an STL file", hint="write the surface to a file NAME.stl")
    found = meshio_mesh(path, "a surface must be an STL file, binary or ASCII")
    points = np.asarray(found.points, dtype=float).reshape(-1, 3)
    if not np.isfinite(points).all():
        raise MeshError(f"{path}: a coordinate is not a number", hint="the file is damaged")
    triangles = np.concatenate([np.zeros((0, 3), dtype=int), *(b.data for b in found.cells)])
    collapsed = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
    if collapsed.any():
        log.warning("%s: ignored %d triangles without area", path, collapsed.sum())
        triangles = triangles[~collapsed]
    if not len(triangles):
        raise MeshError(f"{path}: no triangles", hint="the file is empty or damaged")
    refuse_open(path, points, triangles)
    if signed_volume(points, triangles) < 0.0:
        triangles = triangles[:, ::-1]
    return SurfaceMesh(length_unit * points, triangles)


def signed_volume(points: np.ndarray, triangles: np.ndarray) -> float:
    """Return the enclosed volume, a sixth of the sum of a . (b x c).

    It is positive if the normals are outwards.
    """
    a, b, c = np.moveaxis(points[triangles] - points.mean(axis=0), 1, 0)
    return float((a * np.cross(b, c)).sum() / 6.0)


def refuse_open(path: Path, points: np.ndarray, triangles: np.ndarray) -> None:
    """Raise MeshError unless each edge has two triangles that pass it in opposite directions."""
    directed = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    edges, counts = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    open_edges = np.flatnonzero(counts != 2)
    if len(open_edges):
        first = open_edges[0]
        raise MeshError(
            f"{path}: the surface is open: {len(open_edges)} edges do not have exactly two "
            f"triangles; the first one, {_edge(points, edges[first])}, has {counts[first]}",
            hint="close the holes, merge corners that do not coincide exactly, and unite solids "
            "that cross",
        )
    ways, counts = np.unique(directed, axis=0, return_counts=True)
    twice = np.flatnonzero(counts == 2)
    if len(twice):
        raise MeshError(
            f"{path}: triangles with opposite orientation at {len(twice)} edges; the first one is "
            f"{_edge(points, ways[twice[0]])}",
            hint="orient all triangles in the same way, with normals outwards",
        )


def refuse_flat(points: np.ndarray, triangles: np.ndarray) -> None:
    """Raise MeshError for a triangle whose corners lie on a line: it has no normal."""
    corners = points[triangles]
    sides = np.roll(corners, -1, axis=1) - corners
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    flat = np.flatnonzero(area <= FLAT * (sides**2).sum(axis=2).max(axis=1))
    if len(flat):
        place = ", ".join(f"{1e3 * c:.6g}" for c in corners[flat[0]].mean(axis=0))
        raise MeshError(
            f"{len(flat)} triangles are flat: their corners lie on a line; the first one is at "
            f"({place}) mm",
            hint="mesh the surface again, or merge points that nearly coincide",
        )


def divided(
    points: np.ndarray, facets: np.ndarray, longest: float
) -> tuple[np.ndarray, np.ndarray]:
    """Divide the facets of a surface until no side is longer than `longest` [m].

    Points (n, d) [m] keep their numbers, new ones follow; facets (f, d) keep their orientation. Of
    triangles, sides are halved that are the longest ones of all triangles at them, so that no point
    lies on the side of another triangle, and angles stay near those of the surface (Rivara,
    Int. J. Numer. Methods Eng. 20 (1984) 745).

    Raises MeshError beyond MOST_FACETS.
    """
    while True:
        corners = facets.shape[1]
        ends = np.stack([facets, np.roll(facets, -1, axis=1)], axis=2)[
            :, : corners * (corners - 1) // 2
        ]
        sides, number = np.unique(np.sort(ends, axis=2).reshape(-1, 2), axis=0, return_inverse=True)
        number = number.reshape(ends.shape[:2])
        length = np.linalg.norm(points[sides[:, 1]] - points[sides[:, 0]], axis=1)
        if not (length > longest * (1.0 + 1e-9)).any():
            return points, facets
        # Sides of one length, such as diagonals of a grid, in an order of their own: with that of
        # their numbers, whole rows of triangles would wait for each other.
        rank = np.empty(len(sides), dtype=int)
        shuffled = np.random.default_rng(0).permutation(len(sides))
        rank[np.lexsort((shuffled, np.round(length / longest, 9)))] = np.arange(len(sides))
        of_facet = np.argmax(rank[number], axis=1)
        chosen = number[np.arange(len(facets)), of_facet]
        wanted = np.bincount(chosen, minlength=len(sides)) == np.bincount(number.ravel())
        wanted &= length > longest * (1.0 + 1e-9)
        middle = np.full(len(sides), -1)
        middle[wanted] = len(points) + np.arange(wanted.sum())
        points = np.concatenate([points, points[sides[wanted]].mean(axis=1)])
        split = np.flatnonzero(middle[chosen] >= 0)
        first, second = facets[split].copy(), facets[split].copy()
        rows, column = np.arange(len(split)), of_facet[split]
        first[rows, (column + 1) % corners] = middle[chosen[split]]
        second[rows, column] = middle[chosen[split]]
        facets = np.concatenate([np.delete(facets, split, axis=0), first, second])
        if len(facets) > MOST_FACETS:
            raise MeshError(
                f"divided into sides of at most {1e3 * longest:.3g} mm, the surface has more than "
                f"{MOST_FACETS:,} facets: its size is "
                f"{1e3 * np.ptp(points, axis=0).max():.3g} mm",
                hint="check length_unit, or give a larger element_size",
            )


def depth_in_surface(places: np.ndarray, points: np.ndarray, facets: np.ndarray) -> np.ndarray:
    """Return the depth (k,) [m] of points (k, d) inside a closed surface, 0 outside.

    points (n, d) [m]; facets (f, d): edges or triangles, their normals outwards.
    """
    depth = np.zeros(len(places))
    low, high = points[facets].min(axis=(0, 1)), points[facets].max(axis=(0, 1))
    near = np.flatnonzero(((places >= low) & (places <= high)).all(axis=1))
    inside = near[[winding(place, points[facets]) > 0.5 for place in places[near]]]
    if len(inside):
        facet, weights = closest_on_facets(places[inside], points, facets)
        depth[inside] = np.linalg.norm(at(weights, points[facets[facet]]) - places[inside], axis=1)
    return depth


def winding(place: np.ndarray, corners: np.ndarray) -> float:
    """Return the winding number of facets (f, d, d) about a point.

    It is 1 inside a closed surface, 0 outside. In space it is the sum of the facets' solid angles
    over 4 pi (Van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125).
    """
    arms = corners - place
    if arms.shape[2] == 2:
        (ax, ay), (bx, by) = arms[:, 0].T, arms[:, 1].T
        return float(np.arctan2(ax * by - ay * bx, ax * bx + ay * by).sum() / (2.0 * np.pi))
    a, b, c = np.moveaxis(arms, 1, 0)
    la, lb, lc = (np.linalg.norm(arm, axis=1) for arm in (a, b, c))
    volume = (a * np.cross(b, c)).sum(axis=1)
    cosine = la * lb * lc + la * (b * c).sum(axis=1)
    cosine += lb * (c * a).sum(axis=1) + lc * (a * b).sum(axis=1)
    return float(np.arctan2(volume, cosine).sum() / (2.0 * np.pi))


def in_order(edges: np.ndarray) -> np.ndarray:
    """Return edges (k, 2) sorted so that each begins where the one before it ends, chain by chain.

    Open chains come first.
    """
    leaving: dict[int, list[int]] = {}
    for k, (begin, _) in enumerate(edges.tolist()):
        leaving.setdefault(begin, []).append(k)
    starts = np.flatnonzero(~np.isin(edges[:, 0], edges[:, 1]))
    order: list[int] = []
    for start in [*edges[starts, 0].tolist(), *edges[:, 0].tolist()]:
        while leaving.get(start):
            order.append(leaving[start].pop())
            start = int(edges[order[-1], 1])
    return edges[order]


def _edge(points: np.ndarray, edge: np.ndarray) -> str:
    """Return an edge as text, in the file's unit."""
    ends = ["(" + ", ".join(f"{c:g}" for c in points[k]) + ")" for k in edge]
    return f"from {ends[0]} to {ends[1]} in the unit of the file"
