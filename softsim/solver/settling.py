"""Bodies come to rest before t = 0: dynamic relaxation by local damping (Nodes.shift_damped).

Weight, contact and friction act. Loads are off, as at all times before zero, and Maxwell branches
have relaxed, as those of a body that has lain there for long.
"""

from collections.abc import Sequence
from signal import Signals

import numpy as np

from softsim.errors import Interrupted, StabilityError
from softsim.model import LOCAL_DAMPING
from softsim.solver.energy import EnergyReader
from softsim.solver.equilibrium import moves, unbalanced_share
from softsim.solver.explicit import ExplicitSolver, Scenario
from softsim.solver.guards import refuse_broken_elements, refuse_unsettled

# Increments between two tests of equilibrium.
BLOCK = 512


def settle(
    solver: ExplicitSolver,
    reader: EnergyReader,
    time_increments: np.ndarray,
    asked_to_stop: Sequence[int] = (),
) -> tuple[dict[int, float], dict[int, StabilityError]]:
    """Let the scenarios whose models ask for it come to rest, before the solver begins.

    time_increments: stable without local damping, (scenarios,) [s]. asked_to_stop: signals that
    have arrived.

    Returns the times [s] that relaxation took, and the errors of those that found no equilibrium,
    by scenario. Raises Interrupted.
    """
    limits = {s: m.settling.longest for s, m in enumerate(solver.models) if m.settling is not None}
    took: dict[int, float] = {}
    failed: dict[int, StabilityError] = {}
    if not limits:
        return took, failed
    kept = solver.velocities()
    for s, longest in limits.items():
        solver.times[s] = -longest
        solver.halt(s)
    solver.begin(time_increments / np.sqrt(1.0 + LOCAL_DAMPING))  # see stability/time_step.py
    for s in limits:
        solver.relax_branches(s)
        solver.damp(s, LOCAL_DAMPING)
    while moving := [s for s in limits if s not in took and s not in failed]:
        if asked_to_stop:
            raise Interrupted(
                f"stopped by {Signals(asked_to_stop[0]).name} before t = 0, while bodies settled",
                hint="nothing is there to resume: start again",
            )
        solver.advance(np.bincount(moving, minlength=solver.scenarios) * BLOCK)
        reader.update()
        for s in moving:
            try:
                if is_settled(solver.scenario(s), reader):
                    took[s] = float(solver.times[s]) + limits[s]
            except StabilityError as error:
                failed[s] = error
    solver.start_clock(kept)
    return took, failed


def is_settled(scenario: Scenario, reader: EnergyReader) -> bool:
    """True if forces balance and nothing moves; the reader was just updated.

    Raises StabilityError where an element is broken, or where the time is up before that.
    """
    model, settling = scenario.model, scenario.model.settling
    assert settling is not None
    refuse_broken_elements(model, scenario.positions(), scenario.time)
    share = unbalanced_share(scenario)
    if share <= settling.tolerance and not moves(reader.of_scenario(scenario.number)[0], settling):
        return True
    if scenario.time >= 0.0:
        refuse_unsettled(share, settling)
    return False
