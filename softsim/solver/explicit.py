"""Explicit central difference with velocities at half steps.

x(n+1) = x(n) + dt v(n+1/2);  forces at x(n+1);  v(n+3/2) = v(n+1/2) + dt f(n+1) / m.
After a block of increments positions and forces belong to the same time, and the velocity of that
time is v(n+1/2) less half a kick.

On the CPU a block of increments runs inside one serial kernel: waking threads would cost more than
a small mesh. On a GPU each pass of an increment is a launch over scenarios and indices.
"""

import numpy as np
import taichi as ti

from softsim import backend, fields
from softsim.errors import OutputError
from softsim.model import Model
from softsim.solver.terms import Terms

# Dissipation of the Maxwell branches is booked once in so many increments: it changes over
# milliseconds, an increment takes microseconds.
SAMPLE_EVERY = 8


@ti.data_oriented
class ExplicitSolver:
    """Advances one model, or several scenarios of it side by side.

    time [s], increments done, increment [s]: the step in use.
    """

    def __init__(self, models: list[Model]) -> None:
        self.models = models
        self.scenarios = len(models)
        with fields.together():
            self.terms = Terms(models)
        terms = self.terms
        self.drift_passes = [p for p in terms.drift_passes() if p.count]
        self.force_passes = [p for p in terms.force_passes() if p.count]
        self.kick_passes = [p for p in terms.kick_passes() if p.count]
        self.sampled_passes = [p for p in terms.sampled_passes() if p.count]
        self.shift_passes = [p for p in terms.shift_passes() if p.count]
        self.passes = self.drift_passes + self.force_passes + self.kick_passes
        self.time = 0.0
        self.increments = 0
        self.increment = 0.0

    def begin(self, increment: float) -> None:
        """Forces at t = 0 and the first half kick; `increment` is the step to come [s]."""
        self._take_increment(increment)
        self.force_kernel(self.time, increment)
        for load in self.terms.working_loads:
            fields.write(load.work, 0.0)  # no work is done before the first increment
        self.kick_kernel(self.time, 0.5 * increment)

    def change_increment(self, increment: float) -> None:
        """Go on with another step [s]: half-step velocities move to its half step."""
        self.shift_kernel(self.time, 0.5 * (increment - self.increment))
        self._take_increment(increment)

    def advance(self, count: int) -> None:
        """Do `count` increments."""
        if backend.device().name == "cpu":
            self.advance_serially(self.increments, count, self.time, self.increment)
        else:
            self.advance_by_launches(count)
        self.increments += count
        self.time += count * self.increment

    def advance_by_launches(self, count: int) -> None:
        """One launch a pass: what a GPU does; the same physics in the same order anywhere."""
        for k in range(count):
            self.launch(self.time + (k + 1) * self.increment, self.increment)
            if (self.increments + k + 1) % SAMPLE_EVERY == 0:
                self.launch_sampled(self.time, SAMPLE_EVERY * self.increment)

    def _take_increment(self, increment: float) -> None:
        self.increment = increment
        for body in self.terms.bodies:
            body.set_increment(increment)

    @ti.kernel
    def force_kernel(self, t: ti.f64, dt: ti.f64):
        for p in ti.static(self.force_passes):
            for s, i in ti.ndrange(self.scenarios, p.count):
                p.function(s, i, t, dt)

    @ti.kernel
    def kick_kernel(self, t: ti.f64, dt: ti.f64):
        for p in ti.static(self.kick_passes):
            for s, i in ti.ndrange(self.scenarios, p.count):
                p.function(s, i, t, dt)

    @ti.kernel
    def launch(self, t: ti.f64, dt: ti.f64):
        """One increment, a launch a pass."""
        for p in ti.static(self.passes):
            for s, i in ti.ndrange(self.scenarios, p.count):
                p.function(s, i, t, dt)

    @ti.kernel
    def launch_sampled(self, t: ti.f64, dt: ti.f64):
        """The sampled passes, a launch each."""
        for p in ti.static(self.sampled_passes):
            for s, i in ti.ndrange(self.scenarios, p.count):
                p.function(s, i, t, dt)

    @ti.kernel
    def advance_serially(self, first: ti.i32, count: ti.i32, start: ti.f64, dt: ti.f64):
        """`count` increments in one serial loop; `first` were done before."""
        ti.loop_config(serialize=True)
        for s in range(self.scenarios):
            for k in range(count):
                t = start + (k + 1) * dt
                for p in ti.static(self.passes):
                    for i in range(p.count):
                        p.function(s, i, t, dt)
                if (first + k + 1) % SAMPLE_EVERY == 0:
                    for p in ti.static(self.sampled_passes):
                        for i in range(p.count):
                            p.function(s, i, t, SAMPLE_EVERY * dt)

    @ti.kernel
    def shift_kernel(self, t: ti.f64, dt: ti.f64):
        for p in ti.static(self.shift_passes):
            for s, i in ti.ndrange(self.scenarios, p.count):
                p.function(s, i, t, dt)

    # --- what observers ask; arrays over (scenarios, ...) at the present time --------------------

    def positions(self) -> np.ndarray:
        """x (scenarios, nodes, d) [m]."""
        return fields.read(self.terms.nodes.position)

    def memory(self) -> dict[str, np.ndarray]:
        """Everything that must be kept to continue to the same bits."""
        return {name: fields.read(field) for name, field in self.terms.memory().items()}

    def restore(
        self, memory: dict[str, np.ndarray], time: float, increments: int, increment: float
    ) -> None:
        """Take the state of a checkpoint.

        Raises OutputError if it is the state of another model.
        """
        kept = self.terms.memory()
        shapes = {name: fields.shape_of(field) for name, field in kept.items()}
        if shapes != {name: array.shape for name, array in memory.items()}:
            raise OutputError(
                "the checkpoint holds the state of another mesh or model",
                hint="the mesh has changed since: run without --resume",
            )
        for name, field in kept.items():
            fields.write(field, memory[name])
        self.time, self.increments = time, increments
        self._take_increment(increment)
