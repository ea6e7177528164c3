"""Motion of a robot or body in its history: displacement, walks, track, vibration.

Figures, pages and summary.json ask here along which axis a run is followed, so that they agree.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

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


# -------------------------------------------------------------------------------------------------
# Walks of a robot: forward motions within the fall of a pressure.

LEAST_PROGRESS = 1e-3
"""Forward progress [m] within a fall, beyond the recoil before it, that counts as motion.

As the air leaves, the spikes, 5 mm high, draw the frame back by 1 to 2 mm; a robot whose motor
stands still then springs forward to where the fall began, and overshoots by up to 0.7 mm. A fifth
of a spike's height is above that, and far below a walk.
"""

BEGUN, ARRIVED = 0.05, 0.95
"""Fractions of its progress at which the robot has started to move, and has arrived."""


class CycleTimes(Protocol):
    """Times [s] at which the pressure begins to fall, has fallen, and the cycle ends."""

    @property
    def fall_begin(self) -> float: ...
    @property
    def fall_end(self) -> float: ...
    @property
    def end(self) -> float: ...


def fall_begins(pressure: np.ndarray) -> np.ndarray:
    """Return the rows at which a pressure (rows,) that rose or was constant begins to fall."""
    change = np.sign(np.diff(pressure))
    return np.flatnonzero((change[1:] < 0) & (change[:-1] >= 0)) + 1


@dataclass(frozen=True)
class Walk:
    """Rows of a history at which a forward motion of the robot started and ended."""

    onset: int
    end: int


def forward_walk(x: np.ndarray) -> Walk | None:
    """Return the forward motion in the positions x (rows,) [m]; None if there is none.

    Progress counts from the position to which the robot was drawn back before it walks: the walk
    is the largest rise of x over an earlier minimum. It must exceed the recoil before it by
    LEAST_PROGRESS, as elastic recoil alone explains less. Later backward sliding is ignored.
    """
    if len(x) == 0:
        return None
    farthest = int(np.argmax(x - np.minimum.accumulate(x)))
    lowest = int(np.argmin(x[: farthest + 1]))
    whole, recoil = x[farthest] - x[lowest], x[0] - x[lowest]
    if not whole >= recoil + LEAST_PROGRESS:
        return None
    share = (x[lowest : farthest + 1] - x[lowest]) / whole
    return Walk(lowest + int(np.argmax(share >= BEGUN)), lowest + int(np.argmax(share >= ARRIVED)))


def walk_pressures(
    cycle: CycleTimes, t: np.ndarray, x: np.ndarray, pressure: np.ndarray
) -> tuple[float | None, float | None]:
    """Return the pressures [Pa] at which the robot started and stopped within the fall of a cycle.

    They are P_M3^B and P_M3^S of the thesis, as found; None if the robot did not move.

    t [s], x [m], pressure [Pa]: columns (rows,) of the history.
    """
    fall = np.flatnonzero((t >= cycle.fall_begin) & (t <= cycle.fall_end * (1.0 + 1e-9)))
    walk = forward_walk(x[fall])
    if walk is None:
        return None, None
    return float(pressure[fall[walk.onset]]), float(pressure[fall[walk.end]])


# -------------------------------------------------------------------------------------------------
# The track of a robot in space over the ground: its speed and curvature.
#
# They are measured over the second half of a run. The robot looks along the x of its frame, up is
# y, and the left of x seen from above is -z. The track is the position of a probe, averaged over a
# turn of the motor.

LEAST_TURNS = 10
"""Fewest turns of the slowest motor in the measured half of the run."""

MEASURED_LATE = ("curvature", "turning_rate", "speed")


def track_report(history: History, probe: str, turn: float) -> dict[str, float | None]:
    """Return curvature, turning rate, speed and displacements of the robot.

    Curvature [1/m] and turning rate [rad/s] are positive to the left, the speed [m/s] is that
    ahead; they are None if the run is too short. The displacements forward and to the left [m]
    are of the whole run.

    turn: longest period [s] of a motor.
    """
    path = np.column_stack([history[f"{probe}_x"], -history[f"{probe}_z"]])
    forward, sideways = path[-1] - path[0]
    moved = {"forward_displacement": float(forward), "sideways_displacement": float(sideways)}
    t = history["time"]
    late = t >= 0.5 * (t[0] + t[-1])
    span = t[-1] - t[late][0]
    if late.sum() < 2 or span < LEAST_TURNS * turn:
        return {**dict.fromkeys(MEASURED_LATE), **moved}
    # A turn about y by the angle a looks along (cos a, 0, -sin a): a is counted to the left. The
    # rotation vector is continuous up to a whole turn, where it goes on at minus a whole turn.
    yaw = np.unwrap(history["frame_rotation_y"][late], period=4.0 * np.pi)
    rows = max(round(turn / float(np.median(np.diff(t[late])))), 1)
    bent = curvature(running_mean(path[late], rows))
    return {
        "curvature": None if np.isnan(bent) else bent,
        "turning_rate": float((yaw[-1] - yaw[0]) / span),
        "speed": way_ahead(path[late], yaw) / span,
        **moved,
    }


def way_ahead(path: np.ndarray, yaw: np.ndarray) -> float:
    """Return the length [m] of a path (rows, 2) along the heading of the robot.

    Backward motion is subtracted. yaw (rows,) [rad].
    """
    mean = 0.5 * (yaw[1:] + yaw[:-1])
    ahead = np.column_stack([np.cos(mean), np.sin(mean)])
    return float((np.diff(path, axis=0) * ahead).sum())


# -------------------------------------------------------------------------------------------------
# The strongest vibration in a motion.
#
# Rows of a history are not quite evenly spaced, so the spectrum is that of least squares (Lomb
# 1976, Astrophys. Space Sci. 39:447-462), of the motion less its linear drift, under a Hann window.
# With the products p_k of the motion with cosine and sine, and G_kl of these with each other, the
# power is p . G^-1 p / 2. (scipy.signal has it too, but takes a second or more to import.)

OVERSAMPLING = 4
"""Number of frequencies within 1 / duration, a quarter of a peak's width under a Hann window."""


