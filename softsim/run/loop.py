"""The loop of a run: blocks of increments, and the callbacks that act between them.

A run has a `Stepping`, which advances its blocks, and callbacks, which act between them in the
order of `assembled` (batch.py). A block ends where a callback has to act or where the run ends.
That depends on scene and model only, so results depend neither on other runs of the batch nor on
interruptions.
"""

import logging
import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from softsim.analysis.measures import History, failed_expectations, measures
from softsim.compute import backend
from softsim.errors import ExpectationError, SoftsimError
from softsim.loads.pressure_control import ControlState
from softsim.output.folder import Checkpoint
from softsim.run.cost import CHECKPOINTS, WallClock
from softsim.run.record import Progress, Record
from softsim.solver.energy import EnergyBalance, EnergyReader, moves, unbalanced_share
from softsim.solver.explicit import Scenario, longest_block
from softsim.solver.guards import refuse_no_equilibrium, step_warnings, turning_warnings
from softsim.solver.plausibility import output_warnings, plausibility_warnings
from softsim.solver.stable_step import StableStep, StableStepSchedule

log = logging.getLogger("softsim")


@dataclass(frozen=True)
class Results:
    """Results of a finished run.

    Attributes
    ----------
    folder : Path
        Run folder with all files of the run.
    summary : dict
        Content of summary.json: status, measures, warnings, in SI units.
    history : dict of str to ndarray
        Content of history.csv: an array (rows,) for each column, in SI units.

    Examples
    --------
    >>> from pathlib import Path
    >>> from softsim.run import run
    >>> results = run("block.yaml", out=Path("runs/block"))
    >>> results.folder
    PosixPath('runs/block')
    >>> results.history["time"].shape == results.history["pressure"].shape
    True
    >>> results.summary["simulated_time"] >= 0.01  # [s]
    True
    """

    folder: Path
    summary: dict[str, Any]
    history: dict[str, np.ndarray]


class Callback:
    """One concern of a run, which acts between its blocks of increments; by default it does
    nothing.

    `assembled` (batch.py) lists the callbacks of a run. What a resumed run needs of their state is
    in `Run.progress`, everything else is lost. A callback ends the run by setting `Run.finished`.
    """

    def increments_left(self) -> float:
        """Return the number of increments, at least 1, after which the block must end for it.

        It must follow from scene and model alone: the ends of blocks influence the last bits of
        results.
        """
        return math.inf

    def before_block(self) -> None:
        """Act before the length of a block is determined."""

    def check_block(self) -> None:
        """Check the state that a block has reached."""

    def act(self) -> None:
        """Act on the state at the start, also of a resumed run, and after each checked block."""

    def flush(self) -> None:
        """Write what is gathered: the state is about to be stored, or the run to end."""

    def at_end(self) -> None:
        """Act on the final state of a run that is complete."""

    def summary(self, history: History) -> dict[str, Any]:
        """Return its part of the summary, and record its warnings about the whole run."""
        return {}


C = TypeVar("C", bound=Callback)


class Stepping(ABC):
    """Way in which the blocks of a run advance."""

    def __init__(self, run: "Run") -> None:
        self.run, self.scenario, self.model = run, run.scenario, run.model

    @abstractmethod
    def next_block(self, longest: float) -> int:
        """Begin a block, and return its increments that the solver must compute.

        longest: number of increments after which a callback has to act.
        """

    @abstractmethod
    def increments_to(self, due: float) -> int:
        """Return the increments after which output due at a time [s] is written; 0 or less: now."""

    @abstractmethod
    def contact_time(self) -> float:
        """Return the time [s] over which contact impulses are summed since the last row."""

    def is_complete(self) -> bool:
        """Return True if nothing is left to compute, by default at the end time.

        Raises StabilityError.
        """
        return self.run.has_reached_end

    def summary(self) -> dict[str, Any]:
        """Return entries of summary.json about how the run advanced; none by default."""
        return {}


