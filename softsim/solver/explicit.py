"""Explicit central difference solver with velocities at half steps.

x(n+1) = x(n) + dt v(n+1/2);  forces at x(n+1);  v(n+3/2) = v(n+1/2) + dt f(n+1) / m.
After a block of increments, positions and forces belong to the same time; the velocity at that time
is the half-step velocity minus half a kick.

An increment has three substeps: `drift`, `forces`, `kick`. solver/increments.py distributes their
work over threads.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import Row
from softsim.compute.machine import ComputeDevice, memory_of
from softsim.compute.nodes import PARTS
from softsim.compute.term import Pass, Stage, shares_kernels
from softsim.elements.geometry import alike_regions
from softsim.errors import DeviceError, OutputError
from softsim.loads.load import Load
from softsim.model import Model
from softsim.rigid import Pose
from softsim.solver.guards import (
    BodyPenetration,
    Chatter,
    Penetration,
    body_penetration,
    chatter,
    penetration,
)
from softsim.solver.increments import DRIFT, DT, KICK, IncrementKernels, Span, Substep
from softsim.solver.terms import Terms, filled

# -------------------------------------------------------------------------------------------------
# Check that a model fits the free memory of the device that runs it.

# What a process takes beside its fields: bytes, and bytes an element. CPU: Python, Taichi and
# compiled kernels; working arrays of the start, the guards and frames (both measured, the second at
# 208,000 triangles). CUDA: a context of some 0.5 GB and Taichi's own pool of 1 GiB (its
# device_memory_GB); working arrays live in the CPU's memory.
BASE_MEMORY = {"cpu": (300e6, 1000.0), "cuda": (1.6e9, 0.0)}

# More than any element takes [bytes]: what fits with this needs no count, which takes a second.
ELEMENT_BYTES_BOUND = 20_000.0


def field_bytes(model: Model, scenarios: int) -> int:
    """Return the size [bytes] of all fields of a model's terms, without allocating them.

    The terms are built for this, which takes half a second for 30,000 tetrahedra; the result
    depends on the lanes of the backend, which must have been started.
    """
    with fields.counted(scenarios) as made:
        Terms([model] * scenarios)
    return made.size


def refuse_before_start(model: Model, device: str) -> None:
    """Raise DeviceError if a model does not fit the free memory of a device ("cpu" or "cuda").

    Called before files of an earlier run are changed. The error gives the number of elements that
    would fit.
    """
    place = memory_of(device)
    if (
        place is None
        or BASE_MEMORY[device][0] + ELEMENT_BYTES_BOUND * model.element_count <= place.memory.free
    ):
        return
    backend.start(device)
    refuse_too_large(model, field_bytes(model, scenarios=1), device, place)


def refuse_too_large(model: Model, size: int, device: str, place: ComputeDevice | None) -> None:
    """Raise DeviceError if the fields of a model, of `size` bytes, do not fit the free memory.

    device: "cpu" or "cuda". place: its memory, None if unknown; then nothing is raised. The error
    gives the number of elements that would fit.
    """
    if place is None:
        return
    free, (fixed, an_element) = place.memory.free, BASE_MEMORY[device]
    growing = an_element * model.element_count + size
    need = fixed + growing
    if need <= free:
        return
    elements = int(model.element_count * max(0.0, free - fixed) / growing)
    way_out = f"at most {elements:,} elements of this kind" if elements else "free some memory"
    if device == "cuda":
        way_out += ", or --device cpu"
    raise DeviceError(
        f"{model.element_count:,} elements need {_gigabytes(need)}; {_gigabytes(free)} are free "
        f"on {place.name}",
        hint=way_out,
    )


def scenarios_that_fit(model: Model, device: str, place: ComputeDevice | None) -> int | None:
    """Return the number of scenarios of a model that fit the free memory of a device.

    None if the memory is unknown (place: None).
    """
    if place is None:
        return None
    one, two = (field_bytes(model, scenarios) for scenarios in (1, 2))
    each, (fixed, an_element) = two - one, BASE_MEMORY[device]
    left = place.memory.free - fixed - an_element * model.element_count - (one - each)
    return max(0, int(left // each))


def _gigabytes(size: float) -> str:
    return f"{size / 1e9:.3g} GB"


# -------------------------------------------------------------------------------------------------
# Substeps of an increment, in this order.


def drift(terms: Terms) -> Substep:
    """Return the substep that moves all nodes and bodies by dt times their half-step velocity."""
    nodes, bodies = terms.nodes, terms.rigid_bodies
    stages = filled(
        terms.passes_of(Stage.STEER),
        [
            Pass("integration", int(nodes.count), (nodes.drift,)),
            Pass("integration", bodies.count, (bodies.drift,)),
        ],
        [Pass("integration", bodies.tied_count, (bodies.place_tied,))],
    )
    return Substep(stages, DRIFT, moves=True)


def forces(terms: Terms) -> Substep:
    """Return the substep that computes every force at the new positions."""
    return Substep(terms.force_stages(), DT)


def kick(terms: Terms) -> Substep:
    """Return the substep that computes new half-step velocities from the summed forces."""
    bodies = terms.rigid_bodies
    stages = filled(
        *([Pass("integration", count, (function,))] for count, function in terms.nodes.kicks()),
        [Pass("integration", bodies.count * PARTS, (bodies.collect,))],
        [Pass("integration", bodies.count, (bodies.kick,))],
    )
    return Substep(stages, KICK)


def shift(terms: Terms) -> Substep:
    """Return the substep that advances velocities by a kick with the last forces, between steps."""
    nodes, bodies = terms.nodes, terms.rigid_bodies
    stages = filled(
        [
            Pass("integration", int(nodes.count), (nodes.shift,)),
            Pass("integration", bodies.count, (bodies.shift,)),
        ]
    )
    return Substep(stages, KICK)


# Element updates of a block of increments (output, signals): 80 ms at 50 M/s. Of a million elements
# the shortest takes 0.3 s. It depends on the model only, so that every run has the same blocks.
BLOCK_UPDATES = 4_000_000
SHORTEST_BLOCK, LONGEST_BLOCK = 16, 1024


class ExplicitSolver:
    """Explicit solver of one model, or of several scenarios of it, each with its own time step.

    Results of a scenario do not depend on the other scenarios in the batch. times [s],
    increment_counts, time_increments [s]: simulated time, increments done and step in use of each
    scenario, (scenarios,).

    Raises DeviceError if the device has too little memory. No memory is allocated then, and Taichi
    has to be started again.
    """

    def __init__(self, models: list[Model]) -> None:
        self.models = models
        self.scenarios = len(models)
        with fields.together(self.scenarios) as made:
            self.terms = Terms(models)
            self._made, self._made_by_terms = made, len(made.fields)
            self.kernels = IncrementKernels(
                [drift(self.terms), forces(self.terms), kick(self.terms)],
                shift(self.terms),
                self.scenarios,
            )
            device = backend.device().name
            refuse_too_large(models[0], made.size, device, memory_of(device))
        impulses = [field for term in self.terms.everything for field in term.impulses()]
        self.impulses = [Row(impulses, s) for s in range(self.scenarios)]
        self._reset_clocks()

    def _reset_clocks(self) -> None:
        self.times, self.time_increments = np.zeros(self.scenarios), np.zeros(self.scenarios)
        self.load_times = self.times  # but along a path of equilibria
        self.increment_counts = np.zeros(self.scenarios, dtype=int)
        self.block_starts, self.done_in_block = self.times.copy(), self.increment_counts.copy()

    def take_models(self, models: list[Model]) -> bool:
        """Replace the models, reusing memory and compiled kernels, and reset the state.

        Numbers may differ: material constants, dimensions of a mesh with the same elements, loads.
        Returns False if the kernels do not fit the models because their structure or the number of
        scenarios differs. The solver must not be used any more then.
        """
        if len(models) != self.scenarios:
            return False
        try:
            with fields.refilled(self._made, self._made_by_terms):
                terms = Terms(models)
        except fields.DifferentFieldsError:
            return False
        if not shares_kernels(self.terms, terms):
            return False
        self.models, self.terms = models, terms
        self._reset_clocks()
        return True

    @contextmanager
    def lent(self) -> Iterator[None]:
        """Return to the present model and state at the end of the block.

        The block may take other models.
        """
        clocks = ("time_increments", "increment_counts", "block_starts", "done_in_block")
        kept = {name: getattr(self, name).copy() for name in clocks}
        times, load_times = self.times, self.load_times  # often one array
        before = times.copy(), load_times.copy()
        models, terms, state = self.models, self.terms, self.state()
        try:
            yield
        finally:
            self.take_models(models)
            self.models, self.terms = models, terms  # what refers to these terms stays valid
            self.restore(state, 0.0, 0, float(kept["time_increments"][0]))
            for name, values in kept.items():
                setattr(self, name, values)
            self.times, self.load_times = times, load_times
            times[:], load_times[:] = before

    @property
    def time(self) -> float:
        """Simulated time of the first scenario [s]."""
        return float(self.times[0])

    @property
    def increment_count(self) -> int:
        """Number of increments that the first scenario has done."""
        return int(self.increment_counts[0])

    @property
    def time_increment(self) -> float:
        """Step in use of the first scenario [s]."""
        return float(self.time_increments[0])

    def compile(self) -> None:
        """Compile the kernels of an increment, or load them from the cache; nothing moves."""
        self.kernels.compile()

    def begin(self, dt: float | np.ndarray) -> None:
        """Compute the forces at t = 0 and the first half kick, and reset the energy balance.

        dt: the next steps [s], one for all scenarios, or (scenarios,).
        """
        self.start_motion(dt)
        self.reset_energy_balance()

    def start_motion(self, dt: float | np.ndarray) -> None:
        """Compute the current forces and the first half kick; dt as for `begin`."""
        for s, step in enumerate(np.broadcast_to(dt, self.scenarios)):
            self._set_time_increment(s, float(step))
        self._stand(self.time_increments, kicks=0.5 * self.time_increments)

    def reset_energy_balance(self) -> None:
        """Reset work and dissipation of the energy balance to zero."""
        nodes, bodies = self.terms.nodes, self.terms.rigid_bodies
        for term in self.terms.everything:
            term.forget_work()
            for s in range(self.scenarios):
                term.forget_dissipation(s)
        for work in (bodies.applied_work, nodes.damping_work, bodies.damping_work):
            fields.write(work, 0.0)

    # --- before the clock starts -----------------------------------------------------------------

    @property
    def _velocities(self) -> list[ti.Field]:
        """Velocity fields of nodes and rigid bodies, with the angular momentum of the bodies."""
        bodies = self.terms.rigid_bodies
        of_bodies = [bodies.velocity, bodies.angular_momentum, bodies.angular_velocity]
        return [self.terms.nodes.velocity, *(of_bodies if bodies.count else [])]

    def velocities(self) -> list[np.ndarray]:
        """Return the velocities of all scenarios, in the form that `start_clock` takes."""
        return [fields.read(field) for field in self._velocities]

    def halt(self, s: int) -> None:
        """Set all velocities of scenario s to zero."""
        for field in self._velocities:
            fields.write_row(field, s, 0.0)

    def damp(self, s: int, share: float) -> None:
        """Set the local damping of scenario s to this fraction of every unbalanced force."""
        fields.write_row(self.terms.nodes.local_damping, s, share)

    def relax_branches(self, s: int) -> None:
        """Relax the Maxwell branches of scenario s in every increment until its step is set."""
        for term in self.terms.everything:
            term.set_time_increment(s, np.inf)

    def start_clock(self, velocities: list[np.ndarray]) -> None:
        """Start at t = 0 from the relaxed state with these velocities."""
        for field, values in zip(self._velocities, velocities, strict=True):
            fields.write(field, values)
        self.times[:], self.increment_counts[:] = 0.0, 0
        for s in range(self.scenarios):
            self.damp(s, 0.0)
            for term in self.terms.everything:
                term.forget_dissipation(s)
            self.clear_impulses(s)

    def clear_impulses(self, s: int) -> None:
        """Set to zero the contact impulses that the history of scenario s averages."""
        self.impulses[s].fill(0.0)

    # --- increments ------------------------------------------------------------------------------

    def find_forces(self, dt: float) -> None:
        """Compute the forces at the current positions and velocities, at the end of a step dt [s].

        Nothing moves; branches relax by the step in use.
        """
        self._stand(np.full(self.scenarios, dt), kicks=np.zeros(self.scenarios))

    def change_time_increment(self, dt: float) -> None:
        """Change the time step [s] of all scenarios."""
        for s in range(self.scenarios):
            self.change_time_increment_of(s, dt)

    def change_time_increment_of(self, s: int, dt: float) -> None:
        """Change the time step [s] of scenario s and move its velocities to the new half step."""
        self.kernels.shift(s, self.times[s], 0.5 * (dt - self.time_increments[s]))
        self._set_time_increment(s, dt)

    def advance(self, counts: int | np.ndarray) -> None:
        """Do a block of `counts` increments: one number for all scenarios, or (scenarios,).

        Scenarios with 0 increments do not change.
        """
        self.begin_block()
        self.continue_block(counts)

    def begin_block(self, scenarios: Sequence[int] | slice = slice(None)) -> None:
        """Begin a block of increments, which `continue_block` performs in one or more parts.

        scenarios: those whose block begins, all by default; the others continue theirs.
        """
        self.block_starts[scenarios] = self.times[scenarios]
        self.done_in_block[scenarios] = 0

    def continue_block(self, counts: int | np.ndarray) -> None:
        """Do `counts` more increments of the block; counts as for `advance`.

        The result is the same, bit for bit, whether the block is done in one part or in several.
        """
        each = counts if isinstance(counts, np.ndarray) else np.full(self.scenarios, counts)
        clocks = (each, self.block_starts, self.time_increments, self.done_in_block)
        self.kernels.run(
            [
                Span(count, start, dt, drift=dt, kick=dt, done=done)
                for count, start, dt, done in zip(*(c.tolist() for c in clocks), strict=True)
            ]
        )
        self.increment_counts += each
        self.done_in_block += each
        reached = self.block_starts + self.done_in_block * self.time_increments
        np.copyto(self.times, reached, where=each > 0)

    def _stand(self, steps: np.ndarray, kicks: np.ndarray) -> None:
        """Compute the forces of each scenario at its time, and advance velocities by a kick [s]."""
        self.terms.rigid_bodies.forget_loads()  # which the drift would have done
        self.kernels.run(
            [
                Span.standing(time, dt, kick)
                for time, dt, kick in zip(self.times, steps, kicks, strict=True)
            ]
        )

    def _set_time_increment(self, s: int, dt: float) -> None:
        self.time_increments[s] = dt
        for term in self.terms.everything:
            term.set_time_increment(s, dt)

    # --- what a checkpoint keeps -----------------------------------------------------------------

    def state(self) -> dict[str, np.ndarray]:
        """Return all fields needed to continue a run with the same bits, by name."""
        return {name: fields.read(field) for name, field in self.terms.state_fields().items()}

    def restore(
        self, state: dict[str, np.ndarray], time: float, increment_count: int, dt: float
    ) -> None:
        """Restore the state of a checkpoint; all scenarios get the same time [s] and step dt [s].

        Raises OutputError if it is the state of another model.
        """
        kept = self.terms.state_fields()
        _refuse_other_state(state, {name: fields.shape_of(field) for name, field in kept.items()})
        for name, field in kept.items():
            fields.write(field, state[name])
        self._forget_lists()
        self.times[:], self.increment_counts[:] = time, increment_count
        for s in range(self.scenarios):
            self._set_time_increment(s, dt)

    def restore_scenario(
        self, s: int, state: dict[str, np.ndarray], time: float, increment_count: int, dt: float
    ) -> None:
        """Restore scenario s from `Scenario.state`, its time [s] and step dt [s]; no other changes.

        Raises OutputError if it is the state of another model.
        """
        kept = self.terms.state_fields()
        shapes = {name: (1, *fields.shape_of(field)[1:]) for name, field in kept.items()}
        _refuse_other_state(state, shapes)
        for name, field in kept.items():
            fields.write_row(field, s, state[name][0])
        for contact in self.terms.listing:
            fields.write_row(contact.lists.stale, s, 1)
            fields.write_row(contact.lists.overfull, s, 0)
        self.times[s], self.increment_counts[s] = time, increment_count
        self._set_time_increment(s, dt)

    def _forget_lists(self) -> None:
        """Mark the neighbour lists as stale after positions were overwritten."""
        for contact in self.terms.listing:
            fields.write(contact.lists.stale, 1)
            fields.write(contact.lists.overfull, 0)

    def take_over(self, state: dict[str, np.ndarray], time: float) -> None:
        """Copy the state of another solver of the same bodies at `time` [s], for common fields.

        Velocities of components that are not free are set to zero. The others are those of half a
        step later: call `go_back_half` or `come_to_rest`, then `start_motion`.
        """
        for name, field in self.terms.state_fields().items():
            if name in state and fields.shape_of(field) == state[name].shape:
                fields.write(field, state[name])
        self.times[:] = time
        velocity = self.terms.nodes.velocity
        fields.write(velocity, fields.read(velocity) * self.models[0].is_free)
        for contact in self.terms.node_contacts:
            contact.clear_forces()
            if self.models[0].relaxation is not None:
                contact.forget_rates()
        self._forget_lists()

    def go_back_half(self, dt: float) -> None:
        """Move velocities back by half a step dt [s] to the current time, with the last forces."""
        for s in range(self.scenarios):
            self.kernels.shift(s, self.times[s], -0.5 * dt)

    def come_to_rest(self, dt: float) -> None:
        """Set all velocities to zero, relax all Maxwell branches and reset the energy balance.

        dt [s]: step of the increment in which the branches relax.
        """
        for s in range(self.scenarios):
            self.halt(s)
            self.relax_branches(s)
        self.find_forces(dt)
        self.reset_energy_balance()

    # --- what observers read; arrays (scenarios, ...) at the present time ------------------------

    def positions(self) -> np.ndarray:
        """Return the positions x (scenarios, nodes, d) [m]."""
        return fields.read(self.terms.nodes.position)

    def scenario(self, number: int) -> "Scenario":
        """Return the view of one scenario."""
        return Scenario(self, number)


@dataclass(frozen=True)
class Scenario:
    """View of scenario `number` of a solver: its model, time and part of the fields."""

    solver: ExplicitSolver
    number: int

    @property
    def model(self) -> Model:
        """Model of this scenario."""
        return self.solver.models[self.number]

    @property
    def terms(self) -> Terms:
        """Taichi objects, which all scenarios share."""
        return self.solver.terms

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.solver.times[self.number])

    @property
    def load_time(self) -> float:
        """Time at which loads are taken [s]: along a path of equilibria it may go back."""
        return float(self.solver.load_times[self.number])

    @property
    def increment_count(self) -> int:
        """Number of increments done."""
        return int(self.solver.increment_counts[self.number])

    @property
    def time_increment(self) -> float:
        """Step in use [s]."""
        return float(self.solver.time_increments[self.number])

    def change_time_increment(self, dt: float) -> None:
        """Change the time step [s]."""
        self.solver.change_time_increment_of(self.number, dt)

    def read(self, field: ti.Field) -> np.ndarray:
        """Return this scenario's part of a field whose first axis counts scenarios."""
        return fields.read_row(field, self.number)

    def term_of(self, load: Load) -> Any:
        """Return the term that computes one of the model's loads."""
        return self.terms.loads[[one is load for one in self.model.loads].index(True)]

    def positions(self) -> np.ndarray:
        """Return the positions x (nodes, d) [m]."""
        return self.read(self.terms.nodes.position)

    def pose(self, body: int) -> Pose:
        """Return the current pose of a rigid body."""
        bodies = self.terms.rigid_bodies
        return bodies.pose(body, *(self.read(field)[body] for field in bodies.pose_fields))

    def centre_of_mass(self) -> np.ndarray:
        """Return the centre of mass (d,) [m] of the meshed bodies."""
        return self.centres_of_mass(self.positions()[None])[0]

    def centres_of_mass(self, positions: np.ndarray) -> np.ndarray:
        """Return the centres of mass (rows, d) [m] for nodal positions (rows, nodes, d) [m]."""
        mass = self.model.mass[: self.model.meshed_count]
        # Not BLAS, whose last bits vary.
        moments = np.einsum("a,rai->ri", mass, positions[:, : len(mass)])
        centres: np.ndarray = moments / mass.sum()
        return centres

    def peak_energies(self) -> list[np.ndarray | float]:
        """Return the largest energy density so far (m,) [J/m^3] of the model's regions.

        It is 0 of a region whose material does not soften.
        """
        regions, elements = self.model.regions, list[Any](self.terms.elements)
        peaks: list[np.ndarray | float] = [0.0] * len(regions)
        for alike, term in zip(alike_regions(regions), elements, strict=True):
            if term.points.softens:
                ends = np.cumsum([len(regions[k].cells) for k in alike])
                of_all = self.read(term.points.softening.peak).ravel()[: ends[-1]]
                for k, peak in zip(alike, np.split(of_all, ends[:-1]), strict=True):
                    peaks[k] = peak
        return peaks

    def has_missed_contact(self) -> bool:
        """Return True if a neighbour list of contact was too short for all points nearby."""
        return any(self.read(c.lists.overfull).any() for c in self.terms.listing)

    def chatter(self) -> Chatter:
        """Return the chatter of the nodes on walls since t = 0."""
        count = len(self.model.contact.nodes)
        returns, contact_time = np.zeros((2, count))
        for walls in self.terms.wall_contacts:
            returns += self.read(walls.returns)
            contact_time += self.read(walls.contact_time)
        return chatter(self.model, returns, contact_time)

    def penetration(self) -> Penetration:
        """Return the largest penetration of walls since t = 0."""
        contacts = self.terms.contacts_by_wall
        depths = [np.max([self.read(c.penetration) for c in walls], axis=0) for walls in contacts]
        return penetration(self.model, np.array(depths))

    def body_penetration(self) -> BodyPenetration | None:
        """Return the largest penetration of bodies since t = 0; None without their contact."""
        data = self.model.self_contact
        if data is None:
            return None
        depths = np.max([self.read(c.deepest) for c in self.terms.self_contacts], axis=0)
        return body_penetration(self.model, data, depths)

    def state(self) -> dict[str, np.ndarray]:
        """Return the fields of a checkpoint, as a solver of this scenario alone has them."""
        return {name: self.read(field)[None] for name, field in self.terms.state_fields().items()}


def _refuse_other_state(state: dict[str, np.ndarray], shapes: dict[str, tuple[int, ...]]) -> None:
    """Raise OutputError unless a state has the arrays, by name, of these shapes."""
    if shapes != {name: array.shape for name, array in state.items()}:
        raise OutputError(
            "the checkpoint holds the state of a different mesh or model",
            hint="the mesh has changed since the checkpoint: run without --resume",
        )


def longest_block(element_count: int) -> int:
    """Return the largest number of increments in a block for a model of so many elements."""
    wanted = BLOCK_UPDATES // max(1, element_count)
    return min(max(SHORTEST_BLOCK, wanted), LONGEST_BLOCK)
