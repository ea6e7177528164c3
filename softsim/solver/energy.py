"""The energy books: what was put in must be stored, moving, or dissipated.

internal (ALLSE of ABAQUS: law, Maxwell springs, cables, layers, fibres, tendons, tethers), of which
a part is that of the elements' hourglass modes (ALLAE there), kinetic (ALLKE), contact springs
(ALLPW), friction (ALLFD: contact, tethers, ends of cables), viscous (ALLVD + ALLCD: Maxwell
dashpots, bulk viscosity, contact dashpots), external work (ALLWK: pressure, motor, nodal forces,
gravity). The balance (ETOTAL) is their sum less the external work and less what was there at the
start.
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
    def reference_energy(self) -> float:
        """Size of the books [J], against which an error is measured."""
        accounted = self.balance + self.external_work
        return max(abs(accounted), abs(self.external_work), self.kinetic + self.internal)


@dataclass(frozen=True)
class WallContactTotals:
    """Sums over the nodes in contact with walls.

    contact_count: nodes, and corners of walls, that touch now. Impulses [N s] since they were
    cleared: normal_impulse, the sum of the normal ones; slipping_impulse, the part of it that nodes
    carried while they slipped; impulse (d,), the vector.
    """

    contact_count: int
    normal_impulse: float
    slipping_impulse: float
    impulse: np.ndarray

    @property
    def slip_share(self) -> float:
        """Share of the normal impulse that was carried in slip [-]; 0 without contact."""
        return self.slipping_impulse / self.normal_impulse if self.normal_impulse > 0.0 else 0.0


@ti.data_oriented
class EnergyReader:
    """Reads energies, wall contact and the places of rigid bodies of all scenarios in two kernels:
    copying every field out would cost more than a hundred increments.

    places (scenarios, bodies, d + 4 + 9): centre, orientation, rotation of each body. impulses
    (scenarios, contact nodes): normal ones of walls on each [N s] since they were cleared.
    """

    def __init__(self, solver: ExplicitSolver) -> None:
        self.solver = solver
        self.terms, self.bodies = solver.terms, solver.terms.rigid_bodies
        self.dimension = solver.terms.nodes.dimension
        self.serially = backend.device().name == "cpu"
        self.readings = np.zeros((solver.scenarios, 10 + 2 * self.dimension))
        bodies, contact = len(solver.models[0].rigid_bodies), solver.models[0].contact
        self.places = np.zeros((solver.scenarios, max(1, bodies), self.dimension + 4 + 9))
        self.impulses = np.zeros((solver.scenarios, max(1, len(contact.nodes))))
        self.masses = [float(model.mass[: model.meshed_count].sum()) for model in solver.models]

    def update(self) -> None:
        """Read the present values of all scenarios; `of_scenario` returns them."""
        self.impulses[:] = 0.0
        self._read(self.solver.time_increments, self.readings)
        self._see(self.places, self.impulses)

    def of_scenario(self, scenario: int) -> tuple[Energies, WallContactTotals, np.ndarray]:
        """Energies, wall contact, and the centre of mass of meshed bodies (d,) [m] of a scenario at
        the last update.
        """
        row = self.readings[scenario]
        impulse, moment = row[10 : 10 + self.dimension].copy(), row[10 + self.dimension :]
        walls = WallContactTotals(int(row[7]), row[8], row[9], impulse)
        return Energies(*row[:7]), walls, moment / self.masses[scenario]

    def place_of(self, scenario: int, body: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Centre of mass (d,) [m], orientation (4,) and rotation (3, 3) of a rigid body at the last
        update.
        """
        centre, orientation, rotation = np.split(
            self.places[scenario, body].copy(), [self.dimension, self.dimension + 4]
        )
        return centre, orientation, rotation.reshape(3, 3)

    def normal_impulses(self, scenario: int) -> np.ndarray:
        """Of walls on each node of a scenario (n,) [N s], from when they were cleared to the last
        update.
        """
        model = self.solver.models[scenario]
        found = np.zeros(len(model.points))
        nodes = model.contact.nodes
        found[nodes] = self.impulses[scenario, : len(nodes)]
        return found

    def read(self, scenario: int = 0) -> tuple[Energies, WallContactTotals, np.ndarray]:
        """Update, and return the values of a scenario."""
        self.update()
        return self.of_scenario(scenario)

    @ti.kernel
    def _read(
        self,
        steps: ti.types.ndarray(ti.f64, ndim=1),  # type: ignore[valid-type]  # Taichi wants an instance
        readings: ti.types.ndarray(ti.f64, ndim=2),  # type: ignore[valid-type]  # Taichi wants an instance
    ):
        # A parallel loop misses Taichi's kernel cache; on a GPU a scenario after the other is slow.
        ti.loop_config(serialize=self.serially)
        for s in range(self.solver.scenarios):
            dt = steps[s]
            internal = ti.cast(0.0, backend.real)
            hourglass = ti.cast(0.0, backend.real)
            contact = ti.cast(0.0, backend.real)
            friction = ti.cast(0.0, backend.real)
            viscous = ti.cast(0.0, backend.real)
            work = self.terms.nodes.weight_work(s) + self.terms.rigid_bodies.weight_work(s)
            work += self.terms.rigid_bodies.work_done(s, dt)
            for term in ti.static(self.terms.inner):
                internal += term.stored_energy(s)
            for elements in ti.static(self.terms.elements):
                hourglass += elements.hourglass_energy(s)
            for term in ti.static(self.terms.touching):
                contact += term.stored_energy(s)
            for term in ti.static(self.terms.everything):
                dissipated = term.dissipated_energy(s)
                friction += dissipated[0]
                viscous += dissipated[1]
                work += term.work_done(s, dt)
            if ti.static(self.terms.nodes.relaxes):
                viscous += self.terms.nodes.damped_energy(s)
                viscous += self.terms.rigid_bodies.damped_energy(s)
            readings[s, 0] = internal
            readings[s, 1] = hourglass
            readings[s, 2] = self.terms.nodes.kinetic_energy(
                s, dt
            ) + self.terms.rigid_bodies.kinetic_energy(s, dt)
            readings[s, 3] = contact
            readings[s, 4] = friction
            readings[s, 5] = viscous
            readings[s, 6] = work
            touching = 0
            normal_impulse = ti.cast(0.0, backend.real)
            slipping_impulse = ti.cast(0.0, backend.real)
            impulse = ti.Vector.zero(backend.real, self.dimension)
            for walls in ti.static(self.terms.wall_contacts):
                touching += walls.touching_nodes(s)
                normal_impulse += walls.total_normal_impulse(s)
                slipping_impulse += walls.total_slipping_impulse(s)
                impulse += walls.total_impulse(s)
            moment = self.terms.nodes.mass_moment(s, self.terms.meshed_count.read())
            readings[s, 7] = touching
            readings[s, 8] = normal_impulse
            readings[s, 9] = slipping_impulse
            for i in ti.static(range(self.dimension)):
                readings[s, 10 + i] = impulse[i]
                readings[s, 10 + self.dimension + i] = moment[i]

    @ti.kernel
    def _see(
        self,
        places: ti.types.ndarray(ti.f64, ndim=3),  # type: ignore[valid-type]  # Taichi wants an instance
        impulses: ti.types.ndarray(ti.f64, ndim=2),  # type: ignore[valid-type]  # Taichi wants an instance
    ):
        # A kernel of its own: beside it the compiler adds up impulses in another order.
        ti.loop_config(serialize=self.serially)
        for s in range(self.solver.scenarios):
            for walls in ti.static(self.terms.wall_contacts):
                for i in range(walls.touched_count.read()):
                    impulses[s, i] += walls.normal_impulse[s, i]
            for r in range(self.bodies.count):
                for i in ti.static(range(self.dimension)):
                    places[s, r, i] = self.bodies.centre[s, r][i]
                for i in ti.static(range(4)):
                    places[s, r, self.dimension + i] = self.bodies.orientation[s, r][i]
                for i, j in ti.static(ti.ndrange(3, 3)):
                    places[s, r, self.dimension + 4 + 3 * i + j] = self.bodies.rotation[s, r][i, j]


