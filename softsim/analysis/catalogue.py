"""Catalogue of the measures of a run: name, unit, description, conditions and function of each.

One entry serves the summary of a run, the columns of studies, the page and the reference. The
functions read the history of a run and plain data, so that studies know the measures of a scene
before a model is built.
"""

from collections.abc import Callable, Sequence, Set
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import chain
from typing import Any, Protocol

import numpy as np

from softsim.analysis.travel import (
    BODY,
    FRAME,
    CycleTimes,
    History,
    strongest,
    track_report,
    travel_axis,
    walk_pressures,
    without_radius,
)
from softsim.scene.measures import (
    AREA,
    FORCE,
    FREQUENCY,
    LABEL,
    LENGTH,
    LENGTHS,
    NUMBER,
    PRESSURES,
    ROWS,
    SHARE,
    SPEED,
    TIME,
    Measure,
    Part,
    parts_of,
    probe_readings,
)
from softsim.scene.quantities import ROW_FORCE
from softsim.scene.schema import Scene


class Rotation(Protocol):
    """Rotation of a motor: frequency [Hz] at full speed, duration [s] of the spin-up."""

    @property
    def frequency(self) -> float: ...
    @property
    def spin_up(self) -> float: ...


@dataclass(frozen=True)
class RecordedRun:
    """Run as measures read it.

    history: columns (rows,), SI. parts: of its model, as far as the history has their data.
    cycles: pressure cycles that have ended. rows: names of the rows of spikes. track: name of the
    probe whose path over the ground is measured.
    """

    history: History
    parts: Set[Part]
    cycles: Sequence[CycleTimes] = ()
    motors: Sequence[Rotation] = ()
    rows: Sequence[str] = ()
    track: str = ""

    @property
    def time(self) -> np.ndarray:
        """Times (rows,) [s]."""
        return self.history["time"]

    @property
    def followed(self) -> History:
        """History in which frame and body are followed."""
        return without_radius(self.history) if Part.RADIAL in self.parts else self.history

    @cached_property
    def body_axis(self) -> str | None:
        """Axis along which the body is followed; None if its position is not known."""
        return travel_axis(self.followed, BODY)

    @cached_property
    def frame_axis(self) -> str | None:
        """Axis along which the frame is followed; None if its position is not known."""
        return travel_axis(self.followed, FRAME)

    @property
    def frame_path(self) -> np.ndarray:
        """Positions (rows,) [m] of the frame along its axis."""
        return self.history[f"{FRAME}_{self.frame_axis}"]

    @cached_property
    def walk_pressures(self) -> list[tuple[float | None, float | None]]:
        """Pressures [Pa] at which the frame started and stopped in each cycle."""
        t, x, pressure = self.time, self.frame_path, self.history["pressure"]
        return [walk_pressures(cycle, t, x, pressure) for cycle in self.cycles]

    @property
    def rows_touched(self) -> list[np.ndarray]:
        """Contact (rows of the history,) of each row of spikes in the interval before."""
        return [self.history[f"{ROW_FORCE}{name}"] > 0.0 for name in self.rows]

    @cached_property
    def track_report(self) -> dict[str, float | None]:
        """Measures of the track over the ground, by name."""
        turn = max((1.0 / motor.frequency for motor in self.motors), default=0.0)
        return track_report(self.history, self.track, turn)


# -------------------------------------------------------------------------------------------------
# Displacement and speed.


def displacement_of(run: RecordedRun, column: str) -> float:
    """Return the displacement [m] from the start to the end of the run, along a column."""
    x = run.history[column]
    return float(x[-1] - x[0])


def late_speed(run: RecordedRun, column: str) -> float | None:
    """Return the mean velocity [m/s] over the last tenth of a run; None if it has no two rows."""
    t, x = run.time, run.history[column]
    late = t >= 0.9 * t[-1]
    span = t[late][-1] - t[late][0]
    return float((x[late][-1] - x[late][0]) / span) if span > 0.0 else None


def of_body(run: RecordedRun, measured: Callable[[RecordedRun, str], float | None]) -> float | None:
    """Return what is measured along the axis of the body; None if its position is not known."""
    return None if run.body_axis is None else measured(run, f"{BODY}_{run.body_axis}")


def mean_speed(run: RecordedRun) -> float | None:
    """Return the mean velocity [m/s] over the whole cycles, or over the run if there are none."""
    t, x = run.time, run.frame_path
    end = run.cycles[-1].end if run.cycles else t[-1]
    return float((np.interp(end, t, x) - x[0]) / (end - t[0])) if end > t[0] else None


