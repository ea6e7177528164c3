"""Progress display during kernel compilation, in a separate process.

Taichi compiles inside one call of up to a minute that holds Python's interpreter: no thread, no
spinner and no signal handler of this process runs meanwhile. Another process therefore shows the
time that has passed. SIGINT and SIGTERM end the compiling process at once, and the other one then
says so, on stderr and in the run folders.

This file is a script too, which needs the standard library only: it starts in some 30 ms.
"""

import json
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

PHASE = "compiling kernels (once for this model structure, about a minute)"
LOADING = "loading kernels"
# Kernels that lie in the cache are there within so many seconds; only then is it worth a line.
PATIENCE = 6.0
PLAIN_EVERY = 15.0  # seconds between lines where there is no terminal
READY = "ready"
ENDED = "stopped during kernel compilation, before the first increment; run again"


@contextmanager
def compiling(console: "Console", folders: Sequence[Path] = ()) -> Iterator[None]:
    """Show that kernels are compiled in the block, and for how long.

    In a process that runs a command, SIGINT and SIGTERM end it at once here: there is nothing yet
    that could be saved. The summaries in the run `folders` then say "interrupted". Elsewhere, in a
    notebook for example, signals are left as they are.
    """
    from softsim.interruption import ended_at_once, is_command

    script = [sys.executable, "-S", __file__, str(int(console.is_terminal)), *map(str, folders)]
    watcher = None
    if is_command() and not console.quiet:
        # A session of its own: the Ctrl-C of a terminal goes to all processes of one. Where no more
        # processes may start, the run goes on without one.
        with suppress(OSError):
            watcher = subprocess.Popen(
                script, stdin=subprocess.PIPE, text=True, start_new_session=True
            )
    if watcher is None:
        with console.status(PHASE):
            yield
        return
    try:
        with ended_at_once():
            yield
    finally:
        watcher.communicate(READY)


def watch(is_terminal: bool, folders: Sequence[Path]) -> None:
    """Show the time until stdin yields READY, or ends without it: the compiling process is gone."""
    said: list[str] = []
    reader = threading.Thread(target=lambda: said.append(sys.stdin.read()), daemon=True)
    reader.start()
    began = time.monotonic()
    due = began + PATIENCE
    while reader.is_alive():
        reader.join(0.25)
        now = time.monotonic()
        phase = PHASE if now - began > PATIENCE else LOADING
        if is_terminal:
            line = f"{phase}: {now - began:.0f} s"[: shutil.get_terminal_size().columns - 1]
            print(f"\r\x1b[2K{line}", end="", flush=True)
        elif now > due and reader.is_alive():
            print(f"{phase}: {now - began:.0f} s", flush=True)
            due = now + PLAIN_EVERY
    if is_terminal:
        print("\r\x1b[2K", end="", flush=True)
    if said != [READY]:
        print(f"error: {ENDED}", file=sys.stderr, flush=True)
        for folder in folders:
            note_end(folder)


def note_end(folder: Path) -> None:
    """Set the status in a run folder's summary to "interrupted", and log the reason."""
    summary, partial = folder / "summary.json", folder / ".summary.json.partial"
    try:
        content = json.loads(summary.read_text("utf-8"))
        content |= {"status": "interrupted", "failure": ENDED}
        partial.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", "utf-8")
        os.replace(partial, summary)
        with (folder / "run.log").open("a", encoding="utf-8") as log:
            log.write(f"{time.strftime('%Y-%m-%d %H:%M:%S')} ERROR {ENDED}\n")
    except OSError as error:
        print(f"{folder}: {error}", file=sys.stderr)


if __name__ == "__main__":
    watch(sys.argv[1] == "1", [Path(name) for name in sys.argv[2:]])
