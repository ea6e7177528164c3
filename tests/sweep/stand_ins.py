"""Cheap stand-ins for the simulation of a job: what a worker calls must be importable there."""

import ctypes
import json
import os
import signal
import time

import psutil

from softsim.errors import Interrupted, OutputError, StabilityError
from softsim.interruption import stop_signals

KEPT = []
"""Memory that `hungry` never frees."""

EDGE = 6.2
"""Time of its fall [ms] from which on a block slips no more."""


def leave_files(job):
    """What a run of the case would leave."""
    (job.folder / "history.csv").write_text("time\ns\n0.0\n1.0\n")
    (job.folder / "results.vtkhdf").write_text("fields")
    (job.folder / "checkpoint.h5").write_text("state")
    summary = {"status": "done", "energy_error": 0.001, "increments": 100 * job.case.number}
    summary["slip_share"] = float(job.case.values.get("time", EDGE) < EDGE)
    summary["warnings"] = ["chatter", "hourglass"] if job.case.number == 2 else []
    (job.folder / "summary.json").write_text(json.dumps(summary))


def fine(jobs):
    """All run to their end."""
    for job in jobs:
        leave_files(job)
    return [None for _ in jobs]


def slow(jobs):
    """The same, in a while."""
    time.sleep(0.2)
    return fine(jobs)


def faulty(jobs):
    """Case 1 is stopped by a guard, case 2 by a mistake in the program, case 3 runs."""
    faults = {1: StabilityError("element 7 is inverted", "smaller steps"), 2: KeyError("no such")}
    fine(jobs)
    return [faults.get(job.case.number) for job in jobs]


def deadly(jobs):
    """Case 1 brings its process down whenever it runs, case 2 the first time."""
    for job in jobs:
        tried = job.folder / "tried"
        if job.case.number == 1 or (job.case.number == 2 and not tried.exists()):
            tried.touch()
            os.kill(os.getpid(), 9)
    return fine(jobs)


def deadly_first(jobs):
    """Case 1 brings its process down, all others run."""
    if any(job.case.number == 1 for job in jobs):
        os.kill(os.getpid(), signal.SIGKILL)
    return fine(jobs)


def on_a_full_disk(jobs):
    """The disk refuses."""
    return [OutputError("no space left on device", "make room") for _ in jobs]


def waiting(jobs):
    """Cases 1 and 2 run to their end, the others until they are asked to stop."""
    if jobs[0].case.number <= 2:
        return fine(jobs)
    with stop_signals() as asked:
        while not asked:
            time.sleep(0.01)
    (jobs[0].folder / "checkpoint.h5").write_text("state")
    return [Interrupted("stopped")]


def compiling(jobs):
    """Cases 1 and 2 run to their end, the others hold the interpreter as a compilation does."""
    if jobs[0].case.number <= 2:
        return fine(jobs)
    (jobs[0].folder / "checkpoint.h5").write_text("state")
    ctypes.PyDLL(None).sleep(60)
    return fine(jobs)


def hungry(jobs):
    """Keep 200 MB; the summary names the process and its memory [bytes]."""
    KEPT.append(b"x" * 200_000_000)
    fine(jobs)
    process = psutil.Process()
    found = {"process": process.pid, "memory": process.memory_info().rss}
    for job in jobs:
        (job.folder / "summary.json").write_text(json.dumps(found))
    return [None for _ in jobs]