# -------------------------------------------------------------------------------------------------
# Motion of a robot within the cycles of its pressure.

NEARLY_HIGHEST = 0.99
"""Fraction of the highest pressure above which rows of the history count as being at it."""


def displacement_per_cycle(run: RecordedRun) -> list[float]:
    """Return the displacement [m] in each cycle, from the end of the previous one, or the start."""
    ends = [0.0, *(cycle.end for cycle in run.cycles)]
    displacements: list[float] = np.diff(np.interp(ends, run.time, run.frame_path)).tolist()
    return displacements


def displacement_while_falling(run: RecordedRun) -> list[float]:
    """Return the displacement [m] during the falling pressure of each cycle."""
    falls = [[cycle.fall_begin, cycle.fall_end] for cycle in run.cycles]
    return [float(np.diff(np.interp(fall, run.time, run.frame_path))[0]) for fall in falls]


def pressures_at(run: RecordedRun, times: Sequence[float]) -> list[float]:
    """Return the pressures [Pa] of the chamber at times [s]."""
    pressures: list[float] = np.interp(times, run.time, run.history["pressure"]).tolist()
    return pressures


def rows_at_highest(run: RecordedRun) -> float | None:
    """Return the median count of rows in contact at the highest pressure; None without one."""
    history = run.history
    if "pressure" not in history or not (history["pressure"] > 0.0).any():
        return None
    pressure = history["pressure"]
    full = pressure >= NEARLY_HIGHEST * pressure.max()
    return float(np.median(history["rows_in_contact"][full]))


# -------------------------------------------------------------------------------------------------
# Contact of a robot with its walls: area, number and duration of contacts; tension of a tendon.
#
# A row of the history holds the contact within the interval before it, so the resolution is that of
# the history.

LEAST_AWAY = 1e-3
"""Time [s] without contact after which a contact counts as a new one."""


def interval_integrals(t: np.ndarray, means: np.ndarray) -> np.ndarray:
    """Return the integrals (rows,) of a column of means over the interval before each row."""
    return means * np.diff(t, prepend=t[0])


def mean_of(run: RecordedRun, means: np.ndarray) -> float | None:
    """Return the mean of a column of means over the run; None for a run of zero duration."""
    t = run.time
    span = t[-1] - t[0]
    return float(interval_integrals(t, means).sum() / span) if span > 0.0 else None


def slip_share(run: RecordedRun) -> float | None:
    """Return the fraction of the normal impulse on slipping nodes [-]; None without contact."""
    impulse = interval_integrals(run.time, run.history["wall_force_normal"])
    whole = impulse.sum()
    return float((run.history["slip_share"] * impulse).sum() / whole) if whole > 0.0 else None


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
# The vibration frequency of a frame.

LAST, LEAST_MOTOR_TURNS = 1.0, 20
"""Duration [s] of the measured end of the run, if the motor ran steadily all the time, and fewest
turns of the motor in it."""

SLOWEST = 0.1
"""Fraction of the motor's frequency below which a motion is that of the pressure, no vibration; a
frame that bounces may do so once in two or three turns."""

LEAST_AMPLITUDE = 1e-7
"""Amplitude [m] below which the frame does not vibrate: a thousandth of the amplitude that the
PFR's motor gives it where nothing holds it, m_e r_e / m = 0.1 mm."""


def dominant_frequency(run: RecordedRun) -> float | None:
    """Return the transverse vibration frequency [Hz] of the robot's frame at the end of the run.

    The motion is that along y, or in space along y or z, whichever has the larger amplitude. None
    without a motor, if the body does not vibrate, if the motor has not run steadily for
    LEAST_MOTOR_TURNS, or with fewer than two rows a turn, which resolve no frequency.
    """
    if not run.motors:
        return None
    motor, t = run.motors[0], run.time
    late = (t >= motor.spin_up) & (t >= t[-1] - LAST)
    t = t[late]
    if len(t) < 2 or (t[-1] - t[0]) * motor.frequency < LEAST_MOTOR_TURNS:
        return None
    fastest = 0.5 / float(np.median(np.diff(t)))
    if motor.frequency > fastest:
        return None
    slowest = SLOWEST * motor.frequency
    across = [run.history[f"frame_{a}"][late] for a in ("yz" if Part.Z in run.parts else "y")]
    peak = max((strongest(t, y, slowest, fastest) for y in across), key=lambda p: p.amplitude)
    return peak.frequency if peak.amplitude >= LEAST_AMPLITUDE else None


