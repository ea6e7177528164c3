"""One sweep or optimisation at a time works in a study's folder."""

import fcntl
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from softsim.errors import OutputError
from softsim.output.folder import explained

LOCK = ".lock"


@contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """Keep other sweeps and optimisations out of a study's folder, on all machines that share its
    disk. The system takes the claim back when the process ends, however it ends.

    Raises OutputError: another one works there, or the disk refuses.
    """
    with explained(folder / LOCK):
        stream = (folder / LOCK).open("a+", encoding="utf-8")
    with stream:
        with explained(folder / LOCK):
            _lock(stream, folder)
        yield


def _lock(stream: TextIO, folder: Path) -> None:
    """Lock a file and write into it whose it is now."""
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        stream.seek(0)
        raise OutputError(
            f"{stream.read().strip()} works in {folder} now",
            hint="wait for its end, or choose another folder with --out",
        ) from None
    stream.truncate(0)
    stream.write(f"process {os.getpid()} on {socket.gethostname()}\n")
    stream.flush()
