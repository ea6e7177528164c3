"""Curvature of a path over the ground, from the circle that fits it best."""

import numpy as np


def running_mean(path: np.ndarray, rows: int) -> np.ndarray:
    """Return the moving average of a path (n, 2) over `rows` points: (n - rows + 1, 2)."""
    sums = np.cumsum(np.concatenate([np.zeros((1, 2)), path - path[0]]), axis=0)
    return np.asarray(path[0] + (sums[rows:] - sums[:-rows]) / rows)


def curvature(path: np.ndarray) -> float:
    """Return the curvature [1/m] of the circle fitted to a path (rows, 2), positive to the left."""
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
    """Return the centre (2,) [m] of the circle fitted to a path (rows, 2); infinite if straight."""
    x, y = (path - path.mean(axis=0)).T
    a, b, c, _ = _circle(x, y)
    with np.errstate(divide="ignore"):
        return path.mean(axis=0) - np.array([b, c]) / (2.0 * a)


def _circle(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float, float]:
    """Return A, B, C of A (x^2 + y^2 - q) + B x + C y, and q, the mean of x^2 + y^2.

    The points x, y (rows,) have zero mean. Taubin's fit (1991) minimizes the root mean square of
    the polynomial over that of its gradient.
    A straight path has A = 0.
    """
    square = x**2 + y**2
    mean = square.mean()
    scaled = (square - mean) / (2.0 * np.sqrt(mean))
    *_, axes = np.linalg.svd(np.column_stack([scaled, x, y]), full_matrices=False)
    a, b, c = axes[-1]
    return a / (2.0 * np.sqrt(mean)), b, c, mean
