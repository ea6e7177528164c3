"""Schedule of the estimates of the stable step, which changes as elements deform.

The step in use has a margin below the stable one (solver.safety_factor, 0.9 unless given). A load
that starts grows with the square or the cube of time, so from one interval to the next, twice as
long, its effect may grow eightfold: ALLOWED_CHANGE, 1/100, then becomes 8/100. An estimate costs as
much as some hundred increments, a look at the strains of the elements a tenth of that. While the
step hardly falls, estimates are therefore further apart than looks. A look requests an estimate if
elements were strained since the last one (solver/stiffness_bound.py): the start of a load or an
impact is detected within LOOK_INTERVAL, and in a short run within 1/LEAST_LOOKS of it.
"""

from dataclasses import dataclass

import numpy as np

FIRST_INTERVAL, SHORTEST_INTERVAL = 16, 8
LOOK_INTERVAL = 2048
LONGEST_INTERVAL = 16 * LOOK_INTERVAL
LEAST_LOOKS = 32  # of a run
ALLOWED_CHANGE = 0.01
# The step shrinks at once. It grows when all estimates during so many increments, or this fraction
# of a short run, have found the stable one grown by this factor: that of a body that swings rises
# and falls with every swing, and to follow it would take an estimate every few dozen increments.
GROWTH = 1.05
INCREMENTS_TO_GROW = 2 * LONGEST_INTERVAL
FRACTION_TO_GROW = 0.25


@dataclass
class StableStepSchedule:
    """Schedule of looks at the elements and of estimates of the stable step, after the first one.

    lowest: the smallest stable step [s] since it last grew, from which the step in use is taken.
    look_due, estimate_due: increment counts at which they are due. interval: increments between the
    last estimate and the next one. grown_since: increment count at the first of the estimates in a
    row above GROWTH times the lowest, None without any; lowest_grown: the smallest of them [s].
    latest: stable step [s] of the last estimate, None before the first one of the schedule.
    """

    lowest: float
    look_due: int = FIRST_INTERVAL
    estimate_due: int = FIRST_INTERVAL
    interval: int = FIRST_INTERVAL
    grown_since: int | None = None
    lowest_grown: float = 0.0
    latest: float | None = None

    def plan_next(self, stable: float, increment_count: int, run_length: float) -> None:
        """Plan the next estimate after one that found the stable step `stable` [s].

        increment_count: increments done so far. run_length: increments of the whole run.
        """
        self.latest = stable
        self.interval = next_interval(self.interval, self.lowest, stable, run_length)
        self.estimate_due = increment_count + self.interval
        self.plan_look(increment_count, run_length)
        if stable <= GROWTH * self.lowest:
            self.grown_since, self.lowest = None, min(self.lowest, stable)
        elif self.grown_since is None:
            self.grown_since, self.lowest_grown = increment_count, stable
        else:
            self.lowest_grown = min(self.lowest_grown, stable)
            if increment_count - self.grown_since >= increments_to_grow(run_length):
                self.grown_since, self.lowest = None, self.lowest_grown

    def plan_look(self, increment_count: int, run_length: float) -> None:
        """Plan the next look at the elements.

        increment_count: increments done so far. run_length: increments of the whole run.
        """
        interval = max(SHORTEST_INTERVAL, int(min(LOOK_INTERVAL, run_length / LEAST_LOOKS)))
        self.look_due = min(self.estimate_due, increment_count + interval)


def next_interval(interval: int, lowest: float, now: float, run_length: float) -> int:
    """Return the number of increments to the next estimate, after `interval` of them.

    lowest: the smallest recent stable step [s], from which the step in use was taken; `now`: the
    current one. While a body only oscillates, the lowest is soon known and the step does not fall
    below it.
    run_length: increments of the whole run.
    """
    fall = max(0.0, float(np.log(lowest / now)))
    factor = min(2.0, ALLOWED_CHANGE / fall) if fall > 0.0 else 2.0
    longest = 0.5 * increments_to_grow(run_length) if now > GROWTH * lowest else LONGEST_INTERVAL
    return max(SHORTEST_INTERVAL, int(min(interval * factor, longest)))


def increments_to_grow(run_length: float) -> float:
    """Return the number of increments after which the step may grow.

    run_length: increments of the whole run.
    """
    return min(INCREMENTS_TO_GROW, FRACTION_TO_GROW * run_length)
