"""The duration of a run, estimated by a short trial run with its loads applied faster.

The time step depends on the deformation, so the step at rest is a poor estimate for a skin that
balloons: it may shrink tenfold. The trial run (pilot) covers the whole load history in some 20,000
increments, with the run's own mesh, guards, history and frames. If its loads are k times as fast,
    time of the run's loop = k x time of the pilot's loop,
because an increment costs the same and the step shrinks by as much at the same load. Assumed: the
body follows its loads closely enough for that, and nothing else keeps the machine busy. A static
run by relaxation goes on past its end time until forces balance, which nobody knows beforehand:
left out. A static run by Newton's method is tried with its own loads, k = 1, for some load steps.
"""

import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import psutil
from rich.console import Console

from softsim.compute import backend
from softsim.compute.machine import Choice
from softsim.compute.term import present
from softsim.errors import OutputError, StabilityError
from softsim.model import Model
from softsim.output.compiling import compiling
from softsim.output.folder import RunFolder
from softsim.run.batch import Batch
from softsim.run.callbacks import StopConditions
from softsim.run.control import Feedback
from softsim.run.loop import Run
from softsim.run.record import RunFiles
from softsim.scene.loading import LoadedScene
from softsim.solver.stable_step import first_time_increment

SILENT = Console(quiet=True)
PILOT_INCREMENTS = 20_000  # at the step of rest
PILOT_TIME = 4.0  # [s]
LAST_PART = 0.25
# A start that took longer [s] compiled kernels; the run finds them in the cache, so that it is
# measured once more. Only very large models are read and built in this time.
COLD_START = 6.0
FIGURES_TIME = 2.5  # [s]: matplotlib's import and some four pictures, measured


@dataclass(frozen=True)
class Duration:
    """Estimated parts of the duration of a run [s]: `start`, `loop`, `figures`.

    start: up to the first increment. prepared: part of `start` after the model is built, which the
    next run of a process takes again. increment_count: increments, or load steps, to be done. rate:
    element updates per second in the loop, of increments. threads: CPU threads that share them.
    covered: fraction of the load history that the trial run covered. stopped: why a guard stopped
    it there; empty if none did.
    """

    start: float
    prepared: float
    loop: float
    figures: float
    increment_count: float
    rate: float
    threads: int
    covered: float
    stopped: str

    @property
    def total(self) -> float:
        """Whole duration [s]."""
        return self.start + self.loop + self.figures


@dataclass(frozen=True)
class Mark:
    """State of a trial run: wall time [s], simulated time [s], increments or load steps done."""

    wall: float
    simulated: float
    increment_count: int


