"""Build, loop, observe, verdict: `softsim run` without the command line."""

import logging
import signal
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from softsim import backend
from softsim.builder import build_model
from softsim.errors import ExpectationError, Interrupted, OutputError, SoftsimError, StabilityError
from softsim.feedback import feedback
from softsim.interruption import stop_signals
from softsim.machine import AUTO, Choice, choose, memory_of
from softsim.model import Model
from softsim.output import folder as files
from softsim.output.checkpoint import Checkpoint, read_checkpoint, write_checkpoint
from softsim.output.console import ProgressReport
from softsim.output.cycle_watch import CycleWatch
from softsim.output.expectations import failed_expectations
from softsim.output.fields import FieldWriter
from softsim.output.folder import RunFolder
from softsim.output.history import History, read_history
from softsim.output.measures import measures
from softsim.output.observation import columns, description, frame, mesh_of, observe
from softsim.output.passage import PassageWatch
from softsim.output.progress import Progress
from softsim.output.watch import Watch, ended_by, see_history
from softsim.scene.loading import LoadedScene, load_scene
from softsim.solver.energy import EnergyBalance, Meter
from softsim.solver.equilibrium import unbalanced_share
from softsim.solver.explicit import ExplicitSolver
from softsim.solver.footprint import refuse_too_large
from softsim.solver.guards import (
    refuse_broken_elements,
    refuse_crowding,
    refuse_energy_error,
    refuse_no_equilibrium,
    refuse_unstable_step,
    step_warnings,
    strain_warnings,
)
from softsim.solver.inspection import GROWTH, InspectionPlan
from softsim.solver.profile import measured_profile
from softsim.solver.time_step import StableStep

# Element updates between two stations (output, signals): 80 ms at 50 M/s. Of a million elements
# the shortest takes 0.3 s. It depends on the model only, so that every run has the same stations.
STATION_UPDATES = 4_000_000
SHORTEST_STATION, LONGEST_STATION = 16, 512
# Only a loop that took longer [s] is followed by measuring its passes: their kernel takes a second
# or two to trace, ten or twenty to compile the first time.
PROFILE_AFTER = 60.0

log = logging.getLogger("softsim")


@dataclass(frozen=True)
class Results:
    """A finished run: its folder, its summary, its history (column -> array)."""

    folder: Path
    summary: dict[str, Any]
    history: dict[str, np.ndarray]


def run(
    scene: Path | str | LoadedScene,
    overrides: Sequence[str] = (),
    out: Path | None = None,
    device: str = AUTO,
    resume: bool = False,
    console: Console | None = None,
    threads: int | str = AUTO,
    profile_after: float = PROFILE_AFTER,
    watches: Sequence[Watch] = (),
) -> Results:
    """Run a scene to its end and return what it found.

    Parameters
    ----------
    scene: path of a scene file, or a loaded scene. overrides: "a.b.c=value".
    out: run folder, `runs/<scene's name>` by default. device: auto, cpu, cuda.
    resume: go on from the checkpoint in the run folder.
    threads: CPU threads, a number or auto: one for a small model, else all processors.
    profile_after: a run whose loop took longer [s] ends with measuring what each pass costs.
    watches: see each row of the history, and may end the run early; the summary's `ended_by` names
    the one that did.

    Raises
    ------
    SceneError, MeshError, OutputError, DeviceError: before anything long starts.
    StabilityError: a guard stopped the run; the folder keeps what was computed, the failed frame
    too. Interrupted: SIGINT or SIGTERM came; a checkpoint is written.
    ExpectationError: the run ended outside the scene's `expect` block.
    """
    choice = choose(device, threads)
    loaded = scene if isinstance(scene, LoadedScene) else load_scene(scene, overrides)
    model = build_model(loaded)
    refuse_too_large(model, 1, choice.device, memory_of(choice.device))
    target = RunFolder(out or Path("runs") / loaded.path.stem)
    simulation = Simulation(loaded, model, target, choice, resume, console or Console(), watches)
    return simulation.run(profile_after)


