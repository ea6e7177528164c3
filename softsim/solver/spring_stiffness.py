"""What tendons and tethers add to the stiffness of rigid bodies at most.

A tendon, taut, holds the centre of mass along a line: its k adds k/M to omega^2 of the body's
translation and nothing to that of its turning. A tether that sticks holds a point at the arm r
along a line, and resists turning with K about its stiffest axis: it adds at most
k/M + (k r^2 + K + W r)/I, W being the weight that hangs on it.
"""

import numpy as np

from softsim.model import Model
from softsim.solver.rigid_inertia import TIED_SHARE, least_inertia


def tendon_frequency(model: Model) -> float:
    """Upper bound of omega^2 [1/s^2] of the rigid bodies on their tendons."""
    stiffness = np.zeros(len(model.rigid_bodies))
    for tendon in model.tendons:
        stiffness[tendon.body] += tendon.stiffness
    return largest_frequency(model, stiffness, np.zeros_like(stiffness))


def tether_frequency(model: Model) -> float:
    """Upper bound of omega^2 [1/s^2] of the rigid bodies on their tethers."""
    stiffness, moment = np.zeros((2, len(model.rigid_bodies)))
    strength = float(np.linalg.norm(model.gravity))
    for tether in model.tethers:
        body = model.rigid_bodies[tether.body]
        _, centre, _ = body.with_tied_mass(model.points, model.mass)
        arm = float(np.linalg.norm(tether.point - centre))
        stiffness[tether.body] += tether.stiffness
        moment[tether.body] += tether.stiffness * arm**2 + tether.turning_stiffness.max()
        moment[tether.body] += tether.carried_mass * strength * arm
    return largest_frequency(model, stiffness, moment)


def largest_frequency(model: Model, stiffness: np.ndarray, moment: np.ndarray) -> float:
    """Largest k/M + K/I [1/s^2] of the rigid bodies, with the share of their inertia that their
    tied nodes leave them (solver/rigid_inertia.py). stiffness: k (bodies,) [N/m]; moment: K
    (bodies,) [N m/rad].
    """
    largest = 0.0
    for k, K, body in zip(stiffness, moment, model.rigid_bodies, strict=True):
        mass, inertia = least_inertia(body, model.dimension)
        largest = max(largest, k / mass + K / inertia)
    return largest / (1.0 - TIED_SHARE)
