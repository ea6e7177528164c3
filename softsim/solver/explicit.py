"""Explicit central difference with velocities at half steps.

x(n+1) = x(n) + dt v(n+1/2);  forces at x(n+1);  v(n+3/2) = v(n+1/2) + dt f(n+1) / m.
After a block of increments positions and forces belong to the same time, and the velocity of that
time is v(n+1/2) less half a kick.

How the work is shared out is solver/increments.py's.
"""

import numpy as np
import taichi as ti

from softsim import backend, fields
from softsim.errors import OutputError
from softsim.machine import memory_of
from softsim.model import Model
from softsim.solver.increments import Increments, Span, size, work_at
from softsim.solver.memory import refuse_too_large
from softsim.solver.terms import Terms


@ti.data_oriented
class ExplicitSolver:
    """Advances one model, or several scenarios of it side by side, each at its own pace: what
    becomes of a scenario does not depend on what it is computed with.

    times [s], done (increments), steps [s] in use: arrays (scenarios,).
    Raises DeviceError where the device has too little memory, of which none is taken then; Taichi
    has to be started anew after it.
    """

    def __init__(self, models: list[Model]) -> None:
        self.models = models
        self.scenarios = len(models)
        with fields.together() as made:
            self.terms = Terms(models)
            self.work = Increments(self.terms, self.scenarios)
            device = backend.device().name
            refuse_too_large(models[0], made.size, device, memory_of(device))
        self.shift_stages = self.terms.shift_stages()
        self.times, self.steps = np.zeros(self.scenarios), np.zeros(self.scenarios)
        self.done = np.zeros(self.scenarios, dtype=int)

    @property
    def time(self) -> float:
        """Of the first scenario [s]."""
        return float(self.times[0])

    @property
    def increments(self) -> int:
        """Done by the first scenario."""
        return int(self.done[0])

    @property
    def increment(self) -> float:
        """The step in use of the first scenario [s]."""
        return float(self.steps[0])

    def begin(self, increments: float | np.ndarray) -> None:
        """Forces at t = 0 and the first half kick; the steps to come [s]: one for all scenarios, or
        (scenarios,).
        """
        for s, increment in enumerate(np.broadcast_to(increments, self.scenarios)):
            self._take_increment(s, float(increment))
        self._stand(self.steps, kicks=0.5 * self.steps)
        for term in self.terms.everything:
            term.forget_work()
            for s in range(self.scenarios):
                term.forget_dissipation(s)
        fields.write(self.terms.rigid_bodies.applied_work, 0.0)

    # --- before the clock starts -----------------------------------------------------------------

    @property
    def _velocities(self) -> list[ti.Field]:
        """Fields of all that moves by inertia."""
        bodies = self.terms.rigid_bodies
        of_bodies = [bodies.velocity, bodies.angular_momentum, bodies.angular_velocity]
        return [self.terms.nodes.velocity, *(of_bodies if bodies.count else [])]

    def velocities(self) -> list[np.ndarray]:
        """What moves now in all scenarios, as `start_clock` takes it."""
        return [fields.read(field) for field in self._velocities]

    def halt(self, s: int) -> None:
        """Take all motion from scenario s."""
        for field in self._velocities:
            fields.write_row(field, s, 0.0)

    def damp(self, s: int, share: float) -> None:
        """Let this share of every unbalanced force in scenario s resist the motion from now on."""
        fields.write_row(self.terms.nodes.local_damping, s, share)

    def relax_branches(self, s: int) -> None:
        """From now on Maxwell branches of scenario s relax at once, until its step is set."""
        for term in self.terms.everything:
            term.set_increment(s, np.inf)

    def start_clock(self, velocities: list[np.ndarray]) -> None:
        """What has relaxed stands at t = 0 and moves with these velocities; books are empty."""
        for field, values in zip(self._velocities, velocities, strict=True):
            fields.write(field, values)
        self.times[:], self.done[:] = 0.0, 0
        bodies = self.terms.rigid_bodies
        for work in (self.terms.nodes.damping_work, bodies.damping_work):
            fields.write(work, 0.0)
        for s in range(self.scenarios):
            self.damp(s, 0.0)
            for term in self.terms.everything:
                term.forget_dissipation(s)
                term.clear_impulses(s)

    # --- increments ------------------------------------------------------------------------------

    def find_forces(self, increment: float) -> None:
        """Forces at the present places and velocities, as at the end of a step of `increment` [s];
        nothing moves, branches relax by the step in use.
        """
        self._stand(np.full(self.scenarios, increment), kicks=np.zeros(self.scenarios))

    def change_increment(self, increment: float) -> None:
        """Go on with another step [s] in all scenarios."""
        for s in range(self.scenarios):
            self.change_increment_of(s, increment)

    def change_increment_of(self, s: int, increment: float) -> None:
        """Go on with another step [s] in scenario s: half-step velocities move to its half step."""
        self.shift_kernel(s, self.times[s], 0.5 * (increment - self.steps[s]))
        self._take_increment(s, increment)

    def advance(self, counts: int | np.ndarray) -> None:
        """Do so many increments: one number for all scenarios, or (scenarios,); 0: it rests."""
        each: np.ndarray = np.broadcast_to(counts, self.scenarios)
        self.work.do(
            [
                Span(int(count), time, dt, drift=dt, kick=dt)
                for count, time, dt in zip(each, self.times, self.steps, strict=True)
            ]
        )
        self.done += each
        self.times += each * self.steps

    def _stand(self, steps: np.ndarray, kicks: np.ndarray) -> None:
        """An increment of each scenario that ends now and in which nothing drifts."""
        self.terms.rigid_bodies.forget_loads()  # which the drift would have done
        self.work.do(
            [
                Span(1, time - dt, dt, drift=0.0, kick=kick)
                for time, dt, kick in zip(self.times, steps, kicks, strict=True)
            ]
        )

    def _take_increment(self, s: int, increment: float) -> None:
        self.steps[s] = increment
        for term in self.terms.everything:
            term.set_increment(s, increment)

    @ti.kernel
    def shift_kernel(self, s: ti.i32, t: ti.f64, dt: ti.f64):
        for stage in ti.static(self.shift_stages):
            for i in range(ti.static(size(stage))):
                work_at(stage, s, i, t, dt)

    # --- what observers ask; arrays over (scenarios, ...) at the present time --------------------

    def positions(self) -> np.ndarray:
        """x (scenarios, nodes, d) [m]."""
        return fields.read(self.terms.nodes.position)

    def memory(self) -> dict[str, np.ndarray]:
        """Everything that must be kept to continue to the same bits."""
        return {name: fields.read(field) for name, field in self.terms.state_fields().items()}

    def restore(
        self, memory: dict[str, np.ndarray], time: float, increments: int, increment: float
    ) -> None:
        """Take the state of a checkpoint, with all scenarios at one time and step.

        Raises OutputError if it is the state of another model.
        """
        kept = self.terms.state_fields()
        shapes = {name: fields.shape_of(field) for name, field in kept.items()}
        if shapes != {name: array.shape for name, array in memory.items()}:
            raise OutputError(
                "the checkpoint holds the state of another mesh or model",
                hint="the mesh has changed since: run without --resume",
            )
        for name, field in kept.items():
            fields.write(field, memory[name])
        self.times[:], self.done[:] = time, increments
        for s in range(self.scenarios):
            self._take_increment(s, increment)
