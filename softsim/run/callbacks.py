"""Callbacks of a run: stable step, guards, history, energy balance, stop conditions, frames.

`assembled` (batch.py) puts them in order.
"""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from typing import Any

import numpy as np

from softsim.analysis.measures import History
from softsim.analysis.passage import PassageCondition, analyses
from softsim.compute.term import MOST_ROWS
from softsim.errors import StabilityError
from softsim.model import Model
from softsim.output.observation import Observer, columns
from softsim.output.stop_conditions import (
    CycleLimit,
    MakesStopCondition,
    ProbeAtRest,
    StopCondition,
    column_reached,
    ended_by,
    see_history,
)
from softsim.run.cost import FRAMES, INSPECTIONS, ROWS
from softsim.run.loop import Callback, Run
from softsim.run.record import LONGEST_GATHERING
from softsim.scene.loading import LoadedScene
from softsim.solver.energy import EnergyBalance
from softsim.solver.guards import (
    air_line_warnings,
    body_penetration_warnings,
    chatter_warnings,
    crossing_warnings,
    hourglass_warnings,
    penetration_warnings,
    refuse_broken_elements,
    refuse_collapsed_chamber,
    refuse_collapsed_step,
    refuse_crowding,
    refuse_energy_error,
    refuse_unstable_step,
    step_warnings,
    thinnest_wall,
)
from softsim.solver.stable_step import GROWTH, StableStep, estimator
from softsim.solver.stiffness_bound import ReferenceShape

REPORTED_STEP_CHANGE = 0.2
"""Relative change of the stable step above which it is reported again."""


@contextmanager
def failed_frame_kept(run: Run) -> Iterator[None]:
    """Write the last frame of the fields if a guard stops the run in the block."""
    try:
        yield
    except StabilityError:
        run.files.write_failed_frame(run.scenario)
        raise


def refuse_broken(run: Run) -> None:
    """Raise StabilityError, after a last frame, if an element is broken."""
    with failed_frame_kept(run):
        refuse_broken_elements(run.model, run.scenario.positions(), run.scenario.time)


class StableSteps(Callback):
    """Inspections of the elements, which set the time step of the increments.

    An inspection is due after a number of increments, and skipped if the shape has hardly changed.
    """

    def __init__(self, run: Run) -> None:
        self.run, self.scenario, self.model = run, run.scenario, run.model
        self.estimator, self.schedule = estimator(run.model), run.progress.schedule
        self.shape = ReferenceShape(self.estimator.stiffness, run.inspected)
        self.thinnest_wall = thinnest_wall(run.model.walls)

    def increments_left(self) -> float:
        """Return the number of increments until the next look at the elements."""
        return self.schedule.look_due - self.scenario.increment_count

    def before_block(self) -> None:
        """Look at the elements if that is due."""
        if self.increments_left() <= 0:
            with self.run.clock.spending_on(INSPECTIONS):
                self._look()

    def at_end(self) -> None:
        """Inspect the elements a last time."""
        with self.run.clock.spending_on(INSPECTIONS):
            self.inspect()

    @property
    def _run_length(self) -> float:
        """Number of increments of the whole run with the current time step."""
        return (self.model.end_time - self.model.start_time) / self.scenario.time_increment

    def _look(self) -> None:
        """Inspect the elements if that is due, or if they deformed much since the last time."""
        self._warn_of_crossing()
        count = self.scenario.increment_count
        if count < self.schedule.estimate_due and self.shape.is_near(self.scenario.positions()):
            self.schedule.plan_look(count, self._run_length)
        else:
            self.inspect()

    def _warn_of_crossing(self) -> None:
        name, thickness = self.thinnest_wall
        if np.isfinite(thickness):
            velocity = self.scenario.read(self.scenario.terms.nodes.velocity)
            speed = float(np.sqrt((velocity**2).sum(axis=1).max()))
            step = self.scenario.time_increment
            self.run.files.warn(crossing_warnings(name, thickness, speed, step))

    def inspect(self) -> None:
        """Check the elements, and update the time step to their deformation."""
        run, scenario, model = self.run, self.scenario, self.model
        refuse_broken(run)
        run.inspected = scenario.positions()
        self.shape = ReferenceShape(self.estimator.stiffness, run.inspected)
        stable = self.estimator.at(run.inspected, self.schedule.latest)
        self.schedule.plan_next(stable.value, scenario.increment_count, self._run_length)
        self._report(stable)
        with failed_frame_kept(run):
            refuse_collapsed_step(model, stable, self.estimator.at_rest, scenario.time)
        if model.time_increment is not None:
            refuse_unstable_step(model, stable, scenario.time)
            run.files.warn(step_warnings(model, stable))
            return
        allowed = model.safety_factor * self.schedule.lowest
        if scenario.time_increment > allowed or scenario.time_increment * GROWTH < allowed:
            scenario.change_time_increment(allowed)

    def _report(self, stable: StableStep) -> None:
        """Report the stable step and what limits it, if it has changed by REPORTED_STEP_CHANGE."""
        ratio = stable.value / self.run.progress.told_step
        if abs(ratio - 1.0) < REPORTED_STEP_CHANGE:
            return
        self.run.progress.told_step = stable.value
        self.run.files.tell(
            f"t = {self.scenario.time:.6g} s: stable step {stable.describe()} "
            f"({100.0 * (ratio - 1.0):+.0f} %)"
        )


