"""Dynamic relaxation by local damping (Nodes.shift_damped) before t = 0, and its end.

Before t = 0 weight, contact and friction act. Loads are off, as at all times before zero, and
Maxwell branches have relaxed, as in a body that has been at rest for long.
"""

from collections.abc import Sequence
from signal import Signals

import numpy as np

from softsim import fields
from softsim.errors import Interrupted, StabilityError
from softsim.model import LOCAL_DAMPING, Relaxation
from softsim.solver.energy import Energies, EnergyReader
from softsim.solver.explicit import ExplicitSolver, Scenario, longest_block
from softsim.solver.guards import refuse_broken_elements, refuse_unsettled

# Increments between two tests of equilibrium.
BLOCK = 512


def settle(
    solver: ExplicitSolver,
    reader: EnergyReader,
    time_increments: np.ndarray,
    asked_to_stop: Sequence[int] = (),
) -> tuple[dict[int, float], dict[int, StabilityError]]:
    """Relax the scenarios whose models have settling, before the solver begins.

    time_increments: stable steps without local damping, (scenarios,) [s]. asked_to_stop: signals
    received so far.

    Returns the times [s] that relaxation took, and the errors of scenarios without equilibrium, by
    scenario. Raises Interrupted.
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
    part = longest_block(solver.models[0].element_count)
    parts = [min(part, BLOCK - done) for done in range(0, BLOCK, part)]
    while moving := [s for s in limits if s not in took and s not in failed]:
        is_moving = np.bincount(moving, minlength=solver.scenarios)
        solver.begin_block()
        for part in parts:
            if asked_to_stop:
                raise interrupted_before_start(asked_to_stop)
            solver.go_on(is_moving * part)
        reader.update()
        for s in moving:
            try:
                if is_settled(solver.scenario(s), reader):
                    took[s] = float(solver.times[s]) + limits[s]
            except StabilityError as error:
                failed[s] = error
    solver.start_clock(kept)
    return took, failed


def interrupted_before_start(asked_to_stop: Sequence[int]) -> Interrupted:
    """Return the error of a run that received these signals before t = 0."""
    return Interrupted(
        f"stopped by {Signals(asked_to_stop[0]).name} before t = 0",
        hint="there is no checkpoint yet: start the run again",
    )


def is_settled(scenario: Scenario, reader: EnergyReader) -> bool:
    """Return True if forces balance and nothing moves; the reader must be up to date.

    Raises StabilityError if an element is broken, or if there is no equilibrium at t = 0.
    """
    model, settling = scenario.model, scenario.model.settling
    assert settling is not None
    refuse_broken_elements(model, scenario.positions(), scenario.time)
    if scenario.time < settling.shortest - settling.longest:  # walls still close on bodies
        return False
    share = unbalanced_share(scenario)
    if share <= settling.tolerance and not moves(reader.of_scenario(scenario.number), settling):
        return True
    if scenario.time >= 0.0:
        refuse_unsettled(share, settling)
    return False


def unbalanced_share(scenario: Scenario) -> float:
    """Return the unbalanced force over the internal forces, both root sums of squares [-].

    Unbalanced: the net force on free components of nodes and rigid bodies, with a torque T as the
    force sqrt(m T I^-1 T), its equivalent at the radius of gyration. Internal: every single nodal
    force of elements, pressure, loads and contact. Zero if there is no force at all.
    """
    terms, model, read = scenario.terms, scenario.model, scenario.read
    net = read(terms.nodes.force) + model.mass[:, None] * read(terms.nodes.gravity)
    unbalanced = float((net[model.is_free] ** 2).sum())
    inner = 0.0
    for component in terms.nodes.corner_forces.component:
        inner += float((read(component) ** 2).sum())
    if terms.rigid_bodies.count:
        bodies = terms.rigid_bodies
        torque, rotation = read(bodies.torque), read(bodies.rotation)
        local = np.einsum("bij,bi->bj", rotation, torque)
        turning = np.einsum("bi,bij,bj->b", local, fields.read(bodies.inverse_inertia), local)
        unbalanced += float((read(bodies.force) ** 2).sum())
        unbalanced += float((fields.read(bodies.mass) * turning).sum())
    return float(np.sqrt(unbalanced / inner)) if inner > 0.0 else 0.0


def moves(energies: Energies, relaxation: Relaxation) -> bool:
    """Return True if the kinetic energy is too large for equilibrium.

    A body that moves through equilibrium has balanced forces there but still moves. Kinetic energy
    is compared with the square of the tolerance. At a turning point the forces do not balance.
    """
    return energies.kinetic > relaxation.tolerance**2 * energies.reference_energy
