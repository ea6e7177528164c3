"""Build, loop, observe, verdict: `softsim run` without the command line."""

import logging
import signal
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from softsim import backend
from softsim.builder import build_model
from softsim.errors import ExpectationError, Interrupted, OutputError, SoftsimError, StabilityError
from softsim.model import Model
from softsim.output import folder as files
from softsim.output.checkpoint import Checkpoint, read_checkpoint, write_checkpoint
from softsim.output.console import ProgressReport
from softsim.output.fields import FieldWriter
from softsim.output.folder import RunFolder
from softsim.output.history import History, read_history
from softsim.output.measures import measures
from softsim.output.observation import (
    columns,
    description,
    frame,
    mesh_of,
    observe,
)
from softsim.scene.loading import LoadedScene, load_scene
from softsim.solver.energy import EnergyBalance, Meter
from softsim.solver.equilibrium import unbalanced_share
from softsim.solver.explicit import ExplicitSolver
from softsim.solver.guards import (
    refuse_broken_elements,
    refuse_energy_error,
    strain_warnings,
)
from softsim.solver.inspection import FIRST_INTERVAL, next_interval
from softsim.solver.time_step import StableStep

# Increments between two stations (output, signals) at most, about 10 ms of wall time.
STATION = 256
# The step may grow when the stable one has grown by this factor; it shrinks at once.
GROWTH = 1.05

log = logging.getLogger("softsim")


@dataclass(frozen=True)
class Results:
    """A finished run: its folder, its summary, its history (column -> array)."""

    folder: Path
    summary: dict[str, Any]
    history: dict[str, np.ndarray]


@dataclass
class Progress:
    """Where a run is, beside the solver's memory; all that a checkpoint keeps."""

    time: float = 0.0
    increments: int = 0
    increment: float = 0.0
    next_history: float = 0.0
    next_frame: float = 0.0
    last_history: float = -1.0  # before the first row
    initial_balance: float = 0.0
    largest_turnover: float = 0.0
    largest_energy_error: float = 0.0
    wall_time: float = 0.0
    next_inspection: int = 0  # counted in increments, as the interval from the last one
    inspection_interval: int = FIRST_INTERVAL
    stable_increment: float = 0.0  # at the last inspection


def run(
    scene: Path | str | LoadedScene,
    overrides: Sequence[str] = (),
    out: Path | None = None,
    device: str = "auto",
    resume: bool = False,
    console: Console | None = None,
) -> Results:
    """Run a scene to its end and return what it found.

    Parameters
    ----------
    scene: path of a scene file, or a loaded scene. overrides: "a.b.c=value".
    out: run folder, `runs/<scene's name>` by default. device: auto, cpu, cuda.
    resume: go on from the checkpoint in the run folder.

    Raises
    ------
    SceneError, MeshError, OutputError, DeviceError: before anything long starts.
    StabilityError: a guard stopped the run; the folder keeps what was computed, the failed frame
    too. Interrupted: SIGINT or SIGTERM came; a checkpoint is written.
    ExpectationError: the run ended outside the scene's `expect` block.
    """
    loaded = scene if isinstance(scene, LoadedScene) else load_scene(scene, overrides)
    model = build_model(loaded)
    target = RunFolder(out or Path("runs") / loaded.path.stem)
    simulation = _Simulation(loaded, model, target, device, resume, console or Console())
    return simulation.run()