class Run:
    """One scenario of a solver from start to end: blocks that advance, callbacks between them.

    files: its record, with scene and model. finished: True if nothing is left to compute.
    outcome: its Results, or the error that stopped it; None while it runs. show: shows a detail of
    what is computed, on the console. progress: what a checkpoint contains besides the solver's
    state and `inspected`, the positions of the nodes (n, d) [m] at the last inspection. assemble:
    returns stepping and callbacks, anew at the start and after a return to an earlier state.
    """

    def __init__(
        self,
        files: Record,
        scenario: Scenario,
        reader: EnergyReader,
        clock: WallClock,
        assemble: "Callable[[Run], tuple[Stepping, list[Callback]]]",
    ) -> None:
        self.files, self.scenario, self.reader, self.clock = files, scenario, reader, clock
        self.model, self.output, self.assemble = files.model, files.loaded.scene.output, assemble
        self.finished = False
        self.outcome: Results | SoftsimError | None = None
        self.show: Callable[[str], None] = lambda detail: None

    # --- the start -------------------------------------------------------------------------------

    def begin(self, stable: StableStep, x: np.ndarray, control: ControlState | None = None) -> None:
        """Start with this stable step and the nodes at x (n, d) [m].

        The energy reader must be up to date. control: state of a controlled pressure that
        continues.
        """
        for region in self.model.regions:
            log.info("material %s", region.material.describe())
        if self.model.mass_scaling is not None:
            log.info("mass scaling: %s", self.model.mass_scaling.describe())
            self.files.warn(turning_warnings(self.model.added_turning))
        log.info("stable step %s", stable.describe())
        self.files.warn(
            plausibility_warnings(self.model) | output_warnings(self.model, self.output)
        )
        self.files.warn(step_warnings(self.model, stable))
        energies = self.reader.of_scenario(self.scenario.number)
        balance = EnergyBalance.starting(energies, self.model)
        progress = Progress(
            StableStepSchedule(stable.value),
            time_increment=self.scenario.time_increment,
            initial_balance=balance.initial,
            largest_energy=balance.largest_energy,
            told_step=stable.value,
            next_history=self.scenario.time,
            next_frame=self.scenario.time,
            control=control,
        )
        self._set_out(progress, x)

    def resume(self, checkpoint: Checkpoint) -> None:
        """Continue from a checkpoint."""
        progress = Progress.written(checkpoint.progress)
        self.scenario.solver.restore_scenario(
            self.scenario.number, checkpoint.state, progress.time, progress.increment_count,
            progress.time_increment,
        )  # fmt: skip
        self.files.warnings.update(progress.warnings)
        log.info("resumed at t = %.6g s, increment %d", progress.time, progress.increment_count)
        self._set_out(progress, checkpoint.inspected)

    def _set_out(self, progress: Progress, inspected: np.ndarray) -> None:
        self.progress, self.inspected = progress, inspected
        self.wall_before, self.outcome = progress.wall_time, None
        self.stepping, self.callbacks = self.assemble(self)
        self.finished = self.stepping.is_complete()

    def callback(self, kind: type[C]) -> C:
        """Return the callback of a class."""
        return next(c for c in self.callbacks if isinstance(c, kind))

    # --- blocks of increments --------------------------------------------------------------------

    def act(self) -> None:
        """Let the callbacks act on the present state, and end a run that is complete."""
        for callback in self.callbacks:
            callback.act()
        if self.finished:
            self._finish()

    def next_block(self) -> int:
        """Begin the next block, and return its increments that the solver must compute."""
        for callback in self.callbacks:
            callback.before_block()
        return self.stepping.next_block(min(c.increments_left() for c in self.callbacks))

    def end_block(self) -> None:
        """Check the state that the block has reached, and act on it."""
        for callback in self.callbacks:
            callback.check_block()
        self.finished = self.stepping.is_complete()
        self.act()

    @property
    def has_reached_end(self) -> bool:
        """True at the end time, within round-off."""
        return self.scenario.time >= self.model.end_time * (1.0 - 1e-12)

    # --- the end ---------------------------------------------------------------------------------

    def _finish(self) -> None:
        """Set the outcome of a complete run."""
        for callback in self.callbacks:
            callback.at_end()
        self._store(self.files.write_end)
        history = self.files.rows()
        found = measures(self.model, history)
        error = {"energy_error": self.progress.largest_energy_error}
        failure = failed_expectations(self.files.loaded.scene.expect, found | error)
        self._end("done", history, found, failure)
        if failure is None:
            self.outcome = Results(self.files.path, self.files.summary, history)
        else:
            self.outcome = ExpectationError(failure, hint=f"the run is complete: {self.files.path}")

    def fail(self, error: SoftsimError) -> None:
        """End this run with an error as its outcome; other runs continue."""
        log.error("%s", error)
        self.outcome = error
        self.stop("aborted", str(error), error.element)

    def stop(self, status: str, failure: str | None = None, element: int | None = None) -> None:
        """Write the summary of a run that did not reach its end, and close the files; element:
        that which failed.
        """
        self._flush()
        history = self.files.rows()
        found = measures(self.model, history)
        if element is not None:
            found["failed_element"] = element
        self._end(status, history, found, failure)

    def _end(
        self, status: str, history: History, found: dict[str, Any], failure: str | None
    ) -> None:
        """Write the summary with the measures found in the history, and close the files."""
        for callback in self.callbacks:
            found |= callback.summary(history)
        if failure is not None:
            found["failure"] = failure
        self.write_summary(status, found | self.stepping.summary())
        self.files.close()

    def checkpoint(self) -> None:
        """Write the full state, from which --resume continues."""
        self._store(self.files.write_checkpoint)

    def _flush(self) -> None:
        for callback in self.callbacks:
            callback.flush()

    def _store(self, write: Callable[[Scenario, Progress, np.ndarray], None]) -> None:
        """Store the present state by `write`, a method of the files."""
        self._flush()
        scenario, progress = self.scenario, self.progress
        progress.time, progress.increment_count = scenario.time, scenario.increment_count
        progress.time_increment, progress.wall_time = scenario.time_increment, self._wall_time()
        progress.warnings = dict(self.files.warnings)
        with self.clock.spending_on(CHECKPOINTS):
            write(scenario, progress, self.inspected)

    def _wall_time(self) -> float:
        return self.wall_before + time.monotonic() - self.clock.began

    def write_summary(self, status: str, found: dict[str, Any]) -> None:
        """Write the summary: status, progress and results of the run."""
        scenario, model, device = self.scenario, self.model, backend.device()
        done = scenario.increment_count - int(self.clock.counts_before[scenario.number])
        rate = model.element_count * done / (time.monotonic() - self.clock.steady_since)
        summary: dict[str, Any] = {
            "status": status,
            "scene": str(self.files.loaded.path),
            "title": self.files.loaded.scene.title,
            "snapshot_field": self.output.snapshot_field,
            "device": device.name,
            "threads": device.threads,
            "precision": device.precision,
            "node_count": len(model.points),
            "element_count": model.element_count,
            "time_increment": scenario.time_increment,
            "increments": scenario.increment_count,
            "simulated_time": scenario.time,
            "wall_time": self._wall_time(),
            "wall_times": self.clock.parts(),
            "first_increment_after": self.clock.first_increment_after,
            "element_updates_per_second": rate if done else None,
            "energy_error": float(self.progress.largest_energy_error),
            "warnings": list(self.files.warnings.values()),
        }
        self.files.write_summary(summary | found)


