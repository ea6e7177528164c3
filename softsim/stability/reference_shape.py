"""Shape for which the stable step was estimated; near it, the estimate holds.

The bound assumes contact at every node that may touch (contact_stiffness.py), and the most content
that chambers ever have: it changes only if elements deform or nodes come near a wall. An element
whose principal stretches have changed by the fraction e since the estimate has gradients of at most
1 / (1 - e) times those then, so that its stable step has fallen by about e, and by as much again if
its law stiffens with strain.
"""

import numpy as np

from softsim.model import Model
from softsim.stability.contact_stiffness import REACH

# Root sum of squares of the strains since the estimate: of an incompressible plane element that is
# e = 4 %, for which the stable step may have fallen by 8 %. A step in use has 10 % of room.
ALLOWED_STRAIN = 0.06

# Of tan^2(theta / 2) at a cable's joint: its stiffness goes with 1 + 4 of it at most, the step with
# the root (stability/cable_stiffness.py).
ALLOWED_FOLDING = 0.04


class ReferenceShape:
    """Shape of a model with all nodes at x (n, d) [m]."""

    def __init__(self, model: Model, x: np.ndarray) -> None:
        self.model, self.x = model, x
        self.inverses = [np.linalg.inv(r.deformation(x[r.nodes])) for r in model.regions]
        self.foldings = [data.cable.folding(x) for data in model.cables]
        self.reach = 0.5 * REACH * np.ptp(model.points, axis=0).max()

    def is_near(self, x: np.ndarray) -> bool:
        """Return True if all nodes at x (n, d) [m] form a shape near this one.

        No element is strained relative to this shape by more than ALLOWED_STRAIN, no cable is bent
        by more than ALLOWED_FOLDING, and no node has moved by more than half the reach of contact
        in any component. False for NaN.
        """
        with np.errstate(invalid="ignore", over="ignore"):
            if not np.abs(x - self.x).max() <= self.reach:
                return False
            for data, folding in zip(self.model.cables, self.foldings, strict=True):
                if not (data.cable.folding(x) <= folding + ALLOWED_FOLDING).all():
                    return False
            return all(
                largest_strain(region.deformation(x[region.nodes]) @ inverse) <= ALLOWED_STRAIN
                for region, inverse in zip(self.model.regions, self.inverses, strict=True)
            )


def largest_strain(F: np.ndarray) -> float:
    """Return the largest norm of the Green strain (F^T F - I) / 2 of F (m, 3, 3)."""
    strain = 0.5 * (F.transpose(0, 2, 1) @ F - np.eye(3))
    return float(np.sqrt(np.einsum("eij,eij->e", strain, strain).max()))
