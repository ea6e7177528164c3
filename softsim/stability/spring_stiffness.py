"""What the springs of loads add to the stiffness of rigid bodies at most.

A spring k along a line through a point, and K against turning, add k/M + K/I to omega^2 at most.
"""

import numpy as np

from softsim.loads.load import RigidSpring
from softsim.model import Model
from softsim.stability.rigid_inertia import TIED_SHARE, least_inertia


def load_springs(model: Model) -> list[RigidSpring]:
    """Of all loads."""
    centres = np.array(
        [body.with_tied_mass(model.points, model.mass)[1] for body in model.rigid_bodies]
    )
    gravity = float(np.linalg.norm(model.gravity))
    return [spring for load in model.loads for spring in load.springs(centres, gravity)]


def spring_frequencies(model: Model, springs: list[RigidSpring]) -> dict[str, float]:
    """Largest k/M + K/I [1/s^2] of the rigid bodies on their springs of each kind, by kind, with
    the share of their inertia that their tied nodes leave them (stability/rigid_inertia.py).
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
