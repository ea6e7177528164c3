"""Motors that turn eccentric masses in the upright planes in which their nodes look ahead."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from softsim.chain.lattice import Lattice

TURNS = {"counterclockwise": 1, "clockwise": -1}
"""Sense of rotation, seen with forward to the right and z up."""


@dataclass(frozen=True, eq=False)
class Motors:
    """The centripetal forces of their masses, from the lowest point on (thesis 3.1, 3.2).

    The masses themselves, and their weights, are part of their nodes'. moments: m_e e, zero where
    no motor runs, (n,) [kg m]. angular_velocities: w, negative where they turn clockwise, (n,)
    [rad/s].
    """

    moments: np.ndarray
    angular_velocities: np.ndarray
    lattice: Lattice

    def at(self, frequency: float) -> "Motors":
        """All of them at another frequency [Hz], the same way round."""
        speeds = np.copysign(math.tau * frequency, self.angular_velocities)
        return replace(self, angular_velocities=speeds)

    @cached_property
    def forces(self) -> np.ndarray:
        """m_e e w^2 (n,) [N]."""
        return self.moments * self.angular_velocities**2

    @property
    def longest_turn(self) -> float:
        """Of the slowest of them [s]."""
        return float(math.tau / np.abs(self.angular_velocities).min())

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(..., n, d) [N]: m_e e w^2 (sin wt ahead, -cos wt up)."""
        angles = np.asarray(t)[..., None] * self.angular_velocities
        forces = (self.forces * np.sin(angles))[..., None] * self.lattice.headings(p)
        forces[..., -1] = -self.forces * np.cos(angles)
        return forces
