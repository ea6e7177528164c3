"""Engine that distributes jobs to workers as they become free, and collects their outcomes.

Workers are processes of this machine, or those of a dask scheduler elsewhere.
"""

import asyncio
import logging
import os
import signal
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import cache
from multiprocessing import active_children
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any
from uuid import uuid4

import dask
import psutil
from distributed import (
    Client,
    Future,
    KilledWorker,
    LocalCluster,
    Worker,
    WorkerPlugin,
    get_worker,
)
from distributed.client import FutureCancelledError
from distributed.core import Status

from softsim.compute.machine import chosen_device, processor_count
from softsim.errors import ClusterError, Interrupted, SoftsimError
from softsim.interruption import STOPPING, ask_threads_to_stop, stop_signals
from softsim.output.folder import RunFolder
from softsim.study.cases import LOST, WAITING
from softsim.sweep.job import (
    CONTINUE,
    Job,
    Outcome,
    Simulate,
    forget_starts,
    known_outcome,
    simulate,
    starts,
    work,
    write_outcome,
)

POLL = 0.25
"""Interval [s] of checks for a signal."""

START_POLL = 0.05
"""Interval [s] of checks whether the processes of a local pool have started."""

PATIENCE = 2.0
"""Time limit [s] for runs of this machine to write their checkpoints once asked to stop.

A process that does not respond, as while kernels are compiled, is ended then; its case continues
later from its last checkpoint, or from the start if it has none.
"""

REMOTE_PATIENCE = 60.0
"""The same for workers elsewhere, whose processes cannot be ended from here."""

CLOSE_WITHIN = 0.5
"""Time limit [s] for a process of a local pool to end by itself."""

ATTEMPTS = 2
"""Deaths of its process after which a case is lost: another may have caused the first one."""

MOST_GIVEN_OUT = 10
"""Submissions after which a case is lost, if its workers died before starting it."""

ANSWER_WITHIN = 5.0
"""Time limit [s] for the answer of a scheduler."""

MOST_GROWTH = 300e6
"""Growth [bytes] of a process since its first jobs after which it is replaced by a new one.

A precaution: the memory of a solver is freed before the next one is made, and that of a process
does not grow from case to case.
"""

COUNT_EVERY = 2.0
"""Interval [s] at which workers are counted."""


class WorkerPool:
    """Pool of workers that each do one thing at a time, always in the same thread.

    Taichi has one runtime per process, which is bound to the thread that started it. patience: time
    limit [s] for runs to end after `ask_to_stop`.
    """

    def __init__(self, client: Client, patience: float = PATIENCE) -> None:
        self.client, self.patience = client, patience
        self.counted_at, self.counted = -COUNT_EVERY, 0

    @property
    def size(self) -> int:
        """Number of workers, which may change."""
        if time.monotonic() - self.counted_at >= COUNT_EVERY:
            self.counted_at = time.monotonic()
            self.counted = len(self.client.nthreads())
        return self.counted

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future:
        """Submit a function call to a worker."""
        return self.client.submit(function, *arguments, pure=False)

    def renew(self, worker: str) -> None:
        """Replace the process of an idle worker, given by its address, by a new one."""
        with suppress(ValueError):  # started without a nanny, it has nobody to start it again
            self.client.restart_workers([worker], raise_for_error=False)

    def ask_to_stop(self) -> None:
        """Ask all runs to write their checkpoints and end; a worker may be too busy to respond."""
        with suppress(TimeoutError):
            self.client.run(ask_threads_to_stop, on_error="ignore", callback_timeout=POLL)


def pool_for(
    folder: Path, device: str, workers: int | None = None, scheduler: str | None = None
) -> AbstractContextManager[WorkerPool]:
    """Return the workers of a dask scheduler, or a pool of processes on this machine.

    scheduler: address of the scheduler. workers: number of processes, by default one per core; one
    if a graphics card is used. Raises ClusterError if both are given.
    """
    if scheduler is not None:
        if workers is not None:
            raise ClusterError(
                f"the scheduler at {scheduler} already has workers, so {workers} workers cannot "
                "be requested",
                hint="leave --workers out",
            )
        return remote_pool(scheduler, folder)
    alone = chosen_device(device) == "cuda"
    return local_pool(workers or (1 if alone else processor_count()))


