"""What self-contact adds to the stiffness at most: as if every node that may touch did.

A node against a facet feels k b b^T with b = (1, -w_c) along one direction, the weights w_c of the
facet's corners adding up to 1. As (sum_j b_j u_j)^2 <= (sum_j |b_j|) (sum_j |b_j| u_j^2), that is
at most 2 k at the node and 2 k w_c at the corners. (Two nodes that press each other from both sides
attain it.) Left out: what friction's turning of the facet adds, some gap over its length.

A corner bears the sum of w_c over all nodes on its facets (mesh/bearing.py).
"""

import numpy as np

from softsim.mesh.bearing import nodes_borne
from softsim.model import ContactData, SelfContactData


def self_stiffness(data: SelfContactData, x: np.ndarray, dt: float) -> np.ndarray:
    """Stiffness (k,) [N/m] of each node of the surfaces, all nodes at x (n, d), at the step dt."""
    k = surface_stiffness(data.contact, dt)
    return 2.0 * (k + k.max() * nodes_borne(x, data.facets, data.contact.nodes))


def surface_stiffness(contact: ContactData, dt: float) -> np.ndarray:
    """Largest stiffness (k,) [N/m] of each node against one surface."""
    return np.maximum(*stiffness_with_dashpots(contact, dt))


def stiffness_with_dashpots(contact: ContactData, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """k_n + 2 c_n / dt and k_t + 2 c_t / dt (k,) [N/m] of each node, see stability/time_step.py."""
    return (
        contact.penalty_stiffness + 2.0 * contact.damping / dt,
        contact.tangential_stiffness + 2.0 * contact.tangential_damping / dt,
    )
