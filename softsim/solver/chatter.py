"""Contact chatter: nodes that lose and regain contact many times per oscillation of the body.

Chatter belongs to the mesh, not to the body: each node bounces on its own penalty spring or with
the fastest waves of its elements. Friction then acts for part of the time only, and the distance
that a body slides depends on the mesh. A node that regains contact within RETURN_SHARE of the
body's oscillation period has chattered; the measure is the number of such returns per oscillation
period in contact.
"""

from dataclasses import dataclass

import numpy as np

from softsim.loads.rotor import Rotor
from softsim.model import Model

RETURN_SHARE = 0.1
# More returns in an oscillation than this are no bouncing of the body as a whole.
MOST_RETURNS = 1.0
# A node with less contact in the whole run, in oscillations, is not named.
LEAST_CONTACT = 1.0


@dataclass(frozen=True)
class Chatter:
    """Chatter of all nodes on walls.

    returns: mean number of returns per oscillation period in contact [-], over all nodes. worst,
    worst_returns: the node that chatters most, and its returns per period; worst is None if there
    was hardly any contact.
    """

    returns: float
    worst: int | None
    worst_returns: float


def oscillation_period(model: Model) -> float:
    """Return the period [s] of the slow motion of a model.

    That of the first motor; without a motor, the shortest period 4 h / sqrt(mu0 / rho) of the first
    shear mode over all regions, with the smallest extent h of each.
    """
    for load in model.of_kind(Rotor):
        return 1.0 / load.rotor.frequency
    return min(
        4.0 * float(np.ptp(r.points, axis=0).min())
        * np.sqrt(r.material.density / r.material.law.initial_shear_modulus)
        for r in model.regions
    )  # fmt: skip


def return_time(model: Model) -> float:
    """Return the time [s] within which a node that regains contact has chattered."""
    return RETURN_SHARE * oscillation_period(model)


def chatter(model: Model, returns: np.ndarray, contact_time: np.ndarray) -> Chatter:
    """Return the chatter of the nodes that may touch walls.

    returns (k,): number of returns of each node; contact_time (k,): its time in contact [s].
    """
    oscillations = contact_time / oscillation_period(model)
    long = np.flatnonzero(oscillations > LEAST_CONTACT)
    if len(long) == 0:
        return Chatter(0.0, None, 0.0)
    each = returns[long] / oscillations[long]
    worst = int(np.argmax(each))
    mean = float(returns.sum() / oscillations.sum())
    return Chatter(mean, int(model.contact.nodes[long[worst]]), float(each[worst]))


def chatter_warnings(model: Model, found: Chatter) -> dict[str, str]:
    """Return a warning if contact with walls has chattered since t = 0, with place and remedy."""
    if found.worst is None or found.returns <= MOST_RETURNS:
        return {}
    place = ", ".join(f"{c * 1e3:.2f}" for c in model.points[found.worst])
    body = next(
        (f"'{b.name}'" for b in model.bodies if found.worst in range(len(model.points))[b.nodes]),
        "an outline",
    )
    return {
        "chatter": "contact chatters: nodes lose contact with the wall and return "
        f"{found.returns:.3g} times within one oscillation period of "
        f"{oscillation_period(model) * 1e3:.3g} ms, most often ({found.worst_returns:.3g} "
        f"times) the node of {body} at rest at ({place}) mm. Friction and sliding then depend "
        "on the mesh. Give the material its spectrum up to the kHz range "
        "(materials.NAME.spectrum), raise contact.damping_ratio, slow the response of the "
        "friction limit (contact.friction_memory, contact.friction_slip_length), or let the "
        "body settle first (time.settle)"
    }
