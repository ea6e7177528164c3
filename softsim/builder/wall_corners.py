"""Contact data of convex wall corners against the facets of bodies, in the plane."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from softsim.contact.wall import Wall
from softsim.mesh.bearing import nodal_extents, weights_in_line
from softsim.mesh.mesh import SURFACE
from softsim.model import Body, ContactData, CornerData

LEAST_SHARE = 0.125
"""Least stiffness of a corner relative to that of a node, however many corners there are."""


def corner_data(
    bodies: Sequence[Body], points: np.ndarray, walls: Sequence[Wall], contact: ContactData
) -> CornerData | None:
    """Return the contact data of the corners of the walls, or None if they have none.

    A corner has the stiffness and damping of the softest and the lightest of the facets' nodes (of
    those at (n, d) [m]), since one or two of them bear it. The values are lower where corners are
    so close that several press between the same two nodes: together they are as stiff as one, down
    to LEAST_SHARE.
    """
    nearest = [distance_between(wall.corners()) for wall in walls if len(wall.corners())]
    if not nearest:
        return None
    facets = np.concatenate([body.facet_sets[SURFACE] for body in bodies])
    size = np.linalg.norm(points[facets[:, 0]] - points[facets[:, 1]], axis=1)
    widest = float(nodal_extents(points, facets).max())
    together = float(weights_in_line(np.array(widest / min(nearest))))
    share = max(1.0 / together, LEAST_SHARE)
    bears = np.isin(contact.nodes, facets)

    def least(constants: np.ndarray) -> float:
        """Return the smallest constant of those nodes of the facets that may touch walls."""
        return float(constants[bears].min())

    return CornerData(
        facets=facets,
        facet_size=size,
        penalty_stiffness=share * least(contact.penalty_stiffness),
        tangential_stiffness=share * least(contact.tangential_stiffness),
        damping=np.sqrt(share) * least(contact.damping),
        tangential_damping=np.sqrt(share) * least(contact.tangential_damping),
        together=together,
    )


def distance_between(corners: np.ndarray) -> float:
    """Return the least distance [m] between two of the corners (c, 2); infinite for one."""
    if len(corners) < 2:
        return np.inf
    distance, _ = cKDTree(corners).query(corners, 2)
    return float(distance[:, 1].min())
