"""Lock of a folder: only one run, or one study, writes there at a time."""

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from softsim.errors import OutputError
from softsim.output.folder import explained

LOCK, OWNER = ".lock", ".owner"
"""Files in a locked folder: the lock of the process that works there, and its name."""


@contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """Lock a folder against other runs and studies, on all machines that share its disk.

    The operating system releases the lock when the process ends, however it ends.

    Raises OutputError: another one works there, or the disk refuses.
    """
    owner = folder / OWNER
    with explained(folder / LOCK):
        try:
            held = FileLock(folder / LOCK).acquire(timeout=0)
        except Timeout:
            name = owner.read_text(encoding="utf-8") if owner.is_file() else "another process"
            hint = "wait until it has finished, or choose another folder with --out"
            raise OutputError(f"{name} is using the folder {folder}", hint) from None
    with held:
        try:
            with explained(owner):
                owner.write_text(f"process {os.getpid()} on {socket.gethostname()}", "utf-8")
            yield
        finally:
            owner.unlink(missing_ok=True)
