"""A motor that turns an eccentric mass in the x-z plane."""

import math
from dataclasses import dataclass, replace

import numpy as np

TURNS = {"counterclockwise": 1, "clockwise": -1}
"""Sense of rotation, seen with x to the right and z up."""


@dataclass(frozen=True, eq=False)
class Motor:
    """The centripetal force of its mass, from the lowest point on (thesis 3.1, 3.2).

    The mass itself, and its weight, are part of the head's.
    moment: m_e e [kg m]. angular_velocity: w, negative where it turns clockwise [rad/s]. shares:
    of the force on the nodes (n,), 1 on the head.
    """

    moment: float
    angular_velocity: float
    shares: np.ndarray

    def at(self, frequency: float) -> "Motor":
        """The motor at another frequency [Hz], the same way round."""
        speed = math.copysign(math.tau * frequency, self.angular_velocity)
        return replace(self, angular_velocity=speed)

    @property
    def force(self) -> float:
        """m_e e w^2 [N]."""
        return self.moment * self.angular_velocity**2

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n) [N]: m_e e w^2 (sin wt, -cos wt) on the head."""
        turning = np.exp(1j * self.angular_velocity * t)
        return np.multiply.outer(-1j * self.force * turning, self.shares)
