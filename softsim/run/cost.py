"""Cost of an increment: as a whole, pass by pass, and on another device; wall time of runs.

Taichi has no clock inside a kernel, so a pass is repeated by itself until that takes long enough
to measure. It then finds its data nearer than in a whole increment: the passes need not add up to
one, and what is missing (or too much) is reported as such.

A device is measured by element updates a second of a scene that softsim carries with it.
"""

import multiprocessing
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib import resources
from pathlib import Path

import numpy as np
import taichi as ti

from softsim.builder import build_model
from softsim.compute import backend
from softsim.errors import DeviceError
from softsim.scene.loading import load_scene
from softsim.solver.explicit import ExplicitSolver
from softsim.solver.increments import LARGEST_INDEX, TEAM
from softsim.solver.stable_step import first_time_increment

BLOCK_TIME = 0.02  # seconds of one measurement, so that the call itself does not count
# A pass is repeated for so long [s], the best of so many times: ten passes take a second.
MEASURED_TIME = 0.02
TRIES = 4
MOST_REPEATS = 5_000  # a multiple of UNROLLED
# While passes repeat, the step is this share of the real one. Nothing may move meanwhile, yet zero
# would divide the bulk viscosity's dJ/dt by zero. All repeats together stay below a hundredth of
# an increment, and no product with it comes near subnormal numbers, which are slow.
REPEATED_STEP = 1e-6
# Launches in one kernel call on a GPU: the call itself costs 60 us.
UNROLLED = 4
INCREMENTS_TIME = 0.5  # seconds of whole increments measured

Loop = tuple[int, Callable[..., None]]
"""A number of indices and the function called at each."""


@dataclass(frozen=True)
class PassCost:
    """Cost of one pass: `seconds` of wall time per increment, `count` indices."""

    phase: str
    name: str
    count: int
    seconds: float


@dataclass(frozen=True)
class CostProfile:
    """Costs of the passes in their order.

    increment: wall time of a whole increment, measured as such [s].
    """

    passes: list[PassCost]
    increment: float

    @property
    def unexplained(self) -> float:
        """Wall time of an increment minus the sum over its passes, each measured alone [s]."""
        return self.increment - sum(cost.seconds for cost in self.passes)

    def shares(self) -> dict[str, float]:
        """Return phase -> fraction of the time of all passes, the largest first."""
        whole = sum(cost.seconds for cost in self.passes)
        shares = dict.fromkeys((cost.phase for cost in self.passes), 0.0)
        for cost in self.passes:
            shares[cost.phase] += cost.seconds / whole
        return dict(sorted(shares.items(), key=lambda item: -item[1]))


def increment_time(solver: ExplicitSolver, seconds: float) -> float:
    """Return the median wall time of an increment [s], over about `seconds` of real increments.

    The step stays what it is. The first increment, which compiles, is not among them.
    """
    _time_of(solver, 1)
    count, elapsed = 1, _time_of(solver, 1)
    while elapsed < 0.5 * BLOCK_TIME:
        count = int(count * min(10.0, 1.0 + BLOCK_TIME / elapsed))
        elapsed = _time_of(solver, count)
    blocks = [elapsed]
    while sum(blocks) < seconds:
        blocks.append(_time_of(solver, count))
    return float(np.median(blocks)) / count


def _time_of(solver: ExplicitSolver, count: int) -> float:
    began = time.perf_counter()
    solver.advance(count)
    ti.sync()
    return time.perf_counter() - began


def measured_profile(solver: ExplicitSolver) -> CostProfile:
    """Measure the time of an increment and of every pass; the state of the solver is restored."""
    state, then, count = solver.state(), solver.time, solver.increment_count
    increment = increment_time(solver, INCREMENTS_TIME)
    loops = [(p, f) for p in solver.kernels.passes for f in p.functions]
    repeat = _repetition(solver, [(p.count, f) for p, f in loops])
    passes = [
        PassCost(p.phase, _name(f), p.count, _seconds_each(partial(repeat, number)))
        for number, (p, f) in enumerate(loops)
    ]
    solver.restore(state, then, count, solver.time_increment)
    return CostProfile(passes, increment)


def _name(function: Callable[..., None]) -> str:
    """Return the function's name with its class, such as "Nodes.drift"."""
    return str(getattr(function, "__qualname__", function))


def _seconds_each(repeat: Callable[[int], None]) -> float:
    """Return the time of one repeat [s]; `repeat(count)` does `count`, a multiple of UNROLLED."""
    repeat(UNROLLED)  # compiles
    count, elapsed = UNROLLED, _elapsed(repeat, UNROLLED)
    while elapsed < 0.5 * MEASURED_TIME and count < MOST_REPEATS:
        grown = min(10.0, max(2.0, MEASURED_TIME / elapsed))
        count = min(MOST_REPEATS, UNROLLED * int(count / UNROLLED * grown))
        elapsed = _elapsed(repeat, count)
    return min(elapsed, *(_elapsed(repeat, count) for _ in range(TRIES - 1))) / count


def _elapsed(repeat: Callable[[int], None], count: int) -> float:
    began = time.perf_counter()
    repeat(count)
    ti.sync()
    return time.perf_counter() - began


