"""The course of one scenario, from station to station, and what is looked at there.

Stations are where a history row, an inspection or the end is due. They depend on scene and model
only, so a scenario takes the same course whatever is computed beside it and whatever stops it.
"""

import logging
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from softsim import backend
from softsim.errors import ExpectationError, SoftsimError, StabilityError
from softsim.feedback import feedback
from softsim.model import Model
from softsim.output.checkpoint import Checkpoint
from softsim.output.measures import failed_expectations, measures
from softsim.output.observation import observe
from softsim.output.passage import PassageWatch
from softsim.output.progress import Progress
from softsim.output.watch import CycleWatch, Watch, ended_by, see_history
from softsim.recording import Recording
from softsim.solver.chatter import chatter_warnings
from softsim.solver.energy import EnergyBalance, Meter
from softsim.solver.equilibrium import moves, unbalanced_share
from softsim.solver.guards import (
    refuse_broken_elements,
    refuse_crowding,
    refuse_energy_error,
    refuse_no_equilibrium,
    refuse_unstable_step,
    step_warnings,
)
from softsim.solver.inspection import GROWTH, InspectionPlan
from softsim.solver.scenario import Scenario
from softsim.solver.time_step import StableStep

# Element updates between two stations (output, signals): 80 ms at 50 M/s. Of a million elements
# the shortest takes 0.3 s. It depends on the model only, so that every run has the same stations.
STATION_UPDATES = 4_000_000
SHORTEST_STATION, LONGEST_STATION = 16, 512

log = logging.getLogger("softsim")


@dataclass(frozen=True)
class Results:
    """A finished run: its folder, its summary, its history (column -> array)."""

    folder: Path
    summary: dict[str, Any]
    history: dict[str, np.ndarray]


class Pace:
    """Wall time of what is computed together: since it began, in the loop, and since the first
    station, which compiles; the rate counts from there on.

    done_before: increments of each scenario (scenarios,) that do not count.
    """

    def __init__(self) -> None:
        self.began = time.monotonic()
        self.first_increment_after = 0.0

    def enter_loop(self, done: np.ndarray) -> None:
        """Everything is ready, with so many increments done of each scenario (scenarios,)."""
        self.loop_began = self.steady_since = time.monotonic()
        self.done_before = done.copy()

    def note_station(self, done: np.ndarray) -> None:
        """A station is behind, with so many increments done."""
        if self.first_increment_after == 0.0:
            self.steady_since, self.done_before = time.monotonic(), done.copy()
            self.first_increment_after = self.steady_since - self.began


