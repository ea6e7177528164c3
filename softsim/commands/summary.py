"""The summary of a run, as tables."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rich.table import Table

from softsim.commands.wording import duration


def summary_table(summary: Mapping[str, Any]) -> Table:
    """What a run says of itself in a few lines."""
    table = Table(show_header=False, box=None)
    shown: dict[str, Callable[[Any], str]] = {
        "layout": lambda v: str(v["sentence"]),
        "simulated_time": lambda v: f"{v:.4g} s",
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
        "slip_share": lambda v: f"{100.0 * v:.0f} % of the walls' normal impulse",
        "dominant_frequency": lambda v: f"{v:.4g} Hz across the pipe",
        "peak_pull": lambda v: f"{v:.3g} N",
        "mean_pull": lambda v: f"{v:.3g} N",
    }
    for name, write in shown.items():
        if summary.get(name) is not None:
            table.add_row(name.replace("_", " "), write(summary[name]))
    return table


def each(values: Sequence[float | None], factor: float, unit: str) -> str:
    """An entry a pressure cycle, in this unit; where there was no motion it has none."""
    return ", ".join("no motion" if v is None else f"{v * factor:.4g} {unit}" for v in values)


def profile_table(profile: Mapping[str, Any]) -> Table:
    """What an increment costs, pass by pass: `profile` as the summary keeps it.

    Each pass was measured alone; what a whole increment takes beside them has a row of its own,
    negative where passes alone are slower.
    """
    whole = profile["increment"]
    table = Table("phase", "pass", box=None)
    for heading in ("indices", "us", "share"):
        table.add_column(heading, justify="right")

    def row(phase: str, name: str, indices: str, seconds: float) -> None:
        table.add_row(
            phase, name, indices, f"{seconds * 1e6:.2f}", f"{100 * seconds / whole:.1f} %"
        )

    for cost in sorted(profile["passes"], key=lambda cost: -cost["seconds"]):
        row(cost["phase"], cost["name"], f"{cost['count']:,}", cost["seconds"])
    row("overhead", "not in any pass alone", "", profile["unexplained"])
    row("increment", "measured as a whole", "", whole)
    return table
