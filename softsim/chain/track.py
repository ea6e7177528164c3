"""The track of a chain over the ground: where it turns to, and how tightly."""

from typing import Any

import numpy as np

from softsim.chain.motion import LEAST_TURNS, Motion


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
    path = motion.centre[motion.late, :2]
    sums = np.cumsum(np.concatenate([np.zeros((1, 2)), path - path[0]]), axis=0)
    return path[0] + (sums[rows:] - sums[:-rows]) / rows


def curvature(path: np.ndarray) -> float:
    """Of the circle that fits a path (rows, 2) best, positive where it goes to the left [1/m]."""
    x, y = (path - path.mean(axis=0)).T
    if not (x.any() or y.any()):
        return np.nan
    a, b, c, mean = _circle(x, y)
    steps = np.diff(path, axis=0)
    gradient = 2.0 * a * np.column_stack([x, y])[:-1] + [b, c]
    # The centre is against the gradient where a > 0: to the right of a way whose gradient is left.
    side = (steps[:, 0] * gradient[:, 1] - steps[:, 1] * gradient[:, 0]).sum()
    return float(-np.sign(side) * 2.0 * a / np.sqrt(b**2 + c**2 + 4.0 * mean * a**2))


def centre_of_circle(path: np.ndarray) -> np.ndarray:
    """Of the circle that fits a path (rows, 2) best (2,) [m]; infinite where that is straight."""
    x, y = (path - path.mean(axis=0)).T
    a, b, c, _ = _circle(x, y)
    with np.errstate(divide="ignore"):
        return path.mean(axis=0) - np.array([b, c]) / (2.0 * a)


def _circle(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float, float]:
    """A, B, C of A (x^2 + y^2 - q) + B x + C y, and q, the mean of x^2 + y^2, of points about zero.

    Taubin's fit (1991): the root mean square of the polynomial over that of its gradient is least.
    A straight path has A = 0.
    """
    square = x**2 + y**2
    mean = square.mean()
    scaled = (square - mean) / (2.0 * np.sqrt(mean))
    *_, axes = np.linalg.svd(np.column_stack([scaled, x, y]), full_matrices=False)
    a, b, c = axes[-1]
    return a / (2.0 * np.sqrt(mean)), b, c, mean
