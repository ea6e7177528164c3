"""Kernels that run increments stage by stage, in one thread, several threads or GPU launches.

On a CPU a block of increments runs inside one kernel call, because waking threads would cost more
than a small mesh. Each worker thread does its part of every pass and waits for the others after
each stage; scenarios follow one another. On a GPU a team of threads, which share a multiprocessor,
does the same for a scenario with a small mesh, all scenarios in parallel; with a larger mesh each
stage is a launch over scenarios and indices. All of them sum in the same order: several workers
give the bits of one thread, teams those of launches. Between a CPU and a GPU, and between threads
and launches on a CPU, results agree to round-off only: these are different kernels, and fast_math
lets the compiler of a CPU reorder the arithmetic.
"""

import itertools
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.backend import ThreadCount
from softsim.compute.fields import Row, index_field, real_field, rounded, write
from softsim.compute.taichi_internals import SHARE, Barrier, Launch
from softsim.compute.term import Pass
from softsim.errors import DeviceError
from softsim.solver.terms import Passes

# Increments in one call by launches: a call costs as much as ten launches (60 us; measured on an
# H200), and each increment is traced and compiled.
LAUNCHED_TOGETHER = 4
# Threads of a team. For 256 sections of the robot side by side an H200 takes 29 us an increment
# with 128, 45 with 64, 49 with 256; by launches 81.
TEAM = 128
# Indices of the largest pass up to which a team takes a scenario: of 834, 256 at once take 102 us,
# by launches 149; of 1,112 about as long; 64 of 3,888 take 132 us, by launches 97.
MOST_OF_A_TEAM = 8 * TEAM
# Increments that teams do in one call: 3 ms for one section of the robot, 34 ms for 2,048 (H200). A
# card that draws a screen ends calls that take seconds.
DONE_TOGETHER = 128
# Said to the compiler by a mask: it vectorises stores into neighbouring slots only where it can
# prove that their addresses, of 32 bits within a field, do not overflow (26 against 45 us an
# increment of the robot's section, and twice as fast for tetrahedra).
LARGEST_INDEX = 2**22 - 1


class Span(NamedTuple):
    """Increments of dt [s] of a scenario to run; one with 0 increments does not change.

    Increment k, from 1, ends at start + (done + k) dt, where `done` increments of the same block
    precede this part: a block in parts passes through the same times, bit for bit, as a whole one.
    drift, kick: times [s] by which positions and velocities are advanced in each increment. Without
    drift the forces are those at the current positions.
    """

    increments: int
    start: float
    dt: float
    drift: float
    kick: float
    done: int = 0

    @classmethod
    def standing(cls, time: float, dt: float, kick: float = 0.0) -> "Span":
        """Return one increment of dt [s] that ends at a time [s] and leaves positions as they are.

        kick: time [s] by which velocities are advanced with the forces.
        """
        return cls(1, time, dt, drift=0.0, kick=kick, done=-1)


INCREMENTS, START, DT, DRIFT, KICK, DONE = range(6)
"""Columns of IncrementKernels.spans, which has the values of a Span in each row."""


@dataclass(frozen=True)
class Loop:
    """Pass in the form that kernels use, with its count counts[number] read at run time.

    extent: the count rounded up, so that it does not change with every mesh.
    """

    counts: ti.Field
    number: int
    extent: int
    functions: tuple[Callable[..., None], ...]


@dataclass(frozen=True)
class Substep:
    """Stages of an increment whose passes get the same duration as their `dt`.

    column: of the spans, with that duration: DRIFT, DT or KICK. moves: True if the stages move
    nodes; where their duration is zero they are left out.
    """

    stages: list[Passes]
    column: int
    moves: bool = False


@dataclass(frozen=True)
class TimedStage:
    """Stage in the form that kernels use, with the properties of its substep."""

    loops: list[Loop]
    column: int
    moves: bool


def timed(substeps: Sequence[Substep]) -> list[TimedStage]:
    """Return the stages of all substeps, in order, in the form that kernels use."""
    counts = index_field(
        np.array([p.count for substep in substeps for stage in substep.stages for p in stage])
    )
    number = itertools.count()
    return [
        TimedStage(
            [Loop(counts, next(number), rounded(p.count), p.functions) for p in stage],
            substep.column,
            substep.moves,
        )
        for substep in substeps
        for stage in substep.stages
    ]


