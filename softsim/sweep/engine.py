"""The engine: jobs, pulled as workers become free, go to workers; outcomes come back."""

import signal
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from queue import Empty, SimpleQueue

from distributed import Future, KilledWorker
from distributed.client import FutureCancelledError

from softsim.errors import ClusterError, Interrupted, SoftsimError
from softsim.interruption import stop_signals
from softsim.study.cases import LOST, WAITING
from softsim.sweep.job import Job, Outcome, forget_starts, known_outcome, starts, write_outcome
from softsim.sweep.work import Simulate, simulate, work
from softsim.sweep.worker_pool import WorkerPool

POLL = 0.25
"""Seconds between looks for a signal."""

PATIENCE = 60.0
"""Seconds that runs have to write their checkpoints: what compiles first comes to its end."""

ATTEMPTS = 2
"""A case is lost when its process has died so often: the first death may be another's fault."""

MOST_GIVEN_OUT = 10
"""A case is lost when it was given out so often to workers that died before they began with it."""


def completed(
    jobs: Iterable[Job],
    pool: WorkerPool,
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
    flights = _InFlight(pool, simulate, batch)
    queue = iter(jobs)
    is_dry = False
    with stop_signals() as asked:
        try:
            while not asked and (flights.count or not is_dry):
                if not is_dry and flights.has_room():
                    job = next(queue, None)
                    is_dry = job is None
                    yield from flights.take(job, again)
                else:
                    meanwhile(flights.count)
                    yield from flights.collect()
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


class _InFlight:
    """What workers do now: units of up to `batch` jobs of different keys."""

    def __init__(self, pool: WorkerPool, simulate: Simulate, batch: int) -> None:
        self.pool, self.simulate, self.batch = pool, simulate, batch
        self.gathered: list[Job] = []  # for the next unit
        self.rows: dict[str, list[Job]] = {}  # key -> jobs that wait for its outcome
        self.units: dict[Future, Sequence[Job]] = {}
        self.finished: SimpleQueue[Future] = SimpleQueue()
        self.ended: set[str] = set()
        self.given_out: Counter[str] = Counter()

    @property
    def count(self) -> int:
        """Jobs in flight."""
        return sum(map(len, self.rows.values()))

    def has_room(self) -> bool:
        """A unit a worker, so that few wait behind one that brings its worker down; one where
        there are no workers yet.
        """
        return self.count < self.batch * max(1, self.pool.size)

    def take(self, job: Job | None, again: Collection[str]) -> Iterator[tuple[Job, Outcome]]:
        """Run a job, or wait for the one of the same key; if it is stored, here is its outcome.

        None is the last one: what was gathered so far is submitted.
        """
        if job is not None and job.key in self.rows:
            self.rows[job.key].append(job)
        elif job is not None:
            known = known_outcome(job, () if job.key in self.ended else again)
            if known is not None:
                yield job, known
                return
            self.rows[job.key] = [job]
            self.gathered.append(job)
        if self.gathered and (
            job is None or len(self.gathered) == self.batch or not self.has_room()
        ):
            for one in self.gathered:
                forget_starts(one)
            self._submit(self.gathered)
            self.gathered = []

    def _submit(self, unit: Sequence[Job]) -> None:
        future = self.pool.submit(work, unit, self.simulate)
        self.units[future] = unit
        self.given_out.update(job.key for job in unit)
        future.add_done_callback(self.finished.put)

    def collect(self) -> Iterator[tuple[Job, Outcome]]:
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
        except KilledWorker:
            return self._after_death(unit)
        except FutureCancelledError as error:
            raise ClusterError(
                f"the workers are gone: {error}", hint="the same command goes on where it was"
            ) from error

    def _after_death(self, unit: Sequence[Job]) -> Iterator[Outcome]:
        """The outcome of a job that has brought its workers down; others are given out again.

        The scheduler counts the death of a worker against everything that it had: what only waited
        there has not begun. Of jobs that ran side by side each is to show for itself, alone.
        """
        for job in unit:
            if len(unit) > 1:
                forget_starts(job)
            elif starts(job) >= ATTEMPTS or self.given_out[job.key] >= MOST_GIVEN_OUT:
                yield _lost(job)
                continue
            self._submit([job])

    def ended_early(self) -> Iterator[tuple[Job, Outcome]]:
        """Ask what is in flight to write its checkpoint; what came to its end all the same."""
        began = time.monotonic()
        while self.units and time.monotonic() - began < PATIENCE:
            self.pool.ask_to_stop()
            yield from self.collect()


def _lost(job: Job) -> Outcome:
    """The outcome of a job that brings its workers down."""
    reason = f"its process died {starts(job)} times, as if killed or out of memory"
    outcome = Outcome(job.key, LOST, reason)
    write_outcome(job, outcome)
    return outcome
