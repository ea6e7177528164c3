"""Energy balance: external work equals the change of stored, kinetic and dissipated energy.

The terms are internal energy (ALLSE of ABAQUS: law, Maxwell springs, cables, layers, fibres,
tendons, tethers), which includes that of the hourglass modes (ALLAE), kinetic energy (ALLKE),
contact springs (ALLPW), friction (ALLFD: contact, tethers, ends of cables), viscous dissipation
(ALLVD + ALLCD: Maxwell dashpots, bulk viscosity, contact dashpots, local damping), dissipation by
the softening of materials (ALLDMD) and external work (ALLWK: pressure, motor, nodal forces,
gravity). The balance (ETOTAL) is the sum of the others minus the external work and minus its
initial value.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from signal import Signals

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.taichi_internals import Launch
from softsim.compute.term import Samples
from softsim.errors import Interrupted, StabilityError
from softsim.model import LOCAL_DAMPING, Model, Relaxation
from softsim.solver.explicit import ExplicitSolver, Scenario, longest_block
from softsim.solver.guards import refuse_broken_elements, refuse_unsettled
from softsim.solver.terms import Terms


@dataclass(frozen=True)
class Energies:
    """Energies [J] of one scenario at one time."""

    internal: float
    hourglass: float
    kinetic: float
    contact: float
    friction_dissipation: float
    viscous_dissipation: float
    damage_dissipation: float
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
            + self.damage_dissipation
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
    readings (scenarios, 8) [J]: in the order of Energies; in_parts (scenarios, parts, 8): the
    partial sums of each. is_current: False once the states have changed, which the owner sets.
    """

    def __init__(self, solver: ExplicitSolver) -> None:
        self.solver = solver
        self.terms, self.bodies = solver.terms, solver.terms.rigid_bodies
        self.serially, self.parts = backend.device().name == "cpu", backend.device().parts
        self.in_parts = np.zeros((solver.scenarios, self.parts, 8))
        self.readings = self.in_parts.sum(axis=1)
        self.is_current = False

    @property
    def rests(self) -> list[bool]:
        """For each scenario, True if its states are equilibria, which have no kinetic energy."""
        return [model.takes_load_steps for model in self.solver.models]

    def update(self) -> None:
        """Compute the current energies of all scenarios, which `of_scenario` returns."""
        self._launch(self.solver.time_increments, self.in_parts)
        self.readings = self.in_parts.sum(axis=1)
        if any(rests := self.rests):
            self.readings[rests, 2] = 0.0
        self.is_current = True

    def refresh(self) -> None:
        """Update unless the energies are current: once for all scenarios that have a row."""
        if not self.is_current:
            self.update()

    @cached_property
    def _launch(self) -> Launch:
        return Launch(self._read, self.solver.time_increments, self.in_parts)

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
            damage = ti.cast(0.0, backend.real)
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
                damage += elements.damage_energy(s, part)
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
            in_parts[s, part, 6] = damage
            in_parts[s, part, 7] = work


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


# -------------------------------------------------------------------------------------------------
# Dynamic relaxation by local damping (Nodes.shift_damped) before t = 0, and its end.
#
# Before t = 0 weight, contact and friction act. Loads are off, as at all times before zero, and
# Maxwell branches have relaxed, as in a body that has been at rest for long.

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
    solver.begin(time_increments / np.sqrt(1.0 + LOCAL_DAMPING))  # see solver/stable_step.py
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
            solver.continue_block(is_moving * part)
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


# -------------------------------------------------------------------------------------------------
# Impulses of the walls on the nodes of a scenario since they were last cleared.


@dataclass(frozen=True)
class WallContact:
    """Contact with all walls together, at the times (rows,) of samples.

    contact_count (rows,): nodes, and corners of walls, in contact now. normal_impulses: of each
    node (rows, n) [N s]. slipping_impulse (rows,): the part of their sum that acted while nodes
    slipped [N s]. impulse: the total impulse vector (rows, d) [N s].
    """

    contact_count: np.ndarray
    normal_impulses: np.ndarray
    slipping_impulse: np.ndarray
    impulse: np.ndarray

    @property
    def normal_impulse(self) -> np.ndarray:
        """Sum of the normal impulses of all nodes (rows,) [N s]."""
        total: np.ndarray = self.normal_impulses.sum(axis=-1)
        return total

    @property
    def slip_share(self) -> np.ndarray:
        """Fraction of the normal impulse that acted during slip (rows,); 0 without contact."""
        whole = self.normal_impulse
        none = np.zeros_like(whole)
        return np.divide(self.slipping_impulse, whole, out=none, where=whole > 0.0)


def wall_fields(terms: Terms) -> list[ti.Field]:
    """Return the fields that `wall_contact` reads."""
    return [f for walls in terms.wall_contacts for f in (walls.pressing_force, *walls.impulses())]


def wall_contact(scenario: Scenario, samples: Samples) -> WallContact:
    """Return the contact of a scenario's nodes with its walls, from samples of `wall_fields`."""
    model, read, rows = scenario.model, samples.read, len(samples)
    normal_impulses = np.zeros((rows, len(model.points)))
    count, slipping, impulse = np.zeros(rows), np.zeros(rows), np.zeros((rows, model.dimension))
    nodes = model.contact.nodes
    for walls in scenario.terms.wall_contacts:
        count += np.count_nonzero(read(walls.pressing_force) > 0.0, axis=1)
        normal_impulses[:, nodes] += read(walls.normal_impulse)[:, : len(nodes)]
        slipping += read(walls.slipping_impulse).sum(axis=1)
        impulse += read(walls.impulse).sum(axis=1)
    return WallContact(count, normal_impulses, slipping, impulse)