class Simulation:
    """One scenario on its way. outcome: what became of it, None as long as it runs."""

    def __init__(
        self,
        scenario: Scenario,
        meter: Meter,
        recording: Recording,
        pace: Pace,
        watches: Sequence[Watch],
    ) -> None:
        self.scenario, self.meter, self.recording, self.pace = scenario, meter, recording, pace
        self.model, self.loaded = recording.model, recording.loaded
        self.output = self.loaded.scene.output
        self.stable_step = StableStep(self.model)
        self.given_watches = watches
        self.finished = False
        self.energy_error, self.contact_count = 0.0, 0
        self.outcome: Results | SoftsimError | None = None

    def first_increment(self) -> float:
        """The step to begin with [s]."""
        self.stable_at_rest = self.stable_step.at(self.model.points)
        return self.model.increment or self.model.safety_factor * self.stable_at_rest.value

    def begin(self, settled: float | None) -> None:
        """At t = 0; the meter has just looked. settled: time [s] that coming to rest has taken."""
        stable = self.stable_at_rest
        for body in self.model.bodies:
            log.info("material %s", body.material.describe())
        if settled is not None:
            moved = np.abs(self.scenario.positions() - self.model.points).max()
            log.info("settled within %.3g s, moved by %.3g mm at most", settled, 1e3 * moved)
        log.info("stable increment %s", stable.describe())
        self.recording.warn(step_warnings(self.model, stable))
        self.balance = EnergyBalance.starting(self.meter.of(self.scenario.number)[0], self.model)
        self._set_out(
            Progress(
                InspectionPlan(stable.value),
                increment=self.scenario.increment,
                initial_balance=self.balance.initial,
            )
        )

    def resume(self, checkpoint: Checkpoint) -> None:
        """Where a checkpoint was written."""
        progress = Progress.written(checkpoint.progress)
        self.scenario.solver.restore(
            checkpoint.memory, progress.time, progress.increments, progress.increment
        )
        self.balance = EnergyBalance(progress.initial_balance, progress.largest_energy)
        log.info("resumed at t = %.6g s, increment %d", progress.time, progress.increments)
        self._set_out(progress)

    def _set_out(self, progress: Progress) -> None:
        self.progress = progress
        self.wall_before = progress.wall_time
        self.loop = feedback(self.scenario, progress.control)
        self.watches = [*asked_watches(self.model), *self.given_watches]
        see_history(self.watches, self.recording.rows())
        self.finished = self._is_done()

    # --- stations --------------------------------------------------------------------------------

    def next_station(self) -> int:
        """Increments to the next station; looks at the elements before, if that is due."""
        if self.scenario.increments >= self.progress.inspections.due:
            self._inspect()
        return self._increments_to_station()

    def arrive(self) -> None:
        """At a station: guards, and whether it is the last one."""
        progress, scenario = self.progress, self.scenario
        progress.time, progress.increments = scenario.time, scenario.increments
        if scenario.overfull():
            self._refuse_broken_elements()  # a cause says more than a symptom
            refuse_crowding(scenario.time)
        self.finished = self._is_done()

    @property
    def row_is_due(self) -> bool:
        """Whether there is a row of the history to write now."""
        now, progress = self.scenario.time, self.progress
        is_time = self.finished or now >= progress.next_history
        return now > progress.last_history and is_time

    def look(self) -> None:
        """Write the history row and the frame that are due; the meter has just looked for a row."""
        now, progress = self.scenario.time, self.progress
        if self.row_is_due:
            self._write_row()
        self.finished = self.finished or any(watch.is_over for watch in self.watches)
        if now >= progress.next_frame or self.finished:
            self.recording.write_frame(self.scenario)
            progress.next_frame = _next_multiple(self.output.frame_interval, now)

    def _is_done(self) -> bool:
        """At the end time; a static run goes on until forces balance, within its limit."""
        scenario, model = self.scenario, self.model
        if scenario.time < model.end_time * (1.0 - 1e-12):
            return False
        if model.relaxation is None:
            return True
        share = unbalanced_share(scenario)
        energies = self.meter.read(scenario.number)[0]
        if share <= model.relaxation.tolerance and not moves(energies, model.relaxation):
            return True
        if scenario.time > model.end_time + model.relaxation.longest:
            refuse_no_equilibrium(share, model.relaxation)
        return False

    def _increments_to_station(self) -> int:
        """Increments to the next station: as soon as a history row or an inspection is due, or at
        the end.

        The last ones are shortened so that the run ends exactly at its end time.
        """
        scenario = self.scenario
        left = self.model.end_time - scenario.time
        to_row = np.ceil((self.progress.next_history - scenario.time) / scenario.increment - 1e-9)
        to_inspection = self.progress.inspections.due - scenario.increments
        longest = station_length(self.model.element_count)
        count = min(longest, to_inspection, max(1, int(to_row)))
        if left <= 0.0:  # a static run settles
            return count
        to_end = max(1, int(np.ceil(left / scenario.increment - 1e-9)))
        if to_end > count:
            return count
        scenario.change_increment(left / to_end)
        return to_end

    def _inspect(self) -> None:
        """Guards, and the stable increment, which changes as the elements deform."""
        scenario, model = self.scenario, self.model
        self._refuse_broken_elements()
        stable = self.stable_step.at(scenario.positions())
        run_length = model.end_time / scenario.increment
        self.progress.inspections.go_on(stable.value, scenario.increments, run_length)
        if model.increment is not None:
            refuse_unstable_step(model, stable, scenario.time)
            self.recording.warn(step_warnings(model, stable))
            return
        allowed = model.safety_factor * stable.value
        if scenario.increment > allowed or scenario.increment * GROWTH < allowed:
            scenario.change_increment(allowed)
            self.progress.increment = allowed

    def _refuse_broken_elements(self) -> None:
        """Stop at a broken element, with the failed frame kept."""
        try:
            refuse_broken_elements(self.model, self.scenario.positions(), self.scenario.time)
        except StabilityError:
            self.recording.write_frame(self.scenario)
            raise

    def _write_row(self) -> None:
        scenario, progress = self.scenario, self.progress
        interval = scenario.time - max(progress.last_history, 0.0)
        seen = observe(scenario, self.meter, self.balance, interval)
        row = seen.row | self.loop.readings()
        self.recording.history.append(row)
        self.loop.follow(row)
        for watch in self.watches:
            watch.see_row(row)
        progress.last_history = scenario.time
        progress.next_history = _next_multiple(self.output.history_interval, scenario.time)
        progress.largest_energy = self.balance.largest_energy
        for term in scenario.terms.everything:
            term.clear_impulses(scenario.number)
        error = self.energy_error = seen.row["energy_error"]
        self.contact_count = int(seen.row["contact_count"])
        progress.largest_energy_error = max(progress.largest_energy_error, error)
        if not error <= self.model.energy_error_limit:
            energies = asdict(seen.energies)
            largest = max(energies, key=lambda k: abs(energies[k]))
            self._refuse_broken_elements()  # a cause says more than a symptom
            self.recording.write_frame(scenario)
            refuse_energy_error(self.model, error, scenario.time, largest)

    # --- the end ---------------------------------------------------------------------------------

    def finish(self) -> None:
        """The run is at its end: a last inspection, and what it has found."""
        self._inspect()
        self.checkpoint()
        failure = self._failed_expectations()
        self.stop("done", failure)
        if failure is None:
            self.outcome = Results(
                self.recording.path, self.recording.summary, self.recording.rows()
            )
        else:
            self.outcome = ExpectationError(
                failure, hint=f"the run itself is done: {self.recording.path}"
            )

    def fail(self, error: SoftsimError) -> None:
        """Something has stopped this run, and none but this."""
        log.error("%s", error)
        self.outcome = error
        self.stop("aborted", str(error))

    def stop(self, status: str, failure: str | None = None) -> None:
        """Write what was found so far, and let go of the files."""
        self.write_summary(status, failure)
        self.recording.close()

    def checkpoint(self) -> None:
        """Write the full state, from which --resume goes on."""
        self.progress.wall_time = self._wall_time()
        self.progress.increment = self.scenario.increment
        self.progress.control = self.loop.state
        self.recording.write_checkpoint(self.scenario, self.progress)

    def _wall_time(self) -> float:
        return self.wall_before + time.monotonic() - self.pace.began

    def write_summary(self, status: str, failure: str | None = None) -> None:
        """What is known of the run; what it found, too, unless it is running."""
        scenario, model, device = self.scenario, self.model, backend.device()
        done = scenario.increments - int(self.pace.done_before[scenario.number])
        rate = model.element_count * done / (time.monotonic() - self.pace.steady_since)
        summary: dict[str, Any] = {
            "status": status,
            "scene": str(self.loaded.path),
            "title": self.loaded.scene.title,
            "snapshot_field": self.output.snapshot_field,
            "device": device.name,
            "threads": device.threads,
            "precision": device.precision,
            "node_count": len(model.points),
            "element_count": model.element_count,
            "time_increment": scenario.increment,
            "increments": scenario.increments,
            "simulated_time": scenario.time,
            "wall_time": self._wall_time(),
            "first_increment_after": self.pace.first_increment_after,
            "element_updates_per_second": rate if done else None,
            "energy_error": float(self.progress.largest_energy_error),
        }
        if status != "running":
            summary |= measures(model, self.recording.rows())
            chatter = scenario.chatter()
            summary["contact_chatter"] = chatter.returns
            self.recording.warn(chatter_warnings(model, chatter))
            if (name := ended_by(self.watches)) is not None:
                summary["ended_by"] = name
        if failure is not None:
            summary["failure"] = failure
        self.recording.write_summary(summary)

    def _failed_expectations(self) -> str | None:
        """What the scene's `expect` block demands and the run did not do, or None."""
        found = measures(self.model, self.recording.rows())
        found |= {"energy_error": self.progress.largest_energy_error}
        return failed_expectations(self.loaded.scene.expect, found)


def asked_watches(model: Model) -> list[Watch]:
    """What may end a run before its time because its scene asks for it."""
    watches: list[Watch] = []
    if model.passage is not None:
        watches.append(PassageWatch(model.passage))
    if model.cycles is not None:
        watches.append(CycleWatch(model.cycles))
    return watches


def station_length(element_count: int) -> int:
    """Increments between two stations at most, of a model of so many elements."""
    wanted = STATION_UPDATES // max(1, element_count)
    return min(max(SHORTEST_STATION, wanted), LONGEST_STATION)


def _next_multiple(interval: float, time: float) -> float:
    """The first whole multiple of `interval` after `time` [s]."""
    return (np.floor(time / interval * (1.0 + 1e-12)) + 1.0) * interval
