"""Runs that share a solver, computed side by side; a single run is a batch of one."""

import gc
import logging
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np
from rich.console import Console

from softsim.compute import backend
from softsim.compute.machine import Choice
from softsim.errors import Interrupted, OutputError, SoftsimError, StabilityError
from softsim.interruption import stop_signals
from softsim.loads.pressure_control import ControlState
from softsim.model import Model
from softsim.output.compiling import compiling
from softsim.output.console import ProgressReport, phase
from softsim.output.folder import Checkpoint
from softsim.output.stop_conditions import MakesStopCondition
from softsim.run.callbacks import (
    EnergyGuard,
    FrameOutput,
    Guards,
    Rows,
    StableSteps,
    StopConditions,
)
from softsim.run.control import Feedback
from softsim.run.cost import KERNEL, WallClock, measured_profile
from softsim.run.loop import Callback, IncrementStepping, RelaxationStepping, Results, Run, Stepping
from softsim.run.record import CHANGED_BY_HAND, Progress, Record
from softsim.run.statics import Equilibria, LoadStepping, PathStepping, RowDerivatives
from softsim.solver.energy import EnergyReader, interrupted_before_start, settle
from softsim.solver.explicit import ExplicitSolver, Scenario
from softsim.solver.stable_step import (
    estimator,
    first_time_increment,
    stable_step,
    time_increment,
)

log = logging.getLogger("softsim")
WORDLESS = nullcontext()

JUMP = 0.02
"""Jump of a pressure at the start of a step, over the larger of both, that causes a warning."""

MakesSolver = Callable[[list[Model], Choice], tuple[ExplicitSolver, EnergyReader]]
"""Function that makes the solver of models of one structure, and the reader of its energies."""


def new_solver(models: list[Model], choice: Choice) -> tuple[ExplicitSolver, EnergyReader]:
    """Start Taichi as chosen, and make a solver and its reader, with their kernels compiled.

    Raises DeviceError: the device is not there, or the models do not fit.
    """
    # Of one, lest a run go elsewhere beside others than alone.
    choice = replace(choice, device=choice.device_for(models[0].corner_count))
    threads = choice.threads_for(len(models) * models[0].corner_count)
    backend.start(choice.device, threads=threads, most_lanes=models[0].most_lanes)
    solver = ExplicitSolver(models)
    reader = EnergyReader(solver)
    solver.compile()
    reader.update()
    return solver, reader


class ReusedSolver:
    """Maker of solvers that reuses the last one if the next models differ from its models in
    numbers only.

    That saves the start of Taichi and the tracing and loading of kernels. Results have the same
    bits as those of a new solver. The batch before must have ended.
    """

    def __init__(self) -> None:
        self._last: tuple[Choice, backend.Device, ExplicitSolver, EnergyReader] | None = None

    def __call__(self, models: list[Model], choice: Choice) -> tuple[ExplicitSolver, EnergyReader]:
        """Return a solver of the models and its reader. Raises DeviceError as `new_solver`."""
        if self._last is not None:
            chosen, device, solver, reader = self._last
            is_there = chosen == choice and backend.device() is device
            if is_there and solver.take_models(models):
                return solver, reader
            self._last = None
            del solver, reader
            gc.collect()  # they refer to each other: free their memory before that of the next one
        solver, reader = new_solver(models, choice)
        self._last = choice, backend.device(), solver, reader
        return solver, reader


# -------------------------------------------------------------------------------------------------
# The state that a step takes over from the previous one: positions, velocities, internal states of
# bodies, contacts and loads, and the state of a controlled pressure that continues.


