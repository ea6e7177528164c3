"""How far a study is, for people: a live line on a terminal or in a notebook, else plain lines."""

import time
from collections import Counter
from datetime import datetime, timedelta

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from softsim.output.console import PLAIN_EVERY
from softsim.study.cases import DONE
from softsim.sweep.job import Outcome


class StudyProgress:
    """Counts the cases of this session that ended, and tells when all will have."""

    def __init__(self, count: int, console: Console) -> None:
        self.console, self.count = console, count
        self.ended: Counter[str] = Counter()
        self.began = self.last_line = time.monotonic()
        self.bar: Progress | None = None
        if console.is_terminal or console.is_jupyter:
            self.bar = Progress(
                BarColumn(),
                TextColumn("{task.percentage:>3.0f} %  {task.fields[state]}"),
                console=console,
                transient=True,
            )
            self.task = self.bar.add_task("study", total=count, state="")
            self.bar.start()

    def note(self, outcome: Outcome) -> None:
        """A case has ended."""
        self.ended[outcome.status] += 1

    def show(self, in_flight: int) -> None:
        """Say where the study is, if it is time to."""
        if self.bar is not None:
            self.bar.update(self.task, completed=self.ended.total(), state=self._state(in_flight))
        elif time.monotonic() - self.last_line >= PLAIN_EVERY:
            self.last_line = time.monotonic()
            self.console.print(self._state(in_flight), highlight=False)

    @property
    def told(self) -> str:
        """ "12 of 40 cases, 1 failed"."""
        ended = self.ended.total()
        others = [f"{n} {status}" for status, n in sorted(self.ended.items()) if status != DONE]
        return ", ".join([f"{ended} of {self.count} cases", *others])

    def _state(self, in_flight: int) -> str:
        """The same, what runs now, and when the last case should end."""
        text = f"{self.told}, {in_flight} in flight"
        ended = self.ended.total()
        if not ended:
            return text
        left = (time.monotonic() - self.began) * (self.count - ended) / ended
        return f"{text}, expected end {_moment(datetime.now(), timedelta(seconds=left))}"

    def close(self) -> None:
        """Take the live line away."""
        if self.bar is not None:
            self.bar.stop()


def _moment(now: datetime, later: timedelta) -> str:
    """The time of day, of another day with its date."""
    end = now + later
    return f"{end:%H:%M:%S}" if end.date() == now.date() else f"{end:%d %b, %H:%M}"
