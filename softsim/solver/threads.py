"""Number of threads for the next increments: all, unless a single one was faster recently.

Threads wait for each other by polling, many times per increment. That is quick while each has a
core of its own; if another program takes one, the others wait for that thread to be scheduled, and
all together can be many times slower than one alone. Therefore both are timed, in turns.
"""

# Turns in a row together, or alone after that was faster: a look at the other way may be slow.
MANY_TURNS = 50
# Calls make up a turn once they took so long [s]: a processor that is away for some milliseconds,
# as those of virtual machines are, must not decide.
TURN = 20e-3
# So many turns in a row slower than alone, or one that took so many times as long, are enough.
SLOW_TURNS = 3
MUCH_SLOWER = 2.0


class ThreadCount:
    """Choice between one and `size` threads. workers: number of threads for the next call."""

    def __init__(self, size: int) -> None:
        self.size = size
        self.workers = 1
        self._turns_left = 1
        self._slow_turns = 0
        self._alone = 0.0  # seconds an increment of one worker, when last seen
        self._increment_count, self._seconds = 0, 0.0  # of this turn

    def note(self, increment_count: int, seconds: float) -> None:
        """Record the wall time [s] of the last call and its number of increments."""
        if self.size == 1:
            return
        self._increment_count += increment_count
        self._seconds += seconds
        if self._seconds >= TURN:
            self._end_turn(self._seconds / self._increment_count)
            self._increment_count, self._seconds = 0, 0.0

    def _end_turn(self, pace: float) -> None:
        """Choose the number of threads of the next turn after one at `pace` [s/increment]."""
        self._turns_left -= 1
        if self.workers == 1:
            self._alone = pace
            if self._turns_left == 0:
                self.workers, self._turns_left = self.size, MANY_TURNS
            return
        self._slow_turns = self._slow_turns + 1 if pace > self._alone else 0
        if self._slow_turns == SLOW_TURNS or pace > MUCH_SLOWER * self._alone:
            self.workers, self._turns_left, self._slow_turns = 1, MANY_TURNS, 0
        elif self._turns_left == 0:
            self.workers, self._turns_left = 1, 1
