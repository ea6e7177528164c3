"""A chain: its nodes, links and all that acts on them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from softsim.chain.backbone import Links
from softsim.chain.motor import Motors
from softsim.chain.vectors import dot


class Force(Protocol):
    """Acts on nodes at time t [s], which are at p [m] and move with v [m/s], (..., n, d) each."""

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Force on each node (..., n, d) [N]."""
        ...


class Conservative(Force, Protocol):
    """A force that stores energy, and gives all of it back."""

    def energy(self, p: np.ndarray) -> np.ndarray:
        """What it stores (...) [J]."""
        ...


@dataclass(frozen=True, eq=False)
class Chain:
    """Nodes from the front to the rear, of one line or of two.

    masses: (n,) [kg]. heads: those that carry motors. links: between them. stores: forces with an
    energy, by name. motors: on the heads. others: the rest, which do work on the chain or take it
    away.
    """

    masses: np.ndarray
    heads: np.ndarray
    links: Links
    stores: Mapping[str, Conservative]
    motors: Motors
    others: Mapping[str, Force]

    @property
    def node_count(self) -> int:
        """n."""
        return len(self.masses)

    def driven_at(self, frequency: float) -> "Chain":
        """The chain with its motors at another frequency [Hz]."""
        return replace(self, motors=self.motors.at(frequency))

    @cached_property
    def workers(self) -> dict[str, Force]:
        """The motors and the others, by name."""
        return {"motor": self.motors, **self.others}

    @cached_property
    def _forces(self) -> list[Force]:
        return [*self.stores.values(), *self.workers.values()]

    def at_rest(self) -> np.ndarray:
        """The state, places and velocities (2, n, d), in which all limbs just touch the ground and
        the front is at x = 0.
        """
        places = self.links.lattice.places
        return np.stack([places, np.zeros_like(places)])

    def rates(self, t: float, state: np.ndarray) -> np.ndarray:
        """How places and velocities (2, n, d) change in time."""
        p, v = state
        forces = np.zeros_like(p)
        for force in self._forces:
            forces += force.on_nodes(t, p, v)
        return np.array([v, self.links.accelerations(forces, p, v)])

    def kinetic_energy(self, v: np.ndarray) -> np.ndarray:
        """(...) [J]."""
        return 0.5 * (dot(v, v) @ self.masses)

    def power(self, name: str, t: np.ndarray, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """What one of the workers does (...) [W]."""
        return dot(self.workers[name].on_nodes(t, p, v), v).sum(axis=-1)
