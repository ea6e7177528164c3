"""How soon the elements must be looked at again, because the stable step changes as they deform.

The step in use leaves room below the stable one (solver.safety_factor, 0.9 unless given). A load
that starts grows with the square or the cube of time, so from one interval to the next, twice as
long, its effect may grow eightfold: ALLOWED_CHANGE, 1/100, then is 8/100.
"""

import numpy as np

FIRST_INTERVAL = 16
LONGEST_INTERVAL = 2048
# A run is looked at so many times at least: what its loads do takes a share of its time.
LEAST_INSPECTIONS = 32
ALLOWED_CHANGE = 0.01


def next_interval(interval: int, lowest: float, now: float, run_length: float) -> int:
    """Increments to the next inspection, after `interval` of them.

    lowest: the smallest stable increment [s] lately, from which the step in use was taken; `now`:
    that of now. While a body only swings, the lowest is soon known and nothing falls below it.
    run_length: increments of the whole run.
    """
    fall = max(0.0, float(np.log(lowest / now)))
    factor = min(2.0, ALLOWED_CHANGE / fall) if fall > 0.0 else 2.0
    longest = min(LONGEST_INTERVAL, run_length / LEAST_INSPECTIONS)
    return int(max(FIRST_INTERVAL // 2, min(interval * factor, longest)))
