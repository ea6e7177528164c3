"""Measures of a run, computed from its history, and their comparison with the scene's `expect`."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from softsim.analysis.passage import Verdict, assumptions, crossing_report, layout_report
from softsim.analysis.travel import (
    BODY,
    FRAME,
    curvature,
    running_mean,
    travel_axis,
    without_radius,
)
from softsim.loads.pressure_control import Phase
from softsim.loads.profile import Cycle
from softsim.loads.rotor import Rotor
from softsim.loads.tendon import Tendon
from softsim.model import Model
from softsim.scene.outputs import Expect, Range, probe_columns
from softsim.scene.quantities import ROW_FORCE

# -------------------------------------------------------------------------------------------------
# Pressure cycles, and the motion of a robot within them.

# Forward progress [m] within a fall, beyond the recoil before it, that counts as motion. As the air
# leaves, the spikes, 5 mm high, draw the frame back by 1 to 2 mm; a robot whose motor stands still
# then springs forward to where the fall began, and overshoots by up to 0.7 mm. A fifth of a spike's
# height is above that, and far below a walk.
LEAST_PROGRESS = 1e-3
# The robot has set off when it has made this share of its progress, and has arrived but for it.
BEGUN, ARRIVED = 0.05, 0.95


def whole_cycles(model: Model, history: Mapping[str, np.ndarray]) -> list[Cycle]:
    """Return the cycles of the pressure in the robot's chamber that ended within a history."""
    if model.chamber is None:
        return []
    source = model.chamber.source
    if source.control is not None:
        return controlled_cycles(history)
    until = history["time"][-1]
    return [c for c in source.pressure_cycles if c.has_ended(until)]


def controlled_cycles(history: Mapping[str, np.ndarray]) -> list[Cycle]:
    """Return the finished cycles of a controlled pressure, from the columns cycle and phase.

    A row holds the phase in which it was measured: the last row of a deflation marks its end.
    """
    t, number, falls = history["time"], history["cycle"], history["phase"] == Phase.DEFLATION
    cycles = []
    for k in np.unique(number):
        fall = np.flatnonzero(falls & (number == k))
        if len(fall) > 0 and fall[-1] < len(t) - 1:
            begin, end = float(t[fall[0] - 1]), float(t[fall[-1]])
            cycles.append(Cycle(begin, end, end))
    return cycles


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
    cycle: Cycle, t: np.ndarray, x: np.ndarray, pressure: np.ndarray
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


# -------------------------------------------------------------------------------------------------
# Contact of a robot with its walls, from its history: area, number and duration of contacts.
#
# A row of the history holds the contact within the interval before it, so the resolution is that of
# the history.

LEAST_AWAY = 1e-3
"""Time [s] without contact after which a contact counts as a new one."""

History = dict[str, np.ndarray]


def interval_integrals(t: np.ndarray, means: np.ndarray) -> np.ndarray:
    """Return the integrals (rows,) of a column of means over the interval before each row."""
    return means * np.diff(t, prepend=t[0])


def touching_areas(history: History) -> dict[str, float | None]:
    """Return the largest and the mean area in contact [m^2]; no mean for a run of zero duration."""
    t, area = history["time"], history["contact_area"]
    span = t[-1] - t[0]
    return {
        "largest_contact_area": float(area.max()),
        "mean_contact_area": float(interval_integrals(t, area).sum() / span) if span > 0 else None,
    }


def row_contacts(model: Model, history: History) -> dict[str, Any]:
    """Return the number of contacts of each row of spikes or limbs, and its fraction of the time in
    contact.
    """
    t = history["time"]
    touched = [history[f"{ROW_FORCE}{name}"] > 0.0 for name in model.robot.rows]
    span = t[-1] - t[0]
    return {
        "row_contacts": [contact_count(t, of_row) for of_row in touched],
        "row_contact_shares": [
            float(interval_integrals(t, of_row).sum() / span) if span > 0.0 else None
            for of_row in touched
        ],
    }


def contact_count(t: np.ndarray, touched: np.ndarray) -> int:
    """Return how many separate contacts a history contains.

    t (rows,) [s]: times of the rows. touched (rows,): True for contact in the interval before.
    """
    rows = np.flatnonzero(touched)
    if not len(rows):
        return 0
    away = t[rows[1:] - 1] - t[rows[:-1]]
    return 1 + int((away >= LEAST_AWAY * (1.0 - 1e-6)).sum())


# -------------------------------------------------------------------------------------------------
# The vibration frequency of a frame, from its history.
#
# Rows of a history are not quite evenly spaced, so the spectrum is that of least squares (Lomb
# 1976, Astrophys. Space Sci. 39:447-462), of the motion less its linear drift, under a Hann window.
# With the products p_k of the motion with cosine and sine, and G_kl of these with each other, the
# power is p . G^-1 p / 2. (scipy.signal has it too, but takes a second or more to import.)

# What is looked at: so much of the end of the run [s], if the motor ran steadily all the time, and
# no less than so many of its turns.
LAST, LEAST_MOTOR_TURNS = 1.0, 20
# Slower than this share of the motor's frequency is no vibration but the way of the pressure; a
# frame that bounces may do so once in two or three turns.
SLOWEST = 0.1
# Amplitude [m] below which the frame does not vibrate: a thousandth of what the PFR's motor swings
# it by where nothing holds it, m_e r_e / m = 0.1 mm.
LEAST_AMPLITUDE = 1e-7
# Frequencies looked at within 1 / duration, a quarter of a peak's width under a Hann window.
OVERSAMPLING = 4


@dataclass(frozen=True)
class Peak:
    """Strongest sine of a motion: frequency [Hz], amplitude [m]."""

    frequency: float
    amplitude: float


def strongest(t: np.ndarray, y: np.ndarray, slowest: float, fastest: float) -> Peak:
    """Return the strongest sine between two frequencies [Hz] of positions y [m] at t [s], (rows,).

    A sine faster than half the rate of the rows appears as a slower one.
    """
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


def dominant_frequency(model: Model, history: dict[str, np.ndarray]) -> float | None:
    """Return the transverse vibration frequency [Hz] of the robot's frame at the end of the run.

    The motion is that along y, or in space along y or z, whichever has the larger amplitude. None
    without a motor, if the body does not vibrate, if the motor has not run steadily for
    LEAST_TURNS, or with fewer than two rows a turn, which resolve no frequency.
    """
    motors = model.of_kind(Rotor)
    if not motors:
        return None
    motor, t = motors[0].rotor, history["time"]
    late = (t >= motor.spin_up) & (t >= t[-1] - LAST)
    t = t[late]
    if len(t) < 2 or (t[-1] - t[0]) * motor.frequency < LEAST_MOTOR_TURNS:
        return None
    fastest = 0.5 / float(np.median(np.diff(t)))
    if motor.frequency > fastest:
        return None
    slowest = SLOWEST * motor.frequency
    across = [history[f"frame_{axis}"][late] for axis in "yz"[: model.dimension - 1]]
    peak = max((strongest(t, y, slowest, fastest) for y in across), key=lambda p: p.amplitude)
    return peak.frequency if peak.amplitude >= LEAST_AMPLITUDE else None


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