@contextmanager
def local_pool(workers: int) -> Iterator[WorkerPool]:
    """Yield a pool of `workers` processes on this machine, which end with this process.

    Raises ClusterError if they do not start.
    """
    settings = {"distributed.scheduler.allowed-failures": 0}  # the engine knows what to do
    others = set(active_children())
    with dask.config.set(settings), _empty_cluster() as cluster, Client(cluster) as client:
        client.register_plugin(_ChildProcess())
        try:
            cluster.scale(workers)
            while not cluster.workers:  # dask enters them once all have started, or failed to
                time.sleep(START_POLL)
            if len(client.nthreads()) < workers:
                raise ClusterError(
                    "worker processes ended while they started",
                    hint="their output above this line names the cause",
                )
            yield WorkerPool(client)
        finally:
            if cluster.workers:
                cluster.sync(_end_processes, cluster)
            else:  # they have not started, and dask would wait for them
                for process in set(active_children()) - others:
                    process.kill()


def _empty_cluster() -> LocalCluster:
    """Return a cluster on this machine without workers.

    It cannot be closed before it has started: a signal acts after that.
    """
    with stop_signals() as asked:
        cluster = LocalCluster(
            n_workers=0,
            threads_per_worker=1,
            processes=True,
            memory_limit=0,  # a run takes what it needs, as it would alone
            dashboard_address="127.0.0.1:0",  # any free port: the scheduler insists on one
            scheduler_kwargs={"dashboard": False},
            silence_logs=logging.CRITICAL,  # the engine says what became of a worker
        )
    for number in asked:
        os.kill(os.getpid(), number)
    return cluster


async def _end_processes(cluster: LocalCluster) -> None:
    """End the processes of a cluster, those that do not respond by SIGKILL."""
    processes = {nanny.pid: nanny for nanny in cluster.workers.values() if nanny.pid}
    if not processes:
        return
    closing = [asyncio.ensure_future(nanny.close()) for nanny in processes.values()]
    await asyncio.wait(closing, timeout=CLOSE_WITHIN)
    for pid, nanny in processes.items():
        if nanny.status is not Status.closed:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
    await asyncio.gather(*closing)


class _ChildProcess(WorkerPlugin):
    """Worker that starts and ends with this process."""

    name = "child process"

    def setup(self, worker: Worker) -> None:
        """Ignore Ctrl-C and SIGTERM, which may reach all processes: the main one acts on them."""
        for number in STOPPING:
            signal.signal(number, signal.SIG_IGN)

    def teardown(self, worker: Worker) -> None:
        """End at once: a process that has run Taichi stays until it is killed, seconds later."""
        os._exit(0)


@contextmanager
def remote_pool(address: str, folder: Path) -> Iterator[WorkerPool]:
    """Yield the workers of the dask scheduler at `address`, which share the disk of `folder`.

    Raises ClusterError: nobody answers there, or a worker cannot be worked with.
    """
    try:
        client = Client(address, timeout=ANSWER_WITHIN)
    except Exception as error:  # what answers may be anything, and no dask is read as any error
        raise ClusterError(
            f"no dask scheduler responds at {address}: {error}",
            hint="give the address printed by `dask scheduler`, such as tcp://10.0.0.5:8786",
        ) from error
    with client:
        _refuse_strangers(client, folder)
        yield WorkerPool(client, REMOTE_PATIENCE)


