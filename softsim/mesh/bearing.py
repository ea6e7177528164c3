"""Sizes and sharp edges of facets, and an upper bound of the load on their corners.

A node on a facet loads its corners with its barycentric weights. A corner's weight falls to zero
over its reach, h; nodes at distances s apart on a line load it with at most

    1 + 2 sum_j max(0, 1 - j s/h),

with one of them on the corner, and in space with the square of that. This is one if s = h.
"""

import numpy as np


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
