"""Measures of a run, computed from its history, and their comparison with the scene's `expect`."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from softsim.loads.cycles import Cycle
from softsim.loads.tendon import Tendon
from softsim.model import Model
from softsim.output.crossing import crossing_report
from softsim.output.ground_track import track_report
from softsim.output.motion import walk_pressures, whole_cycles
from softsim.output.passage import Verdict
from softsim.output.touching import interval_integrals, row_contacts, touching_areas
from softsim.output.travel import BODY, FRAME, travel_axis, without_radius
from softsim.output.verdict import assumptions, layout_report
from softsim.output.vibration import dominant_frequency
from softsim.scene.outputs import Expect, Range, probe_columns

History = dict[str, np.ndarray]

# Rows of the history at the highest pressure are those above this share of it.
NEARLY_HIGHEST = 0.99


def measures(model: Model, history: History) -> dict[str, Any]:
    """Return the measures of a run, name -> value in SI; None if a value cannot be determined.

    Lists have an entry for each pressure cycle, or for each row of spikes.
    """
    if len(history["time"]) == 0:
        return {}
    followed = without_radius(history) if model.is_axisymmetric else history
    found: dict[str, Any] = body_motion(followed)
    if model.is_axisymmetric:
        found |= radial_motion(history)
    found["slip_share"] = slip_share(history)
    found |= touching_areas(history)
    if model.robot.rows:
        found["rows_in_contact"] = float(history["rows_in_contact"].max())
        found |= row_contacts(model, history)
    if model.robot.frame is not None:
        found |= frame_motion(model, followed)
        if model.robot.rows:
            found["rows_at_highest"] = rows_at_highest(history)
        found["dominant_frequency"] = dominant_frequency(model, history)
    if model.robot.track is not None:
        found["track"] = track_report(model, history)
    if model.chamber is not None:
        found |= cycle_measures(model, history)
    if model.passage is not None:
        found["layout"] = layout_report(model.passage, history, assumptions(model))
    if model.crossing is not None:
        found["crossing"] = crossing_report(model.crossing, history)
    if model.of_kind(Tendon):
        found["peak_pull"] = float(history["pull"].max())
        found["mean_pull"] = mean_pull(history)
    if model.probes:
        found |= probe_readings(model, history)
    return found


def body_motion(history: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """Return how far the centre of mass of the meshed bodies moved, and how fast it moves late.

    Parameters
    ----------
    history : mapping of str to ndarray, shape (rows,)
        Columns of the history; of an axisymmetric run without the mean radii.

    Returns
    -------
    dict
        Displacement [m] and speed over the last tenth of the run [m/s]: each component, and the one
        along the axis that figures show, with that axis.
    """
    t = history["time"]
    found = component_displacements(history, BODY)
    speeds = {
        f"body_speed_{axis}": late_speed(t, history[f"body_{axis}"])
        for axis in "xyz"
        if f"body_{axis}" in history
    }
    axis = travel_axis(history, BODY)
    return {
        "body_displacement": found.get(f"body_displacement_{axis}"),
        "body_displacement_axis": axis,
        **found,
        "body_speed": speeds.get(f"body_speed_{axis}"),
        **speeds,
    }


def component_displacements(history: Mapping[str, np.ndarray], name: str) -> dict[str, float]:
    """Return the displacement [m] from start to end of FRAME or BODY along each axis."""
    paths = {axis: history[f"{name}_{axis}"] for axis in "xyz" if f"{name}_{axis}" in history}
    return {f"{name}_displacement_{axis}": float(x[-1] - x[0]) for axis, x in paths.items()}


def radial_motion(history: Mapping[str, np.ndarray]) -> dict[str, float | None]:
    """Return by how much the mean radius of an axisymmetric body grew [m], and how fast [m/s]."""
    radius = history["body_x"]
    return {
        "body_displacement_radial": float(radius[-1] - radius[0]),
        "body_speed_radial": late_speed(history["time"], radius),
    }


def late_speed(t: np.ndarray, x: np.ndarray) -> float | None:
    """Return the mean velocity [m/s] over the last tenth of a run; None if it has no two rows."""
    late = t >= 0.9 * t[-1]
    span = t[late][-1] - t[late][0]
    return float((x[late][-1] - x[late][0]) / span) if span > 0.0 else None


def frame_motion(model: Model, history: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """Return how the robot's frame moved, and at which pressures it started and stopped.

    Parameters
    ----------
    model : Model
        It has a robot with a frame.
    history : mapping of str to ndarray, shape (rows,)
        Columns of the history; of an axisymmetric run without the mean radii.

    Returns
    -------
    dict
        Displacements [m]: each component, and the one along the axis that figures show, with that
        axis. Along the same axis the mean speed [m/s] and, per pressure cycle, displacements [m]
        and the pressures [Pa] at which the frame started and stopped moving.
    """
    axis = travel_axis(history, FRAME)
    if axis is None:
        return {}
    t, x = history["time"], history[f"frame_{axis}"]
    cycles = whole_cycles(model, history)
    found: dict[str, Any] = {
        "frame_displacement": float(x[-1] - x[0]),
        "frame_displacement_axis": axis,
        **component_displacements(history, FRAME),
        "mean_speed": mean_speed(cycles, t, x),
    }
    if cycles:
        found["displacement_per_cycle"] = displacement_per_cycle(cycles, t, x)
        found["displacement_while_falling"] = displacement_while_falling(cycles, t, x)
        walks = [walk_pressures(cycle, t, x, history["pressure"]) for cycle in cycles]
        found["onset_pressure"] = [onset for onset, _ in walks]
        found["end_pressure"] = [end for _, end in walks]
    return found


def cycle_measures(model: Model, history: History) -> dict[str, Any]:
    """Return the number of cycles done; if controlled, the pressures [Pa] around each deflation."""
    cycles = whole_cycles(model, history)
    found: dict[str, Any] = {"cycles_done": len(cycles)}
    if "phase" in history:
        t, pressure = history["time"], history["pressure"]
        begin, end = [c.fall_begin for c in cycles], [c.fall_end for c in cycles]
        found["deflation_begin_pressure"] = np.interp(begin, t, pressure).tolist()
        found["deflation_end_pressure"] = np.interp(end, t, pressure).tolist()
    return found


def mean_speed(cycles: list[Cycle], t: np.ndarray, x: np.ndarray) -> float | None:
    """Return the mean velocity [m/s] over the whole cycles, or over the run if there are none."""
    end = cycles[-1].end if cycles else t[-1]
    return float((np.interp(end, t, x) - x[0]) / (end - t[0])) if end > t[0] else None


def displacement_per_cycle(cycles: list[Cycle], t: np.ndarray, x: np.ndarray) -> list[float]:
    """Return the displacement [m] in each cycle, from the end of the previous one, or the start."""
    displacements: list[float] = np.diff(np.interp([0.0, *(c.end for c in cycles)], t, x)).tolist()
    return displacements


def displacement_while_falling(cycles: list[Cycle], t: np.ndarray, x: np.ndarray) -> list[float]:
    """Return the displacement [m] during the falling pressure of each cycle."""
    return [float(np.diff(np.interp([c.fall_begin, c.fall_end], t, x))[0]) for c in cycles]


def rows_at_highest(history: History) -> float | None:
    """Return the median count of rows in contact at the highest pressure; None without one."""
    if "pressure" not in history or not (history["pressure"] > 0.0).any():
        return None
    pressure = history["pressure"]
    full = pressure >= NEARLY_HIGHEST * pressure.max()
    return float(np.median(history["rows_in_contact"][full]))


def slip_share(history: History) -> float | None:
    """Return the fraction of the normal impulse on slipping nodes [-]; None without contact."""
    impulse = interval_integrals(history["time"], history["wall_force_normal"])
    whole = impulse.sum()
    return float((history["slip_share"] * impulse).sum() / whole) if whole > 0.0 else None


def mean_pull(history: History) -> float | None:
    """Return the mean tension of the first tendon over the whole run [N]."""
    t = history["time"]
    span = t[-1] - t[0]
    return float(interval_integrals(t, history["pull"]).sum() / span) if span > 0.0 else None


def probe_readings(model: Model, history: History) -> dict[str, dict[str, float]]:
    """Return the last, the lowest and the highest reading of each probe, by column."""
    axes = "xyz"[: model.dimension]
    names = [name for probe in model.probes for name in probe_columns(probe.name, probe.kind, axes)]
    return {
        "probes": {name: float(history[name][-1]) for name in names},
        "probes_min": {name: float(history[name].min()) for name in names},
        "probes_max": {name: float(history[name].max()) for name in names},
    }


def failed_expectations(expect: Expect, found: dict[str, Any]) -> str | None:
    """Return a message on the expectations that are not met; None if all are met.

    found: name -> value, or list of values that must all be within the limits.
    """
    wrong = [*other_verdict(expect, found), *outside_limits(expect, found)]
    return "expectation of the scene not met: " + "; ".join(wrong) if wrong else None


def other_verdict(expect: Expect, found: dict[str, Any]) -> Iterator[str]:
    """Yield a text if the verdict or exit of a layout is not the expected one.

    The verdict `unfinished` is never expected.
    """
    layout = found.get("layout", {"verdict": None, "sentence": "none"})
    if expect.passes is not None:
        expected = Verdict.PASSED if expect.passes else Verdict.STUCK
        if layout["verdict"] != expected.value:
            yield f"verdict {expected.value}, found {layout['sentence']}"
    if expect.exit is not None and layout.get("exit") != expect.exit:
        yield f"exit {expect.exit}, found {layout['sentence']}"


def outside_limits(expect: Expect, found: dict[str, Any]) -> Iterator[str]:
    """Yield a text for each value outside the limits that the scene gives for it."""
    for name, limits in expect:
        if not isinstance(limits, Range):
            continue
        value = found.get(name)
        low = -np.inf if limits.min is None else limits.min
        high = np.inf if limits.max is None else limits.max
        for v in value if isinstance(value, list) else [value]:
            if v is None or not low <= v <= high:
                yield f"{name}: {v} is outside [{low:g}, {high:g}]"
