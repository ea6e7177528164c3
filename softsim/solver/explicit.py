"""Explicit central difference with velocities at half steps.

x(n+1) = x(n) + dt v(n+1/2);  forces at x(n+1);  v(n+3/2) = v(n+1/2) + dt f(n+1) / m.
After a block of increments positions and forces belong to the same time, and the velocity of that
time is v(n+1/2) less half a kick.

How the work is shared out is solver/increments.py's.
"""

import numpy as np
import taichi as ti

from softsim import fields
from softsim.errors import OutputError
from softsim.model import Model
from softsim.solver.increments import Increments, Span, size, work_at
from softsim.solver.terms import Terms


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
            self.work = Increments(self.terms, self.scenarios)
        self.shift_stages = self.terms.shift_stages()
        self.time = 0.0
        self.increments = 0
        self.increment = 0.0

    def begin(self, increment: float) -> None:
        """Forces at t = 0 and the first half kick; `increment` is the step to come [s]."""
        self._take_increment(increment)
        self._stand(increment, kick=0.5 * increment)
        for load in self.terms.working_loads:
            fields.write(load.work, 0.0)  # no work is done before the first increment

    def find_forces(self, increment: float) -> None:
        """Forces at the present places and velocities, as at the end of a step of `increment` [s];
        nothing moves, branches relax by the step in use.
        """
        self._stand(increment, kick=0.0)

    def change_increment(self, increment: float) -> None:
        """Go on with another step [s]: half-step velocities move to its half step."""
        self.shift_kernel(self.time, 0.5 * (increment - self.increment))
        self._take_increment(increment)

    def advance(self, count: int) -> None:
        """Do `count` increments."""
        dt = self.increment
        self.work.do(Span(self.increments, count, self.time, dt, drift=dt, kick=dt))
        self.increments += count
        self.time += count * dt

    def _stand(self, dt: float, kick: float) -> None:
        """An increment of dt [s] that ends now and in which nothing drifts."""
        self.work.do(Span(0, 1, self.time - dt, dt, drift=0.0, kick=kick))

    def _take_increment(self, increment: float) -> None:
        self.increment = increment
        for body in self.terms.bodies:
            body.set_increment(increment)

    @ti.kernel
    def shift_kernel(self, t: ti.f64, dt: ti.f64):
        for stage in ti.static(self.shift_stages):
            for s, i in ti.ndrange(self.scenarios, ti.static(size(stage))):
                work_at(stage, s, i, t, dt)

    # --- what observers ask; arrays over (scenarios, ...) at the present time --------------------

    def positions(self) -> np.ndarray:
        """x (scenarios, nodes, d) [m]."""
        return fields.read(self.terms.nodes.position)

    def overfull(self) -> bool:
        """Whether a list of what may touch had no room, so that contact was missed."""
        return any(fields.read(c.lists.overfull).any() for c in self.terms.self_contacts)

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
