"""Balance of forces and rest: the end of a dynamic relaxation."""

import numpy as np

from softsim import fields
from softsim.model import Relaxation
from softsim.solver.energy import Energies
from softsim.solver.explicit import Scenario


def unbalanced_share(scenario: Scenario) -> float:
    """Unbalanced force over inner forces, both root sums of squares [-].

    Unbalanced: what accelerates free components of nodes and rigid bodies, a torque T as the force
    sqrt(m T I^-1 T) that it is at the radius of gyration. Inner: every corner force of elements,
    pressure, loads and contact. Zero where there is no force at all.
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
    """True if a body on its way through equilibrium, where forces balance, still moves.

    Kinetic energy goes with the square of the distance from equilibrium. At a turning point it is
    forces that do not balance.
    """
    return energies.kinetic > relaxation.tolerance**2 * energies.reference_energy
