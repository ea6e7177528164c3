"""What a run says of its robot, from its history."""

from typing import Any

import numpy as np

from softsim.loads.drive import GivenPressure
from softsim.model import Model
from softsim.scene.outputs import probe_columns


def measures(model: Model, history: dict[str, np.ndarray]) -> dict[str, Any]:
    """What a run says of its robot: displacements [m], per pressure cycle, speed, contact."""
    t = history["time"]
    if len(t) == 0:
        return {}
    body = history["body_x"]
    late = t >= 0.9 * t[-1]
    span = t[late][-1] - t[late][0]
    result: dict[str, Any] = {
        "body_displacement": float(body[-1] - body[0]),
        "body_speed": float((body[late][-1] - body[late][0]) / span) if span > 0.0 else None,
        "rows_in_contact": float(history["rows_in_contact"].max()),
    }
    if model.rigid_bodies:
        x = history["frame_x"]
        result["frame_displacement"] = float(x[-1] - x[0])
        ends = cycle_ends(model)
        if len(ends) and t[-1] >= ends[0]:
            at = np.interp([0.0, *ends[ends <= t[-1] * (1.0 + 1e-9)]], t, x)
            result["displacement_per_cycle"] = np.diff(at).tolist()
    if model.probes:
        axes = "xyz"[: model.dimension]
        names = [
            name for probe in model.probes for name in probe_columns(probe.name, probe.kind, axes)
        ]
        result["probes"] = {name: float(history[name][-1]) for name in names}
    return result


def cycle_ends(model: Model) -> np.ndarray:
    """Times [s] at which the first pressure has fallen and is about to rise again, or ends."""
    if not model.pressures:
        return np.zeros(0)
    drive = model.pressures[0].drive
    if not isinstance(drive, GivenPressure):
        return np.zeros(0)
    profile = drive.profile
    slope = np.diff(profile.values)
    falling = slope < 0.0
    # The last point of each fall; a rest at the lowest pressure belongs to its cycle.
    last = [k + 1 for k in range(len(slope)) if falling[k] and not falling[k + 1 : k + 2].any()]
    ends = []
    for k in last:
        while k < len(slope) and slope[k] == 0.0:
            k += 1
        ends.append(profile.times[k])
    return np.array(ends)