def _repetition(solver: ExplicitSolver, loops: list[Loop]) -> Callable[[int, int], None]:
    """repeat(number of the loop, count): on a CPU by one thread, on a GPU by teams or launches."""
    repeated = _RepeatedLoops(loops, solver.scenarios)
    t, dt = solver.time, REPEATED_STEP * solver.time_increment
    if backend.device().name == "cpu":
        return lambda number, count: repeated.serially(number, count, t, dt)
    if solver.kernels.is_small:
        return lambda number, count: repeated.in_teams(number, count, t, dt)

    def launch(number: int, count: int) -> None:
        for _ in range(count // UNROLLED):
            repeated.by_launches(number, t, dt)

    return launch


@ti.data_oriented
class _RepeatedLoops:
    """Kernels that run one loop of a list again and again."""

    def __init__(self, loops: list[Loop], scenarios: int) -> None:
        self.loops, self.scenarios = loops, scenarios

    @ti.kernel
    def serially(self, number: ti.i32, count: ti.i32, t: ti.f64, dt: ti.f64):
        ti.loop_config(serialize=True)
        for s in range(self.scenarios):
            for n in ti.static(range(len(self.loops))):
                if number == n:
                    for _ in range(count):
                        for i in range(self.loops[n][0]):
                            self.loops[n][1](s, i & LARGEST_INDEX, t, dt)

    @ti.kernel
    def in_teams(self, number: ti.i32, count: ti.i32, t: ti.f64, dt: ti.f64):
        ti.loop_config(block_dim=TEAM)
        for thread in range(self.scenarios * TEAM):
            s, member = thread // TEAM, thread % TEAM
            for n in ti.static(range(len(self.loops))):
                if number == n:
                    for _ in range(count):
                        for turn in range((self.loops[n][0] - member + TEAM - 1) // TEAM):
                            self.loops[n][1](s, member + turn * TEAM, t, dt)
                        ti.simt.block.sync()

    @ti.kernel
    def by_launches(self, number: ti.template(), t: ti.f64, dt: ti.f64):  # type: ignore[valid-type]  # Taichi wants an instance
        for _ in ti.static(range(UNROLLED)):
            for s, i in ti.ndrange(self.scenarios, self.loops[number][0]):
                self.loops[number][1](s, i, t, dt)


@dataclass(frozen=True)
class Workload:
    """Mesh of the reference scene: target size and approximate number of its elements."""

    element_size: str
    elements: int


SECTION = Workload("0.35 mm", 1_700)  # of the PFR's own scenes
LARGE = Workload("0.095 mm", 20_000)


def measured_rate(device: str, threads: int, work: Workload, seconds: float) -> float:
    """Return the element updates per second on a device, measured in a separate process.

    device: "cpu" or "cuda". seconds: to measure, beside the start.

    Raises DeviceError: the device fails; it says how.
    """
    fresh = multiprocessing.get_context("spawn")
    try:
        with ProcessPoolExecutor(1, fresh) as process:
            return process.submit(_rate, device, threads, work, seconds).result()
    except BrokenProcessPool:
        raise DeviceError(f"the process that used {device} ended unexpectedly") from None
    except RuntimeError as fault:  # what Taichi and the CUDA driver raise
        raise DeviceError(str(fault)) from fault


def reference_scene(work: Workload) -> tuple[Path, list[str]]:
    """Return the path of the reference scene and its overrides."""
    scene = Path(str(resources.files("softsim").joinpath("run/reference_scene.yaml")))
    return scene, [f"bodies.skin.mesh.element_size={work.element_size}"]


def _rate(device: str, threads: int, work: Workload, seconds: float) -> float:
    model = build_model(load_scene(*reference_scene(work)))
    backend.start(device, threads=threads)
    solver = ExplicitSolver([model])
    solver.begin(first_time_increment(model))
    return model.element_count / increment_time(solver, seconds)


# -------------------------------------------------------------------------------------------------
# The wall time of runs, and its division into parts.

START, KERNEL = "start", "kernel"
INSPECTIONS, ROWS, FRAMES, CHECKPOINTS = "inspections", "rows", "frames", "checkpoints"


class WallClock:
    """Wall time of runs that are computed together.

    began: when they started. steady_since: when the first block ended, which compiles kernels;
    rates count from there. counts_before: increments of each run (scenarios,) done before that.
    spent: wall time [s] of each part; START is all before the loop, including the settling of
    bodies.
    """

    def __init__(self) -> None:
        self.began = time.monotonic()
        self.first_increment_after = 0.0
        parts = (START, KERNEL, INSPECTIONS, ROWS, FRAMES, CHECKPOINTS)
        self.spent = dict.fromkeys(parts, 0.0)

    @property
    def age(self) -> float:
        """Wall time [s] since the runs began."""
        return time.monotonic() - self.began

    def enter_loop(self, increment_counts: np.ndarray) -> None:
        """Mark the start of the loop; increment_counts (scenarios,): increments of each run."""
        self.steady_since = time.monotonic()
        self.spent[START] = self.steady_since - self.began
        self.counts_before = increment_counts.copy()

    def note_block(self, increment_counts: np.ndarray) -> None:
        """Mark the end of a block; increment_counts (scenarios,): increments done by each run."""
        if self.first_increment_after == 0.0:
            self.steady_since, self.counts_before = time.monotonic(), increment_counts.copy()
            self.first_increment_after = self.steady_since - self.began

    def parts(self) -> dict[str, float]:
        """Return the wall time [s] since the runs began, by part; "other": the rest."""
        whole = self.age
        return self.spent | {"other": whole - sum(self.spent.values())}

    @contextmanager
    def spending_on(self, part: str) -> Iterator[None]:
        """Add the wall time of the block to a part; blocks must not be nested."""
        began = time.monotonic()
        try:
            yield
        finally:
            self.spent[part] += time.monotonic() - began
