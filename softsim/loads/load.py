"""Base class of the loads of a model."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from softsim.compute.nodes import Nodes
from softsim.compute.term import Term
from softsim.rigid import RigidBodies

L = TypeVar("L", bound="Load")


@dataclass(frozen=True)
class RigidSpring:
    """Largest stiffness that a load adds to rigid body number `body`.

    stiffness [N/m]: along a line. turning [N m/rad]: against rotation. kind: the kind of load, for
    messages. goes_taut: True if the stiffness sets in suddenly, after a slack.
    """

    kind: str
    body: int
    stiffness: float
    turning: float = 0.0
    goes_taut: bool = False


@dataclass(frozen=True, eq=False)
class Load(ABC):
    """Load of one scenario.

    Fields that are not marked `PerScenario` (softsim/compute/term.py) are equal in all scenarios of
    a solver. A load without a spring or a time history keeps the default methods.
    """

    @property
    def columns(self) -> dict[str, str]:
        """Columns that its term adds to the history -> unit.

        If several loads have the same columns, the first one writes them.
        """
        return {}

    @abstractmethod
    def term(self, scenarios: Sequence[Any], nodes: Nodes, rigid_bodies: RigidBodies) -> Term:
        """Return the kernel class of the load.

        scenarios: this load in every scenario, this one first.
        """

    def springs(self, centres: np.ndarray, gravity: float) -> list[RigidSpring]:
        """Return the stiffness that the load adds to rigid bodies under `gravity` [m/s^2].

        centres: centres of mass of the rigid bodies at rest (bodies, d) [m].
        """
        return []

    def remark(self, points: np.ndarray) -> str:
        """Return text on the built load, such as the area that it acts on, for its description.

        points: all nodes at rest (n, d) [m].
        """
        return ""

    @property
    def largest_force(self) -> float:
        """Largest force [N] that the load prescribes; 0 if the force depends on what it acts on."""
        return 0.0

    @property
    def last_change(self) -> float:
        """Time [s] at which the time history of the load ends; 0 without one."""
        return 0.0

    def time_scaled(self, factor: float) -> "Load":
        """Return the load with its time history `factor` times as fast."""
        return self
