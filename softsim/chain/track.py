"""The track of a chain over the ground: where it turns to, and how tightly."""

from typing import Any

import numpy as np

from softsim.chain.motion import LEAST_TURNS, Motion
from softsim.output.path_circle import curvature, running_mean


def track_measures(motion: Motion) -> dict[str, Any]:
    """What a summary tells of a track, SI units; NaN where the run is too short for it."""
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
    """Angle from x to where the chain looks, to the left (rows,) [rad]."""
    return np.unwrap(np.arctan2(motion.heading[:, 1], motion.heading[:, 0]))


def smoothed(motion: Motion, turn: float) -> np.ndarray:
    """The centre in the second half, its mean over a turn of the motor (rows, 2) [m]."""
    rows = max(round(turn / motion.times[1]), 1)
    return running_mean(motion.centre[motion.late, :2], rows)
