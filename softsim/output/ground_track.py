"""The track of a robot in space over the ground: its speed and curvature.

They are measured over the second half of a run. The robot looks along the x of its frame, up is y,
and the left of x seen from above is -z. The track is the position of a probe, averaged over a turn
of the motor.
"""

from collections.abc import Mapping

import numpy as np

from softsim.loads.rotor import Rotor
from softsim.model import Model
from softsim.output.path_circle import curvature, running_mean

LEAST_TURNS = 10
"""Fewest turns of the slowest motor in the measured half of the run."""

TOLD_LATE = ("curvature", "turning_rate", "speed")


def track_report(model: Model, history: Mapping[str, np.ndarray]) -> dict[str, float | None]:
    """Return curvature, turning rate, speed and displacements of the robot.

    Curvature [1/m] and turning rate [rad/s] are positive to the left, the speed [m/s] is that
    ahead; they are None if the run is too short. The displacements forward and to the left [m]
    are of the whole run.
    """
    name = model.robot.track
    path = np.column_stack([history[f"{name}_x"], -history[f"{name}_z"]])
    forward, sideways = path[-1] - path[0]
    told = {"forward_displacement": float(forward), "sideways_displacement": float(sideways)}
    t = history["time"]
    late = t >= 0.5 * (t[0] + t[-1])
    turn = max((1.0 / motor.rotor.frequency for motor in model.of_kind(Rotor)), default=0.0)
    span = t[-1] - t[late][0]
    if late.sum() < 2 or span < LEAST_TURNS * turn:
        return {**dict.fromkeys(TOLD_LATE), **told}
    # A turn about y by the angle a looks along (cos a, 0, -sin a): a is counted to the left. The
    # rotation vector is continuous up to a whole turn, where it goes on at minus a whole turn.
    yaw = np.unwrap(history["frame_rotation_y"][late], period=4.0 * np.pi)
    rows = max(round(turn / float(np.median(np.diff(t[late])))), 1)
    way = running_mean(path[late], rows)
    bent = curvature(way)
    return {
        "curvature": None if np.isnan(bent) else bent,
        "turning_rate": float((yaw[-1] - yaw[0]) / span),
        "speed": way_ahead(path[late], yaw) / span,
        **told,
    }


def way_ahead(path: np.ndarray, yaw: np.ndarray) -> float:
    """Return the length [m] of a path (rows, 2) along the heading of the robot.

    Backward motion is subtracted. yaw (rows,) [rad].
    """
    mean = 0.5 * (yaw[1:] + yaw[:-1])
    ahead = np.column_stack([np.cos(mean), np.sin(mean)])
    return float((np.diff(path, axis=0) * ahead).sum())