@dataclass(frozen=True)
class EarlierStep:
    """Previous step at its end: its model and its checkpoint."""

    model: Model
    checkpoint: Checkpoint

    @property
    def end(self) -> float:
        """End time of the step [s]."""
        return self._progress.time

    @property
    def _progress(self) -> Progress:
        return Progress.written(self.checkpoint.progress)

    @property
    def changes_by_hand(self) -> dict[str, str]:
        """Warnings (kind -> text) about loads changed by hand in this step or an earlier one."""
        warnings = self._progress.warnings.items()
        return {kind: text for kind, text in warnings if kind.startswith(CHANGED_BY_HAND)}

    def _state_for(self, model: Model) -> dict[str, np.ndarray]:
        return renumbered(self.checkpoint.state, self.model.load_names, model.load_names)

    def hand_over(self, scenario: Scenario) -> ControlState | None:
        """Continue the only scenario of a solver from here.

        Return the state of its controlled pressure, None if none continues.
        """
        progress, solver = self._progress, scenario.solver
        solver.take_over(self._state_for(scenario.model), progress.time)
        if self.model.relaxation is None:
            solver.go_back_half(progress.time_increment)
        else:
            solver.come_to_rest(progress.time_increment)
        chamber = scenario.model.chamber
        if chamber is None or chamber.source.control is None:
            return None
        settings = chamber.source.control
        if settings.start < progress.time:
            return progress.control
        # It begins in this step, with the pressure that is there.
        term = scenario.term_of(chamber)
        now = replace(settings.first_ramp(), pressure=float(scenario.read(term.pressure)))
        term.kernel.set_ramp(scenario.number, now)
        return None

    def jumps(self, scenario: Scenario) -> dict[str, str]:
        """Return warnings (kind -> text) on chambers whose pressure jumps at the start of the step.

        The scenario must have started.
        """
        state, found = self._state_for(scenario.model), {}
        for number, load in enumerate(scenario.model.loads):
            pressure = state.get(f"loads/{number}/pressure")
            if pressure is None:
                continue
            before, now = float(pressure[0]), float(scenario.read(scenario.term_of(load).pressure))
            if abs(now - before) > JUMP * max(abs(now), abs(before)):
                name = scenario.model.load_names[number]
                found[f"jump of {name}"] = (
                    f"'{name}' jumps from {1e-3 * before:.4g} to {1e-3 * now:.4g} kPa on the "
                    "facets at the start of the step: start its profile at the last value of "
                    "the previous step"
                )
        return found


def renumbered(
    state: dict[str, np.ndarray], before: tuple[str, ...], now: tuple[str, ...]
) -> dict[str, np.ndarray]:
    """Return a solver's state with its loads renumbered from the names `before` to those `now`.

    Loads that no longer exist are left out.
    """
    result = {}
    for key, values in state.items():
        owner, _, rest = key.partition("/")
        if owner == "loads":
            number, _, field = rest.partition("/")
            name = before[int(number)]
            if name not in now:
                continue
            key = f"loads/{now.index(name)}/{field}"
        result[key] = values
    return result


# -------------------------------------------------------------------------------------------------
# The parts of a run.


def assembled(
    run: Run, given: Sequence[MakesStopCondition] = ()
) -> tuple[Stepping, list[Callback]]:
    """Return how a run advances, and what acts between its blocks, in the order of acting.

    A dynamic run advances by increments of the explicit solver:

    1. `StableSteps` inspects the elements before a block, if that is due, and sets the time step.
    2. The solver computes the increments up to the next inspection or row, or the end of the run.
    3. `Guards` stops the run if contact was missed or a chamber has collapsed.
    4. `Rows` samples a row of the history, if that is due, and computes its columns. `Feedback`
       counts pressure cycles, and controls the pressure by the row; `StopConditions` reads it.
    5. `EnergyGuard` stops the run if the energy balance of the row is off.
    6. `StopConditions` ends the run if one of them is met.
    7. `FrameOutput` writes the fields, if that is due.

    At the start the run begins with 4. At the end `StableSteps` inspects the elements a last time.

    A static run by relaxation is the same, but goes on until forces balance. One by Newton's method
    advances by load steps up to the next row or frame, or along the path of equilibria. It has no
    stable step; `Equilibria` warns of an energy error and of an unstable end, `RowDerivatives`
    computes those that the scene asks for.

    Unless a monitor follows the run or something reads each row, columns of many rows are computed
    together (`Rows.gather`). Beside the runs a batch calls monitors, writes checkpoints by the wall
    clock and shows the state (end of this file).

    given: stop conditions in addition to those of the scene.
    """
    guards, feedback, stop = Guards(run), Feedback(run), StopConditions(run, given)
    frames, path = FrameOutput(run), run.model.relaxation
    if run.model.takes_load_steps:
        follows_path = path is not None and path.follows_path
        stepping = PathStepping(run) if follows_path else LoadStepping(run)
        equilibria = Equilibria(run, stepping)
        rows = Rows(run, [feedback, equilibria, stop])
        derivatives = RowDerivatives(run, stepping, rows)
        return stepping, [guards, feedback, rows, equilibria, stop, frames, derivatives]
    rows = Rows(run, [feedback, stop])
    between = [StableSteps(run), guards, feedback, rows, EnergyGuard(run, rows), stop, frames]
    return IncrementStepping(run) if path is None else RelaxationStepping(run), between


