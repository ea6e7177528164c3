"""Inertia of a rigid body, shared out between the nodes tied to it and its own contacts.

For the stable step the tie is cut: nodes and body then move on their own, which takes nothing away
(a constraint only removes motions). The body's inertia may go to either side. A mass eps at each of
the k tied nodes, at r from the centre, moves with at most 2 eps (k |v|^2 + sum r^2 |omega|^2) / 2,
so it is paid for by the share s of the body when eps = s/2 min(M / k, I / sum r^2).
"""

import numpy as np

from softsim.rigid.body import RigidBodyData

# Of the inertia that goes to the tied nodes; a frame is much heavier than they are.
TIED_SHARE = 0.25


def tied_mass(body: RigidBodyData, points: np.ndarray, tied: np.ndarray) -> float:
    """Mass [kg] that each of the nodes `tied` gets of the body; infinite where it cannot move."""
    mass, inertia = least_inertia(body, points.shape[1])
    spread = ((points[tied] - body.centre) ** 2).sum()
    if len(tied) == 0:
        return np.inf
    turning = inertia / spread if spread > 0.0 else np.inf
    return 0.5 * TIED_SHARE * min(mass / len(tied), turning)


def least_inertia(body: RigidBodyData, dimension: int) -> tuple[float, float]:
    """Mass [kg] and smallest moment of inertia [kg m^2] of what may move; infinite if nothing."""
    mass = body.mass if any(body.free[:dimension]) else np.inf
    return mass, float(np.diag(body.inertia)[list(body.free[3:])].min(initial=np.inf))
