"""Path of a chain over the ground: its curvature and turning rate."""

from typing import Any

import numpy as np

from softsim.chain.motion import LEAST_TURNS, Motion
from softsim.output.path_circle import curvature, running_mean


def track_measures(motion: Motion) -> dict[str, Any]:
    """Return the measures of a path for the summary, in SI units; NaN if the run is too short."""
    turn = motion.chain.motors.longest_turn
    forward, sideways = motion.centre[-1, :2] - motion.centre[0, :2]
    told = {"forward_displacement": float(forward), "sideways_displacement": float(sideways)}
    if motion.times[-1] < 2.0 * LEAST_TURNS * turn:
        return {"curvature": np.nan, "turning_rate": np.nan, **told}
    t, heading = motion.times[motion.late], yaw(motion)[motion.late]
    return {
        "curvature": curvature(smoothed(motion, turn)),
        "turning_rate": float((heading[-1] - heading[0]) / (t[-1] - t[0])),
        **told,
    }


def yaw(motion: Motion) -> np.ndarray:
    """Return the angle of the heading from x, positive to the left (rows,) [rad]."""
    return np.unwrap(np.arctan2(motion.heading[:, 1], motion.heading[:, 0]))


def smoothed(motion: Motion, turn: float) -> np.ndarray:
    """Return the running mean over a turn of the centre in the second half (rows, 2) [m]."""
    rows = max(round(turn / motion.times[1]), 1)
    return running_mean(motion.centre[motion.late, :2], rows)
