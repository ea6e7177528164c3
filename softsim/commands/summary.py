"""The summary of a run, as tables."""

from collections.abc import Mapping
from typing import Any

from rich.table import Table

from softsim.report.readable import readable


def summary_table(summary: Mapping[str, Any]) -> Table:
    """What a run says of itself in a few lines."""
    table = Table(show_header=False, box=None)
    for row in readable(summary):
        table.add_row(*row)
    return table


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
