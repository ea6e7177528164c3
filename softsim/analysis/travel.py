"""The displacement that stands for the motion of a robot or body, found from its history.

Figures, pages and summary.json ask here along which axis a run is followed, so that they agree.
"""

from collections.abc import Mapping

import numpy as np

from softsim.errors import OutputError

History = Mapping[str, np.ndarray]

FRAME, BODY = "frame", "body"
"""Prefixes of the columns that hold the place of the robot's frame, and the centre of mass of the
meshed bodies."""

ROUND_OFF = 1e-6
"""Fraction of the largest curve of its kind below which another one counts as round-off."""

BACK = 0.1
"""Fraction of a body's largest swing below which it counts as back where it started."""

STANDSTILL = 1e-7
"""Largest displacement [m] that counts as none: round-off moves a body in balance by so much."""


def has(history: History, column: str) -> bool:
    """Return True if the history has the column, with at least one finite number in it."""
    return column in history and bool(np.isfinite(history[column]).any())


def without_radius(history: History) -> dict[str, np.ndarray]:
    """Return the history of an axisymmetric run without the mean radii of its half section.

    The place of a body of revolution is on the axis, whatever the mean radius of its section is.
    """
    radii = {f"{name}_x" for name in (FRAME, BODY)}
    return {column: values for column, values in history.items() if column not in radii}


def travel_axis(history: History, name: str) -> str | None:
    """Return the axis along which the motion of the frame or the body is followed.

    A frame is followed along x, if it can move along x. A body is followed along the axis of its
    largest displacement at the end, or of its largest swing if it is back by then.

    Parameters
    ----------
    history : mapping of str to ndarray, shape (rows,)
        Columns of the history; of an axisymmetric run `without_radius`.
    name : str
        FRAME or BODY.

    Returns
    -------
    str or None
        "x", "y" or "z"; None if the history does not hold its place.
    """
    paths = {
        axis: history[f"{name}_{axis}"][np.isfinite(history[f"{name}_{axis}"])]
        for axis in "xyz"
        if has(history, f"{name}_{axis}")
    }
    if not paths:
        return None
    swings = {axis: float(np.ptp(path)) for axis, path in paths.items()}
    furthest = max(swings.values())
    if name == FRAME:
        return next(axis for axis, swing in swings.items() if swing >= ROUND_OFF * furthest)
    displacements = {axis: float(abs(path[-1] - path[0])) for axis, path in paths.items()}
    is_back = max(displacements.values()) < BACK * furthest
    compared = swings if is_back else displacements
    return max(compared, key=compared.__getitem__)


def travelling_column(history: History) -> str:
    """Return the column that is drawn as the place of the robot: of its frame, or else its body.

    Raises
    ------
    OutputError
        The history has neither.
    """
    for name in (FRAME, BODY):
        axis = travel_axis(history, name)
        if axis is not None:
            return f"{name}_{axis}"
    raise OutputError("the history has neither frame_x nor body_x, so no displacement can be drawn")


def displacement(history: History) -> np.ndarray:
    """Return the displacement from the start along `travelling_column`, shape (rows,) [m]."""
    x = history[travelling_column(history)]
    return x - x[np.isfinite(x)][0]


def travels(history: History) -> bool:
    """Return True if the robot is ever farther from its start than STANDSTILL."""
    if travel_axis(history, FRAME) is None and travel_axis(history, BODY) is None:
        return False
    return bool(np.nanmax(np.abs(displacement(history))) > STANDSTILL)


# -------------------------------------------------------------------------------------------------
# Curvature of a path over the ground, from the circle that fits it best.


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
