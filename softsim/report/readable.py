"""The summary of a run, and single numbers, as people read them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any


def degrees(angle: float) -> str:
    """An angle [rad] in degrees."""
    return f"{angle * 57.29577951308232:.0f} deg"


def duration(seconds: float) -> str:
    """A time span for people."""
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
    """An entry a pressure cycle, in this unit; where there was no motion it has none."""
    return ", ".join("no motion" if v is None else f"{v * factor:.4g} {unit}" for v in values)


def track(told: Mapping[str, float | None]) -> str:
    """How fast and how tightly a robot turns over the ground."""
    if told["speed"] is None or told["turning_rate"] is None:
        return "too short a run to tell"
    side = "left" if told["turning_rate"] > 0.0 else "right"
    bent = told["curvature"]
    circle = "" if bent is None else f", curvature {1e-3 * abs(bent):.3g} 1/mm"
    turning = f"{abs(told['turning_rate']):.3g} rad/s to the {side}"
    return f"{1e3 * told['speed']:.3g} mm/s ahead, {turning}{circle}"


SHOWN: Mapping[str, Callable[[Any], str]] = {
    "layout": lambda v: str(v["sentence"]),
    "crossing": lambda v: str(v["sentence"]),
    "track": track,
    "simulated_time": lambda v: f"{v:.4g} s",
    "ended_by": str,
    "wall_time": duration,
    "element_count": str,
    "increments": str,
    "element_updates_per_second": lambda v: f"{v / 1e6:.1f} M",
    "phases": lambda v: ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in v.items()),
    "energy_error": lambda v: f"{100.0 * v:.3f} %",
    "rows_in_contact": lambda v: f"at most {v:g}",
    "frame_displacement": lambda v: f"{v * 1e3:.4g} mm",
    "displacement_per_cycle": lambda v: each(v, 1e3, "mm"),
    "mean_speed": lambda v: f"{v * 1e3:.3g} mm/s",
    "cycles_done": str,
    "deflation_begin_pressure": lambda v: each(v, 1e-3, "kPa"),
    "deflation_end_pressure": lambda v: each(v, 1e-3, "kPa"),
    "onset_pressure": lambda v: each(v, 1e-3, "kPa"),
    "end_pressure": lambda v: each(v, 1e-3, "kPa"),
    "mean_contact_area": lambda v: f"{v * 1e6:.3g} mm^2",
    "row_contact_shares": lambda v: ", ".join(f"{100.0 * s:.0f}" for s in v) + " % of the time",
    "slip_share": lambda v: f"{100.0 * v:.0f} % of the walls' normal impulse",
    "dominant_frequency": lambda v: f"{v:.4g} Hz, the frame across its way",
    "peak_pull": lambda v: f"{v:.3g} N",
    "mean_pull": lambda v: f"{v:.3g} N",
}
"""What a summary says in a few lines: name -> how its value is written."""


NOTHING = ("cycles_done", "rows_in_contact", "mean_contact_area")
"""Of these zero says that the run is not about them: no pressure in cycles, no walls."""


def readable(summary: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """What a run says of itself: names and values with their units; what is empty is left out."""
    for name, write in SHOWN.items():
        value = summary.get(name)
        if value not in (None, []) and not (name in NOTHING and value == 0):
            yield name.replace("_", " "), write(value)
