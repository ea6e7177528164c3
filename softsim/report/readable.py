"""Readable text of the summary of a run and of single numbers."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from softsim.output.travel import STANDSTILL
from softsim.report.probes import QUANTITIES, name_and_axis


def degrees(angle: float) -> str:
    """Return an angle [rad] in degrees."""
    return f"{angle * 57.29577951308232:.0f} deg"


def duration(seconds: float) -> str:
    """Return a readable time span."""
    if seconds < 90.0:
        return f"{seconds:.1f} s"
    minutes = int(seconds // 60)
    if minutes < 90:
        return f"{minutes} min {int(seconds % 60)} s"
    return f"{minutes // 60} h {minutes % 60} min"


def counted(number: int, thing: str) -> str:
    """Return a number of things: "1 warning", "2 warnings"."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def each(values: Sequence[float | None], factor: float, unit: str) -> str:
    """Return one entry per pressure cycle in the unit; a cycle without motion has no number."""
    return ", ".join("no motion" if v is None else f"{v * factor:.4g} {unit}" for v in values)


def track(told: Mapping[str, float | None]) -> str:
    """Return the speed and curvature of a robot's track over the ground."""
    if told["speed"] is None or told["turning_rate"] is None:
        return "run too short to measure"
    side = "left" if told["turning_rate"] > 0.0 else "right"
    bent = told["curvature"]
    circle = "" if bent is None else f", curvature {1e-3 * abs(bent):.3g} 1/mm"
    turning = f"{abs(told['turning_rate']):.3g} rad/s to the {side}"
    return f"{1e3 * told['speed']:.3g} mm/s forward, {turning}{circle}"


def millimetres(length: float) -> str:
    """Return a length [m] in mm, rounded to 0 if it is round-off."""
    return f"{length * 1e3 if abs(length) > STANDSTILL else 0.0:.4g} mm"


@dataclass(frozen=True)
class Line:
    """Line of a readable summary; about: an explanation of its name, or empty."""

    name: str
    value: str
    about: str = ""


@dataclass(frozen=True)
class Entry:
    """Notation of a value of summary.json; label: its readable name, by default the key."""

    write: Callable[[Any], str]
    about: str = ""
    label: str = ""


MOVED = {
    "displacement_per_cycle": Entry(lambda v: each(v, 1e3, "mm")),
    "mean_speed": Entry(
        lambda v: f"{v * 1e3:.3g} mm/s",
        "Displacement of the frame divided by time, over the complete pressure cycles; without "
        "cycles, over the whole run.",
    ),
    "track": Entry(track),
}
"""Notation of the results on motion other than the displacement, by key."""

FOUND = {
    "ended_by": Entry(str),
    "cycles_done": Entry(str, label="pressure cycles done"),
    "deflation_begin_pressure": Entry(lambda v: each(v, 1e-3, "kPa")),
    "deflation_end_pressure": Entry(lambda v: each(v, 1e-3, "kPa")),
    "onset_pressure": Entry(
        lambda v: each(v, 1e-3, "kPa"),
        "Pressure in each deflation at which 5 % of the forward motion had occurred.",
    ),
    "end_pressure": Entry(
        lambda v: each(v, 1e-3, "kPa"),
        "Pressure in each deflation at which 95 % of the forward motion had occurred.",
    ),
    "rows_in_contact": Entry(
        lambda v: f"at most {v:g}",
        "Largest number of rows of spikes in contact with a wall at the same time.",
    ),
    "row_contact_shares": Entry(
        lambda v: ", ".join(f"{100.0 * s:.0f}" for s in v) + " % of the time",
        "Fraction of the time in which each row of spikes, or limb, was in contact with a wall, "
        "in order.",
        label="time in contact, each row",
    ),
    "mean_contact_area": Entry(
        lambda v: f"{v * 1e6:.3g} mm^2",
        "Area in contact with walls, measured on the undeformed mesh, averaged over the run.",
    ),
    "slip_share": Entry(
        lambda v: f"{100.0 * v:.0f} % of the normal impulse",
        "Fraction of the normal impulse of the walls that acted on sliding nodes; the rest acted "
        "on sticking nodes.",
        label="sliding contact",
    ),
    "dominant_frequency": Entry(
        lambda v: f"{v:.4g} Hz",
        "Dominant frequency of the frame normal to its direction of travel, in the last second.",
        label="transverse vibration of the frame",
    ),
    "peak_pull": Entry(lambda v: f"{v:.3g} N", "Largest tension of the first tendon."),
    "mean_pull": Entry(lambda v: f"{v:.3g} N", "Mean tension of the first tendon over the run."),
}
"""Notation of all other results, by key."""

