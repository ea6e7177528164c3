"""The engine: jobs, pulled as workers become free, go to workers; outcomes come back."""

import signal
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from queue import Empty, SimpleQueue

from distributed import Future, KilledWorker
from distributed.client import FutureCancelledError

from softsim.errors import ClusterError, Interrupted, SoftsimError
from softsim.interruption import stop_signals
from softsim.study.cases import LOST, WAITING
from softsim.sweep.crew import Crew
from softsim.sweep.job import Job, Outcome, known_outcome, write_outcome
from softsim.sweep.work import Simulate, simulate, work

POLL = 0.25
"""Seconds between looks for a signal."""

PATIENCE = 60.0
"""Seconds that runs have to write their checkpoints: what compiles first comes to its end."""


def completed(
    jobs: Iterable[Job],
    crew: Crew,
    again: Collection[str] = (LOST,),
    batch: int = 1,
    meanwhile: Callable[[int], None] = lambda in_flight: None,
    simulate: Simulate = simulate,
) -> Iterator[tuple[Job, Outcome]]:
    """Run `jobs`, and yield each with its outcome as it ends.

    A job is pulled when a worker is free for it, after all outcomes before were yielded. What is
    stored is not run again, and jobs of the same key are one run.

    Parameters
    ----------
    again: statuses of stored cases that are run again all the same. batch: jobs that a worker gets
    at once. meanwhile: is called several times a second with the number of jobs in flight.
    simulate: how a worker runs jobs.

    Raises
    ------
    Interrupted: SIGINT or SIGTERM came, and the runs in flight wrote their checkpoints.
    OutputError: a disk refuses. ClusterError: the workers are gone, or cannot see the folder.
    """
    flights = _Flights(crew, simulate, batch)
    queue = iter(jobs)
    is_dry = False
    with stop_signals() as asked:
        try:
            while not asked and (flights.count or not is_dry):
                if not is_dry and flights.has_room():
                    job = next(queue, None)
                    is_dry = job is None
                    yield from flights.board(job, again)
                else:
                    meanwhile(flights.count)
                    yield from flights.landed()
        except ClusterError:
            raise
        except (SoftsimError, GeneratorExit):
            for _ in flights.ended_early():
                continue
            raise
        if asked:
            yield from flights.ended_early()
            name = signal.Signals(asked[0]).name
            raise Interrupted(f"stopped by {name}", hint="the same command goes on")


class _Flights:
    """What workers do now: units of up to `batch` jobs of different keys."""

    def __init__(self, crew: Crew, simulate: Simulate, batch: int) -> None:
        self.crew, self.simulate, self.batch = crew, simulate, batch
        self.boarding: list[Job] = []
        self.rows: dict[str, list[Job]] = {}  # key -> jobs that wait for its outcome
        self.units: dict[Future, Sequence[Job]] = {}
        self.finished: SimpleQueue[Future] = SimpleQueue()
        self.ended: set[str] = set()

    @property
    def count(self) -> int:
        """Jobs in flight."""
        return sum(map(len, self.rows.values()))

    def has_room(self) -> bool:
        """A unit a worker, so that none waits behind one that brings its worker down; one where
        there are no workers yet.
        """
        return self.count < self.batch * max(1, self.crew.size)

    def board(self, job: Job | None, again: Collection[str]) -> Iterator[tuple[Job, Outcome]]:
        """Run a job, or wait for the one of the same key; if it is stored, here is its outcome.

        None is the last one: what came together so far takes off.
        """
        if job is not None and job.key in self.rows:
            self.rows[job.key].append(job)
        elif job is not None:
            known = known_outcome(job, () if job.key in self.ended else again)
            if known is not None:
                yield job, known
                return
            self.rows[job.key] = [job]
            self.boarding.append(job)
        if self.boarding and (
            job is None or len(self.boarding) == self.batch or not self.has_room()
        ):
            self._take_off()

    def _take_off(self) -> None:
        future = self.crew.submit(work, self.boarding, self.simulate)
        self.units[future] = self.boarding
        self.boarding = []
        future.add_done_callback(self.finished.put)

    def landed(self) -> Iterator[tuple[Job, Outcome]]:
        """Each job of the next unit that ends, with its outcome; nothing if none ends soon."""
        try:
            future = self.finished.get(timeout=POLL)
        except Empty:
            return
        unit = self.units.pop(future)
        for outcome in self._outcomes(future, unit):
            self.ended.add(outcome.key)
            for job in self.rows.pop(outcome.key):
                if outcome.status != WAITING:
                    yield job, outcome

    def _outcomes(self, future: Future, unit: Sequence[Job]) -> Iterable[Outcome]:
        try:
            return future.result()
        except KilledWorker as killed:
            return [_lost(job, killed.allowed_failures + 1) for job in unit]
        except FutureCancelledError as error:
            raise ClusterError(
                f"the workers are gone: {error}", hint="the same command goes on where it was"
            ) from error

    def ended_early(self) -> Iterator[tuple[Job, Outcome]]:
        """Ask what flies to write its checkpoint; what came to its end all the same."""
        began = time.monotonic()
        while self.units and time.monotonic() - began < PATIENCE:
            self.crew.ask_to_stop()
            yield from self.landed()


def _lost(job: Job, attempts: int) -> Outcome:
    """The outcome of a job that brought down so many workers: a scheduler elsewhere has its own
    patience.
    """
    reason = f"its process died {attempts} times, as if killed or out of memory"
    outcome = Outcome(job.key, LOST, reason)
    write_outcome(job, outcome)
    return outcome
