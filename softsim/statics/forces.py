"""Forces on the free coordinates of a model at rest, from the force kernels of a run.

A trial state is one increment of 10^6 s from the last accepted state: all nodes move at once, with
velocities so small that dashpots and bulk viscosity vanish, Maxwell branches have relaxed, and
friction is the elastoplastic return mapping of one load step (contact/forces.py). A trial leaves no
trace: slip anchors and all other fields that remember the path are restored before the next one.
They change only when a state is accepted.

Free coordinates q are the free components of nodes, the free translations and rotations of rigid
bodies, and the pressures of chambers whose source asks for their volume. A rotation [rad] is
multiplied by the radius of gyration of its body, and a torque is divided by it. A pressure is
divided by P = G / L (`scales`); its residual is P (p_s - p) / c, where p_s is the pressure of the
source at this volume and c = -dp_s/dV. All coordinates are thus lengths [m] and all residuals
forces [N]. With the pressure as an unknown, Newton's method follows the volume of a liquid, not its
pressure, which would be huge at a trial state.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import taichi as ti
from scipy.spatial.transform import Rotation

from softsim.compute import fields
from softsim.elements.material_points import PEAK_ENERGY
from softsim.model import Model
from softsim.solver.explicit import ExplicitSolver
from softsim.solver.increments import Span

TRIAL_DURATION = 1e6
"""Duration [s] of the increment that makes a trial state of the accepted one.

