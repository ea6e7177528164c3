"""One scenario of a solver, as those see it who look at a run."""

from typing import Any

import numpy as np
import taichi as ti

from softsim import fields
from softsim.loads.load import Load
from softsim.model import Model
from softsim.solver.chatter import Chatter, chatter
from softsim.solver.explicit import ExplicitSolver
from softsim.solver.terms import Terms


class Scenario:
    """Scenario `number` of a solver: its model, its clock, and what fields hold of it now."""

    def __init__(self, solver: ExplicitSolver, number: int) -> None:
        self.solver, self.number = solver, number

    @property
    def model(self) -> Model:
        """What it was built from."""
        return self.solver.models[self.number]

    @property
    def terms(self) -> Terms:
        """The Taichi objects, which all scenarios share."""
        return self.solver.terms

    @property
    def time(self) -> float:
        """Simulated [s]."""
        return float(self.solver.times[self.number])

    @property
    def increments(self) -> int:
        """Done so far."""
        return int(self.solver.done[self.number])

    @property
    def increment(self) -> float:
        """The step in use [s]."""
        return float(self.solver.steps[self.number])

    def change_increment(self, increment: float) -> None:
        """Go on with another step [s]."""
        self.solver.change_increment_of(self.number, increment)

    def read(self, field: ti.Field) -> np.ndarray:
        """What a field, whose first axis counts scenarios, holds of this one."""
        return fields.read_row(field, self.number)

    def term_of(self, load: Load) -> Any:
        """What computes one of the model's loads."""
        return self.terms.loads[[one is load for one in self.model.loads].index(True)]

    def positions(self) -> np.ndarray:
        """x (nodes, d) [m]."""
        return self.read(self.terms.nodes.position)

    def overfull(self) -> bool:
        """Whether a list of what may touch had no room, so that contact was missed."""
        return any(self.read(c.lists.overfull).any() for c in self.terms.self_contacts)

    def chatter(self) -> Chatter:
        """Of the nodes on walls since t = 0."""
        count = len(self.model.contact.nodes)
        returns, contact_time = np.zeros((2, count))
        for walls in self.terms.wall_contacts:
            returns += self.read(walls.returns)
            contact_time += self.read(walls.contact_time)
        return chatter(self.model, returns, contact_time)

    def memory(self) -> dict[str, np.ndarray]:
        """Everything that must be kept to continue to the same bits, as the solver of a run of this
        scenario alone keeps it.
        """
        return {name: self.read(field)[None] for name, field in self.terms.state_fields().items()}
