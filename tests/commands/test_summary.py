"""A run's summary as a table."""

import io

from rich.console import Console

from softsim.commands.summary import summary_table


def test_cycles_without_motion_are_told() -> None:
    summary = {"onset_pressure": [14.2e3, None], "mean_speed": 0.0123, "peak_pull": None}
    out = io.StringIO()
    Console(file=out, width=100).print(summary_table(summary))
    lines = {line.strip()[:14]: " ".join(line.split()[2:]) for line in out.getvalue().splitlines()}
    assert lines == {"onset pressure": "14.2 kPa, no motion", "mean speed    ": "12.3 mm/s"}
