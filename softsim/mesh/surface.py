"""Closed surfaces: triangles from STL files, and refinement of facets."""

import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.closest import at, closest_on_facets
from softsim.mesh.file_reading import meshio_mesh

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