# -------------------------------------------------------------------------------------------------
# The catalogue.


@dataclass(frozen=True)
class RunMeasure:
    """Entry of the catalogue.

    Attributes
    ----------
    name : str
        Key in summary.json, dotted into mappings.
    kind : Measure
        Unit and form of the value.
    value : callable
        Function that returns the value from a `RecordedRun`, SI; None if it cannot be determined.
    needs : set of Part
        Parts without which a scene does not have the measure.
    about : str
        Explanation of the name on the page, as sentences; empty if the name is clear.
    details : str
        Further text of the reference, as Markdown.
    label : str
        Readable name on the page; default: `name` with blanks.
    on_page : bool
        True for a line of its own on the page.
    """

    name: str
    kind: Measure
    value: Callable[[RecordedRun], Any]
    needs: Set[Part] = frozenset()
    about: str = ""
    details: str = ""
    label: str = ""
    on_page: bool = True


MOTION = (
    RunMeasure(
        "body_displacement", LENGTH, partial(of_body, measured=displacement_of), on_page=False,
        details="Displacement of the centre of mass of the meshed bodies from start to end, along "
        "`body_displacement_axis`.",
    ),
    RunMeasure(
        "body_displacement_axis", LABEL, lambda run: run.body_axis, on_page=False,
        details="Axis of the largest displacement at the end, or of the largest excursion if the "
        "body is back by then; it may differ between two runs.",
    ),
    *(
        RunMeasure(
            f"body_displacement_{axis.value}", LENGTH,
            partial(displacement_of, column=f"body_{axis.value}"), {axis}, on_page=False,
            details=f"Component of that displacement along {axis.value}.",
        )
        for axis in (Part.X, Part.Y, Part.Z)
    ),
    RunMeasure(
        "body_displacement_radial", LENGTH, partial(displacement_of, column="body_x"),
        {Part.RADIAL}, on_page=False,
        details="Growth of the mean radius, in axisymmetric models; these have `_y`, along the "
        "axis, and no `_x`.",
    ),
    RunMeasure(
        "body_speed", SPEED, partial(of_body, measured=late_speed), on_page=False,
        details="Mean velocity of the centre of mass over the last tenth of the run, along "
        "`body_displacement_axis`.",
    ),
    *(
        RunMeasure(
            f"body_speed_{axis.value}", SPEED,
            partial(late_speed, column=f"body_{axis.value}"), {axis}, on_page=False,
            details=f"Component of that velocity along {axis.value}.",
        )
        for axis in (Part.X, Part.Y, Part.Z)
    ),
    RunMeasure(
        "body_speed_radial", SPEED, partial(late_speed, column="body_x"),
        {Part.RADIAL}, on_page=False,
        details="Rate of the mean radius, in axisymmetric models.",
    ),
    RunMeasure(
        "frame_displacement", LENGTH,
        lambda run: displacement_of(run, f"{FRAME}_{run.frame_axis}"), {Part.FRAME}, on_page=False,
        details="Displacement of the robot's rigid frame from start to end, along "
        "`frame_displacement_axis`.",
    ),
    RunMeasure(
        "frame_displacement_axis", LABEL, lambda run: run.frame_axis, {Part.FRAME}, on_page=False,
        details="`x` if the frame can move along x, else `y`.",
    ),
    *(
        RunMeasure(
            f"frame_displacement_{axis.value}", LENGTH,
            partial(displacement_of, column=f"frame_{axis.value}"), {Part.FRAME, axis},
            on_page=False, details=f"Component of that displacement along {axis.value}.",
        )
        for axis in (Part.X, Part.Y, Part.Z)
    ),
    RunMeasure(
        "displacement_per_cycle", LENGTHS, displacement_per_cycle, {Part.FRAME, Part.CYCLES},
        details="Displacement of the frame in each cycle.",
    ),
    RunMeasure(
        "displacement_while_falling", LENGTHS, displacement_while_falling,
        {Part.FRAME, Part.CYCLES}, on_page=False,
        details="Displacement of the frame during each deflation.",
    ),
    RunMeasure(
        "mean_speed", SPEED, mean_speed, {Part.FRAME},
        about="Displacement of the frame divided by time, over the complete pressure cycles; "
        "without cycles, over the whole run.",
    ),
)  # fmt: skip

