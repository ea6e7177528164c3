"""Impulses of the walls on the nodes of a scenario since they were last cleared."""

from dataclasses import dataclass

import numpy as np

from softsim.solver.explicit import Scenario


@dataclass(frozen=True)
class WallContact:
    """Contact with all walls together.

    contact_count: nodes, and corners of walls, in contact now. normal_impulses: of each node (n,)
    [N s]. slipping_impulse: the part of their sum that acted while nodes slipped [N s].
    impulse: the total impulse vector (d,) [N s].
    """

    contact_count: int
    normal_impulses: np.ndarray
    slipping_impulse: float
    impulse: np.ndarray

    @property
    def normal_impulse(self) -> float:
        """Sum of the normal impulses of all nodes [N s]."""
        return float(self.normal_impulses.sum())

    @property
    def slip_share(self) -> float:
        """Fraction of the normal impulse that acted during slip [-]; 0 without contact."""
        return self.slipping_impulse / self.normal_impulse if self.normal_impulse > 0.0 else 0.0


def wall_contact(scenario: Scenario) -> WallContact:
    """Return the contact of a scenario's nodes with its walls."""
    model, read = scenario.model, scenario.read
    normal_impulses = np.zeros(len(model.points))
    count, slipping, impulse = 0, 0.0, np.zeros(model.dimension)
    nodes = model.contact.nodes
    for walls in scenario.terms.wall_contacts:
        count += np.count_nonzero(read(walls.pressing_force) > 0.0)
        normal_impulses[nodes] += read(walls.normal_impulse)[: len(nodes)]
        slipping += float(read(walls.slipping_impulse).sum())
        impulse += read(walls.impulse).sum(axis=0)
    return WallContact(count, normal_impulses, slipping, impulse)