# -------------------------------------------------------------------------------------------------
# The batch.


class Monitor(Protocol):
    """Program that follows a run between its blocks of increments, such as the live view.

    It may hold the run and change its loads. A monitor that does neither has no effect on results.
    One that raises an error is detached with a warning, and the run continues.
    """

    def start(self, run: Run) -> None:
        """Called before the first block of a run."""

    def update(self, run: Run, signals: Sequence[int]) -> None:
        """Called before each block and after the last one; it must return soon after a signal.

        signals: SIGINT and SIGTERM received so far, a list that grows.
        """


class Batch:
    """Runs that share a solver, each with its own time step and end.

    A run that has ended, or that a guard has stopped, is idle while the others continue. files:
    record of each run, with its scene and model. stop_conditions: of each run, in addition to those
    of its scene. checkpoint: resumes a batch of one. earlier: previous step of a batch of one.
    make_solver: `new_solver`, or a ReusedSolver.
    """

    def __init__(
        self,
        files: Sequence[Record],
        choice: Choice,
        stop_conditions: Sequence[Sequence[MakesStopCondition]],
        checkpoint: Checkpoint | None = None,
        earlier: EarlierStep | None = None,
        make_solver: MakesSolver = new_solver,
    ) -> None:
        self.clock = WallClock()
        self.console = files[0].console
        self.unsettled: dict[int, StabilityError] = {}
        with _end_noted(files):
            with compiling(self.console, [of_run.path for of_run in files]):
                self.solver, self.reader = make_solver([of_run.model for of_run in files], choice)
            for of_run in files:
                with of_run.logged():
                    log.info("kernels are ready, %.1f s after the start", self.clock.age)
            self.runs = [
                Run(
                    of_run, self.solver.scenario(s), self.reader, self.clock,
                    partial(assembled, given=given),
                )
                for s, (of_run, given) in enumerate(zip(files, stop_conditions, strict=True))
            ]  # fmt: skip
            if checkpoint is not None:
                with files[0].logged():
                    self.runs[0].resume(checkpoint)
            elif earlier is not None:
                self._begin_after(earlier)
            else:
                self._begin()
        self.clock.enter_loop(self.solver.increment_counts)

    def _begin(self) -> None:
        steps = np.array([first_time_increment(run.model) for run in self.runs])
        settles = any(run.model.settling is not None for run in self.runs)
        with stop_signals() as asked:
            with phase(self.console, "settling before t = 0") if settles else WORDLESS:
                settled, self.unsettled = settle(self.solver, self.reader, steps, asked)
            self.solver.begin(steps)
            self.reader.update()
            for run in self.runs:
                with run.files.logged():
                    if (duration := settled.get(run.scenario.number)) is not None:
                        moved = 1e3 * np.abs(run.scenario.positions() - run.model.points).max()
                        log.info(
                            "settled within %.3g s, largest displacement %.3g mm", duration, moved
                        )
                    run.begin(estimator(run.model).at_rest, run.model.points)
        if asked:
            raise interrupted_before_start(asked)

    def _begin_after(self, earlier: EarlierStep) -> None:
        [run] = self.runs
        control = earlier.hand_over(run.scenario)
        x = run.scenario.positions()
        stable = stable_step(run.model, x)
        self.solver.start_motion(time_increment(run.model, stable))
        self.reader.update()
        with run.files.logged():
            log.info("starts at t = %.6g s, the end of the previous step", run.scenario.time)
            run.begin(stable, x, control)
            run.files.warn(earlier.changes_by_hand | earlier.jumps(run.scenario))

    @property
    def running(self) -> list[Run]:
        """Runs that have no outcome yet."""
        return [run for run in self.runs if run.outcome is None]

    def run(
        self, console: Console, monitors: Sequence[Monitor] = ()
    ) -> list[Results | SoftsimError]:
        """Run the loop, always write a summary, and return the outcome of each run.

        monitors: those of a batch of one.
        """
        for run in self.runs:
            run.write_summary("running", {})
        end = max(run.model.end_time for run in self.runs)
        relaxation = self.runs[0].model.relaxation  # a static run is alone
        tolerance = float("nan") if relaxation is None else relaxation.tolerance
        report = ProgressReport(console, end, self.solver.time, tolerance)
        for run in self.runs:
            run.show = report.show
        status = "aborted"
        try:
            with stop_signals() as asked:
                self._loop(report, asked, monitors)
        except Interrupted:
            status = "interrupted"
            raise
        finally:
            report.close()
            for run in self.running:
                run.stop(status)
        return [run.outcome for run in self.runs if run.outcome is not None]

    def _loop(self, report: ProgressReport, asked: list[int], monitors: Sequence[Monitor]) -> None:
        beside: tuple[BatchCallback, ...] = (
            CallMonitors(self.runs[0], monitors, asked),
            Checkpoints(self, asked),
            Display(self, report),
        )
        for s, error in self.unsettled.items():
            with self._attended(self.runs[s]):
                with suppress(StabilityError):  # a symptom of the same
                    for callback in self.runs[s].callbacks:
                        callback.act()
                raise error
        self.act()
        for concern in beside:
            concern.at_start()
        if not monitors:
            for run in self.running:
                run.callback(Rows).gather()
        while self.running:
            for concern in beside:
                concern.before_block()
            self.do_blocks()
            for concern in beside:
                concern.after_block()
        for concern in beside:
            concern.at_end()

    def do_blocks(self) -> None:
        """Advance each run by a block of increments, and let its callbacks act."""
        running = self.running
        self.continue_block(self.next_blocks(running))
        self.end_blocks(running)

    def next_blocks(self, runs: Sequence[Run]) -> np.ndarray:
        """Begin the next block of these runs, and return their numbers of increments (scenarios,).

        Other runs, and those that an inspection stops, have none.
        """
        counts = np.zeros(len(self.runs), dtype=int)
        for run in runs:
            with self._attended(run):
                counts[run.scenario.number] = run.next_block()
        self.solver.begin_block([run.scenario.number for run in runs])
        return counts

    def continue_block(self, counts: np.ndarray) -> None:
        """Compute the given number of increments of each run (scenarios,)."""
        with self.clock.spending_on(KERNEL):
            self.solver.continue_block(counts)
        self.reader.is_current = False

    def end_blocks(self, runs: Sequence[Run]) -> None:
        """Let the callbacks of these runs check and act on the end of a block.

        Runs that have an outcome stay as they are.
        """
        self.clock.note_block(self.solver.increment_counts)
        for run in runs:
            if run.outcome is None:
                with self._attended(run):
                    run.end_block()

    def act(self) -> None:
        """Let the callbacks of all runs act on the start."""
        self.reader.is_current = False
        for run in self.running:
            with self._attended(run):
                run.act()

    def close(self) -> None:
        """Close the files of the runs that have no outcome, which are abandoned."""
        for run in self.running:
            run.files.close()

    def checkpoint(self) -> None:
        """Write the full state of each run that has no outcome yet."""
        for run in self.running:
            run.checkpoint()

    @contextmanager
    def _attended(self, run: Run) -> Iterator[None]:
        """Log into the log of this run, and let an error end this run only."""
        with run.files.logged():
            try:
                yield
            except SoftsimError as error:
                run.fail(error)

    def add_profile(self) -> None:
        """Add the cost of an increment, its passes and phases, to the summary of a batch of one.

        Do nothing unless its run is done.
        """
        if self.reader.rests[0]:  # its increments are not those of a dynamic run
            return
        files = self.runs[0].files
        if files.summary["status"] != "done":
            return
        profile = measured_profile(self.solver)
        costs = asdict(profile) | {"unexplained": profile.unexplained}
        # In place: the outcome of the run has this summary, too.
        files.summary |= {"phases": profile.shares(), "profile": costs}
        files.write_summary(files.summary)