@ti.data_oriented
class IncrementKernels:
    """Kernels that run the stages of increments.

    increment: its substeps, in order. shift: moves velocities with the last forces. passes: those
    of an increment, in order. threads: number of CPU threads of a call.
    """

    def __init__(self, increment: Sequence[Substep], shift: Substep, scenarios: int) -> None:
        self.scenarios = scenarios
        self.passes = [p for part in increment for stage in part.stages for p in stage]
        if backend.device().name == "cpu":
            refuse_uncountable(self.passes)
        self.stages, self.shift_stages = timed(increment), timed([shift])
        self.moving_stages = [stage for stage in self.stages if stage.moves]
        self.threads = ThreadCount(backend.device().threads)
        self.is_small = max(p.count for p in self.passes) <= MOST_OF_A_TEAM
        self.spans = real_field(np.zeros((scenarios, DONE + 1)))
        self.barrier = Barrier(*(index_field(np.zeros(1, dtype=int)) for _ in range(2)))

    def run(self, spans: Sequence[Span]) -> None:
        """Run a span of each scenario with the kernels for the device."""
        if backend.device().name != "cpu":
            by = self.by_teams if self.is_small else self.by_launches
            by(spans)
            ti.sync()
            return
        for s, span in enumerate(spans):
            if span.increments and self.threads.size == 1:
                self.alone(s, span)
            elif span.increments:
                began = time.perf_counter()
                self.together(s, span, self.threads.workers)
                if span.drift > 0.0:  # the first call, which compiles, has none
                    self.threads.note(span.increments, time.perf_counter() - began)

    def compile(self) -> None:
        """Compile the kernel for the device, or load it from the cache; nothing moves."""
        write(self.spans, np.zeros((self.scenarios, DONE + 1)))
        if backend.device().name != "cpu":
            (self._in_teams if self.is_small else self._launch)(0)
            ti.sync()
        elif self.threads.size == 1:
            self._launch_alone(0, 1)
        else:
            self._together(0, self.threads.workers, 0)

    def alone(self, s: int, span: Span) -> None:
        """Run a span in the calling thread, whose cache holds what it reads between two calls.

        The number of workers is an argument so that the compiler treats both kernels in the same
        way.
        """
        self._span_rows[s].fill(np.array(span))
        self._launch_alone(s, 1)

    @cached_property
    def _span_rows(self) -> list[Row]:
        return [Row([self.spans], s) for s in range(self.scenarios)]

    @cached_property
    def _launch_alone(self) -> Launch:
        return Launch(self._alone, 0, 1)

    def together(self, s: int, span: Span, workers: int) -> None:
        """Run a span in `workers` Taichi threads. Raises DeviceError if some of them do not run."""
        self._span_rows[s].fill(np.array(span))
        lost = self._together(s, workers, 0)
        if lost:
            raise DeviceError(
                f"{workers} threads were started, but not all of them run",
                hint="run with --threads 1, or with at most as many threads as there are free "
                "processors",
            )

    def by_teams(self, spans: Sequence[Span]) -> None:
        """Run the span of each scenario by a team of GPU threads."""
        write(self.spans, np.array(spans))
        for done in range(0, max(span.increments for span in spans), DONE_TOGETHER):
            self._in_teams(done)

    def by_launches(self, spans: Sequence[Span]) -> None:
        """Run spans with a launch for each stage, on any device.

        A scenario that has done its own increments does not change while others continue.
        """
        write(self.spans, np.array(spans))
        for k in range(0, max(span.increments for span in spans), LAUNCHED_TOGETHER):
            self._launch(k)

    @ti.kernel
    def _alone(self, s: ti.i32, workers: ti.i32):
        ti.loop_config(serialize=True)
        for worker in range(workers):
            self._work_through(s, worker, workers, 0)

    @ti.kernel
    def _together(self, s: ti.i32, workers: ti.i32, zero: ti.i32) -> ti.i32:
        self.barrier.reset()
        # The number of threads is written into the kernel: Taichi's cache of kernels would else
        # give one compiled for fewer threads, and these would wait for ever for the others.
        for share in range(self.threads.size * SHARE):
            worker = share // SHARE
            if share % SHARE == 0 and worker < workers:
                self._work_through(s, worker, workers, zero)
        return self.barrier.lost[0]

    @ti.func
    def _work_through(self, only, worker, workers, zero):
        """Do one worker's part of all increments of scenario `only`.

        The scenario is found in a loop so that the compiler knows its number if there is only one.
        """
        met = 0
        for s in range(self.scenarios):
            if s != only:
                continue
            for k in range(ti.cast(self.spans[s, INCREMENTS], ti.i32)):
                t = self._time(s, k + 1)
                for stage in ti.static(self.stages):
                    if self._has_part(stage, s):
                        self._work(stage, s, worker, workers, t, self.spans[s, stage.column])
                        met = self.barrier.meet(met, workers, zero)

    @ti.func
    def _has_part(self, stage: ti.template(), s):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return True if a stage is to be done in the increments of scenario s."""
        return ti.static(not stage.moves) or self.spans[s, stage.column] > 0.0

    @ti.func
    def _work(self, stage: ti.template(), s, worker, workers, t, dt):  # type: ignore[valid-type]  # Taichi wants an instance
        """Do one worker's part of a stage."""
        for loop in ti.static(stage.loops):
            count = loop.counts[loop.number]
            for function in ti.static(loop.functions):
                for i in range(count * worker // workers, count * (worker + 1) // workers):
                    function(s, i & LARGEST_INDEX, t, dt)

    @ti.kernel
    def _in_teams(self, first: ti.i32):
        ti.loop_config(block_dim=TEAM)
        for thread in range(self.scenarios * TEAM):
            s, member = thread // TEAM, thread % TEAM
            last = ti.min(first + DONE_TOGETHER, ti.cast(self.spans[s, INCREMENTS], ti.i32))
            for k in range(first, last):
                t = self._time(s, k + 1)
                for stage in ti.static(self.stages):
                    if self._has_part(stage, s):
                        work_in_team(stage, s, member, t, self.spans[s, stage.column])
                        ti.simt.block.sync()

    @ti.kernel
    def _launch(self, first: ti.i32):
        for n in ti.static(range(LAUNCHED_TOGETHER)):
            for stage in ti.static(self.stages):
                for s, i in ti.ndrange(self.scenarios, ti.static(size(stage))):
                    if first + n < self.spans[s, INCREMENTS] and self._has_part(stage, s):
                        t = self._time(s, first + n + 1)
                        work_at(stage, s, i, t, self.spans[s, stage.column])

    @ti.kernel
    def shift(self, s: ti.i32, t: ti.f64, dt: ti.f64):
        """Move the velocities of scenario s by dt [s] at time t [s], with the last forces."""
        for stage in ti.static(self.shift_stages):
            for i in range(ti.static(size(stage))):
                work_at(stage, s, i, t, dt)

    @ti.kernel
    def steer(self, s: ti.i32, t: ti.f64, dt: ti.f64):
        """Move scenario s by dt [s] to time t [s] with its velocities; compute no forces."""
        for stage in ti.static(self.moving_stages):
            for i in range(ti.static(size(stage))):
                work_at(stage, s, i, t, dt)

    @ti.func
    def _time(self, s, k):
        """Return the time [s] of scenario s after k increments of its span."""
        return self.spans[s, START] + (self.spans[s, DONE] + k) * self.spans[s, DT]


@ti.func
def work_in_team(stage: ti.template(), s, member, t, dt):  # type: ignore[valid-type]  # Taichi wants an instance
    """Do the part of a stage of one member of a team.

    Neighbouring members take neighbouring indices, so that a GPU reads their data in one access.
    """
    for loop in ti.static(stage.loops):
        count = loop.counts[loop.number]
        for function in ti.static(loop.functions):
            for turn in range((count - member + TEAM - 1) // TEAM):
                function(s, member + turn * TEAM, t, dt)


@ti.func
def work_at(stage: ti.template(), s, i, t, dt):  # type: ignore[valid-type]  # Taichi wants an instance
    """Do index i of a stage, whose loops follow one another by their extents."""
    first = 0
    for loop in ti.static(stage.loops):
        if first <= i < first + loop.counts[loop.number]:
            for function in ti.static(loop.functions):
                function(s, i - first, t, dt)
        first += loop.extent


def size(stage: TimedStage) -> int:
    """Return the sum of the extents of all loops of a stage."""
    return sum(loop.extent for loop in stage.loops)


def refuse_uncountable(passes: list[Pass]) -> None:
    """Raise DeviceError if a pass has more indices than a kernel can count."""
    largest = max(passes, key=lambda p: p.count)
    if largest.count > LARGEST_INDEX:
        raise DeviceError(
            f"the model has {largest.count:,} nodes, facets or blocks of elements in one loop; "
            f"the limit is {LARGEST_INDEX:,}",
            hint="use a coarser mesh",
        )
