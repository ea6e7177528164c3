"""Sizes of facets, and an upper bound of what a corner of a facet carries of places on it.

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


def area_vectors(x: np.ndarray, facets: np.ndarray) -> np.ndarray:
    """Normals (f, d) out of the material, as long as the length [m] of the edges or the area [m^2]
    of the triangles (f, d), all nodes at x (n, d) [m].
    """
    sides = x[facets[:, 1:]] - x[facets[:, :1]]
    if x.shape[1] == 2:
        return np.stack([sides[:, 0, 1], -sides[:, 0, 0]], axis=1)
    return 0.5 * np.cross(sides[:, 0], sides[:, 1])
