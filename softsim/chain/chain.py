"""A chain: its nodes, links and all that acts on them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from softsim.chain.backbone import Links
from softsim.chain.motor import Motor


class Force(Protocol):
    """Acts on the nodes at time t [s], which are at p [m] and move with v [m/s], (..., n) each."""

    def on_nodes(self, t: np.ndarray | float, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Force on each node (..., n) [N]."""
        ...


class Conservative(Force, Protocol):
    """A force that stores energy, and gives all of it back."""

    def energy(self, p: np.ndarray) -> np.ndarray:
        """What it stores (...) [J]."""
        ...


@dataclass(frozen=True, eq=False)
class Chain:
    """Nodes from the head to the rear.

    masses: (n,) [kg]. links: between them. stores: forces with an energy, by name. motor: on the
    head. others: the rest, which do work on the chain or take it away.
    """

    masses: np.ndarray
    links: Links
    stores: Mapping[str, Conservative]
    motor: Motor
    others: Mapping[str, Force]

    @property
    def node_count(self) -> int:
        """n."""
        return len(self.masses)

    def driven_at(self, frequency: float) -> "Chain":
        """The chain with its motor at another frequency [Hz]."""
        return replace(self, motor=self.motor.at(frequency))

    @cached_property
    def workers(self) -> dict[str, Force]:
        """The motor and the others, by name."""
        return {"motor": self.motor, **self.others}

    @cached_property
    def _forces(self) -> list[Force]:
        return [*self.stores.values(), *self.workers.values()]

    def at_rest(self) -> np.ndarray:
        """The state, places and velocities (2, n), in which all limbs just touch the ground and the
        head stands at x = 0.
        """
        behind = np.concatenate([[0.0], np.cumsum(self.links.lengths)])
        return np.stack([-behind, np.zeros(self.node_count)]).astype(complex)

    def rates(self, t: float, state: np.ndarray) -> np.ndarray:
        """How places and velocities (2, n) change in time."""
        p, v = state
        forces = np.zeros(self.node_count, complex)
        for force in self._forces:
            forces += force.on_nodes(t, p, v)
        return np.array([v, self.links.accelerations(forces, p, v)])

    def kinetic_energy(self, v: np.ndarray) -> np.ndarray:
        """(...) [J]."""
        return 0.5 * ((v * v.conj()).real @ self.masses)

    def power(self, name: str, t: np.ndarray, p: np.ndarray, v: np.ndarray) -> np.ndarray:
        """What one of the workers does (...) [W]."""
        return (self.workers[name].on_nodes(t, p, v).conj() * v).real.sum(axis=-1)