TRACK = (
    RunMeasure(
        "track.curvature", Measure("1/m"), lambda run: run.track_report["curvature"],
        {Part.TRACK}, on_page=False,
        details="Curvature of the circle fitted to the path of the tracked probe, positive to the "
        "left, in the second half of the run; `null` with fewer than 10 motor turns.",
    ),
    RunMeasure(
        "track.turning_rate", Measure("rad/s"), lambda run: run.track_report["turning_rate"],
        {Part.TRACK}, on_page=False,
        details="Turning rate of the frame, positive to the left, in the same time.",
    ),
    RunMeasure(
        "track.speed", SPEED, lambda run: run.track_report["speed"], {Part.TRACK}, on_page=False,
        details="Speed ahead in the same time, in 3D with `robot.track`.",
    ),
    RunMeasure(
        "track.forward_displacement", LENGTH,
        lambda run: run.track_report["forward_displacement"], {Part.TRACK}, on_page=False,
        details="Displacement of the tracked probe along x, over the whole run.",
    ),
    RunMeasure(
        "track.sideways_displacement", LENGTH,
        lambda run: run.track_report["sideways_displacement"], {Part.TRACK}, on_page=False,
        details="Displacement of the tracked probe to the left, over the whole run.",
    ),
)  # fmt: skip

PRESSURE_CYCLES = (
    RunMeasure(
        "cycles_done", NUMBER, lambda run: len(run.cycles), {Part.CHAMBER},
        details="Number of complete pressure cycles.", label="pressure cycles done",
    ),
    RunMeasure(
        "deflation_begin_pressure", PRESSURES,
        lambda run: pressures_at(run, [cycle.fall_begin for cycle in run.cycles]), {Part.CONTROL},
        details="Pressure at which each deflation began, for a [pressure driven by events]"
        "(../how_to/chambers.md#pressure-cycles-driven-by-events).",
    ),
    RunMeasure(
        "deflation_end_pressure", PRESSURES,
        lambda run: pressures_at(run, [cycle.fall_end for cycle in run.cycles]), {Part.CONTROL},
        details="Pressure at which each of these deflations ended.",
    ),
    RunMeasure(
        "onset_pressure", PRESSURES, lambda run: [onset for onset, _ in run.walk_pressures],
        {Part.FRAME, Part.CYCLES},
        about="Pressure in each deflation at which 5 % of the forward motion had occurred.",
        details="`null` if the frame moves forward by less than its recoil plus 1 mm.",
    ),
    RunMeasure(
        "end_pressure", PRESSURES, lambda run: [end for _, end in run.walk_pressures],
        {Part.FRAME, Part.CYCLES},
        about="Pressure in each deflation at which 95 % of the forward motion had occurred.",
        details="`null` as `onset_pressure`.",
    ),
)  # fmt: skip

CONTACT = (
    RunMeasure(
        "rows_in_contact", NUMBER, lambda run: float(run.history["rows_in_contact"].max()),
        {Part.ROWS},
        about="Largest number of rows of spikes in contact with a wall at the same time.",
    ),
    RunMeasure(
        "rows_at_highest", NUMBER, rows_at_highest, {Part.FRAME, Part.ROWS}, on_page=False,
        details="Median number of rows in contact while the pressure is at its maximum.",
    ),
    RunMeasure(
        "row_contacts", Measure(listed=ROWS),
        lambda run: [contact_count(run.time, touched) for touched in run.rows_touched],
        {Part.ROWS}, on_page=False,
        details="Number of times that each row of spikes, or limb, came into contact after at "
        "least 1 ms without.",
    ),
    RunMeasure(
        "row_contact_shares", Measure(listed=ROWS),
        lambda run: [mean_of(run, touched) for touched in run.rows_touched], {Part.ROWS},
        about="Fraction of the time in which each row of spikes, or limb, was in contact with a "
        "wall, in order.",
        label="time in contact, each row",
    ),
    RunMeasure(
        "largest_contact_area", AREA, lambda run: float(run.history["contact_area"].max()),
        on_page=False,
        details="Largest area in contact with walls, measured on the undeformed mesh and as coarse "
        "as the mesh.",
    ),
    RunMeasure(
        "mean_contact_area", AREA, lambda run: mean_of(run, run.history["contact_area"]),
        about="Area in contact with walls, measured on the undeformed mesh, averaged over the run.",
    ),
    RunMeasure(
        "slip_share", SHARE, slip_share,
        about="Fraction of the normal impulse of the walls that acted on sliding nodes; the rest "
        "acted on sticking nodes.",
        label="sliding contact",
    ),
)  # fmt: skip