# -------------------------------------------------------------------------------------------------
# Blocks of the explicit solver.


class IncrementStepping(Stepping):
    """Blocks of increments of the explicit solver, up to the end time.

    The last increments are shortened so that the run ends exactly there.
    """

    def next_block(self, longest: float) -> int:
        """Return the number of increments until a callback has to act, or the run ends."""
        scenario, dt = self.scenario, self.scenario.time_increment
        left = self.model.end_time - scenario.time
        count = int(min(longest_block(self.model.element_count), longest))
        if self.run.has_reached_end:  # a relaxation goes on until forces balance
            return count
        to_end = max(1, int(np.ceil(left / dt - 1e-9)))
        if to_end > count:
            return count
        scenario.change_time_increment(left / to_end)
        return to_end

    def increments_to(self, due: float) -> int:
        """Return the increments after which output due at a time [s] is written; 0 or less: now."""
        scenario = self.scenario
        return increments_to(due, scenario.time, scenario.time_increment, self.model.end_time)

    def contact_time(self) -> float:
        """Return the time [s] since the last row."""
        last = max(self.run.progress.last_history, self.model.start_time)
        return self.scenario.time - last


class RelaxationStepping(IncrementStepping):
    """Blocks of a static run by relaxation, which goes on until forces balance."""

    def is_complete(self) -> bool:
        """Return True once forces balance after the end time.

        Raises StabilityError if they do not within the limit.
        """
        scenario, model, path = self.scenario, self.model, self.model.relaxation
        if not self.run.has_reached_end:
            return False
        assert path is not None
        share = unbalanced_share(scenario)
        energies = self.run.reader.read(scenario.number)
        if share <= path.tolerance and not moves(energies, path):
            return True
        if scenario.time > model.end_time + path.longest:
            refuse_no_equilibrium(model, share, path)
        return False


def increments_to(due: float, time: float, dt: float, end: float) -> int:
    """Return the number of increments after which output due at a time is written; 0 or less: now.

    It is written with the last increment that does not end after that time, so that a row shows the
    load that acted up to then, and not the next ramp of a load with a corner there. From the end of
    the loads on it is the first increment that ends there or later: that of the end is there
    exactly.

    Parameters
    ----------
    due, time, end : float
        Time at which it is due, present time, end of the loads [s].
    dt : float
        Time of an increment [s].
    """
    exact = (due - time) / dt
    if due < end * (1.0 - 1e-12):
        return math.floor(exact + 1e-9)
    return math.ceil(exact - 1e-9)
