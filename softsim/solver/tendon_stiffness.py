"""What tendons add to the stiffness of rigid bodies at most: as if all of them were taut.

A tendon holds the centre of mass along a line, so that its k adds k/M to omega^2 of the body's
translation and nothing to that of its turning.
"""

import numpy as np

from softsim.model import Model
from softsim.solver.rigid_inertia import TIED_SHARE, least_inertia


def tendon_frequency(model: Model) -> float:
    """Upper bound of omega^2 [1/s^2] of the rigid bodies on their tendons, with the share of their
    mass that their tied nodes leave them (solver/rigid_inertia.py).
    """
    stiffness = np.zeros(len(model.rigid_bodies))
    for tendon in model.tendons:
        stiffness[tendon.body] += tendon.stiffness
    largest = 0.0
    for k, body in zip(stiffness, model.rigid_bodies, strict=True):
        mass, _ = least_inertia(body, model.dimension)
        largest = max(largest, k / mass)
    return largest / (1.0 - TIED_SHARE)