DRIVE = (
    RunMeasure(
        "dominant_frequency", FREQUENCY, dominant_frequency, {Part.FRAME},
        about="Dominant frequency of the frame normal to its direction of travel, in the last "
        "second.",
        details="The motor must run steadily. Two history rows per turn are needed, and faster "
        "vibration appears at lower frequencies (aliasing; shorten `output.history_interval`).",
        label="transverse vibration of the frame",
    ),
    RunMeasure(
        "peak_pull", FORCE, lambda run: float(run.history["pull"].max()), {Part.TENDON},
        about="Largest tension of the first tendon.",
        details="From averages over the history interval.",
    ),
    RunMeasure(
        "mean_pull", FORCE, lambda run: mean_of(run, run.history["pull"]), {Part.TENDON},
        about="Mean tension of the first tendon over the run.",
    ),
)  # fmt: skip

CATALOGUE = {
    "Motion": MOTION,
    "Track over the ground": TRACK,
    "Pressure cycles": PRESSURE_CYCLES,
    "Contact": CONTACT,
    "Motor and tendon": DRIVE,
}
"""Measures by subject, in the order of the page and the reference."""

MEASURES = tuple(chain.from_iterable(CATALOGUE.values()))
"""All measures."""


def values(run: RecordedRun) -> dict[str, Any]:
    """Return the measures of a run by name, SI; names with dots become mappings.

    A value is None if it cannot be determined. Lists have an entry for each pressure cycle, or for
    each row of spikes.
    """
    found: dict[str, Any] = {}
    for measure in MEASURES:
        if measure.needs <= run.parts:
            section, _, name = measure.name.rpartition(".")
            place = found.setdefault(section, {}) if section else found
            place[name] = measure.value(run)
    return found


# -------------------------------------------------------------------------------------------------
# All measures that a scene has, with those that are computed elsewhere.

OF_EVERY_RUN = {
    "simulated_time": TIME,
    "wall_time": TIME,
    "time_increment": TIME,
    "increments": NUMBER,
    "node_count": NUMBER,
    "element_count": NUMBER,
    "energy_error": NUMBER,
    "contact_chatter": NUMBER,
    "largest_penetration": SHARE,
}
"""Measures that every run writes about itself, and that do not follow from its history."""

VERDICTS = {
    Part.LAYOUT: {
        "layout.verdict": LABEL,
        "layout.exit": LABEL,
        "layout.blocked_by": LABEL,
        "layout.sentence": LABEL,
        "layout.time": TIME,
        "layout.start": LENGTH,
        "layout.goal": LENGTH,
        "layout.final_arc_length": LENGTH,
        "layout.longest_standstill.began": TIME,
        "layout.longest_standstill.duration": TIME,
        "layout.longest_standstill.where.arc_length": LENGTH,
        "layout.longest_standstill.where.what": LABEL,
        "layout.idle_cycles": NUMBER,
        "layout.patience_used": SHARE,
        "layout.where.arc_length": LENGTH,
        "layout.where.branch": LABEL,
        "layout.where.segment": NUMBER,
        "layout.where.what": LABEL,
    },
    Part.CROSSING: {
        "crossing.verdict": LABEL,
        "crossing.passed": SHARE,
        "crossing.time": TIME,
        "crossing.farthest_rear": LENGTH,
        "crossing.farthest_front": LENGTH,
        "crossing.sentence": LABEL,
    },
}
"""Measures in the reports of `analysis.passage`, which need the pipes and the obstacle."""


def produced(scene: Scene) -> dict[str, Measure]:
    """Return the measures that a run of `scene` may have, by name, such as "layout.verdict".

    A run that is too short has fewer: only whole pressure cycles count.
    """
    parts = parts_of(scene)
    found = OF_EVERY_RUN | {m.name: m.kind for m in MEASURES if m.needs <= parts}
    for part, verdict in VERDICTS.items():
        if part in parts:
            found |= verdict
    if scene.contact.self_contact or scene.contact.pairs:
        found["largest_body_penetration"] = SHARE
    probes = probe_readings(scene)
    for name in ("probes", "probes_min", "probes_max"):
        found |= {f"{name}.{column}": kind for column, kind in probes.items()}
    return found
