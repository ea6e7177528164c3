"""Closed surfaces of triangles from STL files."""

import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.file_reading import meshio_mesh

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class SurfaceMesh:
    """points (n, 3) [m]; triangles (m, 3), their normals outwards by the right-hand rule."""

    points: np.ndarray
    triangles: np.ndarray


def read_surface(path: Path, length_unit: float) -> SurfaceMesh:
    """The closed surface in an STL file, binary or ASCII.

    length_unit: metres in one unit of the file. Corners with the very same coordinates are one
    point. A triangle two of whose corners are one point is left out, and a warning logged. A
    surface that is inside out as a whole is turned.

    Raises MeshError, naming the file, if it is no STL or damaged, has no triangles, is open (an
    edge has not exactly two triangles), or has triangles of two orientations at an edge.
    """
    path = Path(path)
    if path.suffix.lower() != ".stl":
        raise MeshError(f"{path}: no STL file", hint="write the surface to a file NAME.stl")
    found = meshio_mesh(path, "a surface is an STL file, binary or ASCII")
    points = np.asarray(found.points, dtype=float).reshape(-1, 3)
    if not np.isfinite(points).all():
        raise MeshError(f"{path}: a corner is no number", hint="the file is damaged")
    triangles = np.concatenate([np.zeros((0, 3), dtype=int), *(b.data for b in found.cells)])
    collapsed = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
    if collapsed.any():
        log.warning("%s: left out %d triangles without area", path, collapsed.sum())
        triangles = triangles[~collapsed]
    if not len(triangles):
        raise MeshError(f"{path}: no triangles", hint="the file is empty or damaged")
    refuse_open(path, points, triangles)
    if signed_volume(points, triangles) < 0.0:
        triangles = triangles[:, ::-1]
    return SurfaceMesh(length_unit * points, triangles)


def signed_volume(points: np.ndarray, triangles: np.ndarray) -> float:
    """Enclosed volume, a sixth of the sum of a . (b x c); positive if the normals are outwards."""
    a, b, c = np.moveaxis(points[triangles] - points.mean(axis=0), 1, 0)
    return float((a * np.cross(b, c)).sum() / 6.0)


def refuse_open(path: Path, points: np.ndarray, triangles: np.ndarray) -> None:
    """Each edge has two triangles, which pass it in opposite directions."""
    directed = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    edges, counts = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    open_edges = np.flatnonzero(counts != 2)
    if len(open_edges):
        first = open_edges[0]
        raise MeshError(
            f"{path}: the surface is open: {len(open_edges)} edges have not exactly two triangles; "
            f"the first one, {_edge(points, edges[first])}, has {counts[first]}",
            hint="close the holes, join corners that do not meet exactly, and make one solid of "
            "what crosses",
        )
    ways, counts = np.unique(directed, axis=0, return_counts=True)
    twice = np.flatnonzero(counts == 2)
    if len(twice):
        raise MeshError(
            f"{path}: triangles of two orientations at {len(twice)} edges; the first one is "
            f"{_edge(points, ways[twice[0]])}",
            hint="orient all triangles alike, with their normals outwards",
        )


def _edge(points: np.ndarray, edge: np.ndarray) -> str:
    """An edge as people read it, in the file's unit."""
    ends = ["(" + ", ".join(f"{c:g}" for c in points[k]) + ")" for k in edge]
    return f"from {ends[0]} to {ends[1]} in the file's unit"
