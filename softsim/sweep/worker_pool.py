"""The workers of a study: processes of this machine, or those of a dask scheduler elsewhere."""

import logging
import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any
from uuid import uuid4

import dask
from distributed import Client, Future, LocalCluster, Worker, WorkerPlugin

from softsim.errors import ClusterError
from softsim.interruption import ask_threads_to_stop
from softsim.machine import chosen_device, processor_count
from softsim.output.folder import RunFolder

ANSWER_WITHIN = 5.0
"""Seconds in which a scheduler must answer."""

COUNT_EVERY = 2.0
"""Seconds between looks how many workers there are."""


class WorkerPool:
    """Workers that each do one thing at a time, in the same thread: Taichi has one runtime a
    process, which stays in the thread that started it.
    """

    def __init__(self, client: Client) -> None:
        self.client = client
        self.counted_at, self.counted = -COUNT_EVERY, 0

    @property
    def size(self) -> int:
        """How many workers there are: they may come and go."""
        if time.monotonic() - self.counted_at >= COUNT_EVERY:
            self.counted_at = time.monotonic()
            self.counted = len(self.client.nthreads())
        return self.counted

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future:
        """Let a worker call a function."""
        return self.client.submit(function, *arguments, pure=False)

    def ask_to_stop(self) -> None:
        """Ask all runs to write their checkpoints and end."""
        self.client.run(ask_threads_to_stop, on_error="ignore")


def pool_for(
    folder: Path, device: str, workers: int | None = None, scheduler: str | None = None
) -> AbstractContextManager[WorkerPool]:
    """The workers of the dask scheduler at an address; else so many processes of this machine, by
    default one a core. A graphics card is one worker's alone. Raises ClusterError: both are asked.
    """
    if scheduler is not None:
        if workers is not None:
            raise ClusterError(
                f"the scheduler at {scheduler} has workers already: {workers} cannot be asked for",
                hint="leave the number of workers out",
            )
        return remote_pool(scheduler, folder)
    alone = chosen_device(device) == "cuda"
    return local_pool(workers or (1 if alone else processor_count()))


@contextmanager
def local_pool(workers: int) -> Iterator[WorkerPool]:
    """So many processes of this machine; they end with this one, however it ends."""
    settings = {"distributed.scheduler.allowed-failures": 0}  # the engine knows what to do
    with (
        dask.config.set(settings),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            memory_limit=0,  # a run takes what it needs, as it would alone
            dashboard_address="127.0.0.1:0",  # any free port: the scheduler insists on one
            scheduler_kwargs={"dashboard": False},
            silence_logs=logging.CRITICAL,  # the engine says what became of a worker
        ) as cluster,
        Client(cluster) as client,
    ):
        client.register_plugin(_ChildProcess())
        yield WorkerPool(client)


class _ChildProcess(WorkerPlugin):
    """A worker that starts and ends with this process."""

    name = "child process"

    def setup(self, worker: Worker) -> None:
        """Be deaf to Ctrl-C, which reaches all processes of a terminal: the first one asks."""
        signal.signal(signal.SIGINT, signal.SIG_IGN)

    def teardown(self, worker: Worker) -> None:
        """End at once: a process that has run Taichi stays until it is killed, seconds later."""
        os._exit(0)


@contextmanager
def remote_pool(address: str, folder: Path) -> Iterator[WorkerPool]:
    """The workers of the dask scheduler at `address`, which share the disk of `folder`.

    Raises ClusterError: nobody answers there, or a worker cannot be worked with.
    """
    try:
        client = Client(address, timeout=ANSWER_WITHIN)
    except Exception as error:  # what answers may be anything, and no dask is read as any error
        raise ClusterError(
            f"no dask scheduler answers at {address}: {error}",
            hint="name it as `dask scheduler` prints it, such as tcp://10.0.0.5:8786",
        ) from error
    with client:
        _refuse_strangers(client, folder)
        yield WorkerPool(client)


def _refuse_strangers(client: Client, folder: Path) -> None:
    """Refuse workers with several threads, and those that do not see a file written just now."""
    for worker, threads in client.nthreads().items():
        if threads != 1:
            raise ClusterError(
                f"worker {worker} has {threads} threads",
                hint="a process runs one case at a time: dask worker --nthreads 1 --nworkers N",
            )
    token = f"token-{uuid4().hex}"
    RunFolder(folder).write_text_atomic(token, token)
    try:
        seen = client.run(_sees, folder.resolve() / token, on_error="return")
    finally:
        (folder / token).unlink()
    for worker, answer in seen.items():
        if isinstance(answer, Exception):
            raise ClusterError(f"worker {worker} cannot run softsim: {answer}")
        if not answer:
            raise ClusterError(
                f"worker {worker} does not see {folder.resolve()}",
                hint="choose a folder on a disk that all workers share, with --out",
            )


def _sees(file: Path) -> bool:
    return file.is_file()
