"""Convex corners of walls against the facets of bodies, in the plane: how stiff they are."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from softsim.contact.wall import Wall
from softsim.mesh.bearing import nodal_extents, weights_in_line
from softsim.mesh.mesh import SURFACE
from softsim.model import Body, ContactData, CornerData

LEAST_SHARE = 0.125
"""Of a node's stiffness, that a corner has at least, however many there are."""


def corner_data(
    bodies: Sequence[Body], points: np.ndarray, walls: Sequence[Wall], contact: ContactData
) -> CornerData | None:
    """What the corners of the walls have, or None where they have none.

    A corner is as stiff, and as damped, as the softest and the lightest of the facets' nodes (of
    those at (n, d) [m]): two of them bear it, or one. Less where corners are so close that several
    press between the same two nodes: together they are as stiff, down to LEAST_SHARE.
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
        """Of the facets' nodes, of all that touch walls."""
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
    """The least distance [m] of two of the corners (c, 2); infinite for one."""
    if len(corners) < 2:
        return np.inf
    distance, _ = cKDTree(corners).query(corners, 2)
    return float(distance[:, 1].min())
