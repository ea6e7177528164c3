"""Explicit central difference with velocities at half steps.

x(n+1) = x(n) + dt v(n+1/2);  forces at x(n+1);  v(n+3/2) = v(n+1/2) + dt f(n+1) / m.
After a block of increments positions and forces belong to the same time, and the velocity of that
time is v(n+1/2) less half a kick.

On the CPU a block of increments runs inside one kernel call: waking threads would cost more than a
small mesh. Each worker thread does its share of every pass and meets the others after each stage.
On a GPU each stage of an increment is a launch over scenarios and indices. Every number is summed
in the same order in all three, so one worker, many, and launches give the same.
"""

import time

import numpy as np
import taichi as ti

from softsim import backend, fields
from softsim.errors import DeviceError, OutputError
from softsim.model import Model
from softsim.solver.crew import Crew
from softsim.solver.terms import Pass, Stage, Terms

# Dissipation of the Maxwell branches is booked once in so many increments: it changes over
# milliseconds, an increment takes microseconds.
SAMPLE_EVERY = 8
# Increments in one call on a GPU: a call costs as much as a few launches, and each of these is
# traced and compiled.
LAUNCHED_TOGETHER = 4
# Taichi hands neighbouring indices of a parallel loop to a thread in shares of at least so many.
SHARE = 512
# Said to the compiler by a mask: it vectorises stores into neighbouring slots only where it can
# prove that their addresses, of 32 bits within a field, do not overflow (26 against 45 us an
# increment of the robot's section, and twice as fast for tetrahedra).
LARGEST_INDEX = 2**22 - 1