class Guards(Callback):
    """Checks of contact and chambers after each block, and measures of contact over the run."""

    def __init__(self, run: Run) -> None:
        self.run, self.scenario, self.model = run, run.scenario, run.model

    def check_block(self) -> None:
        """Raise StabilityError for a missed contact or a collapsed chamber."""
        scenario = self.scenario
        if scenario.has_missed_contact():
            refuse_broken(self.run)  # the cause, if an element is broken
            refuse_crowding(scenario.time)
        for load in self.model.pressures:
            if load.source.needs_volume:
                term = scenario.term_of(load)
                volume, pressure = (float(scenario.read(f)) for f in (term.volume, term.pressure))
                with failed_frame_kept(self.run):
                    refuse_collapsed_chamber(
                        load.name, load.source, volume, pressure, scenario.time
                    )

    def summary(self, history: History) -> dict[str, Any]:
        """Return chatter and penetrations; warn of them, and of what the history shows."""
        warn = self.run.files.warn
        chatter, deepest = self.scenario.chatter(), self.scenario.penetration()
        found = {"contact_chatter": chatter.returns, "largest_penetration": deepest.relative}
        warn(chatter_warnings(self.model, chatter))
        warn(penetration_warnings(self.model, deepest))
        if (between := self.scenario.body_penetration()) is not None:
            found["largest_body_penetration"] = between.relative
            warn(body_penetration_warnings(between))
        warn(hourglass_warnings(history) | air_line_warnings(history))
        return found


# -------------------------------------------------------------------------------------------------
# The rows of the history, and what they act on.