def weight_energy(model: Model) -> float:
    """Weight of all bodies times the height of the meshed ones, m g h [J]."""
    mass = model.mass.sum() + sum(body.mass for body in model.rigid_bodies)
    along = np.concatenate([b.points for b in model.bodies]) @ model.gravity  # height times g
    return float(mass * np.ptp(along))


class EnergyBalance:
    """Error of the balance relative to the largest reference energy so far."""

    def __init__(self, initial: float, largest_energy: float) -> None:
        self.initial, self.largest_energy = initial, largest_energy

    @classmethod
    def starting(cls, energies: Energies, model: Model) -> "EnergyBalance":
        """The books of a run that starts with these energies.

        Where nothing happens, a small difference of small energies is no error. The reference
        energy counts as at least what everything weighs times how high it is, which a body at rest
        has too; and, without gravity, for the round-off of what is stored, as 1e-12 of the energy
        that would double the bodies' volume.
        """
        stiffness = sum(r.material.bulk_modulus * float(r.volumes.sum()) for r in model.regions)
        return cls(
            energies.balance,
            max(energies.reference_energy, weight_energy(model), 1e-12 * stiffness),
        )

    def error(self, energies: Energies) -> float:
        """|balance - initial balance| / largest reference energy [-]."""
        self.largest_energy = max(self.largest_energy, energies.reference_energy)
        return abs(energies.balance - self.initial) / self.largest_energy
