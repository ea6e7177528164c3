"""Rigid bodies in the bound of the stable step: their inertia, and the springs on them.

For the stable step the tie of nodes to a body is cut, so that nodes and body move independently.
This is safe, as a constraint only removes motions. The body's inertia may be assigned to either. A
mass eps at each of the k tied nodes, at r from the centre, has at most the kinetic energy
2 eps (k |v|^2 + sum r^2 |omega|^2) / 2, which the fraction s of the body's inertia covers if
eps = s/2 min(M / k, I / sum r^2).

A spring k along a line through a point, and K against rotation, add at most k/M + K/I to omega^2.

Let nodes alone have the largest omega^2 p, bodies alone b. The springs of the contact between them
alone give at most d for nodes if bodies are fixed, and s for bodies if nodes are fixed. The block
that couples both is a product of two matrices whose norms are the roots of these. So all together
have at most the larger eigenvalue of
    [ p          sqrt(d s) ]
    [ sqrt(d s)  b         ].
"""

import numpy as np
from scipy.linalg import eigh

from softsim.loads.load import RigidSpring
from softsim.model import Model
from softsim.rigid.body import RigidBodyData, in_space, point_inertia

# Of the inertia that goes to the tied nodes; a frame is much heavier than they are.
TIED_SHARE = 0.25


def tied_mass(body: RigidBodyData, points: np.ndarray, tied: np.ndarray) -> float:
    """Return the mass [kg] of the body for each of the nodes `tied`; infinite if it cannot move."""
    mass, inertia = least_inertia(body, points.shape[1])
    spread = ((points[tied] - body.centre) ** 2).sum()
    if len(tied) == 0:
        return np.inf
    turning = inertia / spread if spread > 0.0 else np.inf
    return 0.5 * TIED_SHARE * min(mass / len(tied), turning)


def least_inertia(body: RigidBodyData, dimension: int) -> tuple[float, float]:
    """Return the mass [kg] and smallest moment of inertia [kg m^2]; infinite if held."""
    mass = body.mass if any(body.free[:dimension]) else np.inf
    return mass, float(np.diag(body.inertia)[list(body.free[3:])].min(initial=np.inf))


class TiedSprings:
    """Isotropic springs at nodes (k,), of which those at nodes tied to a rigid body hold it.

    points (n, d) [m]: positions of all nodes at rest, for which the body's inertia is given.
    """

    def __init__(self, body: RigidBodyData, points: np.ndarray, nodes: np.ndarray) -> None:
        self.own = np.isin(nodes, body.tied)
        self.arms = in_space(points[nodes[self.own]] - body.centre)
        d = points.shape[1]
        moves = np.flatnonzero([*body.free[:d], *([False] * (3 - d)), *body.free[3:]])
        self.hold_nothing = len(moves) == 0 or not self.own.any()
        self.moving = np.ix_(moves, moves)
        inertia = np.zeros((6, 6))
        inertia[:3, :3], inertia[3:, 3:] = body.mass * np.eye(3), body.inertia
        self.inertia = inertia[self.moving]

    def largest_frequency(self, stiffness: np.ndarray) -> float:
        """Return the largest omega^2 [1/s^2] of the body alone on these springs.

        stiffness (k,) [N/m]: of the springs. The result is 0 if the body is fixed or has no spring.
        """
        if self.hold_nothing:
            return 0.0
        k = stiffness[self.own]
        x, y, z = k @ self.arms
        springs = np.zeros((6, 6))
        springs[:3, :3] = k.sum() * np.eye(3)
        springs[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]  # k omega x r
        springs[3:, :3] = springs[:3, 3:].T
        springs[3:, 3:] = point_inertia(k, self.arms)
        return float(eigh(springs[self.moving], self.inertia, eigvals_only=True)[-1])


def with_bodies(nodes: float, bodies: float, pressed: float, pressing: float) -> float:
    """Return a bound of omega^2 [1/s^2] of nodes and rigid bodies together.

    nodes, bodies: omega^2 of each alone, with all its springs. pressed, pressing: omega^2 of nodes
    and of bodies with the springs between them alone.
    """
    mean, half = 0.5 * (nodes + bodies), 0.5 * (nodes - bodies)
    return float(mean + np.sqrt(half**2 + pressed * pressing))


def load_springs(model: Model) -> list[RigidSpring]:
    """Return the springs of all loads on rigid bodies."""
    centres = np.array(
        [body.with_tied_mass(model.points, model.mass)[1] for body in model.rigid_bodies]
    )
    gravity = float(np.linalg.norm(model.gravity))
    return [spring for load in model.loads for spring in load.springs(centres, gravity)]


def spring_frequencies(model: Model, springs: list[RigidSpring]) -> dict[str, float]:
    """Return the largest k/M + K/I [1/s^2] of the rigid bodies for springs of each kind, by kind.

    The inertia of a body is reduced by the part assigned to its tied nodes.
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
