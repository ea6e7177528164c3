"""Interface of structural components: cables, layers, fibres, ties, pulled cables.

A structure adds forces to the nodes of a model. The solver, the bound of the stable step, natural
modes, the history, figures and warnings call the same methods of all structures; the defaults are
those of a structure without mass, stiffness, columns or lines. Adding a structure is described in
docs/developers/recipes.md.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import scipy.sparse as sp

from softsim.compute.nodes import Nodes
from softsim.compute.term import Term
from softsim.contact.surface_contact import ContactData
from softsim.rigid import RigidBodies


@dataclass(frozen=True, eq=False)
class NodalStiffness:
    """Upper bound of the stiffness between the nodes of m parts of a structure.

    Each of the m parts has a nodes, such as the two ends of a bar. Its stiffness, with geometric
    stiffness, is at most `values` in every direction of the displacements. name: the structure, for
    messages. nodes (a, m): numbered in the model. values (a, a, m) [N/m].
    """

    name: str
    nodes: np.ndarray
    values: np.ndarray


class Structure(ABC):
    """Structural component of one scenario.

    Subclasses are frozen dataclasses. Their fields that are not marked `PerScenario`
    (softsim/compute/term.py) are equal in all scenarios of a solver. kind: noun for messages.
    wall_contact: contact of its nodes with walls; None if walls do not touch it. radius [m]:
    distance of its surface, which touches walls, from these nodes.
    """

    kind: ClassVar[str]
    wall_contact: ContactData | None = None
    radius: float = 0.0

    @property
    def title(self) -> str:
        """Kind, and name if it has one, for messages."""
        return self.kind

    @property
    def columns(self) -> dict[str, str]:
        """Columns that its term adds to the history -> unit."""
        return {}

    @abstractmethod
    def term(self, scenarios: Sequence[Any], nodes: Nodes, rigid_bodies: RigidBodies) -> Term:
        """Return the kernel class of the structure.

        scenarios: this structure in every scenario, this one first.
        """

    @property
    def own_nodes(self) -> np.ndarray:
        """Nodes (k,) of the model that belong to the structure and to no body."""
        return np.zeros(0, dtype=int)

    def nodal_mass(self, node_count: int) -> np.ndarray:
        """Return the mass (n,) [kg] that the structure adds to each node of the model."""
        return np.zeros(node_count)

    def stiffness_bound(self, x: np.ndarray) -> list[NodalStiffness]:
        """Return upper bounds of the stiffness with the model's nodes at x (n, d) [m].

        The nodes of each entry do not depend on x.
        """
        return []

    def stiffness_roots(self, x: np.ndarray) -> list[np.ndarray]:
        """Return vectors b (n, d) [(N/m)^1/2] whose products b (x) b add to the stiffness.

        They are for a structure that is slack at first and then becomes stiff as a whole, such as a
        pulled cable: the time step also resolves this impact.
        """
        return []

    def shape_measures(self, x: np.ndarray) -> np.ndarray:
        """Return dimensionless measures (k,) of the shape, on which the stiffness bound depends.

        The stable step is estimated again when one of them has grown by more than ALLOWED_GROWTH,
        0.04 (solver/stiffness_bound.py). Scale them so that the bound then grows by 16 % at most.
        """
        return np.zeros(0)

    def rest_stiffness(self, points: np.ndarray) -> sp.csr_matrix:
        """Return K (n d, n d) [N/m] for natural modes, with the nodes at rest at points (n, d)."""
        return sp.csr_matrix((points.size, points.size))

    def lines(self, x: np.ndarray) -> dict[str, list[np.ndarray]]:
        """Return the lines (k, d) [m] that figures draw, by kind, with the nodes at x (n, d) [m].

        The kinds are "cables", drawn thick and behind the bodies, and "fibres", drawn thin and over
        them.
        """
        return {}

    @property
    def drawn_facets(self) -> np.ndarray:
        """Facets (m, corners) of bodies that figures draw in its colour."""
        return np.zeros((0, 0), dtype=int)

    def description(self) -> dict[str, str]:
        """Return rows of the table that `check` prints, title -> text with size and mass."""
        return {}

    def warnings(self, points: np.ndarray) -> dict[str, str]:
        """Return warnings of implausible data, kind -> text; points: nodes (n, d) [m]."""
        return {}
