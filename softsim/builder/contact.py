"""Contact: stiffness, damping and mass of each node."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from softsim.builder.names import Names
from softsim.elements.geometry import nodal_sums
from softsim.mesh.mesh import signed_volumes
from softsim.model import Body, ContactData
from softsim.rigid.body import RigidBodyData
from softsim.scene import surroundings

# A node may start this far inside a wall: rounding of a shape that just fits.
ALLOWED_PENETRATION = 1e-9


@dataclass(frozen=True)
class Stiffness:
    """Penalty stiffness (n,) [N/m] and mass (n,) [kg] that a contact has to move, per node."""

    settings: surroundings.Contact
    penalty: np.ndarray
    effective_mass: np.ndarray

    def contact(self, nodes: np.ndarray, friction_coefficient: float) -> ContactData:
        """Return the contact data of `nodes` with `damping_ratio` times the critical damping."""
        k_n, m = self.penalty[nodes], self.effective_mass[nodes]
        moving = np.where(np.isfinite(m), m, 0.0)  # a fixed node needs no dashpot
        damping = 2.0 * self.settings.damping_ratio * np.sqrt(k_n * moving)
        return ContactData(
            nodes=nodes,
            penalty_stiffness=k_n,
            tangential_stiffness=self.settings.tangential_stiffness_ratio * k_n,
            damping=damping,
            tangential_damping=self.settings.tangential_damping_fraction * damping,
            effective_mass=m,
            friction_coefficient=friction_coefficient,
        )


def penalty_stiffness(names: Names, bodies: Sequence[Body], node_count: int) -> np.ndarray:
    """Return k_n (n,) [N/m] of every node: the user's, or the bulk modulus times the node's depth.

    The depth is the thickness of a section, the circumference of a ring, or the size of a node's
    surroundings in space. The value is the stiffness of one element across its own size, so a
    contact is as stiff as the solid behind it, for any mesh. That of a cable is the stiffness of a
    segment along itself.
    """
    given = names.scene.contact.penalty_stiffness
    if isinstance(given, float):
        return np.full(node_count, given)
    soft = [nodal_bulk_modulus(b) * nodal_depth(b) for b in bodies]
    stiffness = np.full(node_count, max(s.max() for s in soft))
    for b, s in zip(bodies, soft, strict=True):
        stiffness[b.nodes] = s
    for name, placed in names.cables.items():
        along = names.scene.cables[name].stretching_stiffness
        stiffness[placed.nodes] = along / placed.lengths.mean()
    return stiffness


def nodal_depth(body: Body) -> np.ndarray:
    """Return the depth of the body at each node (n,) [m], see `penalty_stiffness`."""
    volume = np.sum([r.nodal_volumes for r in body.regions], axis=0)
    if body.points.shape[1] == 3:
        return (volume / body.cells.shape[1]) ** (1.0 / 3.0)
    area = signed_volumes(body.points, body.cells)[:, None]
    return volume / nodal_sums(body.cells, area, len(body.points))


def nodal_bulk_modulus(body: Body) -> np.ndarray:
    """Return the bulk modulus (n,) [Pa] around each node."""
    count = len(body.points)
    return body.nodal_mean(np.full(count, r.material.bulk_modulus) for r in body.regions)


def contact_mass(
    points: np.ndarray,
    mass: np.ndarray,
    is_free: np.ndarray,
    rigid_bodies: Sequence[RigidBodyData],
) -> np.ndarray:
    """Return the mass (n,) [kg] that a contact at each node has to move.

    A free node: its own. A node of a rigid body: 1/m = 1/M + r^2/I, its worst direction. A fixed
    node: infinite.
    """
    effective = np.where(is_free.any(axis=1), mass, np.inf)
    for body in rigid_bodies:
        arm_squared = ((points[body.tied] - body.centre) ** 2).sum(axis=1)
        smallest = np.diag(body.inertia)[list(body.free[3:])].min(initial=np.inf)
        effective[body.tied] = 1.0 / (1.0 / body.mass + arm_squared / smallest)
    return effective
