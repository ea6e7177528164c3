"""Progress display: a live line on a terminal, a plain line at intervals elsewhere."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, TextColumn
from rich.progress import Progress as ProgressBar

PLAIN_EVERY = 10.0  # seconds of wall time between lines where there is no terminal
SHOWN_EVERY = 0.1  # seconds of wall time between two states of a run
LEAST_SHARES = 8  # unbalanced shares of which a trend can be told


@contextmanager
def phase(console: Console, text: str) -> Iterator[None]:
    """Show `text` during the block: beside a spinner on a terminal, as a line elsewhere."""
    if console.is_terminal:
        with console.status(text):
            yield
    else:
        console.print(text, highlight=False)
        yield


class SettlingOutlook:
    """Estimate of when a static run reaches equilibrium once its loads are fully applied.

    It extrapolates the unbalanced fraction of the forces over wall time down to `tolerance`.
    """

    def __init__(self, tolerance: float) -> None:
        self.tolerance = tolerance
        self.walls: list[float] = []
        self.shares: list[float] = []

    def see(self, wall: float, share: float) -> None:
        """Record an unbalanced fraction at a wall time [s]; a repeated value is ignored."""
        if not self.shares or share != self.shares[-1]:
            self.walls.append(wall)
            self.shares.append(share)

    @property
    def time_for_a_tenth(self) -> float:
        """Wall time [s] of a tenfold fall, from the last half of the values; NaN without a fall.

        The body oscillates while it settles: a line is fitted to the logarithms.
        """
        late = slice(len(self.shares) // 2, None)
        shares = np.array(self.shares[late])
        if len(shares) < LEAST_SHARES or not (shares > 0.0).all():
            return float("nan")
        slope = float(np.polyfit(self.walls[late], np.log10(shares), 1)[0])
        return -1.0 / slope if slope < 0.0 else float("nan")

    def describe(self) -> str:
        """Return the state of settling as a line of text."""
        if not self.shares:
            return "settling"
        share, pace = self.shares[-1], self.time_for_a_tenth
        text = f"settling: unbalanced force {share:.2g}, required {self.tolerance:.2g}"
        if len(self.shares) < 2 * LEAST_SHARES:
            return f"{text}, no trend yet"
        if np.isnan(pace):
            return f"{text}, not decreasing"
        left = max(0.0, pace * np.log10(share / self.tolerance))
        return f"{text}, falls tenfold in {pace:.2g} s, ETA {left:.0f} s"


class GoalOutlook:
    """Estimate of when a body reaches its goal, from its mean speed since the display began."""

    def __init__(self) -> None:
        self.began: tuple[float, float] | None = None

    def left(self, now: float, share: float) -> float:
        """Return the simulated time [s] that is left at the simulated time `now` [s].

        share: covered fraction of the distance to the goal, from 0 to 1. The result is infinite
        as long as there is no progress.
        """
        if self.began is None:
            self.began = now, share
        since, gained = now - self.began[0], share - self.began[1]
        return (1.0 - share) * since / gained if gained > 0.0 else float("inf")


class ProgressReport:
    """Display of simulated time, speed, time left, energy error and contact count.

    For a body with a goal it also shows the covered distance; for a static run whose loads are
    fully applied, how it settles. tolerance: of the unbalanced fraction of the forces, NaN for a
    dynamic run.
    """

    def __init__(self, console: Console, end: float, start: float, tolerance: float) -> None:
        self.console, self.end, self.start = console, end, start
        self.settling, self.goal = SettlingOutlook(tolerance), GoalOutlook()
        self.began = self.last_line = time.monotonic()
        self.state, self.shown_at = "", -np.inf
        self.progress: ProgressBar | None = None
        if console.is_terminal:
            self.progress = ProgressBar(
                BarColumn(),
                TextColumn("{task.percentage:>5.1f} %  {task.fields[state]}"),
                console=console,
                transient=True,
            )
            self.task = self.progress.add_task("run", total=end, state="")
            self.progress.update(self.task, completed=start)
            self.progress.start()

    @property
    def is_due(self) -> bool:
        """True if the state shown is older than SHOWN_EVERY."""
        return time.monotonic() - self.shown_at >= SHOWN_EVERY

    def update(
        self,
        now: float,
        energy_error: float,
        contact_count: int,
        unbalanced: float,
        way_share: float | None = None,
    ) -> None:
        """Show the state of the run.

        Parameters
        ----------
        now: simulated time [s].
        energy_error, contact_count: at that time.
        unbalanced: share of the forces that do not balance, NaN of a dynamic run.
        way_share: share of the way to the goal that is covered, None of a run without a goal.
        """
        self.shown_at = time.monotonic()
        wall = self.shown_at - self.began
        speed = (now - self.start) / wall if wall > 0.0 else 0.0
        if now <= self.end:
            outlook = self._outlook(now, speed, way_share)
        else:
            self.settling.see(wall, unbalanced)
            outlook = self.settling.describe()
        self.state = (
            f"t = {now:.3f} of {self.end:g} s  {speed:.3g} s/s  "
            f"energy error {100.0 * energy_error:.3f} %  contacts {contact_count}  {outlook}"
        )
        if self.progress is not None:
            shown = now if way_share is None else max(now, way_share * self.end)
            self.progress.update(self.task, completed=shown)
        self.show("")

    def show(self, detail: str) -> None:
        """Show the last state of the run, with a detail of what it computes now."""
        state = f"{self.state}  {detail}".rstrip()
        if self.progress is not None:
            self.progress.update(self.task, state=state)
        elif time.monotonic() - self.last_line >= PLAIN_EVERY:
            self.last_line = time.monotonic()
            self.console.print(state, highlight=False)

    def _outlook(self, now: float, speed: float, way_share: float | None) -> str:
        """Return the wall time that is left: to the goal if there is one, else to the end time.

        speed: simulated over wall time.
        """
        to_goal = float("inf") if way_share is None else self.goal.left(now, way_share)
        if speed <= 0.0:
            return "ETA unknown"
        to_goal, to_end = to_goal / speed, (self.end - now) / speed
        if way_share is None:
            return f"ETA {to_end:.0f} s"
        far = f"{100.0 * way_share:.0f} % of the distance"
        if to_goal > to_end:
            return f"{far}, time limit in {to_end:.0f} s"
        return f"{far}, ETA {to_goal:.0f} s"

    def close(self) -> None:
        """Remove the live line."""
        if self.progress is not None:
            self.progress.stop()
