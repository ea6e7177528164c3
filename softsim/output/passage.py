"""Verdict on the passage of a body through a pipe: passed, stuck, or unfinished.

It is decided row by row. A robot moves forward in jerks and is drawn back by a millimetre or two
whenever the air leaves, so the farthest position that it has reached counts.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np

from softsim.model import Passage

History = dict[str, np.ndarray]

SEEN = ("time", "arc_length", "cycles_done", "branch")
"""Columns of a history that decide the verdict."""


class Verdict(str, Enum):
    """Verdict on a passage; unfinished: the time was up while the body still moved."""

    PASSED = "passed"
    STUCK = "stuck"
    UNFINISHED = "unfinished"


@dataclass(frozen=True)
class Standstill:
    """Period in which a body made less than the least progress of its passage.

    began, duration: time of its last sufficient progress, and time without progress since [s].
    arc_length, branch: its farthest position at that time [m], and the branch of that position.
    """

    began: float
    duration: float
    arc_length: float
    branch: int


class PassageCondition:
    """Stop condition that follows a body along its pipes and ends a run with the verdict.

    exit: the exit through which the body passed. branch: the branch of its farthest position.
    longest_standstill: up to now. idle_cycles: the most consecutive whole pressure cycles without
    the least progress.
    """

    name = "layout"

    def __init__(self, passage: Passage) -> None:
        self.passage = passage
        self.verdict = Verdict.UNFINISHED
        self.exit: str | None = None
        self.farthest, self.branch = passage.start, 0
        # Where and when it had last gained `least_progress`, and in which cycle, counted from 1.
        self.milestone, self.milestone_time, self.milestone_cycle = passage.start, 0.0, 0
        self.longest_standstill = Standstill(0.0, 0.0, passage.start, 0)
        self.idle_cycles = 0

    @property
    def is_over(self) -> bool:
        """True once there is a verdict."""
        return self.verdict is not Verdict.UNFINISHED

    @property
    def patience_used(self) -> float:
        """Largest fraction of the patience that the body has used up so far; it is stuck at 1."""
        if self.passage.in_cycles:
            return self.idle_cycles / self.passage.patience
        return self.longest_standstill.duration / self.passage.patience_time

    @property
    def way_share(self) -> float:
        """Covered fraction of the path from the start to the goal, from 0 to 1."""
        start, goal = self.passage.start, self.passage.goal_beyond(self.branch)
        return min(1.0, max(0.0, (self.farthest - start) / (goal - start)))

    def see_row(self, row: Mapping[str, float]) -> None:
        self.see(*(row[name] for name in SEEN))

    def see(self, time: float, arc_length: float, cycles_done: float, branch: float) -> None:
        """Update the verdict with a row of the history.

        time [s]; arc_length: of the body's centre [m]; cycles_done: number of finished pressure
        cycles; branch: number of the branch of the centre.
        """
        if self.is_over:
            return
        passage = self.passage
        self._note_standstill(time, cycles_done)
        if arc_length > self.farthest:
            self.farthest, self.branch = arc_length, int(branch)
        if self.farthest >= self.milestone + passage.least_progress:
            self.milestone, self.milestone_time = self.farthest, time
            self.milestone_cycle = int(cycles_done) + 1
        if arc_length >= passage.goals[int(branch)]:
            self.verdict, self.exit = Verdict.PASSED, passage.network.branches[int(branch)].exit
        elif self._has_stopped(time, cycles_done) or self._has_fallen(arc_length):
            self.verdict = Verdict.STUCK

    def _note_standstill(self, time: float, cycles_done: float) -> None:
        """Update the longest time and the most whole cycles without a milestone."""
        standing = time - self.milestone_time
        if standing > self.longest_standstill.duration:
            self.longest_standstill = Standstill(
                self.milestone_time, standing, self.milestone, self.branch
            )
        self.idle_cycles = max(self.idle_cycles, int(cycles_done) - self.milestone_cycle)

    def _has_fallen(self, arc_length: float) -> bool:
        return has_fallen(self.passage, self.farthest - arc_length)

    def _has_stopped(self, time: float, cycles_done: float) -> bool:
        """Return True if there was no progress for the whole patience; only whole cycles count."""
        if self.passage.in_cycles:
            return cycles_done - self.milestone_cycle >= self.passage.patience
        return time - self.milestone_time >= self.passage.patience_time


def has_fallen(passage: Passage, way_back: float) -> bool:
    """Return True if a body that moved back by `way_back` [m] from its farthest place has fallen.

    The limit is its own length, ten times the elastic recoil.
    """
    return way_back > passage.length


def after_history(passage: Passage, history: History) -> PassageCondition:
    """Return the condition after all rows of a history."""
    condition = PassageCondition(passage)
    for row in zip(*(history[name].tolist() for name in SEEN), strict=True):
        condition.see(*row)
    return condition


def last_rows(passage: Passage, history: History) -> np.ndarray:
    """Return a mask (rows,) of the rows of the last whole cycle.

    In a run without cycles it selects the last `patience_time`. Without a whole cycle it selects
    all rows.
    """
    time, done = history["time"], history["cycles_done"]
    if not passage.in_cycles:
        return np.asarray(time >= time[-1] - passage.patience_time)
    return np.asarray(done == max(done[-1] - 1.0, 0.0))
