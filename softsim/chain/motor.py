"""Motors that rotate eccentric masses in the upright plane of the heading of their nodes."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from softsim.chain.lattice import Lattice

TURNS = {"counterclockwise": 1, "clockwise": -1}
"""Sense of rotation, seen with forward to the right and z up."""


@dataclass(frozen=True, eq=False)
class Motors:
    """Centripetal forces of eccentric masses, which start at the lowest point (thesis 3.1, 3.2).

    The masses and their weights are part of those of the nodes. moments: m_e e, zero where no motor
    runs, (n,) [kg m]. angular_velocities: w, negative for clockwise rotation, (n,) [rad/s].
    """

    moments: np.ndarray
    angular_velocities: np.ndarray
    lattice: Lattice

    def at(self, frequency: float) -> "Motors":
        """Return the motors at another frequency [Hz] with the same sense of rotation."""
        speeds = np.copysign(math.tau * frequency, self.angular_velocities)
        return replace(self, angular_velocities=speeds)

    @cached_property
    def forces(self) -> np.ndarray:
        """Magnitudes m_e e w^2 of the forces (n,) [N]."""
        return self.moments * self.angular_velocities**2

    @property
    def longest_turn(self) -> float:
        """Duration of one turn of the slowest motor [s]."""
        return float(math.tau / np.abs(self.angular_velocities).min())

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the forces (..., n, d) [N]: m_e e w^2 (sin wt forward, -cos wt up)."""
        angles = np.asarray(t)[..., None] * self.angular_velocities
        forces = (self.forces * np.sin(angles))[..., None] * self.lattice.headings(p)
        forces[..., -1] = -self.forces * np.cos(angles)
        return forces
