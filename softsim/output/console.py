"""Progress for people: a live line on a terminal, a plain line now and then elsewhere."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

PLAIN_EVERY = 10.0  # seconds of wall time between lines where there is no terminal
LEAST_SHARES = 8  # unbalanced shares of which a trend can be told


@contextmanager
def phase(console: Console, text: str) -> Iterator[None]:
    """Show what the block does: beside a spinner on a terminal, as a line elsewhere."""
    if console.is_terminal:
        with console.status(text):
            yield
    else:
        console.print(text, highlight=False)
        yield


class SettlingOutlook:
    """How a static run settles once its loads are there: the unbalanced share of its forces, wanted
    below `tolerance`, how fast it falls in wall time, and when it will be there.
    """

    def __init__(self, tolerance: float) -> None:
        self.tolerance = tolerance
        self.walls: list[float] = []
        self.shares: list[float] = []

    def see(self, wall: float, share: float) -> None:
        """An unbalanced share at a wall time [s]; one that was seen before says nothing new."""
        if not self.shares or share != self.shares[-1]:
            self.walls.append(wall)
            self.shares.append(share)

    @property
    def time_for_a_tenth(self) -> float:
        """Wall time [s] in which the share falls tenfold, by its last half; NaN where it does not.

        The body swings while it settles: a line is laid through the logarithms.
        """
        late = slice(len(self.shares) // 2, None)
        shares = np.array(self.shares[late])
        if len(shares) < LEAST_SHARES or not (shares > 0.0).all():
            return float("nan")
        slope = float(np.polyfit(self.walls[late], np.log10(shares), 1)[0])
        return -1.0 / slope if slope < 0.0 else float("nan")

    def describe(self) -> str:
        """For people."""
        if not self.shares:
            return "settling"
        share, pace = self.shares[-1], self.time_for_a_tenth
        text = f"settling: unbalanced {share:.2g}, wanted {self.tolerance:.2g}"
        if len(self.shares) < 2 * LEAST_SHARES:
            return f"{text}, no trend yet"
        if np.isnan(pace):
            return f"{text}, does not fall"
        left = max(0.0, pace * np.log10(share / self.tolerance))
        return f"{text}, a tenth in {pace:.2g} s, ETA {left:.0f} s"


class ProgressReport:
    """Shows simulated time, speed, time left, energy error and contact count; of a static run whose
    loads are there, how it settles.

    tolerance: of the unbalanced share of forces, NaN of a dynamic run.
    """

    def __init__(self, console: Console, end: float, start: float, tolerance: float) -> None:
        self.console, self.end, self.start = console, end, start
        self.settling = SettlingOutlook(tolerance)
        self.began = self.last_line = time.monotonic()
        self.progress: Progress | None = None
        if console.is_terminal:
            self.progress = Progress(
                BarColumn(),
                TextColumn("{task.percentage:>5.1f} %  {task.fields[state]}"),
                console=console,
                transient=True,
            )
            self.task = self.progress.add_task("run", total=end, state="")
            self.progress.update(self.task, completed=start)
            self.progress.start()

    def update(
        self, now: float, energy_error: float, contact_count: int, unbalanced: float
    ) -> None:
        """Show where the run is; `now` is the simulated time [s], unbalanced the share of forces,
        NaN of a dynamic run.
        """
        wall = time.monotonic() - self.began
        speed = (now - self.start) / wall if wall > 0.0 else 0.0
        if now <= self.end:
            left = (self.end - now) / speed if speed > 0.0 else float("nan")
            outlook = f"ETA {left:.0f} s"
        else:
            self.settling.see(wall, unbalanced)
            outlook = self.settling.describe()
        state = (
            f"t = {now:.3f} of {self.end:g} s  {speed:.3g} s/s  "
            f"energy error {100.0 * energy_error:.3f} %  contacts {contact_count}  {outlook}"
        )
        if self.progress is not None:
            self.progress.update(self.task, completed=now, state=state)
        elif time.monotonic() - self.last_line >= PLAIN_EVERY:
            self.last_line = time.monotonic()
            self.console.print(state, highlight=False)

    def close(self) -> None:
        """Take the live line away."""
        if self.progress is not None:
            self.progress.stop()
