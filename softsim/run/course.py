"""One run, from block to block of increments.

A block ends where a history row, an inspection or the end of the run is due. That depends on scene
and model only, so a run takes the same course whatever is computed beside it and whatever stops it.
`Run.next_block` inspects the elements, and so the stable step, if that is due; `Run.write_due`
writes rows and frames and reads the stop conditions; `Batch._loop` (batch.py) writes checkpoints by
the wall clock.
"""

import logging
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from softsim.analysis.measures import failed_expectations, measures
from softsim.analysis.passage import PassageCondition, analyses
from softsim.compute import backend
from softsim.compute.samples import MOST_ROWS
from softsim.errors import ExpectationError, SoftsimError, StabilityError
from softsim.loads.air_line import AirLineKernel
from softsim.loads.pressure import PressureSource
from softsim.loads.pressure_control import (
    ControlledPressureKernel,
    ControlState,
    EventCycles,
    PressureControl,
    Sensed,
)
from softsim.model import Model
from softsim.output.folder import Checkpoint
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
from softsim.run.record import LONGEST_GATHERING, Progress, Record
from softsim.scene.loading import LoadedScene
from softsim.solver.energy import (
    Energies,
    EnergyBalance,
    EnergyReader,
    moves,
    unbalanced_share,
)
from softsim.solver.explicit import Scenario, longest_block
from softsim.solver.guards import (
    air_line_warnings,
    chatter_warnings,
    hourglass_warnings,
    refuse_broken_elements,
    refuse_collapsed_chamber,
    refuse_collapsed_step,
    refuse_crowding,
    refuse_energy_error,
    refuse_no_equilibrium,
    refuse_unstable_step,
    step_warnings,
    turning_warnings,
)
from softsim.solver.penetration import (
    body_penetration,
    body_penetration_warnings,
    crossing_warnings,
    penetration,
    penetration_warnings,
    thinnest_wall,
)
from softsim.solver.plausibility import output_warnings, plausibility_warnings
from softsim.solver.stable_step import GROWTH, StableStep, StableStepSchedule, estimator
from softsim.solver.stiffness_bound import ReferenceShape

# -------------------------------------------------------------------------------------------------
# Feedback: a row of the history goes to the pressure control, its command to the solver.
#
# Rows come at increments that depend on model and scene only, so a run decides the same whatever
# stops it in between.

log = logging.getLogger("softsim")