class Simulation:
    """One run: the loop over stations and what is looked at there."""

    def __init__(
        self,
        loaded: LoadedScene,
        model: Model,
        target: RunFolder,
        choice: Choice,
        resume: bool,
        console: Console,
        watches: Sequence[Watch] = (),
    ) -> None:
        self.loaded, self.model, self.target = loaded, model, target
        self.output = loaded.scene.output
        self.console = console
        self.began = time.monotonic()
        self.finished = False
        self.energy_error, self.contact_count = 0.0, 0
        self.warned: set[str] = set()
        path = target.path
        checkpoint = read_checkpoint(path / files.CHECKPOINT) if resume else None
        if checkpoint is not None and checkpoint.scene != loaded.scene.model_dump_json():
            raise OutputError(
                f"the checkpoint in {path} belongs to another scene or other settings",
                hint=f"compare with {path / files.SCENE}, or run without --resume",
            )
        self.log_file = logging.FileHandler(path / files.LOG, mode="a" if resume else "w")
        self.log_file.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
        log.addHandler(self.log_file)
        log.setLevel(logging.INFO)
        self.device = backend.start(choice.device, threads=choice.threads_for(model.element_count))
        self.solver = ExplicitSolver([model])
        self.meter = Meter(self.solver)
        self.stable_step = StableStep(model)
        if checkpoint is None:
            self.progress = self._begin()
        else:
            self.progress = self._resume(checkpoint)
        self.loop = feedback(self.solver, self.progress.control)
        self.watches = self._all_watches(watches)
        self.wall_before = self.progress.wall_time
        self.first_increment_after = 0.0
        # The rate counts from the first station on, which compiles.
        self.increments_before = self.solver.increments
        self.loop_began = self.steady_since = time.monotonic()

    def _begin(self) -> Progress:
        path = self.target.path
        for stale in (files.CHECKPOINT, files.SUMMARY):
            (path / stale).unlink(missing_ok=True)
        self.target.write_text_atomic(files.SCENE, self.loaded.resolved())
        stable = self.stable_step.at(self.model.points)
        log.info("stable increment %s", stable.describe())
        self._warn(step_warnings(self.model, stable))
        increment = self.model.increment or self.model.safety_factor * stable.value
        self.solver.begin(increment)
        self.balance = EnergyBalance.starting(self.meter.read()[0], self.model)
        self.history = History(path / files.HISTORY, columns(self.model))
        self.fields = FieldWriter(path / files.RESULTS, *mesh_of(self.model))
        self.fields.describe(**description(self.model, self.loaded.scene.title))
        inspections = InspectionPlan(stable.value)
        return Progress(inspections, increment=increment, initial_balance=self.balance.initial)

    def _resume(self, checkpoint: Checkpoint) -> Progress:
        path = self.target.path
        if checkpoint.device != self.device.name:
            raise OutputError(
                f"the checkpoint in {path} was computed on {checkpoint.device}, this is "
                f"{self.device.name}: the run would not go on to the same bits",
                hint=f"resume with --device {checkpoint.device}",
            )
        progress = Progress.written(checkpoint.progress)
        self.solver.restore(
            checkpoint.memory, progress.time, progress.increments, progress.increment
        )
        self.balance = EnergyBalance(progress.initial_balance, progress.largest_turnover)
        self.history = History.resumed(path / files.HISTORY, columns(self.model), progress.time)
        self.fields = FieldWriter.resumed(path / files.RESULTS, progress.time)
        log.info("resumed at t = %.6g s, increment %d", progress.time, progress.increments)
        return progress

    def _all_watches(self, further: Sequence[Watch]) -> list[Watch]:
        """What may end the run before its time: what the scene asks, then those given. They have
        seen all rows so far.
        """
        watches: list[Watch] = []
        if self.model.passage is not None:
            watches.append(PassageWatch(self.model.passage))
        if self.model.cycles is not None:
            watches.append(CycleWatch(self.model.cycles))
        watches.extend(further)
        see_history(watches, read_history(self.target.path / files.HISTORY))
        return watches

    def run(self, profile_after: float) -> Results:
        """The loop, a summary whatever ends it, and the costs of a long one's passes."""
        self._write_summary("running")
        report = ProgressReport(self.console, self.model.end_time, self.progress.time)
        status, failure = "aborted", None
        try:
            with stop_signals() as asked:
                self._loop(report, asked)
            status = "done"
        except Interrupted:
            status = "interrupted"
            raise
        except SoftsimError as error:
            failure = str(error)
            log.error("%s", error)
            raise
        finally:
            report.close()
            if status == "done":
                failure = self._failed_expectations()
            self._write_summary(status, failure)
            self.close()
        if time.monotonic() - self.loop_began > profile_after:
            self._add_profile()
        history = read_history(self.target.path / files.HISTORY)
        results = Results(self.target.path, self.summary, history)
        if failure is not None:
            raise ExpectationError(failure, hint=f"the run itself is done: {self.target.path}")
        return results

    def close(self) -> None:
        """Let go of the run's files."""
        self.history.close()
        log.removeHandler(self.log_file)
        self.log_file.close()

    def _loop(self, report: ProgressReport, asked: list[int]) -> None:
        solver = self.solver
        self.loop_began = last_checkpoint = time.monotonic()
        self.finished = self._is_done()
        self.look()
        while not self.finished:
            if asked:
                self.checkpoint()
                name = signal.Signals(asked[0]).name
                raise Interrupted(
                    f"stopped by {name} at t = {solver.time:.6g} s; checkpoint written",
                    hint="continue with --resume",
                )
            self.go_to_station()
            report.update(solver.time, self.energy_error, self.contact_count)
            if time.monotonic() - last_checkpoint >= self.output.checkpoint_interval:
                self.checkpoint()
                last_checkpoint = time.monotonic()
        self._inspect()
        self.checkpoint()

    def go_to_station(self) -> None:
        """Advance to the next station, and do what is due: guards, a history row, a frame."""
        progress, solver = self.progress, self.solver
        if solver.increments >= progress.inspections.due:
            self._inspect()
        solver.advance(self._increments_to_station())
        if self.first_increment_after == 0.0:
            self.steady_since, self.increments_before = time.monotonic(), solver.increments
            self.first_increment_after = self.steady_since - self.began
        progress.time, progress.increments = solver.time, solver.increments
        if solver.overfull():
            self._refuse_broken_elements()  # a cause says more than a symptom
            refuse_crowding(solver.time)
        self.finished = self._is_done()
        self.look()

    def _is_done(self) -> bool:
        """At the end time; a static run goes on until forces balance, within its limit."""
        solver, model = self.solver, self.model
        if solver.time < model.end_time * (1.0 - 1e-12):
            return False
        if model.relaxation is None:
            return True
        share = unbalanced_share(solver)
        energies = self.meter.read()[0]
        # At a turning point forces do not balance, on the way through equilibrium it moves: both
        # must be small. Kinetic energy goes with the square of the distance from equilibrium.
        tolerance = model.relaxation.tolerance
        moving = energies.kinetic > tolerance**2 * energies.turnover
        if share <= tolerance and not moving:
            return True
        if solver.time > model.end_time + model.relaxation.longest:
            refuse_no_equilibrium(share, model.relaxation)
        return False

    def _increments_to_station(self) -> int:
        """Increments to the next station: as soon as a history row or an inspection is due, or at
        the end.

        The last ones are shortened so that the run ends exactly at its end time.
        """
        solver = self.solver
        left = self.model.end_time - solver.time
        to_row = np.ceil((self.progress.next_history - solver.time) / solver.increment - 1e-9)
        to_inspection = self.progress.inspections.due - solver.increments
        longest = station_length(self.model.element_count)
        count = min(longest, to_inspection, max(1, int(to_row)))
        if left <= 0.0:  # a static run settles
            return count
        to_end = max(1, int(np.ceil(left / solver.increment - 1e-9)))
        if to_end > count:
            return count
        solver.change_increment(left / to_end)
        return to_end

    def _inspect(self) -> None:
        """Guards, and the stable increment, which changes as the elements deform."""
        solver, model = self.solver, self.model
        self._refuse_broken_elements()
        stable = self.stable_step.at(solver.positions()[0])
        run_length = model.end_time / solver.increment
        self.progress.inspections.go_on(stable.value, solver.increments, run_length)
        if model.increment is not None:
            refuse_unstable_step(model, stable, solver.time)
            self._warn(step_warnings(model, stable))
            return
        allowed = model.safety_factor * stable.value
        if solver.increment > allowed or solver.increment * GROWTH < allowed:
            solver.change_increment(allowed)
            self.progress.increment = allowed

    def _refuse_broken_elements(self) -> None:
        """Stop at a broken element, with the failed frame kept."""
        try:
            refuse_broken_elements(self.model, self.solver.positions()[0], self.solver.time)
        except StabilityError:
            self._write_frame()
            raise

    def _warn(self, warnings: dict[str, str]) -> None:
        """Into the log and onto the console, each kind once."""
        for kind, text in warnings.items():
            if kind not in self.warned:
                self.warned.add(kind)
                log.warning(text)
                self.console.print(f"warning: {text}", highlight=False)

    def look(self) -> None:
        """Write the history row and the frame that are due."""
        solver, progress = self.solver, self.progress
        if solver.time > progress.last_history and (
            self.finished or solver.time >= progress.next_history
        ):
            self._write_row()
        self.finished = self.finished or any(watch.is_over for watch in self.watches)
        if solver.time >= progress.next_frame or self.finished:
            self._write_frame()
            progress.next_frame = _next_multiple(self.output.frame_interval, solver.time)

    def _write_row(self) -> None:
        solver, progress = self.solver, self.progress
        interval = solver.time - max(progress.last_history, 0.0)
        seen = observe(solver, self.meter, self.balance, interval)
        row = seen.row | self.loop.readings()
        self.history.append(row)
        self.loop.follow(row)
        for watch in self.watches:
            watch.see_row(row)
        progress.last_history = solver.time
        progress.next_history = _next_multiple(self.output.history_interval, solver.time)
        progress.largest_turnover = self.balance.largest_turnover
        for gauge in solver.terms.gauges:
            gauge.clear_impulses()
        error = self.energy_error = seen.row["energy_error"]
        self.contact_count = int(seen.row["contact_count"])
        progress.largest_energy_error = max(progress.largest_energy_error, error)
        if not error <= self.model.energy_error_limit:
            energies = asdict(seen.energies)
            largest = max(energies, key=lambda k: abs(energies[k]))
            self._refuse_broken_elements()  # a cause says more than a symptom
            self._write_frame()
            refuse_energy_error(self.model, error, solver.time, largest)

    def _write_frame(self) -> None:
        if self.solver.time > self.fields.last_time:
            now = frame(self.solver)
            self.fields.append(self.solver.time, now.point_data, now.cell_data, now.extra)
            self._warn(strain_warnings(self.model, self.solver.positions()[0], self.solver.time))

    def checkpoint(self) -> None:
        """Write the full state, from which --resume goes on."""
        self.progress.wall_time = self._wall_time()
        self.progress.increment = self.solver.increment
        self.progress.control = self.loop.state
        content = Checkpoint(
            self.solver.memory(),
            asdict(self.progress),
            self.loaded.scene.model_dump_json(),
            self.device.name,
        )
        write_checkpoint(self.target.path / files.CHECKPOINT, content)

    def _wall_time(self) -> float:
        return self.wall_before + time.monotonic() - self.began

    def _write_summary(self, status: str, failure: str | None = None) -> None:
        solver, model, progress = self.solver, self.model, self.progress
        done = solver.increments - self.increments_before
        rate = model.element_count * done / (time.monotonic() - self.steady_since)
        summary: dict[str, Any] = {
            "status": status,
            "scene": str(self.loaded.path),
            "title": self.loaded.scene.title,
            "snapshot_field": self.output.snapshot_field,
            "device": self.device.name,
            "threads": self.device.threads,
            "precision": self.device.precision,
            "node_count": len(model.points),
            "element_count": model.element_count,
            "time_increment": solver.increment,
            "increments": solver.increments,
            "simulated_time": solver.time,
            "wall_time": self._wall_time(),
            "first_increment_after": self.first_increment_after,
            "element_updates_per_second": rate if done else None,
            "energy_error": float(progress.largest_energy_error),
        }
        if status != "running":
            history = read_history(self.target.path / files.HISTORY)
            summary |= measures(model, history)
            if (name := ended_by(self.watches)) is not None:
                summary["ended_by"] = name
        if failure is not None:
            summary["failure"] = failure
        self.summary = summary
        self.target.write_json_atomic(files.SUMMARY, summary)

    def _add_profile(self) -> None:
        """What an increment and its passes cost, and the share of each phase, into the summary."""
        profile = measured_profile(self.solver)
        self.summary |= {
            "phases": profile.shares(),
            "profile": asdict(profile) | {"unexplained": profile.unexplained},
        }
        self.target.write_json_atomic(files.SUMMARY, self.summary)

    def _failed_expectations(self) -> str | None:
        """What the scene's `expect` block demands and the run did not do, or None."""
        history = read_history(self.target.path / files.HISTORY)
        found = measures(self.model, history) | {"energy_error": self.progress.largest_energy_error}
        return failed_expectations(self.loaded.scene.expect, found)


def station_length(element_count: int) -> int:
    """Increments between two stations at most, of a model of so many elements."""
    wanted = STATION_UPDATES // max(1, element_count)
    return min(max(SHORTEST_STATION, wanted), LONGEST_STATION)


def _next_multiple(interval: float, time: float) -> float:
    """The first whole multiple of `interval` after `time` [s]."""
    return (np.floor(time / interval * (1.0 + 1e-12)) + 1.0) * interval
