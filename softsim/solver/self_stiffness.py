"""What self-contact adds to the stiffness at most: as if every node that may touch did.

A node against a facet feels k b b^T with b = (1, -w_c) along one direction, the weights w_c of the
facet's corners adding up to 1. As (sum_j b_j u_j)^2 <= (sum_j |b_j|) (sum_j |b_j| u_j^2), that is at
most 2 k at the node and 2 k w_c at the corners. (Two nodes that press each other from both sides
attain it.) Left out: what friction's turning of the facet adds, some gap over its length.

A corner bears the sum of w_c over all nodes on its facets. The weight falls to zero over its reach,
h; of nodes that lie s apart on a line no more than
    1 + 2 sum_j max(0, 1 - j s/h)
is borne, with one of them on the corner, and in space the square of that. One if s = h.
"""

import numpy as np

from softsim.model import ContactData, SelfContactData


def self_stiffness(data: SelfContactData, x: np.ndarray, dt: float) -> np.ndarray:
    """Stiffness (k,) [N/m] of each node of the surfaces, all nodes at x (n, d), at the step dt."""
    k = surface_stiffness(data.contact, dt)
    extent = nodal_extents(x, data.facets)[data.contact.nodes]
    return 2.0 * (k + k.max() * borne(extent / extent.min()) ** (x.shape[1] - 1))


def surface_stiffness(contact: ContactData, dt: float) -> np.ndarray:
    """Largest stiffness (k,) [N/m] of each node against one surface."""
    normal = contact.penalty_stiffness + 2.0 * contact.damping / dt
    return np.maximum(normal, contact.tangential_stiffness)


def borne(ratio: np.ndarray) -> np.ndarray:
    """1 + 2 sum_j max(0, 1 - j / ratio) of h/s (k,), at least 1."""
    whole = np.floor(ratio)
    return 1.0 + 2.0 * whole - whole * (whole + 1.0) / ratio


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
