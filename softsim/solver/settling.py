"""Bodies come to rest before t = 0: dynamic relaxation by local damping (Nodes.shift_damped).

Weight, contact and friction act. Loads are off, as at all times before zero, and Maxwell branches
have relaxed, as those of a body that has lain there for long.
"""

from collections.abc import Sequence
from signal import Signals

import numpy as np

from softsim.errors import Interrupted, StabilityError
from softsim.model import LOCAL_DAMPING
from softsim.solver.energy import Meter
from softsim.solver.equilibrium import moves, unbalanced_share
from softsim.solver.explicit import ExplicitSolver
from softsim.solver.guards import refuse_broken_elements, refuse_unsettled
from softsim.solver.scenario import Scenario

# Increments between two looks at the forces.
LOOK_EVERY = 512


def settle(
    solver: ExplicitSolver, meter: Meter, steps: np.ndarray, asked_to_stop: Sequence[int] = ()
) -> tuple[dict[int, float], dict[int, StabilityError]]:
    """Let the scenarios whose models ask for it come to rest, before the solver begins.

    steps: stable without local damping, (scenarios,) [s]. asked_to_stop: signals, as they come.
    Returns, by scenario, the times [s] that relaxation took, and why others found no equilibrium.
    Raises Interrupted.
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
    solver.begin(steps / np.sqrt(1.0 + LOCAL_DAMPING))  # see stability/time_step.py
    for s in limits:
        solver.relax_branches(s)
        solver.damp(s, LOCAL_DAMPING)
    while moving := [s for s in limits if s not in took and s not in failed]:
        if asked_to_stop:
            raise Interrupted(
                f"stopped by {Signals(asked_to_stop[0]).name} before t = 0, while bodies settled",
                hint="nothing is there to resume: start again",
            )
        solver.advance(np.bincount(moving, minlength=solver.scenarios) * LOOK_EVERY)
        meter.look()
        for s in moving:
            try:
                if is_settled(Scenario(solver, s), meter):
                    took[s] = float(solver.times[s]) + limits[s]
            except StabilityError as error:
                failed[s] = error
    solver.start_clock(kept)
    return took, failed


def is_settled(scenario: Scenario, meter: Meter) -> bool:
    """Whether forces balance and nothing moves; the meter has just looked.

    Raises StabilityError where an element is broken, or where they do not when time is up.
    """
    model, settling = scenario.model, scenario.model.settling
    assert settling is not None
    refuse_broken_elements(model, scenario.positions(), scenario.time)
    share = unbalanced_share(scenario)
    if share <= settling.tolerance and not moves(meter.of(scenario.number)[0], settling):
        return True
    if scenario.time >= 0.0:
        refuse_unsettled(share, settling)
    return False