COMPUTED = {
    "simulated_time": Entry(lambda v: f"{v:.4g} s"),
    "wall_time": Entry(duration),
    "element_count": Entry(str, label="elements"),
    "increments": Entry(str),
    "element_updates_per_second": Entry(lambda v: f"{v / 1e6:.1f} M"),
    "phases": Entry(
        lambda v: ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in v.items()),
        "Fractions of the time of an increment.",
    ),
    "energy_error": Entry(
        lambda v: f"{100.0 * v:.3f} %",
        "Largest error of the energy balance, relative to the largest energy.",
    ),
    "largest_penetration": Entry(
        lambda v: f"{100.0 * v:.2g} % of the element size",
        "Largest penetration of a node into a wall, relative to the element size there.",
        label="penetration of walls",
    ),
    "largest_body_penetration": Entry(
        lambda v: f"{100.0 * v:.2g} % of the element size",
        "Largest penetration of a body into another body, relative to the element size there.",
        label="penetration of bodies",
    ),
}
"""Notation of the data on how a run was computed, by key."""

NOTHING = (
    "cycles_done", "rows_in_contact", "mean_contact_area", "largest_penetration",
    "largest_body_penetration",
)  # fmt: skip
"""Keys that are omitted if zero: no pressure cycles, no contact."""

COMPONENTS = {"x": "in x", "y": "in y", "z": "in z", "radial": "in the mean radius"}
"""Direction in words by the last part of the key of a displacement."""


def findings(summary: Mapping[str, Any], units: Mapping[str, str]) -> Iterator[Line]:
    """Yield the results of a run: verdicts, displacements and probes first.

    Empty values are left out.

    Parameters
    ----------
    summary : mapping
        Content of summary.json.
    units : mapping of str to str
        Column of the history -> unit.
    """
    for name in ("layout", "crossing"):
        if summary.get(name) is not None:
            yield Line(name, summary[name]["sentence"])
    yield from displacements(summary)
    yield from written(summary, MOVED)
    yield from probes(summary, units)
    yield from written(summary, FOUND)


def bookkeeping(summary: Mapping[str, Any]) -> Iterator[Line]:
    """Yield how a run was computed: time, size, rate and energy error."""
    yield from written(summary, COMPUTED)


def written(summary: Mapping[str, Any], entries: Mapping[str, Entry]) -> Iterator[Line]:
    """Yield the lines of the entries that a summary has values for."""
    for key, entry in entries.items():
        value = summary.get(key)
        if value not in (None, []) and not (key in NOTHING and value == 0):
            yield Line(entry.label or key.replace("_", " "), entry.write(value), entry.about)


def displacements(summary: Mapping[str, Any]) -> Iterator[Line]:
    """Yield the distance and direction of the displacement of the frame, or else of the body."""
    name = "frame" if summary.get("frame_displacement") is not None else "body"
    key = f"{name}_displacement"
    value, axis = summary.get(key), summary.get(f"{key}_axis")
    if value is None:
        return
    direction = "" if axis is None else f" {COMPONENTS[axis]}"
    words = [f"{millimetres(value)}{direction}"]
    for end, other_direction in COMPONENTS.items():
        other = summary.get(f"{key}_{end}") or 0.0
        if end != axis and abs(other) > STANDSTILL:
            words.append(f"{millimetres(other)} {other_direction}")
    of = "the frame" if name == "frame" else "the centre of mass of all meshed bodies"
    yield Line(
        f"{name} displacement",
        ", ".join(words),
        f"Displacement of {of} from the start to the end of the run.",
    )
    speed = summary.get("body_speed")
    if name == "body" and speed is not None and abs(value) > STANDSTILL:
        about = "Mean velocity of the centre of mass over the last tenth of the run."
        yield Line("body speed at the end", f"{speed * 1e3:.3g} mm/s{direction}", about)


def probes(summary: Mapping[str, Any], units: Mapping[str, str]) -> Iterator[Line]:
    """Yield the last reading of each probe and its range."""
    lowest, highest = summary.get("probes_min", {}), summary.get("probes_max", {})
    for column, last in summary.get("probes", {}).items():
        unit = units.get(column, "")
        _, factor, shown = QUANTITIES.get(unit, ("", 1.0, unit))
        none = STANDSTILL if unit == "m" else 0.0  # what round-off explains
        values = [
            f"{value * factor if abs(value) > none else 0.0:.4g}"
            for value in (last, lowest.get(column), highest.get(column))
            if value is not None
        ]
        if last is None:
            continue
        words = f"{values[0]} {shown}".rstrip()
        if len(values) == 3:
            words += f" at the end, from {values[1]} to {values[2]}"
        yield Line(" ".join(name_and_axis(column, unit)).rstrip(), words)
