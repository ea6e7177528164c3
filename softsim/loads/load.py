"""A load as a model has it: what acts on bodies from outside, in numbers."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from softsim.nodes import Nodes
from softsim.rigid.frame import RigidBodies
from softsim.term import Term

L = TypeVar("L", bound="Load")


@dataclass(frozen=True)
class RigidSpring:
    """What a load adds to the stiffness of rigid body number `body` at most: `stiffness` [N/m]
    along a line, `turning` [N m/rad]. kind: of the load, for people. goes_taut: at once, after a
    slack.
    """

    kind: str
    body: int
    stiffness: float
    turning: float = 0.0
    goes_taut: bool = False


@dataclass(frozen=True, eq=False)
class Load(ABC):
    """Of one scenario. Fields that are not the scenario's own (softsim/sharing.py) are alike in all
    scenarios of a solver. A load without a spring or a time course says nothing of them.
    """

    @property
    def columns(self) -> dict[str, str]:
        """Columns that its term adds to the history -> unit; of several loads with the same ones
        the first tells them.
        """
        return {}

    @abstractmethod
    def term(self, alike: Sequence[Any], nodes: Nodes, rigid_bodies: RigidBodies) -> Term:
        """What the solver computes it with; alike: this load in every scenario, this one first."""

    def springs(self, centres: np.ndarray, gravity: float) -> list[RigidSpring]:
        """How it stiffens rigid bodies, their centres of mass being at `centres` (bodies, d) [m] at
        rest, under `gravity` [m/s^2].
        """
        return []

    def remark(self, points: np.ndarray) -> str:
        """Return what the built load adds to the words of the scene, such as the area that it acts
        on; the nodes being at `points` (n, d) [m] at rest.
        """
        return ""

    @property
    def largest_force(self) -> float:
        """Largest force [N] that it exerts of itself; 0 where that follows from what it acts on."""
        return 0.0

    @property
    def last_change(self) -> float:
        """Time [s] at which its time course ends; 0 of one that has none."""
        return 0.0

    def time_scaled(self, factor: float) -> "Load":
        """The load with its time course played `factor` times as fast."""
        return self


def of_kind(loads: Iterable[Load], kind: type[L]) -> tuple[L, ...]:
    """Those of a kind, in their order."""
    return tuple(load for load in loads if isinstance(load, kind))