# -------------------------------------------------------------------------------------------------
# What acts between the blocks of all runs of a batch, in this order. None has an effect on results,
# except monitors that change loads.


class BatchCallback:
    """One concern of a batch, which acts between the blocks of its runs; by default it does
    nothing.
    """

    def at_start(self) -> None:
        """Act before the first block."""

    def before_block(self) -> None:
        """Act before a block."""

    def after_block(self) -> None:
        """Act after a block, once the callbacks of the runs have acted."""

    def at_end(self) -> None:
        """Act after the last block."""


class CallMonitors(BatchCallback):
    """Calls of the monitors of a run; one that raises an error is removed, with a warning.

    signals: SIGINT and SIGTERM received so far.
    """

    def __init__(self, run: Run, monitors: Sequence[Monitor], signals: Sequence[int]) -> None:
        self.run, self.monitors, self.signals = run, list(monitors), signals

    def at_start(self) -> None:
        """Start the monitors."""
        self._call(lambda monitor: monitor.start(self.run))

    def before_block(self) -> None:
        """Let the monitors follow the run, hold it, or change its loads."""
        self._call(lambda monitor: monitor.update(self.run, self.signals))

    def at_end(self) -> None:
        """Let the monitors see the end."""
        self.before_block()

    def _call(self, call: Callable[[Monitor], None]) -> None:
        run = self.run
        for monitor in tuple(self.monitors):
            try:
                call(monitor)
            except Exception as error:
                self.monitors.remove(monitor)
                name = type(monitor).__name__
                with run.files.logged():
                    run.files.warn(
                        {
                            f"failed monitor {name}": f"t = {run.scenario.time:.6g} s: {name} "
                            f"failed and no longer follows the run, which continues ({error!r})"
                        }
                    )
                    log.info("traceback of %s", name, exc_info=error)


