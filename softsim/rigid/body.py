"""What a rigid body is, in numpy."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class RigidBodyData:
    """One rigid body. mass [kg], inertia [kg m^2] about `centre`, all without the tied nodes.

    centre: (2,) [m]. tied: node numbers. velocity: (2,) [m/s]. angular_velocity [rad/s].
    free: which of x, y, rotation may move.
    """

    name: str
    mass: float
    inertia: float
    centre: np.ndarray
    tied: np.ndarray
    velocity: np.ndarray
    angular_velocity: float
    free: tuple[bool, bool, bool]

    def with_tied_mass(
        self, points: np.ndarray, node_mass: np.ndarray
    ) -> tuple[float, np.ndarray, float]:
        """Mass, centre of mass and inertia about it, of the body with its tied nodes."""
        m, x = node_mass[self.tied], points[self.tied]
        mass = self.mass + m.sum()
        centre = (self.mass * self.centre + m @ x) / mass
        inertia = (
            self.inertia
            + self.mass * ((self.centre - centre) ** 2).sum()
            + m @ ((x - centre) ** 2).sum(axis=1)
        )
        return mass, centre, inertia
