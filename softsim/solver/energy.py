"""Energy balance: external work equals the change of stored, kinetic and dissipated energy.

The terms are internal energy (ALLSE of ABAQUS: law, Maxwell springs, cables, layers, fibres,
tendons, tethers), which includes that of the hourglass modes (ALLAE), kinetic energy (ALLKE),
contact springs (ALLPW), friction (ALLFD: contact, tethers, ends of cables), viscous dissipation
(ALLVD + ALLCD: Maxwell dashpots, bulk viscosity, contact dashpots, local damping) and external work
(ALLWK: pressure, motor, nodal forces, gravity). The balance (ETOTAL) is the sum of the others minus
the external work and minus its initial value.
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim import backend
from softsim.model import Model
from softsim.solver.explicit import ExplicitSolver


@dataclass(frozen=True)
class Energies:
    """Energies [J] of one scenario at one time."""

    internal: float
    hourglass: float
    kinetic: float
    contact: float
    friction_dissipation: float
    viscous_dissipation: float
    external_work: float

    @property
    def balance(self) -> float:
        """Sum of all energies minus the external work [J], constant if energy is conserved."""
        return (
            self.internal
            + self.kinetic
            + self.contact
            + self.friction_dissipation
            + self.viscous_dissipation
            - self.external_work
        )

    @property
    def reference_energy(self) -> float:
        """Energy [J] to which an error of the balance is relative."""
        accounted = self.balance + self.external_work
        return max(abs(accounted), abs(self.external_work), self.kinetic + self.internal)


@ti.data_oriented
class EnergyReader:
    """Kernel class that computes the energies of all scenarios in one launch.

    Most energies are not stored in fields: they follow from stretches, gaps and velocities.
    readings (scenarios, 7) [J]: in the order of Energies; in_parts (scenarios, parts, 7): the
    partial sums of each.
    """

    def __init__(self, solver: ExplicitSolver) -> None:
        self.solver = solver
        self.terms, self.bodies = solver.terms, solver.terms.rigid_bodies
        self.serially, self.parts = backend.device().name == "cpu", backend.device().parts
        self.in_parts = np.zeros((solver.scenarios, self.parts, 7))
        self.readings = self.in_parts.sum(axis=1)

    def update(self) -> None:
        """Compute the current energies of all scenarios, which `of_scenario` returns."""
        self._read(self.solver.time_increments, self.in_parts)
        self.readings = self.in_parts.sum(axis=1)

    def of_scenario(self, scenario: int) -> Energies:
        """Return the energies of a scenario at the last update."""
        return Energies(*self.readings[scenario].tolist())

    def read(self, scenario: int = 0) -> Energies:
        """Compute and return the current energies of a scenario."""
        self.update()
        return self.of_scenario(scenario)

    @ti.kernel
    def _read(
        self,
        steps: ti.types.ndarray(ti.f64, ndim=1),  # type: ignore[valid-type]  # Taichi wants an instance
        in_parts: ti.types.ndarray(ti.f64, ndim=3),  # type: ignore[valid-type]  # Taichi wants an instance
    ):
        # A parallel loop misses Taichi's kernel cache; on a GPU one thread for all is slow.
        ti.loop_config(serialize=self.serially)
        for k in range(self.solver.scenarios * self.parts):
            s, part = k // self.parts, k % self.parts
            dt = steps[s]
            internal = ti.cast(0.0, backend.real)
            hourglass = ti.cast(0.0, backend.real)
            contact = ti.cast(0.0, backend.real)
            friction = ti.cast(0.0, backend.real)
            viscous = ti.cast(0.0, backend.real)
            kinetic = self.terms.nodes.kinetic_energy(s, dt, part)
            work = self.terms.nodes.weight_work(s, part)
            if part == 0:
                kinetic += self.bodies.kinetic_energy(s, dt)
                work += self.bodies.weight_work(s)
                work += self.bodies.work_done(s, dt)
            for term in ti.static(self.terms.inner):
                internal += term.stored_energy(s, part)
            for elements in ti.static(self.terms.elements):
                hourglass += elements.hourglass_energy(s, part)
            for term in ti.static(self.terms.touching):
                contact += term.stored_energy(s, part)
            for term in ti.static(self.terms.everything):
                dissipated = term.dissipated_energy(s, part)
                friction += dissipated[0]
                viscous += dissipated[1]
                work += term.work_done(s, dt, part)
            if ti.static(self.terms.nodes.relaxes):
                viscous += self.terms.nodes.damped_energy(s, part)
                if part == 0:
                    viscous += self.bodies.damped_energy(s)
            in_parts[s, part, 0] = internal
            in_parts[s, part, 1] = hourglass
            in_parts[s, part, 2] = kinetic
            in_parts[s, part, 3] = contact
            in_parts[s, part, 4] = friction
            in_parts[s, part, 5] = viscous
            in_parts[s, part, 6] = work


def weight_energy(model: Model) -> float:
    """Return the weight of all bodies times the height of the meshed ones, m g h [J]."""
    mass = model.mass.sum() + sum(body.mass for body in model.rigid_bodies)
    along = np.concatenate([b.points for b in model.bodies]) @ model.gravity  # height times g
    return float(mass * np.ptp(along))


class EnergyBalance:
    """Error of the energy balance relative to the largest reference energy so far."""

    def __init__(self, initial: float, largest_energy: float) -> None:
        self.initial, self.largest_energy = initial, largest_energy

    @classmethod
    def starting(cls, energies: Energies, model: Model) -> "EnergyBalance":
        """Return the balance of a run that starts with these energies.

        The reference energy has a lower bound, so that a small difference of small energies is not
        an error: the weight of all bodies times the height of the meshed ones, and, for round-off
        without gravity, 1e-12 times the sum of bulk modulus times volume.
        """
        stiffness = sum(r.material.bulk_modulus * float(r.volumes.sum()) for r in model.regions)
        return cls(
            energies.balance,
            max(energies.reference_energy, weight_energy(model), 1e-12 * stiffness),
        )

    def error(self, energies: Energies) -> float:
        """Return |balance - initial balance| / largest reference energy [-]."""
        self.largest_energy = max(self.largest_energy, energies.reference_energy)
        return abs(energies.balance - self.initial) / self.largest_energy
