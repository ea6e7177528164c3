"""Rigid bodies in the bound of the stable step: their inertia, and the springs on them.

For the stable step the tie of nodes to a body is cut: nodes and body then move on their own, which
takes nothing away (a constraint only removes motions). The body's inertia may go to either side. A
mass eps at each of the k tied nodes, at r from the centre, moves with at most
2 eps (k |v|^2 + sum r^2 |omega|^2) / 2, so it is paid for by the share s of the body when
eps = s/2 min(M / k, I / sum r^2).

A spring k along a line through a point, and K against turning, add k/M + K/I to omega^2 at most.
"""

import numpy as np

from softsim.loads.load import RigidSpring
from softsim.model import Model
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


def load_springs(model: Model) -> list[RigidSpring]:
    """The springs on rigid bodies of all loads."""
    centres = np.array(
        [body.with_tied_mass(model.points, model.mass)[1] for body in model.rigid_bodies]
    )
    gravity = float(np.linalg.norm(model.gravity))
    return [spring for load in model.loads for spring in load.springs(centres, gravity)]


def spring_frequencies(model: Model, springs: list[RigidSpring]) -> dict[str, float]:
    """Largest k/M + K/I [1/s^2] of the rigid bodies on their springs of each kind, by kind, with
    the share of their inertia that their tied nodes leave them.
    """
    stiffness: dict[str, np.ndarray] = {}
    for spring in springs:
        of_kind = stiffness.setdefault(spring.kind, np.zeros((len(model.rigid_bodies), 2)))
        of_kind[spring.body] += spring.stiffness, spring.turning
    inertias = np.array([least_inertia(body, model.dimension) for body in model.rigid_bodies])
    return {
        kind: float((of_kind / inertias).sum(axis=1).max()) / (1.0 - TIED_SHARE)
        for kind, of_kind in stiffness.items()
    }
