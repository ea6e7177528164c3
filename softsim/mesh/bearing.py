"""Upper bound of the nodes of a surface that a corner of a facet carries in self-contact.

A node on a facet is carried by its corners with its barycentric weights. A corner's weight falls to
zero over its reach, h; of nodes that lie s apart on a line it carries no more than
    1 + 2 sum_j max(0, 1 - j s/h),
with one of them on the corner, and in space the square of that. One if s = h.
"""

import numpy as np


def nodes_per_facet_bound(x: np.ndarray, facets: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Upper bound (k,) of the sum of weights that each of `nodes` (k,), the corners of the facets
    (f, d), carries where the nodes are densest, all nodes at x (n, d).
    """
    extent = nodal_extents(x, facets)[nodes]
    return weights_in_line(extent / extent.min()) ** (x.shape[1] - 1)


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
