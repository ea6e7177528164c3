"""What a history says of how the robot moved: the few measures that summary.json does not hold.

A history has time [s], pressure [Pa] and frame_x [m], (rows,) each. A run that failed has an empty
one: its numbers are NaN.
"""

from collections.abc import Mapping

import numpy as np

NAN = float("nan")
MILLI = 1e3
History = Mapping[str, np.ndarray]


def speed_after(history: History, share: float) -> float:
    """Mean speed [m/s] along the pipe after a `share` of the run, in which it settles."""
    if not history:
        return NAN
    t, x = history["time"], history["frame_x"]
    late = t >= share * t[-1]
    return float((x[late][-1] - x[late][0]) / (t[late][-1] - t[late][0]))
