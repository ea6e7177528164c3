"""Sizes and sharp edges of facets, and an upper bound of what their corners carry.

A node on a facet is carried by its corners with its barycentric weights. A corner's weight falls to
zero over its reach, h; of nodes that lie s apart on a line it carries no more than
    1 + 2 sum_j max(0, 1 - j s/h),
with one of them on the corner, and in space the square of that. One if s = h.
"""

import numpy as np


def weights_in_line(ratio: np.ndarray) -> np.ndarray:
    """Upper bound of the sum of weights that a corner carries along a line, of its reach over the
    distance of what lies there.
    """
    whole = np.floor(ratio)
    return 1.0 + 2.0 * whole - whole * (whole + 1.0) / np.maximum(ratio, 1e-300)


def nodal_extents(x: np.ndarray, facets: np.ndarray) -> np.ndarray:
    """Length (n,) [m] of the facets (f, d) that belongs to each node, in space the root of its
    area; zero of others.
    """
    d = x.shape[1]
    edges = x[facets[:, 1:]] - x[facets[:, :1]]
    squared = np.linalg.det(edges @ edges.transpose(0, 2, 1))
    share = np.sqrt(squared) / (2.0 if d == 2 else 6.0)
    own = np.bincount(facets.ravel(), np.repeat(share, d), minlength=len(x))
    return own ** (1.0 / (d - 1))


def side_lengths(x: np.ndarray, facets: np.ndarray) -> np.ndarray:
    """Return the distance (f, c) [m] of each corner of facets (f, c) from the one before it, all
    nodes at x (n, d) [m].
    """
    return np.linalg.norm(x[facets] - x[np.roll(facets, 1, axis=1)], axis=2)


def area_vectors(x: np.ndarray, facets: np.ndarray) -> np.ndarray:
    """Normals (f, d) out of the material, as long as the length [m] of the edges or the area [m^2]
    of the triangles (f, d), all nodes at x (n, d) [m].
    """
    sides = x[facets[:, 1:]] - x[facets[:, :1]]
    if x.shape[1] == 2:
        return np.stack([sides[:, 0, 1], -sides[:, 0, 0]], axis=1)
    return 0.5 * np.cross(sides[:, 0], sides[:, 1])


def sharp_edges(x: np.ndarray, facets: np.ndarray, angle: float) -> np.ndarray:
    """Return the convex edges (e, 2) between triangles (f, 3) whose normals differ by more than
    `angle` [rad], nodes at x (n, 3) [m].
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