def _refuse_strangers(client: Client, folder: Path) -> None:
    """Raise ClusterError for workers with several threads, or without access to `folder`."""
    for worker, threads in client.nthreads().items():
        if threads != 1:
            raise ClusterError(
                f"worker {worker} has {threads} threads",
                hint="a process runs one case at a time: dask worker --nthreads 1 --nworkers N",
            )
    token = f"token-{uuid4().hex}"
    RunFolder(folder).write_text_atomic(token, token)
    try:
        seen = client.run(Path.is_file, folder.resolve() / token, on_error="return")
    finally:
        (folder / token).unlink()
    for worker, answer in seen.items():
        if isinstance(answer, Exception):
            raise ClusterError(f"worker {worker} cannot run softsim: {answer}")
        if not answer:
            raise ClusterError(
                f"worker {worker} cannot access {folder.resolve()}",
                hint="choose a folder on a disk shared by all workers, with --out",
            )


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
            raise Interrupted(f"stopped by {name}", hint=CONTINUE)


class _InFlight:
    """Work in progress: units of up to `batch` jobs with different keys."""

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
        """Number of jobs in progress."""
        return sum(map(len, self.rows.values()))

    def has_room(self) -> bool:
        """Return True if fewer jobs are in progress than one unit per worker, at least one unit.

        Thus few jobs wait behind one that crashes its worker.
        """
        return self.count < self.batch * max(1, self.pool.size)

    def take(self, job: Job | None, again: Collection[str]) -> Iterator[tuple[Job, Outcome]]:
        """Submit a job, or join it to one of the same key; yield a stored outcome.

        None as the last job submits those gathered so far.
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
        future = self.pool.submit(_work, unit, self.simulate)
        self.units[future] = unit
        self.given_out.update(job.key for job in unit)
        future.add_done_callback(self.finished.put)

    def collect(self) -> Iterator[tuple[Job, Outcome]]:
        """Yield the jobs of the next unit that ends with their outcomes; none if none ends soon."""
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
        outcomes: list[Outcome]
        overgrown: str | None
        try:
            outcomes, overgrown = future.result()
        except KilledWorker:
            return self._after_death(unit)
        except FutureCancelledError as error:
            raise ClusterError(f"the workers have stopped: {error}", hint=CONTINUE) from error
        if overgrown is not None:
            self.pool.renew(overgrown)
        return outcomes

    def _after_death(self, unit: Sequence[Job]) -> Iterator[Outcome]:
        """Yield the outcome of a job that has crashed its workers; submit others again.

        The scheduler counts the death of a worker against all of its jobs, even those not started.
        Jobs that ran side by side are submitted again one by one.
        """
        for job in unit:
            if len(unit) > 1:
                forget_starts(job)
            elif starts(job) >= ATTEMPTS or self.given_out[job.key] >= MOST_GIVEN_OUT:
                yield _lost(job)
                continue
            self._submit([job])

    def ended_early(self) -> Iterator[tuple[Job, Outcome]]:
        """Ask running jobs to write checkpoints; yield those that end nevertheless."""
        began = time.monotonic()
        while self.units and time.monotonic() - began < self.pool.patience:
            self.pool.ask_to_stop()
            yield from self.collect()


def _work(unit: Sequence[Job], simulate: Simulate) -> tuple[list[Outcome], str | None]:
    """Run jobs in a worker; return the outcomes, and its address if its process has grown much."""
    outcomes = work(unit, simulate)
    growth = _memory() - _memory_after_first_jobs()
    return outcomes, get_worker().address if growth > MOST_GROWTH else None


def _memory() -> int:
    """Return the memory of this process [bytes]."""
    return psutil.Process().memory_info().rss


@cache
def _memory_after_first_jobs() -> int:
    """Return the memory [bytes] that this process had when this function was called first."""
    return _memory()


def _lost(job: Job) -> Outcome:
    """Return the outcome of a job that crashes its workers, and write it."""
    reason = f"its process ended unexpectedly {starts(job)} times (killed, or out of memory)"
    outcome = Outcome(job.key, LOST, reason)
    write_outcome(job, outcome)
    return outcome
