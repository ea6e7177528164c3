"""How many workers take the next increments: all of them, unless one alone was faster lately.

Workers wait for each other by looking again and again, many times an increment. That is quick while
each has a core of its own; when another program takes one, the others wait for it to be scheduled,
and together they can be many times slower than one alone. So they are timed.
"""

# Calls that one worker does alone before all are tried again: a try that fails may cost as much as
# ten calls.
RETRY_AFTER = 100
# Shorter calls [s] say nothing about the pace.
SHORTEST = 1e-3


class Crew:
    """`size` workers."""

    def __init__(self, size: int) -> None:
        self.size = size
        self._alone = 0.0  # seconds an increment of one worker, when it was last seen
        self._calls_alone = 1 if size > 1 else 0  # still to come

    @property
    def workers(self) -> int:
        """Workers for the next call."""
        return 1 if self._calls_alone else self.size

    def note(self, increments: int, seconds: float) -> None:
        """The last call, of `workers`, did so many increments in so many seconds."""
        if self.size == 1 or seconds < SHORTEST:
            return
        pace = seconds / increments
        if self._calls_alone:
            self._alone = pace
            self._calls_alone -= 1
        elif pace > self._alone:
            self._calls_alone = RETRY_AFTER