class RowReader(Callback):
    """Callback that rows of the history act on. needs_each_row: rows must not be gathered."""

    needs_each_row = False

    def readings(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """Return its columns of rows at the times (rows,) [s]."""
        return {}

    def see_row(self, row: Mapping[str, float]) -> None:
        """Process a row of the history, column -> number in SI units: each row if
        `needs_each_row`, else the last of those computed together.
        """


class Rows(Callback):
    """The history: samples a row if that is due, computes its columns and passes it on.

    Columns of many rows may be computed at once, see `gather`. readers: act on each row, or on the
    last of those computed at once. row: the latest one that was written since the start or a return
    to an earlier state; empty before the first. energy_error: of the last sample. is_new: True if
    the last call of `act` has sampled a row. waiting_since: wall clock at the first row that waits
    for its columns.
    """

    def __init__(self, run: Run, readers: Sequence[RowReader]) -> None:
        self.run, self.scenario, self.readers = run, run.scenario, readers
        progress = run.progress
        self.balance = EnergyBalance(progress.initial_balance, progress.largest_energy)
        self.observer = Observer(run.scenario, run.reader, self.balance)
        self.row: dict[str, float] = {}
        self.energy_error, self.is_new, self.waiting_since = 0.0, False, np.inf

    def gather(self) -> None:
        """Compute the columns of many rows at once from now on, unless something needs each row.

        That is a controlled pressure, a stop condition, or a column of the present state (see
        Observer). Guards act at each row all the same.
        """
        if self.run.model.relaxation is None and not any(r.needs_each_row for r in self.readers):
            self.flush()
            self.observer = Observer(self.scenario, self.run.reader, self.balance, MOST_ROWS)

    def increments_left(self) -> float:
        """Return the number of increments until the next row, at least one."""
        return max(1, self.run.stepping.increments_to(self.run.progress.next_history))

    def act(self) -> None:
        """Sample a row if it is due."""
        progress, now = self.run.progress, self.scenario.time
        is_time = self.run.finished or self.run.stepping.increments_to(progress.next_history) <= 0
        self.is_new = is_time and now > progress.last_history
        if self.is_new:
            with self.run.clock.spending_on(ROWS):
                self._sample()

    def _sample(self) -> None:
        run, progress, now = self.run, self.run.progress, self.scenario.time
        run.reader.refresh()
        if self.observer.is_empty:
            self.waiting_since = time.monotonic()
        self.energies = self.observer.take(run.stepping.contact_time())
        if self.observer.is_full or time.monotonic() - self.waiting_since > LONGEST_GATHERING:
            self.flush()
        progress.last_history = now
        progress.next_history = next_multiple(
            run.output.history_interval, max(now, progress.next_history)
        )
        self.scenario.solver.clear_impulses(self.scenario.number)
        self.energy_error = self.observer.energy_error
        progress.largest_energy = self.balance.largest_energy
        progress.largest_energy_error = max(progress.largest_energy_error, self.energy_error)

    def flush(self) -> None:
        """Write the rows sampled so far, and pass them to the readers."""
        if self.observer.is_empty:
            return
        rows = self.observer.rows()
        for reader in self.readers:
            rows |= reader.readings(rows["time"])
        self.run.files.history.append(rows)
        self.row = {name: float(values[-1]) for name, values in rows.items()}
        for reader in self.readers:
            reader.see_row(self.row)


class EnergyGuard(Callback):
    """Check of the energy balance at each row."""

    def __init__(self, run: Run, rows: Rows) -> None:
        self.run, self.rows = run, rows

    def act(self) -> None:
        """Raise StabilityError if the balance of a new row is off."""
        run, error = self.run, self.rows.energy_error
        if not self.rows.is_new or error <= run.model.energy_error_limit:
            return
        values = asdict(self.rows.energies)
        largest = max(values, key=lambda k: abs(values[k]))
        refuse_broken(run)  # the cause, if an element is broken
        with failed_frame_kept(run):
            refuse_energy_error(run.model, error, run.scenario.time, largest)


class StopConditions(RowReader):
    """Conditions that end the run early: those of its scene, and given ones."""

    def __init__(self, run: Run, given: Sequence[MakesStopCondition]) -> None:
        self.run = run
        self.conditions = [
            *conditions_of_scene(run.files.loaded, run.model),
            *(make(run.model) for make in given),
        ]
        self.needs_each_row = bool(self.conditions)
        see_history(self.conditions, run.files.rows())

    def see_row(self, row: Mapping[str, float]) -> None:
        """Pass a row to the conditions."""
        for condition in self.conditions:
            condition.see_row(row)

    def act(self) -> None:
        """Finish the run if a condition is met."""
        self.run.finished |= any(condition.is_over for condition in self.conditions)

    def summary(self, history: History) -> dict[str, Any]:
        """Return the name of the condition that ended the run."""
        name = ended_by(self.conditions)
        return {} if name is None else {"ended_by": name}

    @property
    def path_covered(self) -> float | None:
        """Covered fraction of the path to the goal of a layout; None without a layout."""
        on_the_way = [c for c in self.conditions if isinstance(c, PassageCondition)]
        return on_the_way[0].way_share if on_the_way else None


def conditions_of_scene(loaded: LoadedScene, model: Model) -> list[StopCondition]:
    """Return the conditions of a scene that may end its run early.

    Raises SceneError where it asks for one of a column that its history does not have.
    """
    conditions: list[StopCondition] = []
    if (reached := column_reached(loaded, columns(model))) is not None:
        conditions.append(reached)
    if model.cycles is not None:
        conditions.append(CycleLimit(model.cycles))
    conditions += [analysis.condition() for analysis in analyses(model)]
    if model.relaxation is not None and model.relaxation.until is not None:
        conditions.append(ProbeAtRest(model.relaxation.until))
    return conditions


class FrameOutput(Callback):
    """Frames of the fields."""

    def __init__(self, run: Run) -> None:
        self.run = run

    def act(self) -> None:
        """Write the frame if it is due, or if the run is finished."""
        run, progress = self.run, self.run.progress
        if run.finished or run.stepping.increments_to(progress.next_frame) <= 0:
            with run.clock.spending_on(FRAMES):
                run.files.write_frame(run.scenario)
            latest = max(run.scenario.time, progress.next_frame)
            progress.next_frame = next_multiple(run.output.frame_interval, latest)


def next_multiple(interval: float, time: float) -> float:
    """Return the first whole multiple of `interval` after `time` [s]."""
    return (math.floor(time / interval * (1.0 + 1e-12)) + 1.0) * interval
