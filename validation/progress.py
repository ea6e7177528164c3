"""How far a validation is: cases done, and when it should end."""

import time
from datetime import datetime, timedelta

from rich.console import Console


class CaseProgress:
    """A line for each case that ends, with the expected end; weighed by simulated time [s].

    The time counts from here on.
    """

    def __init__(self, console: Console, total: float, count: int) -> None:
        self.console, self.total, self.count = console, total, count
        self.done, self.ended = 0.0, 0
        self.began = time.monotonic()

    def finished(self, name: str, simulated: float, failure: str) -> None:
        """A case of so much simulated time [s] has ended, `failure` the reason if it failed."""
        self.done += simulated
        self.ended += 1
        took = time.monotonic() - self.began
        left = took * (self.total - self.done) / self.done
        end = datetime.now() + timedelta(seconds=left)
        told = f"failed: {failure.splitlines()[0]}" if failure else "done"
        self.console.print(
            f"{self.ended:>3} of {self.count} cases, {100.0 * self.done / self.total:3.0f} %, "
            f"expected end {end:%H:%M:%S}  {name} {told}",
            highlight=False, markup=False,
        )  # fmt: skip
