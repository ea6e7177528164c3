"""Chain of nodes and links, with the forces on it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from softsim.chain.backbone import Links
from softsim.chain.lattice import Lattice, dot

# -------------------------------------------------------------------------------------------------
# Motors that rotate eccentric masses in the upright plane of the heading of their nodes.

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


class Force(Protocol):
    """Force on nodes at time t [s], positions p [m] and velocities v [m/s], (..., n, d) each."""

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the force on each node (..., n, d) [N]."""
        ...


class Conservative(Force, Protocol):
    """Conservative force, which has an energy."""

    def energy(self, p: np.ndarray) -> np.ndarray:
        """Return the stored energy (...) [J]."""
        ...


@dataclass(frozen=True, eq=False)
class Chain:
    """Chain with one or two lines of nodes, each from the front to the rear.

    masses: of the nodes (n,) [kg]. heads: numbers of the nodes with motors. links: between nodes.
    stores: conservative forces, by name. motors: on the heads. others: all other forces, by name.
    """

    masses: np.ndarray
    heads: np.ndarray
    links: Links
    stores: Mapping[str, Conservative]
    motors: Motors
    others: Mapping[str, Force]

    @property
    def node_count(self) -> int:
        """Number of nodes n."""
        return len(self.masses)

    def driven_at(self, frequency: float) -> "Chain":
        """Return the chain with its motors at another frequency [Hz]."""
        return replace(self, motors=self.motors.at(frequency))

    @cached_property
    def workers(self) -> dict[str, Force]:
        """All forces without an energy by name: the motors and the others."""
        return {"motor": self.motors, **self.others}

    @cached_property
    def _forces(self) -> list[Force]:
        return [*self.stores.values(), *self.workers.values()]

    def at_rest(self) -> np.ndarray:
        """Return the initial state, positions and velocities (2, n, d) [m, m/s].

        All limbs just touch the ground, and the front is at x = 0.
        """
        places = self.links.lattice.places
        return np.stack([places, np.zeros_like(places)])

    def rates(self, t: float, state: np.ndarray) -> np.ndarray:
        """Return the time derivatives of positions and velocities (2, n, d) [m/s, m/s^2]."""
        p, v = state
        forces = np.zeros_like(p)
        for force in self._forces:
            forces += force.on_nodes(t, p, v)
        return np.array([v, self.links.accelerations(forces, p, v)])

    def kinetic_energy(self, v: np.ndarray) -> np.ndarray:
        """Return the kinetic energy (...) [J]."""
        return 0.5 * (dot(v, v) @ self.masses)

    def power(self, name: str, t: np.ndarray, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the power (...) [W] of one of the workers, by name."""
        return dot(self.workers[name].on_nodes(t, p, v), v).sum(axis=-1)