class Checkpoints(BatchCallback):
    """Checkpoints by the wall clock, and at a signal, which ends the batch.

    signals: SIGINT and SIGTERM received so far.
    """

    def __init__(self, batch: Batch, signals: Sequence[int]) -> None:
        self.batch, self.signals, self.last = batch, signals, time.monotonic()

    def before_block(self) -> None:
        """Raise Interrupted after a signal."""
        if self.signals:
            self.batch.checkpoint()
            reached = min(run.scenario.time for run in self.batch.running)
            raise Interrupted(
                f"stopped by {signal.Signals(self.signals[0]).name} at t = {reached:.6g} s; "
                "checkpoint written",
                hint="continue with --resume",
            )

    def after_block(self) -> None:
        """Write checkpoints if the last ones are old."""
        since = time.monotonic() - self.last
        if since >= min(run.output.checkpoint_interval for run in self.batch.runs):
            self.batch.checkpoint()
            self.last = time.monotonic()


class Display(BatchCallback):
    """State of the slowest run on the console."""

    def __init__(self, batch: Batch, report: ProgressReport) -> None:
        self.batch, self.report = batch, report

    def after_block(self) -> None:
        """Show the state if what is shown is old."""
        if not self.report.is_due:
            return
        run = min(self.batch.running or self.batch.runs, key=lambda run: run.scenario.time)
        rows = run.callback(Rows)
        self.report.update(
            run.scenario.time, rows.energy_error, int(rows.row.get("contact_count", 0)),
            rows.row.get("unbalanced_share", float("nan")),
            run.callback(StopConditions).path_covered,
        )  # fmt: skip


@contextmanager
def _end_noted(records: Sequence[Record]) -> Iterator[None]:
    """Write status and failure into the summaries, and close the files, if the block raises.

    Files of a resumed run that has no summary yet stay as they are.
    """
    try:
        yield
    except BaseException as error:
        status = "interrupted" if isinstance(error, Interrupted | KeyboardInterrupt) else "aborted"
        failure = str(error) or type(error).__name__
        for record in records:
            with suppress(OutputError):  # of a full disk: the first error says more
                if record.summary:
                    record.write_summary(record.summary | {"status": status, "failure": failure})
                    with record.logged():
                        log.error("%s", failure)
                record.close()
        raise
