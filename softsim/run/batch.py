"""Scenarios of one structure computed side by side; a run is a batch of one."""

import signal
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict

import numpy as np
from rich.console import Console

from softsim import backend
from softsim.errors import Interrupted, SoftsimError, StabilityError
from softsim.interruption import stop_signals
from softsim.machine import Choice
from softsim.output.checkpoint import Checkpoint
from softsim.output.console import ProgressReport
from softsim.output.watch import Watch
from softsim.run.cost import measured_profile
from softsim.run.course import Pace, Results, Simulation
from softsim.run.files import Recording
from softsim.solver.energy import Meter
from softsim.solver.explicit import ExplicitSolver
from softsim.solver.scenario import Scenario
from softsim.solver.settling import settle


class Batch:
    """Simulations that share a solver, each at its own pace: one that has ended, or that a guard
    has stopped, rests while the others go on.

    recordings: where each goes on record, and with it scene and model. watches: of each.
    checkpoint: of a run of one that goes on.
    """

    def __init__(
        self,
        recordings: Sequence[Recording],
        choice: Choice,
        watches: Sequence[Sequence[Watch]],
        checkpoint: Checkpoint | None = None,
    ) -> None:
        self.pace = Pace()
        self.console = recordings[0].console
        elements = len(recordings) * recordings[0].model.element_count
        backend.start(choice.device, threads=choice.threads_for(elements))
        self.solver = ExplicitSolver([recording.model for recording in recordings])
        self.meter = Meter(self.solver)
        self.simulations = [
            Simulation(Scenario(self.solver, s), self.meter, recording, self.pace, watching)
            for s, (recording, watching) in enumerate(zip(recordings, watches, strict=True))
        ]
        self.unsettled: dict[int, StabilityError] = {}
        if checkpoint is None:
            self._begin()
        else:
            with recordings[0].logged():
                self.simulations[0].resume(checkpoint)
        self.pace.enter_loop(self.solver.done)

    def _begin(self) -> None:
        steps = np.array([s.first_increment() for s in self.simulations])
        with stop_signals() as asked, self.console.status("bodies come to rest before t = 0"):
            settled, self.unsettled = settle(self.solver, self.meter, steps, asked)
        self.solver.begin(steps)
        self.meter.look()
        for simulation in self.simulations:
            with simulation.recording.logged():
                simulation.begin(settled.get(simulation.scenario.number))

    @property
    def running(self) -> list[Simulation]:
        """Those of which nothing has come out yet."""
        return [s for s in self.simulations if s.outcome is None]

    def run(self, console: Console) -> list[Results | SoftsimError]:
        """The loop, and a summary whatever ends it: what came out of each scenario."""
        for simulation in self.simulations:
            simulation.write_summary("running")
        end = max(s.model.end_time for s in self.simulations)
        report = ProgressReport(console, end, self.solver.time)
        status = "aborted"
        try:
            with stop_signals() as asked:
                self._loop(report, asked)
        except Interrupted:
            status = "interrupted"
            raise
        finally:
            report.close()
            for simulation in self.running:
                simulation.stop(status)
        return [s.outcome for s in self.simulations if s.outcome is not None]

    def _loop(self, report: ProgressReport, asked: list[int]) -> None:
        last_checkpoint = time.monotonic()
        self.look()
        for s, error in self.unsettled.items():
            with self._attended(self.simulations[s]):
                raise error
        while running := self.running:
            if asked:
                self._interrupt(signal.Signals(asked[0]).name)
            self.go_to_stations()
            slowest = min(running, key=lambda s: s.scenario.time)
            report.update(slowest.scenario.time, slowest.energy_error, slowest.contact_count)
            since = time.monotonic() - last_checkpoint
            if since >= min(s.output.checkpoint_interval for s in running):
                self.checkpoint()
                last_checkpoint = time.monotonic()

    def go_to_stations(self) -> None:
        """Advance each to its next station, and do what is due: guards, a history row, a frame."""
        counts = np.zeros(len(self.simulations), dtype=int)
        for simulation in self.running:
            with self._attended(simulation):
                counts[simulation.scenario.number] = simulation.next_station()
        self.solver.advance(counts)
        self.pace.note_station(self.solver.done)
        for simulation in self.running:
            with self._attended(simulation):
                simulation.arrive()
        self.look()

    def look(self) -> None:
        """Write what is due of each; one that is at its end is finished."""
        if any(simulation.row_is_due for simulation in self.running):
            self.meter.look()
        for simulation in self.running:
            with self._attended(simulation):
                simulation.look()
                if simulation.finished:
                    simulation.finish()

    def close(self) -> None:
        """Let go of the files of those that run: nothing more will come of them."""
        for simulation in self.running:
            simulation.recording.close()

    def checkpoint(self) -> None:
        """Write the full state of each that runs."""
        for simulation in self.running:
            simulation.checkpoint()

    def _interrupt(self, name: str) -> None:
        self.checkpoint()
        reached = min(s.scenario.time for s in self.running)
        raise Interrupted(
            f"stopped by {name} at t = {reached:.6g} s; checkpoint written",
            hint="continue with --resume",
        )

    @contextmanager
    def _attended(self, simulation: Simulation) -> Iterator[None]:
        """What the block logs is logged for this one; what goes wrong there ends this one only."""
        with simulation.recording.logged():
            try:
                yield
            except SoftsimError as error:
                simulation.fail(error)

    def add_profile(self, after: float) -> None:
        """Of a run of one that is done and whose loop took longer than `after` [s], put into its
        summary what an increment and its passes cost, and the share of each phase.
        """
        recording = self.simulations[0].recording
        took = time.monotonic() - self.pace.loop_began
        if recording.summary["status"] != "done" or took <= after:
            return
        profile = measured_profile(self.solver)
        recording.summary |= {
            "phases": profile.shares(),
            "profile": asdict(profile) | {"unexplained": profile.unexplained},
        }
        recording.write_summary(recording.summary)
