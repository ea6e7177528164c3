"""Rows of the history at the present time of a solver, for tests without a run."""

from softsim.compute.term import Term, present
from softsim.solver import energy
from softsim.solver.energy import WallContact, wall_fields
from softsim.solver.explicit import Scenario


def wall_contact(scenario: Scenario) -> WallContact:
    """Return the present contact of a scenario with its walls, without the axis of rows."""
    now = present(scenario.number, wall_fields(scenario.terms))
    return WallContact(*(rows[0] for rows in vars(energy.wall_contact(scenario, now)).values()))


def readings(term: Term, interval: float) -> dict[str, float]:
    """Return the columns of a term in the first scenario, `interval` [s] after impulses began."""
    now = present(0, term.sampled(), interval=interval)
    return {name: float(values[0]) for name, values in term.readings(now).items()}