def predicted_duration(
    loaded: LoadedScene,
    model: Model,
    choice: Choice,
    pilot_time: float = PILOT_TIME,
    console: Console = SILENT,
) -> Duration:
    """Return the duration of a run, estimated by a trial run in a temporary folder.

    console: shows the kernel compilation. pilot_time: limit of the wall time of the trial run [s].
    A large model, or one whose step shrinks a lot, may not reach its end by then; the rest is
    extrapolated at the rate of the last part of the trial run.

    Raises DeviceError if the device does not start, StabilityError if a guard stops the very first
    increments.
    """
    built_after = time.time() - psutil.Process().create_time()
    factor = pilot_speed(model)
    pilot_model = time_scaled(model, factor)
    with tempfile.TemporaryDirectory() as folder:
        target = RunFolder(Path(folder))
        with compiling(console):
            pilot, started_in = _compiled(loaded, pilot_model, target, choice)
        if started_in > COLD_START:
            pilot.close()
            pilot, started_in = _compiled(loaded, pilot_model, target, choice)
        began = time.perf_counter()
        pilot.runs[0].checkpoint()
        checkpoint = time.perf_counter() - began
        marks = _marks(pilot, pilot_time)
        end = pilot.solver.time if _is_done(pilot.runs[0]) else pilot_model.end_time
        loop, count, covered = extrapolated(marks, end)
        loop, count = loop * factor, count * factor
        stopped = _stopped(pilot.runs[0], factor)
        pilot.close()
    loop += checkpoint * (1.0 + loop // loaded.scene.output.checkpoint_interval)
    rate = count * model.element_count / loop
    start = built_after + started_in
    threads = backend.device().threads
    return Duration(start, started_in, loop, FIGURES_TIME, count, rate, threads, covered, stopped)


def pilot_speed(model: Model) -> float:
    """Return the factor of the load rate of the trial run; 1 if the run itself is short enough."""
    if model.takes_load_steps:
        return 1.0
    return max(1.0, model.end_time / first_time_increment(model) / PILOT_INCREMENTS)


def time_scaled(model: Model, factor: float) -> Model:
    """Return the model with its loads and prescribed motions `factor` times as fast.

    Motors keep their frequency: it is the loads that deform the body most.
    """
    return replace(
        model,
        end_time=model.end_time / factor,
        loads=tuple(load.time_scaled(factor) for load in model.loads),
        walls=tuple(wall.time_scaled(factor) for wall in model.walls),
    )


def extrapolated(marks: list[Mark], end: float) -> tuple[float, float, float]:
    """Return wall time [s] and increments of a whole trial run, and the covered part of `end`.

    Its first block of increments, which includes one-time work, is assumed to be as fast as the
    following ones. The missing part is extrapolated from the last LAST_PART of the wall time.
    """
    second, last = marks[min(1, len(marks) - 2)], marks[-1]
    wall = last.wall - second.wall
    late = next(m for m in reversed(marks[:-1]) if m.wall <= last.wall - LAST_PART * wall)
    missing = max(0.0, (end - last.simulated) / (last.simulated - late.simulated))
    return (
        wall * last.increment_count / (last.increment_count - second.increment_count)
        + missing * (last.wall - late.wall),
        last.increment_count + missing * (last.increment_count - late.increment_count),
        min(1.0, last.simulated / end),
    )


def _compiled(
    loaded: LoadedScene, model: Model, target: RunFolder, choice: Choice
) -> tuple[Batch, float]:
    """Return the trial run with its kernels compiled, and the wall time that this took [s].

    The first increment compiles them; a run by load steps has compiled before its first step.
    """
    began = time.perf_counter()
    files = RunFiles(loaded, model, target, SILENT)
    pilot = Batch([files], choice, [()])
    # A layout's verdict says nothing here: the loads are faster, the robot is not.
    pilot.runs[0].callback(StopConditions).conditions.clear()
    pilot.act()
    if not model.takes_load_steps:
        pilot.solver.advance(1)
    return pilot, time.perf_counter() - began


def _marks(pilot: Batch, pilot_time: float) -> list[Mark]:
    """Run the trial to its end, to its limit of wall time [s], or until a guard stops it.

    Raises StabilityError if a guard stops it before there is anything to measure.
    """

    def mark() -> Mark:
        return Mark(time.perf_counter(), pilot.solver.time, pilot.solver.increment_count)

    marks = [mark()]
    run = pilot.runs[0]
    while not _is_done(run):
        pilot.do_blocks()
        stopped = run.outcome
        if isinstance(stopped, StabilityError) and len(marks) > 1:
            break  # too fast for this body: the share that it saw says so
        if isinstance(stopped, StabilityError | OutputError):
            raise stopped
        marks.append(mark())
        if marks[-1].wall - marks[0].wall > pilot_time:
            break
    return marks


def _stopped(run: Run, factor: float) -> str:
    """Return why a guard stopped a trial run whose loads are `factor` times as fast; else "".

    The text includes the gauge pressure of each chamber at that time.
    """
    if not isinstance(run.outcome, StabilityError):
        return ""
    s = run.scenario
    gauges = {}
    for load in run.model.pressures:
        term = s.term_of(load)
        now = term.chamber_readings(present(s.number, term.sampled(), s.time))
        gauges[load.name] = float(now["pressure"][0])
    told = ", ".join(f"'{name}' at {1e-3 * pressure:.3g} kPa" for name, pressure in gauges.items())
    shown = f" with {told}" if told else ""
    faster = "" if factor == 1.0 else f", with loads applied {factor:.3g} times as fast,"
    return f"the trial run{faster} was stopped{shown}: {run.outcome.message}"


def _is_done(run: Run) -> bool:
    """Return True at the end time, or when the last cycle is over, or a path is complete."""
    if run.model.takes_load_steps:
        return run.finished
    cycles = run.model.cycles
    done = run.callback(Feedback).cycles_done(run.scenario.time)
    return run.has_reached_end or (cycles is not None and done >= cycles)