class OpenLoop:
    """Loop without feedback: the pressure of the robot's chamber, if any, is given over time."""

    state: ControlState | None = None
    needs_rows = False

    def __init__(self, scenario: Scenario, source: PressureSource | None) -> None:
        self.scenario, self.source = scenario, source

    def cycles_done(self) -> int:
        """Return the number of pressure cycles that have ended; 0 without a falling pressure."""
        return 0 if self.source is None else self.source.cycles_done(self.scenario.time)

    def readings(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """Return the column `cycles_done` of rows at the times (rows,) [s]."""
        if self.source is None:
            return {"cycles_done": np.zeros(len(times))}
        return {"cycles_done": np.array([self.source.cycles_done(time) for time in times])}

    def follow(self, row: Mapping[str, float]) -> None:
        """Do nothing: rows of the history have no effect."""


class ClosedLoop:
    """Loop with feedback: the pressure of the robot's chamber depends on sensed quantities.

    state: of a resumed run, changed in place; None for a run that begins. needs_rows: True, each
    row may change the pressure.
    """

    needs_rows = True

    def __init__(
        self,
        scenario: Scenario,
        kernel: ControlledPressureKernel | AirLineKernel,
        settings: EventCycles,
        state: ControlState | None,
    ) -> None:
        self.scenario, self.kernel = scenario, kernel
        self.control = PressureControl(settings, state)

    @property
    def state(self) -> ControlState:
        """State for a checkpoint; the ramp of its pressure is in the solver's state."""
        return self.control.state

    def cycles_done(self) -> int:
        """Return the number of pressure cycles that have ended."""
        return self.control.state.cycles_done

    def readings(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """Return the columns `cycles_done`, `cycle` and `phase` of the present row."""
        return {
            "cycles_done": np.array([self.cycles_done()]),
            "cycle": np.array([self.control.cycle]),
            "phase": np.array([self.control.phase_at(time) for time in times]),
        }

    def follow(self, row: Mapping[str, float]) -> None:
        """Pass a row of the history to the control, and pass its ramp, if any, to the solver."""
        decision = self.control.sense(sensed(row))
        if decision is None:
            return
        self.kernel.set_ramp(self.scenario.number, decision.ramp)
        log.info(
            "t = %.6g s, cycle %d: %s at %.4g kPa, now %+.4g kPa/s",
            row["time"], row["cycle"], decision.reason, 1e-3 * row["pressure"],
            1e-3 * decision.ramp.rate,
        )  # fmt: skip


def feedback(scenario: Scenario, state: ControlState | None) -> OpenLoop | ClosedLoop:
    """Return the loop for the pressure source of the robot's chamber; state: of a resumed run."""
    chamber = scenario.model.chamber
    if chamber is None:
        return OpenLoop(scenario, None)
    settings = chamber.source.control
    if settings is not None:
        return ClosedLoop(scenario, scenario.term_of(chamber).kernel, settings, state)
    return OpenLoop(scenario, chamber.source)


def sensed(row: Mapping[str, float]) -> Sensed:
    """Return the sensed quantities in a row of the history."""
    place = tuple(row[name] for name in ("frame_x", "frame_y", "frame_z") if name in row)
    turns = ("frame_rotation_x", "frame_rotation_y", "frame_rotation_z")
    turn = [row[name] for name in turns] if "frame_z" in row else [0.0, 0.0, row["frame_angle"]]
    axis = Rotation.from_rotvec(turn).apply([1.0, 0.0, 0.0])[: len(place)]
    return Sensed(
        row["time"], row["pressure"], row["rows_in_contact"], row["wall_force_normal"], place,
        tuple(axis.tolist()),
    )  # fmt: skip


# -------------------------------------------------------------------------------------------------
# The wall time of runs, and its division into parts.

START, KERNEL = "start", "kernel"
INSPECTIONS, ROWS, FRAMES, CHECKPOINTS = "inspections", "rows", "frames", "checkpoints"
# Work of the host beside the increments.
HOST_WORK = (INSPECTIONS, ROWS, FRAMES, CHECKPOINTS)


class Stopwatch:
    """Context that adds its wall time [s] to a part of those spent."""

    def __init__(self, spent: dict[str, float], part: str) -> None:
        self.spent, self.part = spent, part

    def __enter__(self) -> None:
        self.began = time.monotonic()

    def __exit__(self, *error: object) -> None:
        self.spent[self.part] += time.monotonic() - self.began


class WallClock:
    """Wall time of runs that are computed together.

    It is measured from their start, from the start of their loop, and from the end of its first
    block, which compiles kernels; the rate counts from there. counts_before: increments of each run
    (scenarios,) done before that. spent: wall time [s] of each part; START is all before the loop,
    including the settling of bodies.
    """

    def __init__(self) -> None:
        self.began = time.monotonic()
        self.first_increment_after = 0.0
        self.spent = dict.fromkeys((START, KERNEL, *HOST_WORK), 0.0)
        self._stopwatches = {part: Stopwatch(self.spent, part) for part in self.spent}

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

    def spending_on(self, part: str) -> Stopwatch:
        """Return a context that adds its wall time to a part; blocks must not be nested."""
        return self._stopwatches[part]


# A stable step that has changed by this share is told.
REPORTED_STEP_CHANGE = 0.2


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


class Run:
    """Run of one scenario of a solver.

    files: its record, with scene and model. finished: True if nothing is left to compute.
    outcome: its Results, or the error that stopped it; None while it runs. show: shows a detail of
    what is computed, on the console. row: the latest one of the history that was written since the
    start or a return to an earlier state; empty before the first. rows_since: wall clock at the
    first row that waits for its columns.
    is_commanded: True once a command has replaced the control of the robot's chamber.
    """

    def __init__(
        self,
        files: Record,
        scenario: Scenario,
        reader: EnergyReader,
        clock: WallClock,
        given_conditions: Sequence[MakesStopCondition],
    ) -> None:
        self.files, self.scenario, self.reader, self.clock = files, scenario, reader, clock
        self.model, self.output = files.model, files.loaded.scene.output
        self.estimator = estimator(self.model)
        self.given_conditions = given_conditions
        self.thinnest_wall = thinnest_wall(self.model.walls)
        self.finished = False
        self.energy_error, self.contact_count, self.unbalanced_share = 0.0, 0, float("nan")
        self.outcome: Results | SoftsimError | None = None
        self.show: Callable[[str], None] = lambda detail: None
        self.row: dict[str, float] = {}

    def begin(self, settled: float | None) -> None:
        """Start at t = 0; the energy reader must be up to date.

        settled: simulated time [s] of the settling before, None without one.
        """
        if settled is not None:
            moved = np.abs(self.scenario.positions() - self.model.points).max()
            log.info("settled within %.3g s, largest displacement %.3g mm", settled, 1e3 * moved)
        self._start(self.estimator.at_rest, self.model.points, None)

    def begin_step(self, control: ControlState | None) -> None:
        """Start at the end of the previous step; the energy reader must be up to date.

        control: state of a controlled pressure that continues.
        """
        log.info("starts at t = %.6g s, the end of the previous step", self.scenario.time)
        x = self.scenario.positions()
        self._start(self.estimator.at(x), x, control)

    def _start(self, stable: StableStep, x: np.ndarray, control: ControlState | None) -> None:
        """Start with this stable step and the nodes at x (n, d) [m]."""
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
        self.balance = EnergyBalance.starting(energies, self.model)
        self.shape = ReferenceShape(self.estimator.stiffness, x)
        self._set_out(
            Progress(
                StableStepSchedule(stable.value),
                time_increment=self.scenario.time_increment,
                initial_balance=self.balance.initial,
                told_step=stable.value,
                next_history=self.scenario.time,
                next_frame=self.scenario.time,
                control=control,
            )
        )

    def resume(self, checkpoint: Checkpoint) -> None:
        """Continue from a checkpoint."""
        progress = Progress.written(checkpoint.progress)
        self.scenario.solver.restore_scenario(
            self.scenario.number, checkpoint.state, progress.time, progress.increment_count,
            progress.time_increment,
        )  # fmt: skip
        self.balance = EnergyBalance(progress.initial_balance, progress.largest_energy)
        self.shape = ReferenceShape(self.estimator.stiffness, checkpoint.inspected)
        self.files.warnings.update(progress.warnings)
        log.info("resumed at t = %.6g s, increment %d", progress.time, progress.increment_count)
        self._set_out(progress)

    def _set_out(self, progress: Progress) -> None:
        self.progress = progress
        self.observer = Observer(self.scenario, self.reader, self.balance)
        self.rows_since = np.inf
        self.wall_before = progress.wall_time
        self.loop = feedback(self.scenario, progress.control)
        self.is_commanded, self.row = False, {}
        self.stop_conditions = [
            *conditions_of_scene(self.files.loaded, self.model),
            *(make(self.model) for make in self.given_conditions),
        ]
        see_history(self.stop_conditions, self.files.rows())
        self.prepare()
        self.finished = self._is_done()

    def prepare(self) -> None:
        """Prepare the first block; the state is that of the start, or of a checkpoint."""

    def end_control(self) -> None:
        """End the control of the robot's chamber by its profile or by events: commands set it."""
        self.is_commanded = True
        self.loop = OpenLoop(self.scenario, None)

    # --- blocks of increments --------------------------------------------------------------------

    def next_block(self) -> int:
        """Inspect the elements if due, and return the number of increments of the next block."""
        if self.scenario.increment_count >= self.progress.schedule.look_due:
            with self.clock.spending_on(INSPECTIONS):
                self._look()
        return self._block_length()

    def end_block(self) -> None:
        """Check the state after a block, and whether it was the last one."""
        scenario = self.scenario
        if scenario.has_missed_contact():
            self._refuse_broken_elements()  # a cause says more than a symptom
            refuse_crowding(scenario.time)
        self._refuse_collapsed_chambers()
        self.finished = self._is_done()

    @property
    def way_share(self) -> float | None:
        """Covered fraction of the path to the goal of a layout; None without a layout."""
        on_the_way = [c for c in self.stop_conditions if isinstance(c, PassageCondition)]
        return on_the_way[0].way_share if on_the_way else None

    @property
    def row_is_due(self) -> bool:
        """True if a row of the history is to be written now."""
        progress = self.progress
        is_time = self.finished or self._increments_to(progress.next_history) <= 0
        return self.scenario.time > progress.last_history and is_time

    def write_due(self) -> None:
        """Write the history row and the frame if due; for a row the reader must be up to date."""
        progress = self.progress
        if self.row_is_due:
            with self.clock.spending_on(ROWS):
                self._sample_row()
        self.finished = self.finished or any(c.is_over for c in self.stop_conditions)
        if self._increments_to(progress.next_frame) <= 0 or self.finished:
            with self.clock.spending_on(FRAMES):
                self.files.write_frame(self.scenario)
            latest = max(self.scenario.time, progress.next_frame)
            progress.next_frame = _next_multiple(self.output.frame_interval, latest)

    def has_reached_end(self) -> bool:
        """Return True at the end time, within round-off."""
        return self.scenario.time >= self.model.end_time * (1.0 - 1e-12)

    def _is_done(self) -> bool:
        """Return True at the end time, or for a static run once forces balance after it.

        Raises an error if a static run does not balance within its limit.
        """
        scenario, model = self.scenario, self.model
        if not self.has_reached_end():
            return False
        if model.relaxation is None:
            return True
        share = unbalanced_share(scenario)
        energies = self.reader.read(scenario.number)
        if share <= model.relaxation.tolerance and not moves(energies, model.relaxation):
            return True
        if scenario.time > model.end_time + model.relaxation.longest:
            refuse_no_equilibrium(model, share, model.relaxation)
        return False

    def _block_length(self) -> int:
        """Return the number of increments until a history row, an inspection or the end is due.

        The last ones are shortened so that the run ends exactly at its end time.
        """
        scenario, dt = self.scenario, self.scenario.time_increment
        left = self.model.end_time - scenario.time
        to_row = self._increments_to(self.progress.next_history)
        to_inspection = self.progress.schedule.look_due - scenario.increment_count
        longest = longest_block(self.model.element_count)
        count = min(longest, to_inspection, max(1, to_row))
        if left <= 0.0:  # a static run settles
            return count
        to_end = max(1, int(np.ceil(left / dt - 1e-9)))
        if to_end > count:
            return count
        scenario.change_time_increment(left / to_end)
        return to_end

    def _increments_to(self, due: float) -> int:
        """Return the number of increments until what is due at a time [s] is written."""
        scenario = self.scenario
        return increments_to(due, scenario.time, scenario.time_increment, self.model.end_time)

    def _run_length(self) -> float:
        """Return the number of increments of the whole run with the current time step."""
        duration = self.model.end_time - self.model.start_time
        return duration / self.scenario.time_increment

    def _look(self) -> None:
        """Inspect the elements if that is due, or if they deformed much since the last time."""
        self._warn_of_crossing()
        count, schedule = self.scenario.increment_count, self.progress.schedule
        near = count < schedule.estimate_due and self.shape.is_near(self.scenario.positions())
        if near:
            schedule.plan_look(count, self._run_length())
        else:
            self._inspect()

    def _warn_of_crossing(self) -> None:
        name, thickness = self.thinnest_wall
        if np.isfinite(thickness):
            velocity = self.scenario.read(self.scenario.terms.nodes.velocity)
            speed = float(np.sqrt((velocity**2).sum(axis=1).max()))
            self.files.warn(crossing_warnings(name, thickness, speed, self.scenario.time_increment))

    def _inspect(self) -> None:
        """Check the elements, and update the time step to their deformation."""
        scenario, model = self.scenario, self.model
        self._refuse_broken_elements()
        self.shape = ReferenceShape(self.estimator.stiffness, scenario.positions())
        stable = self.estimator.at(self.shape.x, self.progress.schedule.latest)
        count, length = scenario.increment_count, self._run_length()
        self.progress.schedule.plan_next(stable.value, count, length)
        self._tell_step(stable)
        with self._failed_frame_kept():
            refuse_collapsed_step(model, stable, self.estimator.at_rest, scenario.time)
        if model.time_increment is not None:
            refuse_unstable_step(model, stable, scenario.time)
            self.files.warn(step_warnings(model, stable))
            return
        allowed = model.safety_factor * self.progress.schedule.lowest
        if scenario.time_increment > allowed or scenario.time_increment * GROWTH < allowed:
            scenario.change_time_increment(allowed)
            self.progress.time_increment = allowed

    def _tell_step(self, stable: StableStep) -> None:
        """Log the stable step and what limits it, if it has changed by REPORTED_STEP_CHANGE."""
        ratio = stable.value / self.progress.told_step
        if abs(ratio - 1.0) < REPORTED_STEP_CHANGE:
            return
        self.progress.told_step = stable.value
        self.files.tell(
            f"t = {self.scenario.time:.6g} s: stable step {stable.describe()} "
            f"({100.0 * (ratio - 1.0):+.0f} %)"
        )

    def _refuse_broken_elements(self) -> None:
        with self._failed_frame_kept():
            refuse_broken_elements(self.model, self.scenario.positions(), self.scenario.time)

    def _refuse_collapsed_chambers(self) -> None:
        scenario = self.scenario
        for load in self.model.pressures:
            if load.source.needs_volume:
                term = scenario.term_of(load)
                volume, pressure = (float(scenario.read(f)) for f in (term.volume, term.pressure))
                with self._failed_frame_kept():
                    refuse_collapsed_chamber(
                        load.name, load.source, volume, pressure, scenario.time
                    )

    @contextmanager
    def _failed_frame_kept(self) -> Iterator[None]:
        """Write the last frame of the fields if a guard stops the run in the block."""
        try:
            yield
        except StabilityError:
            self.files.write_failed_frame(self.scenario)
            raise

    def gather_rows(self) -> None:
        """Compute the columns of many rows at once from now on, unless something needs each row.

        That is a controlled pressure, a stop condition, or a column of the present state (see
        Observer). Guards act at each row all the same.
        """
        needs_rows = self.loop.needs_rows or bool(self.stop_conditions)
        if not needs_rows and self.model.relaxation is None:
            self.write_rows()
            self.observer = Observer(self.scenario, self.reader, self.balance, MOST_ROWS)

    def write_rows(self) -> None:
        """Write the rows sampled so far, and pass them to what acts on them."""
        if self.observer.is_empty:
            return
        rows = self.observer.rows()
        rows |= self.loop.readings(rows["time"]) | self.path_readings()
        self.files.history.append(rows)
        self.row = row = {name: float(values[-1]) for name, values in rows.items()}
        self.contact_count = int(row["contact_count"])
        self.unbalanced_share = row.get("unbalanced_share", float("nan"))
        self.loop.follow(row)
        for condition in self.stop_conditions:
            condition.see_row(row)

    def _sample_row(self) -> None:
        scenario, progress = self.scenario, self.progress
        if self.observer.is_empty:
            self.rows_since = time.monotonic()
        energies = self.observer.take(self._interval())
        if self.observer.is_full or time.monotonic() - self.rows_since > LONGEST_GATHERING:
            self.write_rows()
        progress.last_history = scenario.time
        latest = max(scenario.time, progress.next_history)
        progress.next_history = _next_multiple(self.output.history_interval, latest)
        progress.largest_energy = self.balance.largest_energy
        scenario.solver.clear_impulses(scenario.number)
        error = self.energy_error = self.observer.energy_error
        progress.largest_energy_error = max(progress.largest_energy_error, error)
        self._refuse_energy_error(error, energies)

    def path_readings(self) -> dict[str, np.ndarray]:
        """Return the columns of the present row along a path of equilibria; none in other runs."""
        return {}

    def _interval(self) -> float:
        """Return the time [s] since the impulses of contact were cleared."""
        last = max(self.progress.last_history, self.model.start_time)
        return self.scenario.time - last

    def _refuse_energy_error(self, error: float, energies: Energies) -> None:
        if error <= self.model.energy_error_limit:
            return
        values = asdict(energies)
        largest = max(values, key=lambda k: abs(values[k]))
        self._refuse_broken_elements()  # a cause says more than a symptom
        with self._failed_frame_kept():
            refuse_energy_error(self.model, error, self.scenario.time, largest)

    # --- the end ---------------------------------------------------------------------------------

    def finish(self) -> None:
        """Inspect the elements a last time, and set the outcome."""
        with self.clock.spending_on(INSPECTIONS):
            self._inspect()
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
        self.write_rows()
        history = self.files.rows()
        found = measures(self.model, history)
        if element is not None:
            found["failed_element"] = element
        self._end(status, history, found, failure)

    def _end(
        self,
        status: str,
        history: dict[str, np.ndarray],
        found: dict[str, Any],
        failure: str | None,
    ) -> None:
        """Write the summary with the measures found in the history, and close the files."""
        chatter = self.scenario.chatter()
        found |= {"contact_chatter": chatter.returns}
        self.files.warn(chatter_warnings(self.model, chatter))
        deepest = penetration(self.scenario)
        found |= {"largest_penetration": deepest.relative}
        self.files.warn(penetration_warnings(self.model, deepest))
        if (between := body_penetration(self.scenario)) is not None:
            found |= {"largest_body_penetration": between.relative}
            self.files.warn(body_penetration_warnings(between))
        self.files.warn(hourglass_warnings(history) | air_line_warnings(history))
        if (name := ended_by(self.stop_conditions)) is not None:
            found["ended_by"] = name
        if failure is not None:
            found["failure"] = failure
        self.write_summary(status, found | self.solution())
        self.files.close()

    def solution(self) -> dict[str, Any]:
        """Return how equilibria were found, for the summary; empty for a dynamic run."""
        return {}

    def checkpoint(self) -> None:
        """Write the full state, from which --resume continues."""
        self._store(self.files.write_checkpoint)

    def _store(self, write: Callable[[Scenario, Progress, np.ndarray], None]) -> None:
        """Write the rows so far, then the present state by `write`, a method of the files."""
        self.write_rows()
        scenario, progress = self.scenario, self.progress
        progress.time, progress.increment_count = scenario.time, scenario.increment_count
        progress.time_increment, progress.control = scenario.time_increment, self.loop.state
        progress.wall_time = self._wall_time()
        progress.warnings = dict(self.files.warnings)
        with self.clock.spending_on(CHECKPOINTS):
            write(scenario, progress, self.shape.x)

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


def increments_to(due: float, time: float, dt: float, end: float) -> int:
    """Return the number of increments until what is due at a time is written; 0 or less: now.

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


def _next_multiple(interval: float, time: float) -> float:
    """Return the first whole multiple of `interval` after `time` [s]."""
    return (math.floor(time / interval * (1.0 + 1e-12)) + 1.0) * interval