class _Simulation:
    """One run: the loop over stations and what is looked at there."""

    def __init__(
        self,
        loaded: LoadedScene,
        model: Model,
        target: RunFolder,
        device: str,
        resume: bool,
        console: Console,
    ) -> None:
        self.loaded, self.model, self.target = loaded, model, target
        self.output = loaded.scene.output
        self.console = console
        self.began = time.monotonic()
        self.finished = False
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
        self.device = backend.start(device)
        self.solver = ExplicitSolver([model])
        self.meter = Meter(self.solver)
        self.stable_step = StableStep(model)
        if checkpoint is None:
            self.progress = self._begin()
        else:
            self.progress = self._resume(checkpoint)
        self.wall_before = self.progress.wall_time
        self.first_increment_after = 0.0
        self.increments_before = self.solver.increments
        self.loop_began = time.monotonic()

    def _begin(self) -> Progress:
        path = self.target.path
        for stale in (files.CHECKPOINT, files.SUMMARY):
            (path / stale).unlink(missing_ok=True)
        self.target.write_text_atomic(files.SCENE, self.loaded.resolved())
        stable = self.stable_step.at(self.model.points)
        log.info("stable increment %s", stable.describe())
        increment = self.model.increment or self.model.safety_factor * stable.value
        self.solver.begin(increment)
        self.balance = EnergyBalance.starting(self.meter.read()[0], self.model)
        self.history = History(path / files.HISTORY, columns(self.model))
        self.fields = FieldWriter(path / files.RESULTS, *mesh_of(self.model))
        self.fields.describe(**description(self.model, self.loaded.scene.title))
        return Progress(increment=increment, initial_balance=self.balance.initial)

    def _resume(self, checkpoint: Checkpoint) -> Progress:
        path = self.target.path
        if checkpoint.device != self.device.name:
            raise OutputError(
                f"the checkpoint in {path} was computed on {checkpoint.device}, this is "
                f"{self.device.name}: the run would not go on to the same bits",
                hint=f"resume with --device {checkpoint.device}",
            )
        progress = Progress(**checkpoint.progress)
        self.solver.restore(
            checkpoint.memory, progress.time, progress.increments, progress.increment
        )
        self.balance = EnergyBalance(progress.initial_balance, progress.largest_turnover)
        self.history = History.resumed(path / files.HISTORY, columns(self.model), progress.time)
        self.fields = FieldWriter.resumed(path / files.RESULTS, progress.time)
        log.info("resumed at t = %.6g s, increment %d", progress.time, progress.increments)
        return progress

    def run(self) -> Results:
        """The loop, and a summary whatever ends it."""
        self._write_summary("running")
        report = ProgressReport(self.console, self.model.end_time, self.progress.time)
        status, failure = "aborted", None
        try:
            with _signals() as asked:
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
            self.history.close()
            if status == "done":
                failure = self._failed_expectations()
            self._write_summary(status, failure)
            log.removeHandler(self.log_file)
            self.log_file.close()
        history = read_history(self.target.path / files.HISTORY)
        results = Results(self.target.path, self.summary, history)
        if failure is not None:
            raise ExpectationError(failure, hint=f"the run itself is done: {self.target.path}")
        return results

    def _loop(self, report: ProgressReport, asked: list[int]) -> None:
        progress, solver = self.progress, self.solver
        self.loop_began = last_checkpoint = time.monotonic()
        self.finished = self._is_done()
        error, contacts = self._look()
        while not self.finished:
            if asked:
                self._checkpoint()
                name = signal.Signals(asked[0]).name
                raise Interrupted(
                    f"stopped by {name} at t = {solver.time:.6g} s; checkpoint written",
                    hint="continue with --resume",
                )
            if solver.increments >= progress.next_inspection:
                self._inspect()
            solver.advance(self._increments_to_station())
            if self.first_increment_after == 0.0:
                self.first_increment_after = time.monotonic() - self.began
            progress.time, progress.increments = solver.time, solver.increments
            self.finished = self._is_done()
            error, contacts = self._look(error, contacts)
            report.update(solver.time, error, contacts)
            if time.monotonic() - last_checkpoint >= self.output.checkpoint_interval:
                self._checkpoint()
                last_checkpoint = time.monotonic()
        self._inspect()
        self._checkpoint()

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
            raise StabilityError(
                f"no equilibrium was found within {model.relaxation.longest:g} s after the loads' "
                f"time: the unbalanced force is {share:.3g} of the inner forces, wanted "
                f"{tolerance:g}",
                "the body may be free to move away, balloon or slide; hold it, lower the load, "
                "drive the chamber by volume, or give time.settle more time",
            )
        return False

    def _increments_to_station(self) -> int:
        """Increments to the next station: as soon as a history row or an inspection is due, or at
        the end.

        The last ones are shortened so that the run ends exactly at its end time.
        """
        solver = self.solver
        left = self.model.end_time - solver.time
        to_row = np.ceil((self.progress.next_history - solver.time) / solver.increment - 1e-9)
        to_inspection = self.progress.next_inspection - solver.increments
        count = min(STATION, to_inspection, max(1, int(to_row)))
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
        self._warn_of_strain()
        stable = self.stable_step.at(solver.positions()[0])
        self._plan_inspection(stable.value)
        if model.increment is not None:
            if model.increment > stable.value:
                raise StabilityError(
                    f"the time step {model.increment * 1e6:.3g} us is no longer stable at "
                    f"t = {solver.time:.6g} s: {stable.describe()}",
                    'write time.increment: "auto", or a smaller one',
                )
            return
        allowed = model.safety_factor * stable.value
        if solver.increment > allowed or solver.increment * GROWTH < allowed:
            solver.change_increment(allowed)
            self.progress.increment = allowed

    def _plan_inspection(self, stable: float) -> None:
        """Say when to inspect again, the stable increment [s] being this one now."""
        progress, solver = self.progress, self.solver
        before = progress.stable_increment or stable
        progress.inspection_interval = next_interval(
            progress.inspection_interval, before, stable, self.model.end_time / solver.increment
        )
        progress.next_inspection = solver.increments + progress.inspection_interval
        progress.stable_increment = stable

    def _refuse_broken_elements(self) -> None:
        """Stop at a broken element, with the failed frame kept."""
        try:
            refuse_broken_elements(self.model, self.solver.positions()[0], self.solver.time)
        except StabilityError:
            self._write_frame()
            raise

    def _warn_of_strain(self) -> None:
        """Say once a body and kind that a law is used where it was not fitted, or is unstable."""
        warnings = strain_warnings(self.model, self.solver.positions()[0], self.solver.time)
        for kind, text in warnings.items():
            if kind not in self.warned:
                self.warned.add(kind)
                log.warning(text)
                self.console.print(f"warning: {text}", highlight=False)

    def _look(self, error: float = 0.0, contacts: int = 0) -> tuple[float, int]:
        """Write history and frames that are due; the newest energy error and contact count."""
        solver, progress = self.solver, self.progress
        if solver.time > progress.last_history and (
            self.finished or solver.time >= progress.next_history
        ):
            interval = solver.time - max(progress.last_history, 0.0)
            seen = observe(solver, self.meter, self.balance, interval)
            self.history.append(seen.row)
            progress.last_history = solver.time
            progress.next_history = _next_multiple(self.output.history_interval, solver.time)
            progress.largest_turnover = self.balance.largest_turnover
            for walls in solver.terms.wall_contacts:
                walls.clear_impulses()
            error, contacts = seen.row["energy_error"], int(seen.row["contact_count"])
            progress.largest_energy_error = max(progress.largest_energy_error, error)
            energies = asdict(seen.energies)
            largest = max(energies, key=lambda k: abs(energies[k]))
            if not error <= self.model.energy_error_limit:
                self._refuse_broken_elements()  # a cause says more than a symptom
                self._write_frame()
                refuse_energy_error(self.model, error, solver.time, largest)
        if solver.time >= progress.next_frame or self.finished:
            self._write_frame()
            progress.next_frame = _next_multiple(self.output.frame_interval, solver.time)
        return error, contacts

    def _write_frame(self) -> None:
        if self.solver.time > self.fields.last_time:
            now = frame(self.solver)
            self.fields.append(self.solver.time, now.point_data, now.cell_data, now.extra)

    def _checkpoint(self) -> None:
        self.progress.wall_time = self._wall_time()
        self.progress.increment = self.solver.increment
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
        rate = model.element_count * done / (time.monotonic() - self.loop_began)
        summary: dict[str, Any] = {
            "status": status,
            "scene": str(self.loaded.path),
            "title": self.loaded.scene.title,
            "snapshot_field": self.output.snapshot_field,
            "device": self.device.name,
            "precision": self.device.precision,
            "node_count": len(model.points),
            "element_count": model.element_count,
            "time_increment": solver.increment,
            "increments": solver.increments,
            "simulated_time": solver.time,
            "wall_time": self._wall_time(),
            "first_increment_after": self.first_increment_after,
            "element_updates_per_second": rate,
            "energy_error": float(progress.largest_energy_error),
        }
        if status != "running":
            history = read_history(self.target.path / files.HISTORY)
            summary |= measures(model, history)
        if failure is not None:
            summary["failure"] = failure
        self.summary = summary
        self.target.write_json_atomic(files.SUMMARY, summary)

    def _failed_expectations(self) -> str | None:
        """What the scene's `expect` block demands and the run did not do, or None."""
        history = read_history(self.target.path / files.HISTORY)
        found = measures(self.model, history) | {"energy_error": self.progress.largest_energy_error}
        wrong = []
        for name, limits in self.loaded.scene.expect:
            if limits is None:
                continue
            value = found.get(name)
            values = value if isinstance(value, list) else [value]
            for v in values:
                low = -np.inf if limits.min is None else limits.min
                high = np.inf if limits.max is None else limits.max
                if v is None or not low <= v <= high:
                    wrong.append(f"{name}: {v} is outside [{low:g}, {high:g}]")
        return "not as the scene expects: " + "; ".join(wrong) if wrong else None


def _next_multiple(interval: float, time: float) -> float:
    """The first whole multiple of `interval` after `time` [s]."""
    return (np.floor(time / interval * (1.0 + 1e-12)) + 1.0) * interval


@contextmanager
def _signals() -> Iterator[list[int]]:
    """Collect SIGINT and SIGTERM instead of dying of them; a second one acts at once."""
    asked: list[int] = []
    previous: dict[int, Any] = {}

    def remember(number: int, _: Any) -> None:
        asked.append(number)
        signal.signal(number, previous[number])

    # In another thread signals cannot be caught: whoever started the thread handles them.
    if threading.current_thread() is threading.main_thread():
        for wanted in (signal.SIGINT, signal.SIGTERM):
            previous[wanted] = signal.signal(wanted, remember)
    try:
        yield asked
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
