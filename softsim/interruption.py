"""Being asked to stop: by Ctrl-C, or by whoever ends processes."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def stop_signals() -> Iterator[list[int]]:
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
