"""Being asked to stop: by Ctrl-C, by whoever ends processes, or by another thread."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_in_threads: dict[int, list[int]] = {}  # thread -> signals that it has been asked by


@contextmanager
def stop_signals() -> Iterator[list[int]]:
    """Collect SIGINT and SIGTERM instead of dying of them; a second one acts at once.

    Signals reach the main thread only; what runs in another is asked by `ask_threads_to_stop`.
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

    for wanted in (signal.SIGINT, signal.SIGTERM):
        previous[wanted] = signal.signal(wanted, remember)
    try:
        yield asked
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


@contextmanager
def interrupted_by_sigterm() -> Iterator[None]:
    """Let SIGTERM raise KeyboardInterrupt in the block, as SIGINT does, so that it can clean up.

    In a thread other than the main one, which signals do not reach, nothing changes.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, previous)


def ask_threads_to_stop() -> None:
    """Ask what collects signals in other threads of this process to stop, as SIGTERM would."""
    for asked in list(_in_threads.values()):
        asked.append(signal.SIGTERM)