@dataclass(frozen=True)
class Peak:
    """Strongest sine of a motion: frequency [Hz], amplitude [m]."""

    frequency: float
    amplitude: float


def strongest(t: np.ndarray, y: np.ndarray, slowest: float, fastest: float) -> Peak:
    """Return the strongest sine between two frequencies [Hz] of positions y [m] at t [s], (rows,).

    A sine faster than half the rate of the rows appears as a slower one.
    """
    from scipy.optimize import minimize_scalar  # slow to import

    span = t[-1] - t[0]
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * (t - t[0]) / span)
    swing = window * (y - np.polyval(np.polyfit(t - t[0], y, 1), t - t[0]))

    def power(frequency: float | np.ndarray) -> np.ndarray:
        phase = 2.0 * np.pi * np.multiply.outer(np.atleast_1d(frequency), t - t[0])
        waves = np.stack([np.cos(phase), np.sin(phase)], axis=1)
        p, G = np.einsum("fkr,r->fk", waves, swing), np.einsum("fkr,flr->fkl", waves, waves)
        return 0.5 * np.einsum("fk,fk->f", p, np.linalg.solve(G, p[:, :, None])[:, :, 0])

    step = 1.0 / (OVERSAMPLING * span)
    frequencies = np.arange(slowest, fastest, step)
    highest = frequencies[np.argmax(power(frequencies))]
    refined = minimize_scalar(
        lambda frequency: -power(frequency)[0],
        bounds=(highest - step, highest + step),
        method="bounded",
        options={"xatol": 1e-3 * step},
    ).x
    # Of a sine of amplitude a the power is (a sum(window) / 2)^2 / rows.
    amplitude = 2.0 * np.sqrt(len(t) * power(refined)[0]) / window.sum()
    return Peak(float(refined), float(amplitude))
