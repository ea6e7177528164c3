"""The energy books: what was put in must be stored, moving, or dissipated.

internal (ALLSE of ABAQUS, law and Maxwell springs), kinetic (ALLKE), contact springs (ALLPW),
friction (ALLFD), viscous (ALLVD + ALLCD: Maxwell dashpots, bulk viscosity, contact dashpots),
external work (ALLWK: pressure, motor, nodal forces, gravity). The balance (ETOTAL) is their sum
less the external work and less what was there at the start.
"""

from dataclasses import dataclass

import numpy as np

from softsim.solver.explicit import ExplicitSolver


@dataclass(frozen=True)
class Energies:
    """Energies [J] of one scenario at one time."""

    internal: float
    kinetic: float
    contact: float
    friction_dissipation: float
    viscous_dissipation: float
    external_work: float

    @property
    def balance(self) -> float:
        """Constant when energy is kept [J]."""
        return (
            self.internal
            + self.kinetic
            + self.contact
            + self.friction_dissipation
            + self.viscous_dissipation
            - self.external_work
        )

    @property
    def turnover(self) -> float:
        """Size of the books [J], against which an error is measured."""
        accounted = self.balance + self.external_work
        return max(abs(accounted), abs(self.external_work), self.kinetic + self.internal)


def measure(solver: ExplicitSolver) -> list[Energies]:
    """Energies of each scenario now."""
    terms = solver.terms
    scenarios = solver.scenarios
    zero = np.zeros(scenarios)
    internal = sum((b.internal_energy() for b in terms.bodies), zero)
    viscous = sum((b.viscous_dissipation() for b in terms.bodies), zero)
    contact = sum((c.contact_energy() for c in terms.contacts), zero)
    friction = sum((c.friction_dissipation.to_numpy().sum(axis=1) for c in terms.contacts), zero)
    viscous = viscous + sum(
        (c.damping_dissipation.to_numpy().sum(axis=1) for c in terms.contacts), zero
    )
    work = sum((load.external_work() for load in [*terms.pressures, *terms.nodal_forces]), zero)
    if terms.rigid_bodies.count:
        work = work + terms.rigid_bodies.applied_work.to_numpy().sum(axis=1)
    work = work + gravity_work(solver)
    columns = zip(
        internal, kinetic_energy(solver), contact, friction, viscous, work, strict=True
    )
    return [Energies(*map(float, row)) for row in columns]


def kinetic_energy(solver: ExplicitSolver) -> np.ndarray:
    """Kinetic energy of nodes and rigid bodies [J], (scenarios,)."""
    v = solver.node_velocities()
    energy = 0.5 * np.einsum("a,sai,sai->s", solver.models[0].mass, v, v)
    bodies = solver.terms.rigid_bodies
    if bodies.count:
        velocity, omega = solver.rigid_velocities()
        energy = energy + 0.5 * np.einsum("r,sri,sri->s", bodies.mass.to_numpy(), velocity, velocity)
        energy = energy + 0.5 * np.einsum("r,sr,sr->s", bodies.inertia.to_numpy(), omega, omega)
    return energy


def gravity_work(solver: ExplicitSolver) -> np.ndarray:
    """Work of the weight since t = 0 [J], (scenarios,)."""
    model = solver.models[0]
    gravity = np.stack([m.gravity for m in solver.models])
    loose = np.where(model.is_free, model.mass, 0.0)
    moved = np.einsum("a,sai->si", loose, solver.positions() - model.points)
    bodies = solver.terms.rigid_bodies
    if bodies.count:
        shift = bodies.centre.to_numpy() - bodies.rest_centre
        moved = moved + np.einsum("r,sri->si", bodies.mass.to_numpy(), shift)
    return np.einsum("si,si->s", gravity, moved)


class EnergyBalance:
    """Error of the balance relative to the largest turnover so far."""

    def __init__(self, initial: float, largest_turnover: float) -> None:
        self.initial, self.largest_turnover = initial, largest_turnover

    @classmethod
    def starting(cls, energies: Energies) -> "EnergyBalance":
        """The books of a run that starts with these energies."""
        return cls(energies.balance, energies.turnover)

    def error(self, energies: Energies) -> float:
        """|balance - initial balance| / largest turnover [-]; zero while nothing has happened."""
        self.largest_turnover = max(self.largest_turnover, energies.turnover)
        if self.largest_turnover == 0.0:
            return 0.0
        return abs(energies.balance - self.initial) / self.largest_turnover