Dashpots of contact and bulk viscosity act over microseconds: over this time their forces are below
1e-11 of those of the springs.
"""

RECOMPUTED = ("work", "pressure", "volume")
"""State fields of loads and structures that forces do not depend on, or that each trial renews."""


@dataclass(frozen=True, eq=False)
class Configuration:
    """Positions of all nodes x (n, d) [m], and centres (b, d) [m] and rotations of rigid bodies.

    turns (b, 4): quaternions x, y, z, w. pressures (c,) [Pa]: of the chambers that ask for their
    volume.
    """

    x: np.ndarray
    centres: np.ndarray
    turns: np.ndarray
    pressures: np.ndarray


class StaticForces:
    """Forces of a solver with one scenario at trial states.

    time: load time [s], at which loads and gravity are taken. start: the accepted configuration.
    withheld (size,): forces [N] that are taken off the residual, while the loads of the start are
    applied step by step.
    """

    def __init__(self, solver: ExplicitSolver) -> None:
        self.solver, [self.model] = solver, solver.models
        self.nodes, self.bodies = solver.terms.nodes, solver.terms.rigid_bodies
        self.is_free = self.model.is_free
        count, d = self.bodies.count, self.model.dimension
        self.free_moves = self._of_bodies(self.bodies.free, d) > 0.0
        self.free_turns = self._of_bodies(self.bodies.free_rotation, 3) > 0.0
        self.gyration = np.array([self._gyration(b) for b in range(count)]).reshape(count, 1)
        asking = [p for p in self.model.pressures if p.source.needs_volume]
        self.chambers = {load: solver.scenario(0).term_of(load) for load in asking}
        free = (self.is_free, self.free_moves, self.free_turns)
        self.counts = [*(int(mask.sum()) for mask in free), len(asking)]
        shear, side = scales(self.model)
        self.pressure_scale, self.force_scale = shear / side, shear * side**2
        self.arms = fields.read(self.bodies.arm).reshape(-1, d)  # one more if there is none
        self.tied = [np.asarray(body.tied, dtype=int) for body in self.model.rigid_bodies]
        solver.relax_branches(0)
        solver.time_increments[0] = TRIAL_DURATION
        self.time = float(solver.load_times[0])
        self._hold(1)
        self._accepted = self._base = solver.state()
        self.start = self.configuration()
        self.withheld = np.zeros(self.size)

    def _of_bodies(self, field: ti.Field, width: int) -> np.ndarray:
        """Return a field of the rigid bodies as (b, width); a field without cells has one."""
        return fields.read(field).ravel()[: self.bodies.count * width].reshape(-1, width)

    def _gyration(self, body: int) -> float:
        """Return the radius of gyration [m] of a rigid body about its most inert axis."""
        mass = fields.read(self.bodies.mass)[body]
        inertia = np.linalg.inv(fields.read(self.bodies.inverse_inertia).reshape(-1, 3, 3)[body])
        return float(np.sqrt(np.linalg.eigvalsh(inertia)[-1] / mass))

    @property
    def size(self) -> int:
        """Number of free coordinates."""
        return sum(self.counts)

    # --- configurations --------------------------------------------------------------------------

    def configuration(self) -> Configuration:
        """Return the present configuration of the solver."""
        wxyz = self._of_bodies(self.bodies.orientation, 4)
        centres = self._of_bodies(self.bodies.centre, self.model.dimension)
        pressures = [fields.read(term.pressure)[0] for term in self.chambers.values()]
        turns = np.roll(wxyz, -1, axis=1)
        return Configuration(self.solver.positions()[0], centres, turns, np.array(pressures))

    def moved(self, at: Configuration, step: np.ndarray) -> Configuration:
        """Return a configuration displaced by `step` (size,) [m] of the free coordinates."""
        of_nodes, of_moves, of_turns, of_pressures = np.split(step, np.cumsum(self.counts)[:-1])
        x, centres, turns = at.x.copy(), at.centres.copy(), at.turns
        x[self.is_free] += of_nodes
        centres[self.free_moves] += of_moves
        if self.counts[2]:
            angles = np.zeros(self.free_turns.shape)
            angles[self.free_turns] = of_turns
            by = Rotation.from_rotvec(angles / self.gyration)
            turns = (by * Rotation.from_quat(at.turns)).as_quat()
        pressures = at.pressures + self.pressure_scale * of_pressures
        return self._tied_placed(Configuration(x, centres, turns, pressures))

    def difference(self, before: Configuration, after: Configuration) -> np.ndarray:
        """Return the step (size,) [m] by which `moved` leads from one state to another."""
        angles = np.zeros(self.free_turns.shape)
        if self.counts[2]:
            turned = Rotation.from_quat(after.turns) * Rotation.from_quat(before.turns).inv()
            angles = turned.as_rotvec() * self.gyration
        return np.concatenate(
            [
                (after.x - before.x)[self.is_free],
                (after.centres - before.centres)[self.free_moves],
                angles[self.free_turns],
                (after.pressures - before.pressures) / self.pressure_scale,
            ]
        )

    def _tied_placed(self, at: Configuration) -> Configuration:
        """Return a configuration with the nodes that are tied to rigid bodies in their places."""
        first, d = 0, self.model.dimension
        for body, tied in enumerate(self.tied):
            arms = self.arms[first : first + len(tied)]
            turn = Rotation.from_quat(at.turns[body]).as_matrix()[:d, :d]
            at.x[tied] = at.centres[body] + arms @ turn.T
            first += len(tied)
        return at

    # --- forces at a trial state -----------------------------------------------------------------

    def residual(self, at: Configuration) -> np.ndarray:
        """Return the unbalanced forces (size,) [N] on the free coordinates of a trial state."""
        self._put(at)
        self._compute()
        nodes, bodies = self.nodes, self.bodies
        force = fields.read(nodes.force)[0] + (
            self.model.mass[:, None] * fields.read(nodes.gravity).reshape(1, -1)
        )
        on_bodies = self._of_bodies(bodies.force, self.model.dimension)[self.free_moves]
        torques = self._of_bodies(bodies.torque, 3) / self.gyration
        missing = [
            (fields.read(term.source_pressure)[0] - fields.read(term.pressure)[0])
            * (self.pressure_scale / load.source.stiffness(load.volume(self.start.x)))
            for load, term in self.chambers.items()
        ]
        parts = [force[self.is_free], on_bodies, torques[self.free_turns], missing]
        unbalanced: np.ndarray = np.concatenate(parts) - self.withheld
        return unbalanced

    def resisting(self, at: Configuration, step: np.ndarray) -> np.ndarray:
        """Return K dq (size,) [N] of a step dq (size,), by a central difference over 2 dq."""
        ends = [self.residual(self.moved(at, sign * step)) for sign in (-1.0, 1.0)]
        resisted: np.ndarray = 0.5 * (ends[0] - ends[1])
        return resisted

    def inner_force(self) -> float:
        """Return the root sum of squares [N] of every single nodal force at the last trial state.

        The unbalanced forces are compared with it, as in `unbalanced_share` of solver/energy.py.
        """
        slots = self.nodes.corner_forces.component
        return float(np.linalg.norm([np.linalg.norm(fields.read(slot)) for slot in slots]))

    def nodal_forces(self) -> np.ndarray:
        """Return the forces (n, d) [N] on all nodes at the last trial state, without weight."""
        return fields.read(self.nodes.force)[0]

    def _put(self, at: Configuration) -> None:
        """Write a trial state, one increment of TRIAL_DURATION seconds from the accepted one."""
        for name, field in self._path_fields.items():
            fields.write(field, self._base[name])
        for contact in self.solver.terms.listing:
            fields.write(contact.lists.due, 0.0)  # a path between two trial states is not bounded
        fields.write(self.nodes.position, at.x[None])
        fields.write(self.nodes.velocity, (at.x - self.start.x)[None] / TRIAL_DURATION)
        for term, pressure in zip(self.chambers.values(), at.pressures, strict=True):
            fields.write(term.pressure, pressure)
        if self.bodies.count:
            turns, before = Rotation.from_quat(at.turns), Rotation.from_quat(self.start.turns)
            wxyz = np.roll(at.turns, 1, axis=1)
            fields.write(self.bodies.centre, at.centres[None])
            fields.write(self.bodies.orientation, wxyz[None])
            fields.write(self.bodies.rotation, turns.as_matrix()[None])
            fields.write(
                self.bodies.velocity, (at.centres - self.start.centres)[None] / TRIAL_DURATION
            )
            angular_velocity = (turns * before.inv()).as_rotvec() / TRIAL_DURATION
            fields.write(self.bodies.angular_velocity, angular_velocity[None])

    def _compute(self) -> None:
        self.bodies.forget_loads()
        self.solver.kernels.run([Span.standing(self.time, TRIAL_DURATION)])

    @cached_property
    def _path_fields(self) -> dict[str, ti.Field]:
        """State fields that remember the path: of contact, tethers, ends of cables, softening."""
        owners = ("contacts/", "self_contacts/", "loads/", "structures/")
        state = self.solver.terms.state_fields()
        of_materials = {n: field for n, field in state.items() if n.endswith(f"/{PEAK_ENERGY}")}
        of_terms = {
            name: field
            for name, field in state.items()
            if name.startswith(owners) and name.rsplit("/", 1)[1] not in RECOMPUTED
        }
        if not of_terms:
            return of_materials
        slots = zip("xyz", self.nodes.corner_forces.component, strict=False)
        of_nodes = {f"nodes/corner_forces_{axis}": field for axis, field in slots}
        return of_materials | of_terms | of_nodes

    # --- accepted states -------------------------------------------------------------------------

    def steer(self, time: float) -> Configuration:
        """Move what is prescribed to its place at a load time [s], from the accepted state.

        Return the configuration that results: free nodes stay where they are.
        """
        terms, solver, step = self.solver.terms, self.solver, time - self.time
        solver.clear_impulses(0)
        self._accepted = solver.state()
        held_velocity = np.where(self.is_free, 0.0, fields.read(self.nodes.velocity)[0])
        fields.write(self.nodes.velocity, held_velocity[None] * (TRIAL_DURATION / step))
        if self.bodies.count:
            velocity = self._of_bodies(self.bodies.velocity, self.model.dimension)
            held = np.where(self.free_moves, 0.0, velocity) * (TRIAL_DURATION / step)
            fields.write(self.bodies.velocity, held[None])
            fields.write(self.bodies.angular_momentum, 0.0)
        solver.kernels.steer(0, time, step)
        for frame in terms.frames:
            for speed in frame.speeds():
                fields.write(speed, fields.read(speed) * (step / TRIAL_DURATION))
        self.time = time
        self._base = solver.state()
        return self._tied_placed(self.configuration())

    def accept(self, at: Configuration, duration: float) -> None:
        """Accept a state at the present load time: slip anchors move, work is added up.

        duration [s]: by which the clock of the run goes on.
        """
        self._restore(self._base)
        self._put(at)
        self._hold(0)  # the pressure is now that of the source at this volume, to round-off
        self._compute()
        self._hold(1)
        self.solver.times[0] += duration
        self.solver.load_times[0] = self.time
        self.solver.increment_counts[0] += 1
        self.solver.begin_block()
        self._accepted = self._base = self.solver.state()
        pressures = [fields.read(term.pressure)[0] for term in self.chambers.values()]
        self.start = replace(at, pressures=np.array(pressures))

    def _hold(self, is_held: int) -> None:
        for term in self.chambers.values():
            fields.write(term.is_held, is_held)

    def go_back(self) -> None:
        """Return to the accepted state."""
        self._restore(self._accepted)
        self._base = self._accepted
        self.time = float(self.solver.load_times[0])
        self._compute()
        self._restore(self._accepted)  # the increment has added up work and memories of the path

    def _restore(self, state: dict[str, np.ndarray]) -> None:
        for name, field in self.solver.terms.state_fields().items():
            fields.write(field, state[name])


def scales(model: Model) -> tuple[float, float]:
    """Return the largest shear modulus G and the shortest side L of all bodies [Pa, m]."""
    shear = max(r.material.law.initial_shear_modulus for r in model.regions)
    return float(shear), float(min(np.ptp(body.points, axis=0).min() for body in model.bodies))