@ti.data_oriented
class ExplicitSolver:
    """Advances one model, or several scenarios of it side by side.

    time [s], increments done, increment [s]: the step in use. crew: the threads that share the work
    on a CPU.
    """

    def __init__(self, models: list[Model]) -> None:
        self.models = models
        self.scenarios = len(models)
        with fields.together():
            self.terms = Terms(models)
            self.arrived = fields.index_field(np.zeros(1, dtype=int))
        self.drift_stages = self.terms.drift_stages()
        self.force_stages = self.terms.force_stages()
        self.kick_stages = self.terms.kick_stages()
        self.sampled_stages = self.terms.sampled_stages()
        self.shift_stages = self.terms.shift_stages()
        refuse_uncountable(self.passes)
        self.crew = Crew(backend.device().threads)
        self.time = 0.0
        self.increments = 0
        self.increment = 0.0

    @property
    def stages(self) -> list[Stage]:
        """The stages of an increment."""
        return self.drift_stages + self.force_stages + self.kick_stages

    @property
    def passes(self) -> list[Pass]:
        """The passes of an increment, in order."""
        return [p for stage in self.stages for p in stage]

    def begin(self, increment: float) -> None:
        """Forces at t = 0 and the first half kick; `increment` is the step to come [s]."""
        self._take_increment(increment)
        self._increments(0, 1, self.time - increment, increment, 0.0, 0.5 * increment)
        for load in self.terms.working_loads:
            fields.write(load.work, 0.0)  # no work is done before the first increment

    def find_forces(self, increment: float) -> None:
        """Forces at the present places and velocities, as in a step of `increment` [s]; nothing
        moves.
        """
        self._increments(0, 1, self.time - increment, increment, 0.0, 0.0)

    def change_increment(self, increment: float) -> None:
        """Go on with another step [s]: half-step velocities move to its half step."""
        self.shift_kernel(self.time, 0.5 * (increment - self.increment))
        self._take_increment(increment)

    def advance(self, count: int) -> None:
        """Do `count` increments."""
        dt, began = self.increment, time.perf_counter()
        self._increments(self.increments, count, self.time, dt, dt, dt)
        self.crew.note(count, time.perf_counter() - began)
        self.increments += count
        self.time += count * dt

    def _increments(
        self, first: int, count: int, start: float, dt: float, drift: float, kick: float
    ) -> None:
        """`count` increments after `first`, from time `start` on, that drift and kick so far."""
        if backend.device().name != "cpu":
            self.run_by_launches(first, count, start, dt, drift, kick)
        elif self.crew.size == 1:
            self.run_alone(first, count, start, dt, drift, kick, 1)
        else:
            self.run_together(first, count, start, dt, drift, kick, self.crew.workers, 0)

    def run_by_launches(
        self, first: int, count: int, start: float, dt: float, drift: float, kick: float
    ) -> None:
        """A launch a stage: what a GPU does, on any device."""
        done = 0
        while done < count:
            together = LAUNCHED_TOGETHER if count - done >= LAUNCHED_TOGETHER else 1
            self.launch(start + done * dt, dt, drift, kick, together)
            if (first + done + together) // SAMPLE_EVERY > (first + done) // SAMPLE_EVERY:
                self.launch_sampled(start + (done + together) * dt, SAMPLE_EVERY * dt)
            done += together

    def _take_increment(self, increment: float) -> None:
        self.increment = increment
        for body in self.terms.bodies:
            body.set_increment(increment)

    @ti.kernel
    def run_alone(
        self, first: ti.i32, count: ti.i32, start: ti.f64, dt: ti.f64, drift: ti.f64,
        kick: ti.f64, workers: ti.i32,
    ):  # fmt: skip
        """Increments in one loop, by the thread that calls: it has what it reads in its cache."""
        ti.loop_config(serialize=True)
        for worker in range(workers):
            self.run(first, count, start, dt, drift, kick, worker, workers, 0)

    @ti.kernel
    def run_together(
        self, first: ti.i32, count: ti.i32, start: ti.f64, dt: ti.f64, drift: ti.f64,
        kick: ti.f64, workers: ti.i32, zero: ti.i32,
    ):  # fmt: skip
        """Increments in one loop, side by side by `workers` threads. `zero`: see `meet`."""
        self.arrived[0] = 0
        for share in range(workers * SHARE):
            if share % SHARE == 0:
                self.run(first, count, start, dt, drift, kick, share // SHARE, workers, zero)

    @ti.func
    def run(self, first, count, start, dt, drift, kick, worker, workers, zero):
        """A worker's part of the increments."""
        met = 0
        for s in range(self.scenarios):
            for k in range(count):
                t = start + (k + 1) * dt
                if drift > 0.0:
                    for stage in ti.static(self.drift_stages):
                        self.work(stage, s, worker, workers, t, drift)
                        met = self.meet(met, workers, zero)
                for stage in ti.static(self.force_stages):
                    self.work(stage, s, worker, workers, t, dt)
                    met = self.meet(met, workers, zero)
                for stage in ti.static(self.kick_stages):
                    self.work(stage, s, worker, workers, t, kick)
                    met = self.meet(met, workers, zero)
                if (first + k + 1) % SAMPLE_EVERY == 0:
                    for stage in ti.static(self.sampled_stages):
                        self.work(stage, s, worker, workers, t, SAMPLE_EVERY * dt)
                        met = self.meet(met, workers, zero)

    @ti.func
    def work(self, stage: ti.template(), s, worker, workers, t, dt):  # type: ignore[valid-type]  # Taichi wants an instance
        """A worker's share of a stage."""
        for p in ti.static(stage):
            for function in ti.static(p.functions):
                for i in range(p.count * worker // workers, p.count * (worker + 1) // workers):
                    function(s, i & LARGEST_INDEX, t, dt)

    @ti.func
    def meet(self, met, workers, zero):
        """Wait for all workers; `met` times they did. Returns met + 1.

        Taichi has no barrier on a CPU: each worker counts itself in and reads the count until all
        have. Only an atomic operation reads it anew each time, and adding a `zero` that the
        compiler does not know.
        """
        if workers > 1:
            ti.atomic_add(self.arrived[0], 1)
            while ti.atomic_add(self.arrived[0], zero) < workers * (met + 1):
                pass
        return met + 1

    @ti.kernel
    def launch(self, start: ti.f64, dt: ti.f64, drift: ti.f64, kick: ti.f64, count: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """`count` increments, a launch a stage."""
        for k in ti.static(range(count)):
            for stage in ti.static(self.drift_stages):
                for s, i in ti.ndrange(self.scenarios, ti.static(size(stage))):
                    if drift > 0.0:
                        self.work_at(stage, s, i, start + (k + 1) * dt, drift)
            for stage in ti.static(self.force_stages):
                for s, i in ti.ndrange(self.scenarios, ti.static(size(stage))):
                    self.work_at(stage, s, i, start + (k + 1) * dt, dt)
            for stage in ti.static(self.kick_stages):
                for s, i in ti.ndrange(self.scenarios, ti.static(size(stage))):
                    self.work_at(stage, s, i, start + (k + 1) * dt, kick)

    @ti.kernel
    def launch_sampled(self, t: ti.f64, dt: ti.f64):
        """The sampled stages, a launch each."""
        for stage in ti.static(self.sampled_stages):
            for s, i in ti.ndrange(self.scenarios, ti.static(size(stage))):
                self.work_at(stage, s, i, t, dt)

    @ti.kernel
    def shift_kernel(self, t: ti.f64, dt: ti.f64):
        for stage in ti.static(self.shift_stages):
            for s, i in ti.ndrange(self.scenarios, ti.static(size(stage))):
                self.work_at(stage, s, i, t, dt)

    @ti.func
    def work_at(self, stage: ti.template(), s, i, t, dt):  # type: ignore[valid-type]  # Taichi wants an instance
        """Index i of a stage whose passes are numbered through, one after another."""
        first = 0
        for p in ti.static(stage):
            if first <= i < first + p.count:
                for function in ti.static(p.functions):
                    function(s, i - first, t, dt)
            first += p.count

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


def size(stage: Stage) -> int:
    """Indices of all passes of a stage."""
    return sum(p.count for p in stage)


def refuse_uncountable(passes: list[Pass]) -> None:
    """Raise DeviceError where a pass has more indices than a kernel counts."""
    largest = max(passes, key=lambda p: p.count)
    if largest.count > LARGEST_INDEX:
        raise DeviceError(
            f"the model has {largest.count:,} nodes, facets or blocks of elements in one loop, "
            f"{LARGEST_INDEX:,} can be counted",
            hint="use a coarser mesh",
        )
