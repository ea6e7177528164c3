"""Progress for people: a live line on a terminal, a plain line now and then elsewhere."""

import time

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

PLAIN_EVERY = 10.0  # seconds of wall time between lines where there is no terminal


class ProgressReport:
    """Shows simulated time, speed, time left, energy error and contact count."""

    def __init__(self, console: Console, end: float, start: float = 0.0) -> None:
        self.console, self.end, self.start = console, end, start
        self.began = self.last_line = time.monotonic()
        self.progress: Progress | None = None
        if console.is_terminal:
            self.progress = Progress(
                BarColumn(),
                TextColumn("{task.percentage:>5.1f} %  {task.fields[state]}  ETA"),
                TimeRemainingColumn(),
                console=console,
                transient=True,
            )
            self.task = self.progress.add_task("run", total=end, state="")
            self.progress.update(self.task, completed=start)
            self.progress.start()

    def update(self, now: float, energy_error: float, contact_count: int) -> None:
        """Show where the run is; `now` is the simulated time [s]."""
        wall = time.monotonic() - self.began
        speed = (now - self.start) / wall if wall > 0.0 else 0.0
        state = (
            f"t = {now:.3f} of {self.end:g} s  {speed:.3g} s/s  "
            f"energy error {100.0 * energy_error:.3f} %  contacts {contact_count}"
        )
        if self.progress is not None:
            self.progress.update(self.task, completed=now, state=state)
        elif time.monotonic() - self.last_line >= PLAIN_EVERY:
            self.last_line = time.monotonic()
            left = (self.end - now) / speed if speed > 0.0 else float("nan")
            # A static run goes on past its end until forces balance: nobody knows how long.
            outlook = f"ETA {left:.0f} s" if now <= self.end else "settling"
            self.console.print(f"{state}  {outlook}", highlight=False)

    def close(self) -> None:
        """Take the live line away."""
        if self.progress is not None:
            self.progress.stop()
