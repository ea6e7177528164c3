"""Requests to stop, by SIGINT (Ctrl-C), SIGTERM or another thread."""

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

STOPPED = "stopped by SIGINT"
INTERRUPTED = 130
"""Exit code of a command that Ctrl-C ended before it stored results, as in shells."""

STOPPING = (signal.SIGINT, signal.SIGTERM)

AGAIN_AFTER = 0.1
"""Time [s] after which a signal is sent again that an import would have lost."""

_in_threads: dict[int, list[int]] = {}  # thread -> signals that it has been asked by
_is_command = False


def become_command() -> None:
    """Declare that this process runs one command of the command line and nothing else.

    A signal may then end it at once where it could not act otherwise: while kernels are compiled
    (`ended_at_once`), and Ctrl-C while modules are imported. In a notebook or a program of the
    user's own that would lose their data.
    """
    global _is_command
    _is_command = True
    signal.signal(signal.SIGINT, _interrupt)


def _interrupt(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, or end the process at once while a module is imported.

    Imports lose the exception: Taichi's decorators catch all exceptions raised in them, and
    compiled modules of Taichi and pydantic convert it to another error.
    """
    if _is_importing(frame):
        os.write(sys.stderr.fileno(), f"{STOPPED}\n".encode())
        os._exit(INTERRUPTED)
    raise KeyboardInterrupt


def _is_importing(frame: FrameType | None) -> bool:
    """Return True if a frame or one of its callers imports a module."""
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False


def is_command() -> bool:
    """Return True in the main thread of a process that runs one command and nothing else."""
    return _is_command and threading.current_thread() is threading.main_thread()


@contextmanager
def stop_signals() -> Iterator[list[int]]:
    """Collect SIGINT and SIGTERM without ending the process; a second one acts at once.

    Signals reach the main thread only; `ask_threads_to_stop` stops code in other threads.
    """
    asked: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        _in_threads[threading.get_ident()] = asked
        try:
            yield asked
        finally:
            del _in_threads[threading.get_ident()]
        return
    previous: dict[int, Any] = {}

    def remember(number: int, _: Any) -> None:
        asked.append(number)
        signal.signal(number, previous[number])

    for wanted in STOPPING:
        previous[wanted] = signal.signal(wanted, remember)
    try:
        yield asked
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


@contextmanager
def interrupted_by_signals() -> Iterator[None]:
    """Let SIGINT and SIGTERM raise KeyboardInterrupt in the block, so that it can clean up.

    The text of the exception is the name of the signal. In a thread other than the main one, which
    signals do not reach, nothing changes.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = {wanted: signal.signal(wanted, _interrupt_later) for wanted in STOPPING}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


def _interrupt_later(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, or send the signal again soon while a module is imported."""
    if not _is_importing(frame):
        raise KeyboardInterrupt(signal.Signals(number).name)
    again = threading.Timer(AGAIN_AFTER, os.kill, (os.getpid(), number))
    again.daemon = True
    again.start()


@contextmanager
def ended_at_once() -> Iterator[None]:
    """Let SIGINT and SIGTERM end the process at once, as the system does.

    For calls into compiled code that take long and hold the interpreter, so that no handler of
    Python's runs before their end. Main thread only.
    """
    previous = {wanted: signal.signal(wanted, signal.SIG_DFL) for wanted in STOPPING}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


def ask_threads_to_stop() -> None:
    """Request a stop, as by SIGTERM, of code that collects signals in other threads."""
    for asked in list(_in_threads.values()):
        asked.append(signal.SIGTERM)
